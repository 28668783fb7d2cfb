# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The monitor of one valve: what it remembers, and what a change of settings leaves."""

import dataclasses
import math
import pickle

import numpy as np
import pytest
from records import simulated

from valve_friction_ros.health import (
    Baseline,
    BaselineLack,
    FrictionLimits,
    FrictionMonitor,
    Lack,
    Level,
    MonitorSettings,
    RefusedRecordError,
    SlidingFriction,
    StatusSignal,
    diagnose,
    identify_snapshot,
)
from valve_friction_ros.health.friction_monitor import MOST_SAMPLES
from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    identify_bench,
    identify_plant,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    LOW_FRICTION,
    SensorNoise,
    SineWave,
    converter_response,
)
from valve_friction_ros.streams import Samples, Snapshot
from valve_friction_ros.wording import Code, name_in_words, said

SETTINGS = MonitorSettings(BENCH_VALVE)
START = 1_700_000_000_000_000_000


def replaced(**changes):
    return dataclasses.replace(SETTINGS, **changes)


def compared_with(baseline):
    """A monitor that has a baseline."""
    monitor = FrictionMonitor(SETTINGS)
    monitor.baseline = baseline
    return monitor


def coulomb_friction(result):
    return result.parameters["coulomb_friction"]


def feed(monitor, record, but=()):
    """Fill the buffer with a record, but for some of its samples."""
    period = round(record.sample_period * 1e9)
    pairs = zip(record.pressure.tolist(), record.position.tolist(), strict=True)
    for step, (pressure, position) in enumerate(pairs):
        if step in but:
            continue
        assert monitor.buffer.add_pressure(START + step * period, pressure) is None
        assert monitor.buffer.add_position(START + step * period, position) is None


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_impossible_windows_are_named(value):
    with pytest.raises(ValueError, match=r"^window must be"):
        replaced(window=value)


class TestRefusalsInARow:
    """Bad records are a fault; records with too little motion are none."""

    BAD, STILL = (RefusedRecordError("why", {}, is_fault) for is_fault in (True, False))

    def problem(self, *refusals):
        monitor = FrictionMonitor(SETTINGS)
        for one in refusals:
            monitor.refuse(one)
        return monitor.refusals_problem

    def test_three_are_a_fault(self):
        assert self.problem(self.BAD, self.BAD) is None
        told = "the latest 3 identifications were refused: why"
        assert str(self.problem(self.BAD, self.BAD, self.BAD)) == told

    def test_the_diagnosis_beside_them_has_the_reason(self):
        monitor = FrictionMonitor(SETTINGS)
        for _ in range(3):
            monitor.refuse(self.BAD)
        assert str(monitor.refusals_beside_diagnosis) == "the latest 3 identifications were refused"
        assert str(monitor.diagnosis().message) == "no estimate: why"
        monitor.skip(RefusedRecordError("other", {}, is_fault=True))
        assert str(monitor.refusals_beside_diagnosis).endswith(
            "4 identifications were refused: other"
        )

    def test_too_little_motion_does_not_count(self):
        assert self.problem(*[self.STILL] * 9) is None
        assert self.problem(self.BAD, self.STILL, self.BAD) is None
        assert self.problem(self.BAD, self.STILL, self.BAD, self.BAD) is not None
        assert self.problem(*[RefusalError("already running")] * 9) is None

    def test_a_success_ends_it(self, loose_record):
        monitor = FrictionMonitor(SETTINGS)
        for _ in range(3):
            monitor.skip(self.BAD)
        feed(monitor, loose_record)
        monitor.accept(identify_snapshot(*monitor.input()), START)
        assert monitor.refusals_problem is None

    @pytest.mark.parametrize(("is_still", "is_fault"), [(True, False), (False, True)])
    def test_what_an_identification_refuses(self, loose_record, is_still, is_fault):
        monitor = FrictionMonitor(SETTINGS)
        feed(monitor, loose_record)
        if is_still:
            monitor.buffer.clear("")
        else:
            monitor.buffer.add_pressure(monitor.buffer.newest_stamp + 1, math.nan)
        with pytest.raises(RefusedRecordError) as refused:
            identify_snapshot(*monitor.input())
        assert refused.value.is_fault is is_fault
        again = pickle.loads(pickle.dumps(refused.value))
        assert (str(again), again.is_fault) == (str(refused.value), is_fault)


class TestLongRecord:
    """Twice the samples that are identified, at 2 kHz."""

    def test_means_of_it_are_identified_and_the_result_says_so(self):
        times = np.arange(2 * MOST_SAMPLES) / 2000
        pressure = converter_response(SineWave(period=8.0).sample(times), 5e-4, 0.6)
        record = SensorNoise(28.6e-6, 165.0, seed=1).applied_to(simulated(pressure, 5e-4))
        stamps = START + 500_000 * np.arange(times.size, dtype=np.int64)
        signals = (Samples(stamps, one) for one in (record.pressure, record.position))
        snapshot = Snapshot(next(signals), next(signals), (), None)
        result = identify_snapshot(snapshot, replaced(method="bench"))
        assert result.evidence["averaged_samples"] == 2
        assert result.findings[-1] == "the record consists of averages of 2 successive samples"
        assert len(result.recording) == MOST_SAMPLES
        assert result.recording.sample_period == 1e-3
        # The motion takes thousands of samples, so pairs of them say what they say by themselves.
        found = coulomb_friction(result)
        whole = coulomb_friction(identify_bench(snapshot.recording(), BENCH_VALVE))
        assert abs(found.value - whole.value) < 0.25 * whole.half_width
        assert found.half_width == pytest.approx(whole.half_width, rel=0.2)


class TestIdentification:
    @pytest.mark.parametrize(
        ("name", "method"),
        [("plant", identify_plant), ("best", identify_plant), ("refined", identify_bench)],
    )
    def test_a_full_buffer_gives_what_the_record_gives(self, loose_record, name, method):
        """Former names of the methods are understood, and results carry the present ones."""
        settings = replaced(method=name)
        monitor = FrictionMonitor(settings)
        feed(monitor, loose_record)
        found = identify_snapshot(monitor.buffer.snapshot(), settings)
        expected = method(loose_record, BENCH_VALVE, settings.identification)
        assert found.method == settings.method == expected.method
        assert str(found.parameters) == str(expected.parameters)  # nan is not nan
        if expected.estimate is not None:
            assert found.estimate.values == expected.estimate.values

    def test_a_gap_is_refused_only_by_a_method_that_needs_a_whole_record(self, loose_record):
        monitor = FrictionMonitor(SETTINGS)
        feed(monitor, loose_record, but=range(400, 475))
        snapshot = monitor.buffer.snapshot()
        with pytest.raises(RefusalError, match=r"^gap of 0\.76 s in actuator_pressure"):
            identify_snapshot(snapshot, replaced(method="published"))
        friction = identify_snapshot(snapshot, SETTINGS).parameters["coulomb_friction"]
        assert friction.interval[0] < LOW_FRICTION.coulomb_friction < friction.interval[1]

    def test_by_the_settings(self, loose_record):
        settings = replaced(
            identification=IdentificationSettings(fixed={"mass": 1.25}, derivative_window=21),
            method="published",
        )
        monitor = FrictionMonitor(settings)
        feed(monitor, loose_record)
        found = identify_snapshot(monitor.buffer.snapshot(), settings)
        assert found.values["mass"] == 1.25
        assert found.estimate.settings.published_window == 21
        assert found.derivative_window == 21

    def test_and_why_the_buffer_was_emptied(self):
        monitor = FrictionMonitor(SETTINGS)
        monitor.buffer.clear("time returned")
        with pytest.raises(RefusalError) as refusal:
            identify_snapshot(monitor.buffer.snapshot(), SETTINGS)
        assert str(refusal.value).startswith("no samples of actuator_pressure")
        assert str(refusal.value).endswith(" (the buffer was cleared: time returned)")


class TestMemory:
    def test_before_any_estimate_and_from_the_first_on(self, result):
        monitor = FrictionMonitor(SETTINGS)
        remembered = (monitor.result, monitor.stamp, monitor.refusal, monitor.baseline)
        assert remembered == (None, None, None, None)
        diagnosis = monitor.diagnosis()
        assert (diagnosis.level, diagnosis.status_signal) == (Level.OK, StatusSignal.GOOD)
        assert diagnosis.ratio is None
        assert diagnosis.message == "no estimate: nothing has been identified yet"
        monitor.refuse(RefusalError("the stem did not move"))
        assert monitor.refusal == "the stem did not move"
        assert str(monitor.diagnosis()) == "unknown: no estimate: the stem did not move"
        monitor.internal_error = "a bug"
        failed = "ERROR: a bug; previous result: no estimate: the stem did not move"
        assert str(monitor.diagnosis()) == failed
        monitor.accept(result, START)
        assert (monitor.result, monitor.stamp) == (result, START)
        assert monitor.refusal is None
        assert monitor.diagnosis() == diagnose(result, BENCH_VALVE)

    def test_a_refusal_leaves_the_estimate(self, result):
        monitor = compared_with(Baseline(coulomb_friction(result).value / 3))
        monitor.accept(result, START)
        monitor.refuse(RefusalError("the stem did not move"))
        assert (monitor.result, monitor.stamp) == (result, START)
        assert monitor.refusal == "the stem did not move"
        assert monitor.diagnosis().level == Level.ERROR
        verdict = diagnose(result, BENCH_VALVE, monitor.baseline)
        refused = said(Code.REFUSED, reason="the stem did not move", of=verdict.statement)
        assert monitor.diagnosis() == dataclasses.replace(verdict, statement=refused)


class TestInternalError:
    def test_it_is_an_error_until_an_identification_succeeds(self, result):
        monitor = FrictionMonitor(SETTINGS)
        monitor.accept(result, START)
        good = monitor.diagnosis()
        monitor.internal_error = "internal error: a bug"
        diagnosis = monitor.diagnosis()
        assert (diagnosis.level, diagnosis.status_signal) == (
            Level.ERROR,
            StatusSignal.CHECK_FUNCTION,
        )
        assert diagnosis.message == f"internal error: a bug; previous result: {good.message}"
        assert (monitor.result, monitor.refusal) == (result, None)

        monitor.refuse(RefusalError("the stem did not move"))
        assert monitor.internal_error == "internal error: a bug"
        assert monitor.diagnosis().level == Level.ERROR
        monitor.accept(result, START + 1)
        assert monitor.internal_error is None
        assert monitor.diagnosis() == good

    def test_an_alarm_stays(self, result):
        monitor = compared_with(Baseline(coulomb_friction(result).value / 3))
        monitor.accept(result, START)
        alarm = monitor.diagnosis()
        monitor.internal_error = "internal error: a bug"
        assert alarm.level == Level.ERROR
        failed = said(Code.FAILED, error="internal error: a bug", of=alarm.statement)
        assert monitor.diagnosis() == dataclasses.replace(alarm, statement=failed)


class TestBaseline:
    def test_of_the_latest_assessment_with_its_interval(self, result, with_values, friction):
        monitor = FrictionMonitor(SETTINGS)
        monitor.accept(result, START)
        healthy, slid = coulomb_friction(result), result.parameters["sliding_friction"]
        sliding = SlidingFriction(slid.value, slid.half_width, result.sliding_speed)
        expected = Baseline(healthy.value, healthy.half_width, sliding)
        monitor.baseline = monitor.result_as_baseline()
        assert monitor.baseline == expected
        assert monitor.diagnosis().ratio.value == 1.0
        tight = friction(2.5 * healthy.value, 7.0)
        more = friction(slid.value + 1.5 * healthy.value, 7.0, "sliding_friction")
        monitor.accept(with_values(coulomb_friction=tight, sliding_friction=more), START + 1)
        assert monitor.diagnosis().ratio.of == "coulomb_friction"
        assert monitor.diagnosis().ratio.value == 2.5
        assert monitor.diagnosis().level == Level.ERROR
        monitor.baseline = monitor.result_as_baseline()
        assert monitor.baseline.coulomb_friction == tight.value
        assert monitor.diagnosis().level == Level.OK

    def test_needs_an_estimate(self):
        monitor = FrictionMonitor(SETTINGS)
        text = "^the valve has no result to take as baseline: identify it first$"
        with pytest.raises(RefusalError, match=text):
            monitor.result_as_baseline()
        assert monitor.baseline_lacks() == (BaselineLack("result", Lack.RESULT),)

    @pytest.mark.parametrize("name", ["coulomb_friction", "sliding_friction"])
    def test_needs_a_friction(self, with_values, name):
        monitor = compared_with(Baseline(100.0))
        monitor.accept(with_values(**{name: -3.0}), START)
        with pytest.raises(RefusalError) as refusal:
            monitor.result_as_baseline()
        assert str(refusal.value) == (
            f"a {name_in_words(name)} of -3 N cannot be a baseline: check the direction of "
            "both signals, then identify again"
        )
        assert refusal.value.lacks == monitor.baseline_lacks() == (BaselineLack(name, Lack.SIZE),)
        assert monitor.baseline == Baseline(100.0)

    @pytest.mark.parametrize("before", [None, Baseline(100.0)])
    def test_needs_an_identifiable_friction(self, with_values, unknown, before):
        monitor = compared_with(before)
        nothing = {name: unknown(name) for name in ("coulomb_friction", "sliding_friction")}
        monitor.accept(with_values(**nothing), START)
        with pytest.raises(RefusalError) as refusal:
            monitor.result_as_baseline()
        why = "is not identifiable (the record does not determine it)"
        assert str(refusal.value).startswith(
            f"this result cannot be the baseline: Coulomb friction {why}; sliding friction {why}: "
            "record more strokes, "
        )
        assert monitor.baseline == before
        assert monitor.diagnosis().level == Level.OK


class TestChangeOfSettings:
    def filled(self, result, baseline=None):
        monitor = compared_with(baseline)
        monitor.accept(result, START)
        monitor.buffer.add_pressure(START, 1e5)
        return monitor

    @pytest.mark.parametrize(
        "changes",
        [
            {"window": 30.0},
            {"valve": dataclasses.replace(BENCH_VALVE, pressure_maximum=2e5)},
        ],
        ids=["window", "valve"],
    )
    def test_another_window_or_valve_empties_the_buffer(self, result, changes):
        monitor = self.filled(result)
        monitor.change_settings(replaced(**changes))
        assert len(monitor.buffer) == 0
        cause = "valve or window parameters were changed"
        assert str(monitor.buffer.snapshot().cleared_because) == cause
        assert monitor.result is result
        if "valve" in changes:
            assert "0 to 200000 Pa" in str(monitor.buffer.add_pressure(START, 2.1e5))

    @pytest.mark.parametrize(
        "changes",
        [
            {"limits": FrictionLimits(warn_ratio=1.2)},
            {"identification": IdentificationSettings(derivative_window=51)},
        ],
        ids=["limits", "identification"],
    )
    def test_other_changes_keep_it(self, result, changes):
        monitor = self.filled(result)
        changed = replaced(**changes)
        monitor.change_settings(changed)
        assert len(monitor.buffer) == 1
        assert monitor.buffer.snapshot().cleared_because is None
        assert monitor.settings == changed

    def test_new_limits_judge_the_old_estimate_by_the_same_baseline(self, result):
        healthy = Baseline(coulomb_friction(result).value / 1.2)
        monitor = self.filled(result, healthy)
        assert monitor.diagnosis().level == Level.OK
        monitor.change_settings(dataclasses.replace(monitor.settings, limits=FrictionLimits(1.15)))
        assert monitor.diagnosis().level == Level.WARN
        assert monitor.baseline == healthy
