"""The monitor of one valve: what it remembers, and what a change of settings leaves."""

import dataclasses
import math

import numpy as np
import pytest

from valve_friction_ros.identification import IdentificationSettings, RefusalError, identify
from valve_friction_ros.model import BENCH_VALVE, Recording, SineWave, simulate
from valve_friction_ros.monitoring import (
    FrictionLimits,
    FrictionMonitor,
    Level,
    MonitorSettings,
    StatusSignal,
    diagnose,
    identify_snapshot,
)

SETTINGS = MonitorSettings(BENCH_VALVE)
START = 1_700_000_000_000_000_000


def replaced(**changes):
    return dataclasses.replace(SETTINGS, **changes)


def feed(monitor, record):
    period = round(record.sample_period * 1e9)
    pairs = zip(record.pressure.tolist(), record.position.tolist(), strict=True)
    for step, (pressure, position) in enumerate(pairs):
        assert monitor.buffer.add_pressure(START + step * period, pressure) is None
        assert monitor.buffer.add_position(START + step * period, position) is None


@pytest.fixture(scope="module")
def record(benches):
    """Ten seconds of a sine at 100 Hz."""
    pressure = SineWave(period=10.0).sample(np.arange(1000) / 100)
    return Recording(0.01, pressure, simulate(*benches["low"], pressure, 0.01).position)


class TestSettings:
    @pytest.mark.parametrize("name", ["window", "baseline"])
    @pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
    def test_impossible_values_are_named(self, name, value):
        with pytest.raises(ValueError, match=rf"^{name}\w* must be"):
            replaced(**{name: value})


class TestIdentification:
    def test_a_full_buffer_gives_what_the_record_gives(self, record):
        monitor = FrictionMonitor(SETTINGS)
        feed(monitor, record)
        found = identify_snapshot(monitor.buffer.snapshot(), SETTINGS)
        assert found.values == identify(record, BENCH_VALVE).values

    def test_by_the_settings(self, record):
        settings = replaced(identification=IdentificationSettings(fixed={"mass": 1.25}))
        monitor = FrictionMonitor(settings)
        feed(monitor, record)
        assert identify_snapshot(monitor.buffer.snapshot(), settings).mass == 1.25

    def test_a_refusal_has_its_cause(self):
        snapshot = FrictionMonitor(SETTINGS).buffer.snapshot()
        with pytest.raises(RefusalError) as refusal:
            identify_snapshot(snapshot, SETTINGS)
        assert str(refusal.value).startswith("no samples of actuator_pressure")
        assert "cleared" not in str(refusal.value)

    def test_and_why_the_buffer_was_emptied(self):
        monitor = FrictionMonitor(SETTINGS)
        monitor.buffer.clear("time went back")
        with pytest.raises(RefusalError) as refusal:
            identify_snapshot(monitor.buffer.snapshot(), SETTINGS)
        assert str(refusal.value).startswith("no samples of actuator_pressure")
        assert str(refusal.value).endswith(" (the buffer was cleared: time went back)")


class TestMemory:
    def test_at_first(self):
        monitor = FrictionMonitor(SETTINGS)
        remembered = (monitor.estimate, monitor.estimate_stamp, monitor.refusal, monitor.baseline)
        assert remembered == (None, None, None, None)
        diagnosis = monitor.diagnosis()
        assert (diagnosis.level, diagnosis.status_signal) == (Level.OK, StatusSignal.GOOD)
        assert diagnosis.ratio is None
        assert diagnosis.message == "no estimate: nothing has been identified yet"

    def test_a_refusal_before_any_estimate(self):
        monitor = FrictionMonitor(SETTINGS)
        monitor.refuse(RefusalError("the stem did not move"))
        assert monitor.refusal == "the stem did not move"
        assert monitor.diagnosis().level == Level.OK
        assert monitor.diagnosis().message == "no estimate: the stem did not move"

    def test_an_estimate_ends_the_refusal(self, estimate):
        monitor = FrictionMonitor(SETTINGS)
        monitor.refuse(RefusalError("the stem did not move"))
        monitor.accept(estimate, START)
        assert (monitor.estimate, monitor.estimate_stamp) == (estimate, START)
        assert monitor.refusal is None
        assert monitor.diagnosis() == diagnose(estimate, BENCH_VALVE)

    def test_a_refusal_leaves_the_estimate(self, estimate):
        monitor = FrictionMonitor(replaced(baseline=estimate.coulomb_friction / 3))
        monitor.accept(estimate, START)
        monitor.refuse(RefusalError("the stem did not move"))
        assert (monitor.estimate, monitor.estimate_stamp) == (estimate, START)
        assert monitor.refusal == "the stem did not move"
        assert monitor.diagnosis().level == Level.ERROR


class TestBaseline:
    def test_of_the_settings(self, estimate):
        monitor = FrictionMonitor(replaced(baseline=100.0))
        assert monitor.baseline == 100.0
        monitor.accept(estimate, START)
        assert monitor.diagnosis().ratio == estimate.coulomb_friction / 100.0

    def test_of_the_latest_estimate(self, estimate):
        monitor = FrictionMonitor(SETTINGS)
        monitor.accept(estimate, START)
        assert monitor.set_baseline() == monitor.baseline == estimate.coulomb_friction
        tight = dataclasses.replace(estimate, coulomb_friction=2.5 * estimate.coulomb_friction)
        monitor.accept(tight, START + 1)
        assert monitor.diagnosis().ratio == 2.5
        assert monitor.diagnosis().level == Level.ERROR
        assert monitor.set_baseline() == tight.coulomb_friction
        assert monitor.diagnosis().level == Level.OK

    def test_needs_an_estimate(self):
        monitor = FrictionMonitor(SETTINGS)
        with pytest.raises(RefusalError, match="identify first"):
            monitor.set_baseline()
        assert monitor.baseline is None

    @pytest.mark.parametrize("coulomb", [0.0, -3.0])
    def test_needs_a_friction(self, estimate, coulomb):
        monitor = FrictionMonitor(replaced(baseline=100.0))
        monitor.accept(dataclasses.replace(estimate, coulomb_friction=coulomb), START)
        with pytest.raises(
            RefusalError, match=f"^a coulomb friction of {coulomb:.4g} N is no base"
        ):
            monitor.set_baseline()
        assert monitor.baseline == 100.0


class TestChangeOfSettings:
    def filled(self, estimate, settings=SETTINGS):
        monitor = FrictionMonitor(settings)
        monitor.accept(estimate, START)
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
    def test_another_window_or_valve_empties_the_buffer(self, estimate, changes):
        monitor = self.filled(estimate)
        monitor.change_settings(replaced(**changes))
        assert len(monitor.buffer) == 0
        cause = "valve or window parameters were changed"
        assert monitor.buffer.snapshot().cleared_because == cause
        assert monitor.estimate is estimate

    def test_the_new_range_holds(self, estimate):
        monitor = self.filled(estimate)
        monitor.change_settings(
            replaced(valve=dataclasses.replace(BENCH_VALVE, pressure_maximum=2e5))
        )
        assert "0 to 200000 Pa" in monitor.buffer.add_pressure(START, 2.1e5)

    @pytest.mark.parametrize(
        "changes",
        [
            {"baseline": 3.0},
            {"limits": FrictionLimits(warn_ratio=1.2)},
            {"identification": IdentificationSettings(window=51)},
        ],
        ids=["baseline", "limits", "identification"],
    )
    def test_other_changes_keep_it(self, estimate, changes):
        monitor = self.filled(estimate)
        changed = replaced(**changes)
        monitor.change_settings(changed)
        assert len(monitor.buffer) == 1
        assert monitor.buffer.snapshot().cleared_because is None
        assert monitor.settings == changed

    def test_a_baseline_that_was_set_survives_other_changes(self, estimate):
        monitor = self.filled(estimate)
        monitor.set_baseline()
        monitor.change_settings(replaced(limits=FrictionLimits(warn_ratio=1.2)))
        assert monitor.baseline == estimate.coulomb_friction

    def test_but_not_a_baseline_of_the_settings(self, estimate):
        monitor = self.filled(estimate, replaced(baseline=100.0))
        monitor.set_baseline()
        monitor.change_settings(replaced(baseline=120.0))
        assert monitor.baseline == 120.0
        monitor.change_settings(SETTINGS)
        assert monitor.baseline is None

    def test_new_limits_judge_the_old_estimate(self, estimate):
        monitor = self.filled(estimate, replaced(baseline=estimate.coulomb_friction / 1.4))
        assert monitor.diagnosis().level == Level.OK
        monitor.change_settings(dataclasses.replace(monitor.settings, limits=FrictionLimits(1.3)))
        assert monitor.diagnosis().level == Level.WARN
