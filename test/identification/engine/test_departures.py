# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""F_s by the forces at which the stem leaves its rests."""

import numpy as np
import pytest

from valve_friction_ros.identification.engine.balance_regression import LagPrior
from valve_friction_ros.identification.engine.departures import static_friction
from valve_friction_ros.identification.engine.intervals import Budget, Estimated
from valve_friction_ros.model import KarnoppParameters, Valve, simulate
from valve_friction_ros.model.recording import StampedRecord, StampedSignal

PERIOD = 2e-3
TIME = np.arange(30_000) * PERIOD
USUAL, NO_LAG = LagPrior(), LagPrior(0.0)


def estimated(value, share):
    return Estimated(value, share * value, Budget(share * value / 2, 0.0, {}))


def drawn(seed, slips=True):
    """Draw a valve from the smallest to the largest, and a packing in proportion to it."""
    generator = np.random.default_rng(seed)
    area, spring, travel, dry, ratio, stribeck = np.exp(
        generator.uniform(
            *np.log([[4e-3, 2e4, 8e-3, 0.02, 1.25, 0.5e-3], [0.12, 2e6, 0.08, 0.2, 2.0, 3e-3]])
        )
    )
    dry, preload = dry * spring * travel, 0.3 * spring * travel
    packing = KarnoppParameters(
        40 * area,
        0.02 * spring,
        dry,
        ratio * dry if slips else dry,
        spring,
        preload,
        stribeck_velocity=stribeck if slips else 0.0,
    )
    return Valve(area, 41_740.0, travel), packing


def loaded(valve, packing, seed, late=0.0):
    """Load and unload the stem by a slow sweep with noise; it slips and sticks on its way."""
    spring, travel = packing.spring_constant, valve.travel
    middle = packing.spring_preload + 0.5 * spring * travel
    swing = 0.25 * spring * travel + packing.static_friction
    generator = np.random.default_rng(seed)
    force = middle + swing * np.sin(2 * np.pi * TIME / generator.uniform(12.0, 20.0))
    pressure = valve.pressure_reference + force / valve.diaphragm_area
    position = simulate(valve, packing, pressure, PERIOD).position
    noises = generator.standard_normal((2, TIME.size))
    drive = pressure + 3e-4 * np.ptp(pressure) * noises[0]
    stem = position + 2e-4 * travel * noises[1]
    return StampedRecord(StampedSignal(TIME, drive), StampedSignal(TIME + late, stem))


def spring_of(packing, share=0.03):
    names = ("spring_constant", "spring_preload")
    return {name: estimated(getattr(packing, name), share) for name in names}


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("late", [0.0, 0.02])
def test_a_stem_that_slips_shows_its_static_friction(seed, late):
    valve, packing = drawn(seed)
    found = static_friction(loaded(valve, packing, seed, late), valve, spring_of(packing), USUAL)
    one, true = found.static_friction, packing.static_friction
    assert found.departures >= 4
    assert abs(one.value - true) <= one.half_width
    assert one.half_width < 0.25 * true


def test_the_departures_alone_determine_the_spring_well_enough():
    valve, packing = drawn(3)
    record = loaded(valve, packing, 3)
    one = static_friction(record, valve, {}, NO_LAG).static_friction
    assert abs(one.value - packing.static_friction) <= one.half_width < packing.static_friction


def test_a_spring_that_the_departures_contradict_is_not_believed():
    valve, packing = drawn(3)
    wrong = {
        "spring_constant": estimated(2.0 * packing.spring_constant, 0.01),
        "spring_preload": estimated(0.3 * packing.spring_preload, 0.01),
    }
    one = static_friction(loaded(valve, packing, 3), valve, wrong, NO_LAG).static_friction
    assert abs(one.value - packing.static_friction) <= one.half_width


@pytest.mark.parametrize("seed", range(6))
def test_without_a_slip_there_is_no_static_friction_of_its_own(seed):
    valve, packing = drawn(seed, slips=False)
    assert static_friction(loaded(valve, packing, seed), valve, spring_of(packing), USUAL) is None


def test_few_departures_say_nothing():
    valve, packing = drawn(3)
    record = loaded(valve, packing, 3)
    kept = record.drive.time < 4.0
    short = StampedRecord(
        *(StampedSignal(one.time[kept], one.value[kept]) for one in (record.drive, record.position))
    )
    assert static_friction(short, valve, spring_of(packing), USUAL) is None


def test_an_unstated_lag_widens_what_was_loaded_quickly():
    valve, packing = drawn(5)
    record = loaded(valve, packing, 5)
    usual, known = (
        static_friction(record, valve, spring_of(packing), lag).static_friction
        for lag in (USUAL, NO_LAG)
    )
    assert known.budget.timing == pytest.approx(0.0, abs=1e-6 * known.value)
    assert usual.budget.timing > 0
    assert usual.budget.shared == usual.budget.timing
