# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a monitor goes on with: a standing alarm, numbers found on a valve, an earlier estimate."""

import contextlib
import sqlite3
from dataclasses import replace

import pytest
from histories import DAY, SECOND, START, VALVE, parameter, success

from valve_friction_ros.health import (
    Baseline,
    Diagnosis,
    FrictionLimits,
    FrictionMonitor,
    FrictionState,
    KnownNumbers,
    Level,
    Measured,
    MonitorSettings,
    SlidingFriction,
    StandingAlarm,
    StatusSignal,
    diagnose,
)
from valve_friction_ros.health.friction_monitor import limited
from valve_friction_ros.history import HistoryFile, entry_of
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE, Valve
from valve_friction_ros.streams.record_buffer import RecordBuffer
from valve_friction_ros.wording import quoted

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
        assert told.message.split(DATED)[1].startswith("Coulomb friction is not id")
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


def test_what_is_not_lowered_keeps_its_signal():
    """As that of an alarm which a new scale of the drive may explain."""
    check = StatusSignal.CHECK_FUNCTION
    alarm = StandingAlarm(Level.ERROR, check, FrictionState.EXCESS, quoted("so"), START)
    assert limited(alarm, Level.ERROR) is alarm
    assert limited(alarm, Level.WARN).status_signal is StatusSignal.MAINTENANCE_REQUIRED


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


@pytest.mark.parametrize("speed", [2.0, 5.0])
def test_a_friction_below_zero_ends_nothing(monitor, sliding, speed):
    monitor.accept(sliding(-3.0, speed), START + 1)
    assert monitor.diagnosis().level is Level.ERROR
    assert "friction cannot be negative" in monitor.diagnosis().message.split(DATED)[1]


def test_a_new_baseline_ends_it(monitor, nothing):
    monitor.accept(nothing, START + 1)
    monitor.baseline = OTHER
    assert monitor.diagnosis().level is Level.OK
    monitor.baseline = HEALTHY
    assert monitor.diagnosis().level is Level.OK


@pytest.mark.parametrize("is_between", [False, True])
def test_a_new_packing_ends_it(monitor, nothing, is_between):
    """Renewed after the next record, or between both; not before the first."""
    monitor.renew(START - 1)
    assert monitor.diagnosis().level is Level.ERROR
    if is_between:
        monitor.renew(START + 1)
        assert monitor.diagnosis().level is Level.ERROR
    monitor.accept(nothing, START + 2)
    if not is_between:
        assert monitor.diagnosis().level is Level.ERROR
        monitor.renew(START + 3)
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
    def keep(self, monitor, tmp_path):
        """Function of a record a day after the alarm: the last success of the history it is in."""

        def put(record):
            file = HistoryFile(tmp_path / "history.sqlite")
            monitor.accept(record, START + DAY)
            snapshot = RecordBuffer(BENCH_VALVE, 60.0).snapshot()
            file.add(entry_of(monitor, VALVE, snapshot, monitor.settings, START + DAY))
            found = file.last_success(VALVE.name)
            assert found.diagnosis == monitor.diagnosis()
            return found

        return put

    @pytest.fixture
    def kept(self, keep, nothing):
        """One whose alarm is of the record before it."""
        return keep(nothing)

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
        assert (told.level, told.message.count("cannot be compared")) == (Level.ERROR, 1)
        assert told.message.startswith(ALARM)

    def test_what_is_left_of_it_stands(self, keep, sliding):
        """Its level and side, when the record that left it was the last before the restart."""
        kept = keep(sliding(200.0, 2.0, 40.0))
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

    @pytest.mark.parametrize("is_before", [True, False])
    def test_a_new_baseline_ends_it(self, kept, is_before):
        monitor = self.again(kept, OTHER if is_before else HEALTHY)
        monitor.baseline = OTHER
        assert monitor.diagnosis().level is Level.OK
        assert monitor.diagnosis().message.startswith("Coulomb friction is not identifiable")

    def test_a_new_packing_ends_it(self, kept):
        monitor = self.again(kept)
        monitor.renew(kept.time + 1)
        assert monitor.diagnosis().level is Level.OK


TRAVEL = 0.03
ACTUATOR = Valve(diaphragm_area=0.04, pressure_reference=1e5, travel=TRAVEL)
WHOLE = {
    "spring_constant": Measured(2e5, 1e3),
    "lower_stop": Measured(0.0, 1e-5),
    "lowest_position": Measured(0.0, 1e-5),
    "highest_position": Measured(0.025, 1e-5),
}
WITHIN = {"lowest_position": Measured(0.01, 1e-5), "highest_position": Measured(0.02, 1e-5)}
LOST = {**WHOLE, "lower_stop": Measured(2e-3, 1e-5), "lowest_position": Measured(2e-3, 1e-5)}
WEAK = {**WHOLE, "spring_constant": Measured(1.2e5, 1e3)}
HEALTHY_NUMBERS = Baseline(150.0, numbers=WHOLE)


def after(*records):
    """What is known after records, one a day."""
    known = KnownNumbers()
    for day, numbers in enumerate(records):
        known = known.followed_by(numbers, day * DAY)
    return known


@pytest.mark.parametrize(
    ("changed", "level", "words"),
    [(LOST, Level.WARN, "travel is lost"), (WEAK, Level.ERROR, "the spring constant has changed")],
)
def test_a_weaker_record_leaves_the_finding_and_its_date(changed, level, words):
    (at_first,) = after(WHOLE, changed).findings(HEALTHY_NUMBERS, ACTUATOR)
    assert (at_first.level, "measured" in at_first.message) == (level, False)
    (later,) = after(WHOLE, changed, WITHIN, {}).findings(HEALTHY_NUMBERS, ACTUATOR)
    assert (later.level, later.status_signal) == (level, at_first.status_signal)
    assert words in later.message
    assert later.message.endswith("(measured 1970-01-02 00:00 UTC; not seen in any record since)")


def test_a_new_measurement_ends_it():
    for changed in (LOST, WEAK):
        assert after(changed, WITHIN, WHOLE).findings(HEALTHY_NUMBERS, ACTUATOR) == ()


def test_a_stem_that_goes_beyond_the_stop_ends_it():
    known = after(LOST, {"lowest_position": Measured(0.0, 1e-5)})
    assert "lower_stop" not in known.dated
    assert known.findings(HEALTHY_NUMBERS, ACTUATOR) == ()


def test_a_record_that_is_older_than_others_replaces_none_of_theirs():
    known = after(WHOLE, LOST).with_record(WEAK, 0)
    assert known.dated == after(WEAK, LOST).dated
    assert known.latest == DAY


def test_what_was_measured_since_a_time():
    known = after(WHOLE, WITHIN)
    assert known.since(None) == known
    assert known.since(DAY).dated.keys() == set()
    assert known.since(0).dated == known.dated


def test_the_reach_is_that_of_the_farthest_record_until_a_stop_is_met():
    known = after(WHOLE, WITHIN)
    assert known.numbers["highest_position"] == WHOLE["highest_position"]
    assert known.of_latest == {}
    assert known.followed_by(LOST, 9 * DAY).numbers == LOST


class TestMonitor:
    @pytest.fixture
    def monitor(self, nothing):
        """A monitor of a valve that has lost travel, and then shows nothing of it."""
        monitor = FrictionMonitor(MonitorSettings(ACTUATOR))
        monitor.baseline = HEALTHY_NUMBERS
        monitor.accept(nothing, 0, LOST)
        monitor.accept(nothing, DAY, WITHIN)
        return monitor

    def test_the_finding_stays_until_another_baseline(self, monitor):
        (finding,) = monitor.findings
        assert "travel is lost" in finding.message
        assert monitor.changes["lower_stop"].value == pytest.approx(2e-3)
        monitor.baseline = HEALTHY_NUMBERS
        assert monitor.findings == ()

    def test_another_valve_drops_it(self, monitor):
        settings = monitor.settings
        monitor.change_settings(replace(settings, window=20.0))
        assert monitor.findings
        monitor.change_settings(replace(settings, valve=replace(ACTUATOR, travel=0.04)))
        assert monitor.findings == ()


HEALTHY_FRICTION = Baseline(100.0, 1.0)
EARLIER_ALARM = Diagnosis(
    Level.ERROR, StatusSignal.FAILURE, quoted("excess friction: 4 times; so"), None
)
DOUBT = "the Karnopp model does not describe this valve (misfit 9 µm)"


def kept_estimate(diagnosis=EARLIER_ALARM, baseline=HEALTHY_FRICTION, **changes):
    return replace(success(START, 400.0, baseline=baseline, **changes), diagnosis=diagnosis)


def monitor_with(earlier, baseline=HEALTHY_FRICTION, limits=None):
    monitor = FrictionMonitor(MonitorSettings(BENCH_VALVE, limits=limits or FrictionLimits()))
    monitor.baseline = baseline
    monitor.remember(earlier)
    return monitor


@pytest.mark.parametrize(
    ("age", "words"),
    [
        (0, "0 s ago, "),
        (119 * SECOND, "119 s ago, "),
        (120 * SECOND, "2 min ago, "),
        (119 * 60 * SECOND, "119 min ago, "),
        (3.9 * 3600 * SECOND, "3 h ago, "),
        (2 * DAY, "2 days ago, "),
        (-1, "in the future: a clock has since been set back, "),
    ],
)
def test_the_alarm_goes_on_with_its_age(age, words):
    earlier = kept_estimate()
    monitor = monitor_with(earlier)
    assert monitor.diagnosis() == EARLIER_ALARM
    told = f"{EARLIER_ALARM.message} (identified {words}before the restart)"
    aged = monitor.diagnosis(START + int(age))
    assert aged.message == told
    assert replace(aged, statement=EARLIER_ALARM.statement) == EARLIER_ALARM
    assert (monitor.estimate, monitor.earlier) == (earlier, earlier)
    assert (monitor.result, monitor.stamp) == (None, START)


def test_the_first_result_ends_it(result):
    monitor = monitor_with(kept_estimate())
    monitor.accept(result, START + 1)
    assert (monitor.estimate, monitor.earlier, monitor.stamp) == (result, None, START + 1)
    assert monitor.diagnosis(START + 2) == diagnose(result, BENCH_VALVE, HEALTHY_FRICTION)


def test_a_refusal_leaves_it():
    monitor = monitor_with(kept_estimate())
    monitor.refuse(RefusalError("the stem did not move"))
    assert str(monitor.diagnosis(START)) == (
        "ERROR: the latest identification was refused: the stem did not move; previous result: "
        f"{EARLIER_ALARM.message} (identified 0 s ago, before the restart)"
    )


class TestAgain:
    """The kept frictions count where something else is in force by now."""

    def test_another_baseline(self):
        monitor = monitor_with(kept_estimate(), Baseline(400.0, 1.0))
        assert (monitor.diagnosis().level, monitor.diagnosis().ratio.value) == (Level.OK, 1.0)
        monitor.baseline = Baseline(300.0, 1.0)
        assert monitor.diagnosis().level == Level.WARN
        monitor.baseline = HEALTHY_FRICTION
        assert monitor.diagnosis() == EARLIER_ALARM

    def test_a_baseline_that_was_set_since(self):
        calm = Diagnosis(Level.OK, StatusSignal.GOOD, quoted("no baseline yet; so"), None)
        monitor = monitor_with(kept_estimate(diagnosis=calm, baseline=None))
        assert monitor.diagnosis().level == Level.ERROR
        assert monitor.diagnosis().message.startswith("excess friction: Coulomb friction is 4.00 (")

    def test_other_limits_judge_it_anew_but_not_without_a_baseline(self):
        limits = FrictionLimits(1.25, 5.0)
        assert monitor_with(kept_estimate(), limits=limits).diagnosis().level == Level.WARN
        assert monitor_with(kept_estimate(), None, limits).diagnosis() == EARLIER_ALARM

    @pytest.mark.parametrize("value", [float("nan"), -3.0])
    def test_what_cannot_be_compared_stays(self, value):
        """Such as friction that has vanished: no number, and an alarm."""
        earlier = kept_estimate(
            parameters={"coulomb_friction": parameter("coulomb_friction", value)}
        )
        assert monitor_with(earlier, Baseline(50.0)).diagnosis() == EARLIER_ALARM

    def test_a_doubt_about_the_model_stays(self):
        doubted = replace(
            EARLIER_ALARM,
            statement=quoted(f"{DOUBT}; {EARLIER_ALARM.message}"),
            doubt=quoted(DOUBT),
        )
        monitor = monitor_with(kept_estimate(diagnosis=doubted), Baseline(400.0, 1.0))
        diagnosis = monitor.diagnosis()
        assert diagnosis.level == Level.OK
        assert str(diagnosis.doubt) == DOUBT
        assert diagnosis.message.startswith(f"{DOUBT}; friction normal: Coulomb friction is 1.00")
