# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What an identification becomes in the history."""

import json

import numpy as np
import pytest
from histories import START, VALVE, parameter, refused, success

from valve_friction_ros import __version__
from valve_friction_ros.health import (
    DatedNumber,
    FrictionMonitor,
    Measured,
    MonitorSettings,
    RefusedRecordError,
    identify_snapshot,
)
from valve_friction_ros.history import entry_of
from valve_friction_ros.history.entry import settings_text
from valve_friction_ros.identification import IdentificationSettings, RefusalError, Verdict
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, SineWave, Valve, simulate

PERIOD = 10_000_000


@pytest.fixture
def monitor():
    """A monitor that has gathered five seconds; the pressure begins a sample later."""
    monitor = FrictionMonitor(MonitorSettings(BENCH_VALVE))
    pressure = SineWave(period=5.0).sample(np.arange(500) / 100)
    position = simulate(BENCH_VALVE, LOW_FRICTION, pressure, 0.01).position
    for k in range(500):
        if k:
            monitor.buffer.add_pressure(k * PERIOD, pressure[k])
        monitor.buffer.add_position(k * PERIOD, position[k])
    return monitor


def test_a_success(monitor):
    snapshot = monitor.buffer.snapshot()
    result = identify_snapshot(snapshot, monitor.settings)
    monitor.accept(result, START)
    baseline = monitor.baseline = monitor.result_as_baseline()
    entry = entry_of(monitor, VALVE, snapshot, monitor.settings, START)
    assert entry.parameters == dict(result.parameters)
    assert entry.span == (0, 499 * PERIOD)
    assert entry.fit == (
        result.fit,
        result.rms,
        result.misfit.systematic,
    )
    assert entry.diagnosis == monitor.diagnosis()
    assert entry.diagnosis.ratio.value == 1.0
    assert (entry.baseline, entry.limits) == (baseline, monitor.settings.limits)
    assert entry.warnings == result.warnings
    assert (entry.time, entry.valve, entry.refusal) == (START, VALVE, "")
    assert entry.method == result.method == "plant"
    assert entry.version == __version__


def test_a_refusal(monitor):
    """It keeps why, and nothing of the estimate before it."""
    snapshot = monitor.buffer.snapshot()
    monitor.accept(identify_snapshot(snapshot, monitor.settings), START)
    refusal = RefusedRecordError("too little travel", {"stem_noise": Measured(1e-5, 1e-7)})
    entry = entry_of(monitor, VALVE, snapshot, monitor.settings, START, refusal)
    assert entry.refusal == "too little travel"
    assert entry.numbers == refusal.numbers
    assert not entry.parameters
    assert entry.friction is None
    assert entry.point() is None
    assert entry.span == (0, 499 * PERIOD)


def test_a_refusal_of_nothing(monitor):
    monitor.buffer.clear("on request")
    empty, refusal = monitor.buffer.snapshot(), RefusalError("no samples")
    assert entry_of(monitor, VALVE, empty, monitor.settings, START, refusal).span is None


@pytest.mark.parametrize(("name", "method"), [("best", "plant"), ("bench", "bench")])
def test_a_refusal_has_the_method_that_would_have_identified(name, method):
    monitor = FrictionMonitor(MonitorSettings(BENCH_VALVE, method=name))
    empty, refusal = monitor.buffer.snapshot(), RefusalError("no samples")
    entry = entry_of(monitor, VALVE, empty, monitor.settings, START, refusal)
    assert entry.method == method


def test_neither_a_success_nor_a_refusal_or_both():
    for changes in ({"parameters": {}}, {"refusal": "why"}):
        with pytest.raises(ValueError, match="either parameters or the reason"):
            success(**changes)


@pytest.mark.parametrize("verdict", Verdict)
def test_only_what_was_measured_makes_a_trend(verdict):
    expected = DatedNumber(START, 150.0, 3.0)
    measured = verdict in (Verdict.IDENTIFIED, Verdict.WEAK)
    assert success(verdict=verdict).point() == (expected if measured else None)
    assert refused().point() is None


def test_settings_are_the_same_text_for_the_same_settings():
    one = MonitorSettings(BENCH_VALVE, IdentificationSettings(fixed={"mass": 1.6}))
    assert settings_text(one) == settings_text(MonitorSettings(BENCH_VALVE, one.identification))
    told = json.loads(settings_text(one))
    assert told["identification"]["fixed"] == {"mass": 1.6}
    assert told["valve"]["diaphragm_area"] == BENCH_VALVE.diaphragm_area
    assert told["window"] == 60.0
    endless = MonitorSettings(Valve(0.0445, 0.0))
    assert json.loads(settings_text(endless))["valve"]["travel"] is None


def test_parameters_cannot_be_changed():
    with pytest.raises(TypeError):
        success().parameters["mass"] = parameter("mass", 2.0)
