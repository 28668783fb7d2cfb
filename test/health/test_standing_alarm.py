# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""An alarm on friction stands while later records cannot be compared with the baseline."""

import contextlib
import sqlite3
from dataclasses import replace

import pytest
from histories import DAY, START, VALVE

from valve_friction_ros.health import (
    Baseline,
    FrictionLimits,
    FrictionMonitor,
    FrictionState,
    Level,
    MonitorSettings,
    SlidingFriction,
    StatusSignal,
)
from valve_friction_ros.history import HistoryFile, entry_of
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.streams.record_buffer import RecordBuffer

HEALTHY = Baseline(sliding=SlidingFriction(150.0, 3.0, 2e-3))
OTHER = Baseline(sliding=SlidingFriction(400.0, 3.0, 2e-3))
ALARM = "excess friction: sliding friction at 2 mm/s is 2.67 (2.60 to 2.73) times its baseline"
DATED = "(identified 2026-09-21 14:13 UTC); the latest record cannot be compared: "


@pytest.fixture
def sliding(with_values, unknown, friction):
    """Function of a sliding friction, N, and its speed, mm/s: a result without F_c."""

    def build(value, speed, width=6.0):
        slid = friction(value, width, "sliding_friction")
        known = with_values(coulomb_friction=unknown(), sliding_friction=slid)
        return replace(known, sliding_speed=1e-3 * speed)

    return build


@pytest.fixture
def nothing(with_values, unknown):
    """A result with both frictions not identifiable."""
    names = ("coulomb_friction", "sliding_friction")
    return with_values(**{name: unknown(name) for name in names})


@pytest.fixture
def monitor(sliding):
    """A monitor in an alarm."""
    found = FrictionMonitor(MonitorSettings(BENCH_VALVE))
    found.baseline = HEALTHY
    found.accept(sliding(400.0, 2.0), START)
    assert found.diagnosis().level is Level.ERROR
    return found


def test_it_stands_with_its_date(monitor, nothing):
    for days in (1, 2):
        monitor.accept(nothing, START + days * DAY)
        told = monitor.diagnosis()
        assert (told.level, told.status_signal) == (Level.ERROR, StatusSignal.FAILURE)
        assert told.message.startswith(ALARM)
        assert told.message.count(DATED) == 1
        assert told.message.split(DATED)[1].startswith("coulomb friction is not id")
        assert told.ratio is None


def test_a_record_at_another_speed_is_compared(monitor, sliding):
    """F_v, 4865 N·s/m, makes 15 of the 160 N: at 2 mm/s they are normal."""
    monitor.accept(sliding(400.0, 5.0), START + DAY)
    told = monitor.diagnosis()
    assert (told.level, told.alarm, told.ratio.speed) == (Level.ERROR, None, 2e-3)
    monitor.accept(sliding(160.0, 5.0), START + 2 * DAY)
    assert monitor.diagnosis().message.startswith("friction normal")


def test_a_record_that_can_be_compared_ends_it(monitor, sliding, nothing):
    monitor.accept(nothing, START + 1)
    monitor.accept(sliding(150.0, 2.0), START + 2)
    assert monitor.diagnosis().message.startswith("friction normal")
    monitor.accept(nothing, START + 3)
    assert monitor.diagnosis().level is Level.OK
    assert DATED not in monitor.diagnosis().message


PLACES = {  # sliding friction now, its half width; level and words of what is said then
    "as high, unsure": (400.0, 200.0, Level.ERROR, "excess friction"),
    "normal, unsure": (150.0, 150.0, Level.ERROR, "excess friction"),
    "collapsed, unsure": (60.0, 120.0, Level.ERROR, "excess friction"),
    "surely below error_ratio": (200.0, 40.0, Level.WARN, "excess friction"),
    "surely grown": (240.0, 6.0, Level.WARN, "friction has grown"),
    "surely below both": (150.0, 6.0, Level.OK, "friction normal"),
    "surely fallen": (100.0, 3.0, Level.WARN, "friction has fallen"),
    "surely collapsed": (60.0, 3.0, Level.ERROR, "friction collapsed"),
}


@pytest.mark.parametrize("name", PLACES)
def test_only_a_sure_end_ends_it(monitor, sliding, name):
    """The baseline is 150 N; above 300 N it is ERROR, above 187.5 N WARN."""
    value, width, level, words = PLACES[name]
    monitor.accept(sliding(value, 2.0, width), START + DAY)
    told = monitor.diagnosis()
    assert told.level is level
    assert told.message.startswith(words)
    assert told.own.ratio.value == pytest.approx(value / 150.0)
    stands = told.alarm is not None
    assert stands is (words == "excess friction")
    assert ("does not clear it" in told.message) is stands


def test_what_is_surely_over_does_not_come_back(monitor, sliding, nothing):
    """An ERROR that has become a WARN stays one, until both are surely over."""
    monitor.accept(sliding(200.0, 2.0, 40.0), START + DAY)
    for later in (nothing, sliding(150.0, 2.0, 100.0)):
        monitor.accept(later, START + 2 * DAY)
        told = monitor.diagnosis()
        assert (told.level, told.status_signal, told.state) == (
            Level.WARN,
            StatusSignal.MAINTENANCE_REQUIRED,
            FrictionState.GROWN,
        )
    monitor.accept(sliding(150.0, 2.0, 6.0), START + 3 * DAY)
    assert monitor.diagnosis().level is Level.OK


LOW_PLACES = {
    "unsure": (150.0, 150.0, Level.ERROR),
    "surely above low_ratio": (115.0, 15.0, Level.WARN),
    "surely above both": (150.0, 6.0, Level.OK),
    "not compared": (None, None, Level.ERROR),
}


@pytest.mark.parametrize("name", LOW_PLACES)
def test_the_low_side_is_its_mirror(sliding, nothing, name):
    """Below 75 N it is ERROR, below 120 N WARN."""
    monitor = FrictionMonitor(MonitorSettings(BENCH_VALVE))
    monitor.baseline = HEALTHY
    monitor.accept(sliding(50.0, 2.0, 1.0), START)
    assert monitor.diagnosis().state is FrictionState.COLLAPSED
    value, width, level = LOW_PLACES[name]
    monitor.accept(nothing if value is None else sliding(value, 2.0, width), START + DAY)
    assert monitor.diagnosis().level is level


def test_the_demonstration_of_a_bad_measurement(sliding):
    """F_c of 90 N of 301 all the time; two records are worse measured than the others."""
    monitor = FrictionMonitor(MonitorSettings(BENCH_VALVE))
    monitor.baseline = Baseline(sliding=SlidingFriction(301.0, 6.0, 2e-3))
    widths = [5.0] * 6 + [38.0] + [5.0] * 3 + [38.0]
    for k, width in enumerate(widths):
        monitor.accept(sliding(111.0 if width > 5 else 90.0, 2.0, width), START + k)
        assert monitor.diagnosis().level is Level.ERROR


@pytest.mark.parametrize("speed", [2.0, 5.0])
def test_a_friction_below_zero_ends_nothing(monitor, sliding, speed):
    monitor.accept(sliding(-3.0, speed), START + 1)
    assert monitor.diagnosis().level is Level.ERROR
    assert "friction is above zero" in monitor.diagnosis().message.split(DATED)[1]


def test_a_new_baseline_ends_it(monitor, nothing):
    monitor.accept(nothing, START + 1)
    monitor.baseline = OTHER
    assert monitor.diagnosis().level is Level.OK
    monitor.baseline = HEALTHY
    assert monitor.diagnosis().level is Level.OK


def test_a_new_packing_ends_it(monitor, nothing):
    monitor.accept(nothing, START + 1)
    monitor.renew(START - 1)
    assert monitor.diagnosis().level is Level.ERROR
    monitor.renew(START + 2)
    assert monitor.diagnosis().level is Level.OK


def test_a_new_packing_before_the_next_record(monitor, nothing):
    monitor.renew(START + 1)
    assert monitor.diagnosis().level is Level.ERROR
    monitor.accept(nothing, START + 2)
    assert monitor.diagnosis().level is Level.OK


def test_other_limits_judge_it_anew(monitor, nothing):
    monitor.accept(nothing, START + 1)
    monitor.change_settings(replace(monitor.settings, limits=FrictionLimits(1.25, 3.0)))
    assert monitor.diagnosis().level is Level.WARN
    monitor.change_settings(replace(monitor.settings, limits=FrictionLimits(3.0, 4.0)))
    assert monitor.diagnosis().level is Level.OK


def test_another_valve_ends_it(monitor, nothing):
    monitor.accept(nothing, START + 1)
    other = replace(BENCH_VALVE, diaphragm_area=2 * BENCH_VALVE.diaphragm_area)
    monitor.change_settings(replace(monitor.settings, valve=other))
    assert monitor.diagnosis().level is Level.OK


class TestRestart:
    """What the history keeps goes on."""

    @pytest.fixture
    def kept(self, monitor, nothing, tmp_path):
        """The last success of a history, whose alarm is of the record before it."""
        file = HistoryFile(tmp_path / "history.sqlite")
        later = START + DAY
        monitor.accept(nothing, later)
        snapshot = RecordBuffer(BENCH_VALVE, 60.0).snapshot()
        file.add(entry_of(monitor, VALVE, snapshot, monitor.settings, later))
        found = file.last_success(VALVE.name)
        assert found.diagnosis == monitor.diagnosis()
        return found

    def again(self, kept, baseline=HEALTHY):
        monitor = FrictionMonitor(MonitorSettings(BENCH_VALVE))
        monitor.baseline = baseline
        monitor.remember(kept)
        return monitor

    def test_it_stands(self, kept, nothing):
        monitor = self.again(kept)
        assert monitor.diagnosis() == kept.diagnosis
        monitor.refuse(RefusalError("the stem did not move"))
        assert monitor.diagnosis().level is Level.ERROR
        monitor.accept(nothing, START + 2 * DAY)
        told = monitor.diagnosis()
        assert told.level is Level.ERROR
        assert told.message.startswith(ALARM)
        assert told.message.count("cannot be compared") == 1
        assert told.message.split(DATED)[1].startswith("coulomb friction is not id")

    def test_what_is_left_of_it_stands(self, monitor, sliding, tmp_path):
        """Its level and side, when the record that left it was the last before the restart."""
        file = HistoryFile(tmp_path / "history.sqlite")
        later = START + DAY
        monitor.accept(sliding(200.0, 2.0, 40.0), later)
        snapshot = RecordBuffer(BENCH_VALVE, 60.0).snapshot()
        file.add(entry_of(monitor, VALVE, snapshot, monitor.settings, later))
        kept = file.last_success(VALVE.name)
        assert kept.diagnosis == monitor.diagnosis()
        again = self.again(kept)
        assert again.diagnosis() == kept.diagnosis
        again.accept(sliding(150.0, 2.0, 100.0), START + 2 * DAY)
        assert again.diagnosis().level is Level.WARN
        again.accept(sliding(150.0, 2.0, 6.0), START + 3 * DAY)
        assert again.diagnosis().level is Level.OK

    def test_a_file_of_before_typed_states(self, kept, sliding, tmp_path):
        """Its sentence is read once; then the alarm goes on by its state."""
        with contextlib.closing(sqlite3.connect(tmp_path / "history.sqlite")) as file:
            file.execute("UPDATE identification SET state = NULL, alarm_message = NULL")
            file.commit()
        old = HistoryFile(tmp_path / "history.sqlite").last_success(VALVE.name)
        assert old.diagnosis.message == kept.diagnosis.message
        assert old.diagnosis.alarm.state is FrictionState.EXCESS
        monitor = self.again(old)
        assert monitor.diagnosis().level is Level.ERROR
        monitor.accept(sliding(150.0, 2.0, 150.0), START + 2 * DAY)
        assert monitor.diagnosis().level is Level.ERROR
        monitor.accept(sliding(150.0, 2.0, 6.0), START + 3 * DAY)
        assert monitor.diagnosis().level is Level.OK

    def test_a_record_that_can_be_compared_ends_it(self, kept, sliding, nothing):
        monitor = self.again(kept)
        monitor.accept(sliding(150.0, 2.0), START + 2 * DAY)
        assert monitor.diagnosis().level is Level.OK
        monitor.accept(nothing, START + 3 * DAY)
        assert monitor.diagnosis().level is Level.OK

    @pytest.mark.parametrize("is_before", [True, False])
    def test_a_new_baseline_ends_it(self, kept, is_before):
        monitor = self.again(kept, OTHER if is_before else HEALTHY)
        monitor.baseline = OTHER
        assert monitor.diagnosis().level is Level.OK
        assert monitor.diagnosis().message.startswith("coulomb friction is not identifiable")

    def test_a_new_packing_ends_it(self, kept):
        monitor = self.again(kept)
        monitor.renew(kept.time + 1)
        assert monitor.diagnosis().level is Level.OK
