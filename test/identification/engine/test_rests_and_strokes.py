# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""F_s by the forces at which the stem leaves its rests; friction by whole strokes of jumps."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.identification.engine import friction_curve
from valve_friction_ros.identification.engine.balance_regression import LagPrior
from valve_friction_ros.identification.engine.departures import static_friction
from valve_friction_ros.identification.engine.friction_curve import (
    _by_strokes,
    _cut,
    curve_numbers,
    friction_curves,
)
from valve_friction_ros.identification.engine.intervals import Estimated
from valve_friction_ros.identification.engine.sliding_averages import MeasuredSignal
from valve_friction_ros.model import KarnoppParameters, Valve, simulate
from valve_friction_ros.model.recording import StampedRecord, StampedSignal

PERIOD = 2e-3
TIME = np.arange(30_000) * PERIOD
USUAL, NO_LAG = LagPrior(), LagPrior(0.0)


def estimated(value, share):
    return Estimated(value, share * value, share * value / 2)


def drawn_valve(seed, slips=True):
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


def spring_of(packing):
    names = ("spring_constant", "spring_preload")
    return {name: estimated(getattr(packing, name), 0.03) for name in names}


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("late", [0.0, 0.02])
def test_a_stem_that_slips_shows_its_static_friction(seed, late):
    valve, packing = drawn_valve(seed)
    found = static_friction(loaded(valve, packing, seed, late), valve, spring_of(packing), USUAL)
    one, true = found.static_friction, packing.static_friction
    assert found.departures >= 4
    assert abs(one.value - true) <= one.half_width
    assert one.half_width < 0.25 * true


@pytest.mark.parametrize("is_known", [False, True])
def test_without_a_spring_or_with_one_that_they_contradict_the_departures_find_it(is_known):
    valve, packing = drawn_valve(3)
    wrong = {
        "spring_constant": estimated(2.0 * packing.spring_constant, 0.01),
        "spring_preload": estimated(0.3 * packing.spring_preload, 0.01),
    }
    known = wrong if is_known else {}
    one = static_friction(loaded(valve, packing, 3), valve, known, NO_LAG).static_friction
    assert abs(one.value - packing.static_friction) <= one.half_width < packing.static_friction


@pytest.mark.parametrize("seed", range(6))
def test_without_a_slip_there_is_no_static_friction_of_its_own(seed):
    valve, packing = drawn_valve(seed, slips=False)
    assert static_friction(loaded(valve, packing, seed), valve, spring_of(packing), USUAL) is None


def test_few_departures_say_nothing():
    valve, packing = drawn_valve(3)
    record = loaded(valve, packing, 3)
    kept = record.drive.time < 4.0
    short = StampedRecord(
        *(StampedSignal(one.time[kept], one.value[kept]) for one in (record.drive, record.position))
    )
    assert static_friction(short, valve, spring_of(packing), USUAL) is None


def test_an_unstated_lag_widens_what_was_loaded_quickly():
    valve, packing = drawn_valve(5)
    record = loaded(valve, packing, 5)
    usual, known = (
        static_friction(record, valve, spring_of(packing), lag).static_friction
        for lag in (USUAL, NO_LAG)
    )
    assert known.timing == pytest.approx(0.0, abs=1e-6 * known.value)
    assert usual.timing > 0
    assert usual.shared == usual.timing


JUMP_PERIOD = 0.01
JUMP_TIME = np.arange(6000) * JUMP_PERIOD
SLIDING = "sliding_friction"
VALVE = Valve(0.04, 40e3, 0.03)
FRICTION, SPRING, PRELOAD = 80.0, 1e5, 400.0


def jumping(jumps=8, rest=2.0, uneven=0.0, noise=(0.0, 0.0), seed=0):
    """Jump to and fro within a sample; before each jump the force is what the stem breaks away at.

    While it jumps, the force hardly changes: the mean over the way is spring and friction.
    """
    random = np.random.default_rng(seed)
    sizes = 0.3e-3 * (1.0 + uneven * random.uniform(-1.0, 1.0, jumps))
    places = np.concatenate([[0.01], 0.01 + np.cumsum(sizes * np.resize([1.0, -1.0], jumps))])
    at = np.clip((JUMP_TIME / rest).astype(int), 0, jumps)
    stem = places[at]
    middles, sides = 0.5 * (places[1:] + places[:-1]), np.resize([1.0, -1.0], jumps)
    pushed = PRELOAD + SPRING * middles + FRICTION * sides
    force = np.interp(JUMP_TIME, rest * np.arange(1, jumps + 1), pushed)
    white = random.standard_normal((2, JUMP_TIME.size))
    return force + noise[0] * white[0], stem + noise[1] * white[1]


def forces(force, stem, lag=NO_LAG, noise=(0.0, 0.0)):
    """Regress both."""
    return _by_strokes(
        MeasuredSignal(JUMP_TIME, force, noise[0], JUMP_PERIOD),
        MeasuredSignal(JUMP_TIME, stem, noise[1], JUMP_PERIOD),
        VALVE,
        lag,
    )


def test_what_each_jump_takes():
    found = forces(*jumping(12, uneven=0.4))
    assert found.numbers[SLIDING].value == pytest.approx(FRICTION, rel=0.02)
    assert np.all(np.sign(found.friction) == np.sign(found.speed))
    assert found.friction == pytest.approx(FRICTION * np.sign(found.speed), rel=0.1)


@pytest.mark.parametrize("seed", range(8))
def test_the_interval_holds_the_truth(seed):
    noise = (10.0, 8e-6)
    one = forces(*jumping(10, uneven=0.3, noise=noise, seed=seed), noise=noise).numbers[SLIDING]
    assert abs(one.value - FRICTION) <= one.half_width < 0.5 * FRICTION


def test_noise_of_a_resting_stem_is_no_part_of_a_stroke():
    """Strokes end at extremes of that noise, when the force is that of the rest."""
    noise = (10.0, 4e-5)
    found = [forces(*jumping(12, rest=4.0, noise=noise, seed=n), noise=noise) for n in range(6)]
    values = [one.numbers[SLIDING].value for one in found]
    assert np.mean(values) == pytest.approx(FRICTION, rel=0.07)


def test_noise_that_averages_remove_widens_nothing():
    """The strokes of a noisy stem are averaged over many samples, and so is the force."""
    quiet, noisy = (
        forces(*jumping(12, noise=noise), noise=noise).numbers[SLIDING]
        for noise in ((0.0, 2e-5), (10.0, 2e-5))
    )
    assert noisy.half_width < quiet.half_width + 0.02 * FRICTION


def test_a_lag_that_nobody_stated_widens_it():
    known = forces(*jumping(12)).numbers[SLIDING]
    open_ = forces(*jumping(12), lag=LagPrior()).numbers[SLIDING]
    assert known.timing == 0.0
    assert open_.half_width > known.half_width
    assert open_.shared == open_.timing > 0.0


def test_a_force_that_jumps_with_the_stem_leaves_open_what_it_was_between():
    """It changes by 160 N between two samples, before the stem moves or after it."""
    force, stem = jumping(12)
    held = np.flatnonzero(np.diff(stem) != 0.0)
    force = np.concatenate([np.repeat(force[held], np.diff(held, prepend=-1)),
                            np.full(JUMP_TIME.size - held[-1] - 1, force[held[-1]])])  # fmt: skip
    assert np.max(np.abs(np.diff(force))) > 1.9 * FRICTION
    found = forces(force, stem).numbers[SLIDING]
    assert found.half_width > 0.5 * FRICTION


def test_a_force_that_knows_nothing_of_the_stem_is_no_friction():
    """In 20 walks the interval is wider than a third of what it holds, or holds no friction."""
    _, stem = jumping(12, uneven=0.3)
    for seed in range(20):
        walk = np.cumsum(np.random.default_rng(seed).standard_normal(JUMP_TIME.size))
        one = forces(1e3 * walk / np.ptp(walk), stem).numbers[SLIDING]
        assert one.value < 3.0 * one.half_width, seed


def test_one_way_has_no_friction():
    assert forces(*jumping(1)) is None
    assert forces(np.ones_like(JUMP_TIME), np.full_like(JUMP_TIME, 0.01)) is None


def test_few_strokes_are_cut_into_pieces():
    """Two slow strokes have eight pieces of equal length, whose scatter is seen."""
    place = 0.01 + 0.002 * np.interp(JUMP_TIME, [10.0, 25.0, 40.0], [0.0, 1.0, 0.0])
    side = np.where(JUMP_TIME < 25.0, 1.0, -1.0)
    found = forces(PRELOAD + SPRING * place + FRICTION * side, place)
    assert found.speed.size == 8
    assert found.numbers[SLIDING].value == pytest.approx(FRICTION, rel=0.02)


@given(st.lists(st.floats(0.1, 1.0), min_size=1, max_size=6), st.integers(1, 9))
def test_pieces_are_of_equal_length(ways, pieces):
    turns = np.concatenate([[0.0], np.cumsum(ways * np.resize([1.0, -1.0], len(ways)))])
    ends = 1000 * np.arange(len(turns))
    position = np.interp(np.arange(ends[-1] + 1), ends, turns)
    cuts = _cut(position, ends, pieces)
    assert set(ends) <= set(cuts)
    lengths = np.abs(np.diff(position[cuts])).reshape(len(ways), pieces)
    assert lengths == pytest.approx(np.array(ways)[:, None] / pieces * np.ones(pieces), rel=0.03)


def test_where_no_stem_slides_the_sliding_friction_is_that_of_the_strokes():
    force, stem = jumping(12, uneven=0.3, noise=(1.0, 1e-6))
    pressure = VALVE.pressure_reference + force / VALVE.diaphragm_area
    record = StampedRecord(StampedSignal(JUMP_TIME, pressure), StampedSignal(JUMP_TIME, stem))
    (curve,) = friction_curves(record, VALVE)
    assert curve.numbers.keys() == {SLIDING}
    one = curve_numbers([curve])[SLIDING]
    assert abs(one.value - FRICTION) <= one.half_width <= 0.1 * FRICTION


@pytest.mark.parametrize(("value", "is_kept"), [(FRICTION, True), (0.5 * FRICTION, False)])
def test_whole_strokes_check_what_no_second_averaging_time_confirms(value, is_kept):
    strokes = forces(*jumping(12))
    one = replace(strokes.numbers[SLIDING], value=value, half_width=0.05 * FRICTION)
    curve = replace(strokes, numbers={SLIDING: one})
    (found,) = friction_curve._checked_by_strokes([curve], strokes)
    assert (found is curve) is is_kept
    assert found.numbers[SLIDING] is (one if is_kept else strokes.numbers[SLIDING])
    assert friction_curve._checked_by_strokes([curve], None) == [curve]
