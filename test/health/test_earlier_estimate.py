# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A monitor that goes on with the estimate from before it began."""

from dataclasses import replace

import pytest
from histories import DAY, SECOND, START, parameter, success

from valve_friction_ros.health import (
    Baseline,
    Diagnosis,
    FrictionLimits,
    FrictionMonitor,
    Level,
    MonitorSettings,
    StatusSignal,
    diagnose,
)
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.wording import quoted

HEALTHY = Baseline(100.0, 1.0)
ALARM = Diagnosis(Level.ERROR, StatusSignal.FAILURE, quoted("excess friction: 4 times; so"), None)
DOUBT = "the Karnopp model does not describe this valve (9 µm of misfit)"


def kept(friction=400.0, diagnosis=ALARM, baseline=HEALTHY, **changes):
    return replace(success(START, friction, baseline=baseline, **changes), diagnosis=diagnosis)


def monitor_with(earlier, baseline=HEALTHY, limits=None):
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
        (-1, "in the future: a clock has been set back since, "),
    ],
)
def test_the_alarm_goes_on_with_its_age(age, words):
    earlier = kept()
    monitor = monitor_with(earlier)
    assert monitor.diagnosis() == ALARM
    told = f"{ALARM.message} (identified {words}before the restart)"
    aged = monitor.diagnosis(START + int(age))
    assert aged.message == told
    assert replace(aged, statement=ALARM.statement) == ALARM
    assert (monitor.estimate, monitor.earlier) == (earlier, earlier)
    assert (monitor.result, monitor.stamp) == (None, START)


def test_the_first_result_ends_it(result):
    monitor = monitor_with(kept())
    monitor.accept(result, START + 1)
    assert (monitor.estimate, monitor.earlier, monitor.stamp) == (result, None, START + 1)
    assert monitor.diagnosis(START + 2) == diagnose(result, BENCH_VALVE, HEALTHY)


def test_a_refusal_and_a_bug_leave_it():
    monitor = monitor_with(kept())
    monitor.refuse(RefusalError("the stem did not move"))
    told = monitor.diagnosis(START)
    assert told.level == Level.ERROR
    assert told.message == (
        "the latest identification was refused: the stem did not move; before: "
        f"{ALARM.message} (identified 0 s ago, before the restart)"
    )
    monitor.fail("internal error: a bug")
    assert monitor.diagnosis().level == Level.ERROR


def test_it_is_no_baseline():
    with pytest.raises(RefusalError, match="no result to take as baseline"):
        monitor_with(kept()).result_as_baseline()


class TestAgain:
    """The kept frictions count where something else is in force by now."""

    def test_another_baseline(self):
        monitor = monitor_with(kept(), Baseline(400.0, 1.0))
        assert monitor.diagnosis().level == Level.OK
        assert monitor.diagnosis().ratio.value == 1.0
        monitor.baseline = Baseline(300.0, 1.0)
        assert monitor.diagnosis().level == Level.WARN
        monitor.baseline = HEALTHY
        assert monitor.diagnosis() == ALARM

    def test_a_baseline_that_was_set_since(self):
        calm = Diagnosis(Level.OK, StatusSignal.GOOD, quoted("no baseline yet; so"), None)
        monitor = monitor_with(kept(diagnosis=calm, baseline=None))
        assert monitor.diagnosis().level == Level.ERROR
        assert monitor.diagnosis().message.startswith("excess friction: coulomb friction is 4.00 (")

    def test_other_limits(self):
        monitor = monitor_with(kept(), limits=FrictionLimits(1.25, 5.0))
        assert monitor.diagnosis().level == Level.WARN

    def test_without_a_baseline_the_alarm_stays(self):
        assert monitor_with(kept(), None).diagnosis() == ALARM

    @pytest.mark.parametrize("value", [float("nan"), -3.0])
    def test_what_cannot_be_compared_stays(self, value):
        """Such as friction that has vanished: no number, and an alarm."""
        earlier = kept(parameters={"coulomb_friction": parameter("coulomb_friction", value)})
        assert monitor_with(earlier, Baseline(50.0)).diagnosis() == ALARM

    def test_a_doubt_about_the_model_stays(self):
        doubted = replace(ALARM, statement=quoted(f"{DOUBT}; {ALARM.message}"), doubt=quoted(DOUBT))
        monitor = monitor_with(kept(diagnosis=doubted), Baseline(400.0, 1.0))
        diagnosis = monitor.diagnosis()
        assert diagnosis.level == Level.OK
        assert str(diagnosis.doubt) == DOUBT
        assert diagnosis.message.startswith(f"{DOUBT}; friction normal: coulomb friction is 1.00")
