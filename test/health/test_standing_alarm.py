"""An alarm on friction stands while later records cannot be compared with the baseline."""

from dataclasses import replace

import pytest
from histories import DAY, START, VALVE

from valve_friction_ros.health import (
    Baseline,
    FrictionLimits,
    FrictionMonitor,
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

    def build(value, speed):
        slid = friction(value, 6.0, "sliding_friction")
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


@pytest.mark.parametrize("latest", ["another speed", "not identifiable"])
def test_it_stands_with_its_date(monitor, sliding, nothing, latest):
    results = {"another speed": sliding(400.0, 5.0), "not identifiable": nothing}
    words = {"another speed": "no comparison", "not identifiable": "coulomb friction is not id"}
    for days in (1, 2):
        monitor.accept(results[latest], START + days * DAY)
        told = monitor.diagnosis()
        assert (told.level, told.status_signal) == (Level.ERROR, StatusSignal.FAILURE)
        assert told.message.startswith(ALARM)
        assert told.message.count(DATED) == 1
        assert told.message.split(DATED)[1].startswith(words[latest])
        assert told.ratio is None


def test_a_record_that_can_be_compared_ends_it(monitor, sliding, nothing):
    monitor.accept(nothing, START + 1)
    monitor.accept(sliding(150.0, 2.0), START + 2)
    assert monitor.diagnosis().message.startswith("friction normal")
    monitor.accept(nothing, START + 3)
    assert monitor.diagnosis().level is Level.OK
    assert DATED not in monitor.diagnosis().message


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

    def test_it_stands(self, kept, sliding):
        monitor = self.again(kept)
        assert monitor.diagnosis() == kept.diagnosis
        monitor.refuse(RefusalError("the stem did not move"))
        assert monitor.diagnosis().level is Level.ERROR
        monitor.accept(sliding(400.0, 5.0), START + 2 * DAY)
        told = monitor.diagnosis()
        assert told.level is Level.ERROR
        assert told.message.startswith(ALARM)
        assert told.message.count("cannot be compared") == 1
        assert told.message.split(DATED)[1].startswith("no comparison")

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
