# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Friction by whole strokes: a stem that jumps between two samples."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.identification.engine import friction_curve
from valve_friction_ros.identification.engine.balance_regression import LagPrior
from valve_friction_ros.identification.engine.friction_curve import (
    _by_strokes,
    _cut,
    curve_numbers,
    friction_curves,
)
from valve_friction_ros.identification.engine.sliding_averages import MeasuredSignal
from valve_friction_ros.model import Valve
from valve_friction_ros.model.recording import StampedRecord, StampedSignal

PERIOD = 0.01
TIME = np.arange(6000) * PERIOD
NO_LAG = LagPrior(0.0)
SLIDING = "sliding_friction"
VALVE = Valve(0.04, 40e3, 0.03)
FRICTION, SPRING, PRELOAD = 80.0, 1e5, 400.0


def jumping(jumps=8, rest=2.0, size=0.3e-3, uneven=0.0, noise=(0.0, 0.0), seed=0):
    """Jump to and fro within a sample; before each jump the force is what the stem breaks away at.

    While it jumps, the force hardly changes: the mean over the way is spring and friction.
    """
    random = np.random.default_rng(seed)
    sizes = size * (1.0 + uneven * random.uniform(-1.0, 1.0, jumps))
    places = np.concatenate([[0.01], 0.01 + np.cumsum(sizes * np.resize([1.0, -1.0], jumps))])
    at = np.clip((TIME / rest).astype(int), 0, jumps)
    stem = places[at]
    middles, sides = 0.5 * (places[1:] + places[:-1]), np.resize([1.0, -1.0], jumps)
    pushed = PRELOAD + SPRING * middles + FRICTION * sides
    force = np.interp(TIME, rest * np.arange(1, jumps + 1), pushed)
    white = random.standard_normal((2, TIME.size))
    return force + noise[0] * white[0], stem + noise[1] * white[1]


def forces(force, stem, lag=NO_LAG, noise=(0.0, 0.0)):
    """Regress both."""
    return _by_strokes(
        MeasuredSignal(TIME, force, noise[0], PERIOD),
        MeasuredSignal(TIME, stem, noise[1], PERIOD),
        VALVE,
        lag,
    )


@pytest.mark.parametrize("uneven", [0.0, 0.4])
def test_what_each_jump_takes(uneven):
    found = forces(*jumping(12, uneven=uneven))
    assert found.numbers[SLIDING].value == pytest.approx(FRICTION, rel=0.02)
    assert np.all(np.sign(found.friction) == np.sign(found.speed))
    assert found.friction == pytest.approx(FRICTION * np.sign(found.speed), rel=0.1)


@pytest.mark.parametrize("seed", range(8))
def test_the_interval_holds_the_truth(seed):
    noise = (10.0, 8e-6)
    one = forces(*jumping(10, uneven=0.3, noise=noise, seed=seed), noise=noise).numbers[SLIDING]
    assert abs(one.value - FRICTION) <= one.half_width < 0.5 * FRICTION


def test_a_lag_that_nobody_stated_widens_it():
    known = forces(*jumping(12)).numbers[SLIDING]
    open_ = forces(*jumping(12), lag=LagPrior()).numbers[SLIDING]
    assert known.budget.timing == 0.0
    assert open_.half_width > known.half_width
    assert open_.budget.shared == open_.budget.timing > 0.0


def test_a_force_that_jumps_with_the_stem_leaves_open_what_it_was_between():
    """It changes by 160 N between two samples, before the stem moves or after it."""
    force, stem = jumping(12)
    held = np.flatnonzero(np.diff(stem) != 0.0)
    force = np.concatenate([np.repeat(force[held], np.diff(held, prepend=-1)),
                            np.full(TIME.size - held[-1] - 1, force[held[-1]])])  # fmt: skip
    assert np.max(np.abs(np.diff(force))) > 1.9 * FRICTION
    found = forces(force, stem).numbers[SLIDING]
    assert found.half_width > 0.5 * FRICTION


def test_a_force_that_knows_nothing_of_the_stem_is_no_friction():
    """In 20 walks the interval is wider than a third of what it holds, or holds no friction."""
    _, stem = jumping(12, uneven=0.3)
    for seed in range(20):
        walk = np.cumsum(np.random.default_rng(seed).standard_normal(TIME.size))
        one = forces(1e3 * walk / np.ptp(walk), stem).numbers[SLIDING]
        assert one.value < 3.0 * one.half_width, seed


def test_one_way_has_no_friction():
    assert forces(*jumping(1)) is None
    assert forces(np.ones_like(TIME), np.full_like(TIME, 0.01)) is None


def test_few_strokes_are_cut_into_pieces():
    """Two slow strokes have eight pieces of equal length, whose scatter is seen."""
    place = 0.01 + 0.002 * np.interp(TIME, [10.0, 25.0, 40.0], [0.0, 1.0, 0.0])
    side = np.where(TIME < 25.0, 1.0, -1.0)
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
    record = StampedRecord(StampedSignal(TIME, pressure), StampedSignal(TIME, stem))
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
