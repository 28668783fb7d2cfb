# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A factor that spring and friction share qualifies what is said of the friction."""

from dataclasses import replace

import pytest
from records import quick_record

from valve_friction_ros import compare
from valve_friction_ros.health import (
    Baseline,
    Diagnosis,
    FrictionMonitor,
    Level,
    Measured,
    MonitorSettings,
    Ratio,
    StatusSignal,
    diagnose_valve,
    qualified,
)
from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, Valve
from valve_friction_ros.wording import quoted

FACTOR = Measured.between(2.2, 2.15, 2.25)
VALVE = Valve(diaphragm_area=0.04, pressure_reference=1e5, travel=0.03)
GROWN = Diagnosis(
    Level.ERROR,
    StatusSignal.FAILURE,
    quoted("excess friction: so much"),
    Ratio.between(2.2, 2.1, 2.3),
)
WORDS = (
    "friction and spring constant have changed by one factor, which points to the scale of the "
    "pressure sensor and the diaphragm area: check both before any work on the packing; "
)


def test_the_level_stays_and_the_signal_is_to_check():
    told = qualified(GROWN, FACTOR, VALVE)
    assert (told.level, told.status_signal) == (Level.ERROR, StatusSignal.CHECK_FUNCTION)
    assert told.message == WORDS + "excess friction: so much"
    assert qualified(told, FACTOR, VALVE) == told


def test_a_force_has_no_diaphragm():
    told = qualified(GROWN, FACTOR, Valve(None, travel=0.03))
    assert "points to the scale of the drive force sensor: check both" in told.message


@pytest.mark.parametrize(
    ("diagnosis", "factor"),
    [
        (GROWN, None),
        (GROWN, Measured.between(1.5, 1.45, 1.55)),
        (replace(GROWN, level=Level.OK), FACTOR),
        (replace(GROWN, ratio=None), FACTOR),
    ],
)
def test_what_the_factor_does_not_explain_stays(diagnosis, factor):
    """No factor; a friction that has grown by more; nothing found; nothing compared."""
    assert qualified(diagnosis, factor, VALVE) == diagnosis


@pytest.fixture(scope="module")
def healthy():
    return identify(quick_record(), BENCH_VALVE)


class TestWholeRecords:
    """Half the area stands for a pressure sensor that reads twice too much."""

    @pytest.fixture(scope="class")
    def scaled(self):
        twice = replace(BENCH_VALVE, diaphragm_area=2 * BENCH_VALVE.diaphragm_area)
        return identify(quick_record(), twice)

    def test_by_a_result(self, healthy, scaled):
        found = diagnose_valve(scaled, Baseline.of(healthy))
        assert found.friction.message.startswith(WORDS)
        assert "one common factor" in found.findings[0].message
        assert compare(scaled, healthy) == found.friction

    def test_by_the_monitor(self, healthy, scaled):
        monitor = FrictionMonitor(MonitorSettings(scaled.valve))
        monitor.baseline = Baseline.of(healthy)
        monitor.accept(scaled, 1)
        assert monitor.diagnosis().message.startswith(WORDS)
        assert monitor.diagnosis().level > Level.OK

    def test_friction_that_has_grown_by_itself(self, healthy):
        tight = 2.5 * LOW_FRICTION.coulomb_friction
        packing = replace(LOW_FRICTION, coulomb_friction=tight, static_friction=tight)
        found = diagnose_valve(identify(quick_record(packing), BENCH_VALVE), Baseline.of(healthy))
        assert found.friction.status_signal is StatusSignal.FAILURE
        assert found.friction.message.startswith("excess friction")
