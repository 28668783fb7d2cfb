# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Ends of the stem's motion, and the stops among them, on simulated valves."""

import math
from dataclasses import replace

import numpy as np
import pytest

from valve_friction_ros.health.stem_reach import stem_reach
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION, Recording, SineWave, simulate
from valve_friction_ros.model.recording import StampedRecord, StampedSignal

STICKY = replace(HIGH_FRICTION, static_friction=2 * HIGH_FRICTION.coulomb_friction)
SLIP = STICKY.static_friction - STICKY.coulomb_friction
TRAVEL = BENCH_VALVE.travel
TIME = np.arange(3000) / 100


def record(low, high, seat=0.0, noise=0.0):
    """Three slow strokes between two pressures, kPa, on a stop that may have moved."""
    wave = SineWave(period=10.0).sample(TIME)
    share = (wave - wave.min()) / np.ptp(wave)
    pressure = 1e3 * (low + (high - low) * share)
    inner = replace(BENCH_VALVE, travel=TRAVEL - seat)
    moved = replace(STICKY, spring_preload=STICKY.spring_preload + STICKY.spring_constant * seat)
    position = simulate(inner, moved, pressure, 0.01).position + seat
    position = position + noise * np.random.default_rng(5).standard_normal(position.size)
    return Recording(0.01, pressure, position)


@pytest.mark.parametrize("known", [SLIP, math.nan])
@pytest.mark.parametrize("noise", [0.0, 40e-6])
def test_a_stem_that_turns_between_the_stops_meets_none(known, noise):
    found = stem_reach(record(70.0, 160.0, noise=noise), BENCH_VALVE, known)
    assert found.keys() == {"lowest_position", "highest_position"}
    low, high = found["lowest_position"], found["highest_position"]
    assert 0.0 < low.value < high.value < TRAVEL


@pytest.mark.parametrize(
    ("known", "low", "high"), [(SLIP, -45.0, 300.0), (math.nan, -250.0, 500.0)]
)
@pytest.mark.parametrize("noise", [0.0, 40e-6])
@pytest.mark.parametrize("seat", [0.0, 2e-3])
def test_stops_are_found_where_they_are(known, low, high, noise, seat):
    """Without a known slip force, only those against which the stem is pressed by far more."""
    found = stem_reach(record(low, high, seat, noise), BENCH_VALVE, known)
    for name, place in (("lower_stop", seat), ("upper_stop", TRAVEL)):
        assert abs(found[name].value - place) <= found[name].half_width
        assert found[name].half_width < 0.01 * TRAVEL


def test_a_stem_that_waits_at_the_begin_may_have_come_from_either_side():
    """It stands at its upper end while the force grows from −F_s to F_s, and is then let down."""
    force = np.concatenate([np.linspace(-0.9, 0.9, 500), np.linspace(0.9, -4.0, 500)])
    valve = replace(BENCH_VALVE, diaphragm_area=1.0, pressure_reference=0.0)
    place = 0.02 + np.minimum(force + 1.0, 0.0) * (np.arange(1000) >= 500) * 1e-3
    found = stem_reach(Recording(0.01, 1e3 * force, place), valve, 100.0)
    assert "upper_stop" not in found


FORCE = np.interp(TIME, [0, 8, 12, 16, 20, 24, 30], [-600, 400, 400, -300, 300, -400, -600])
PLACE = np.interp(TIME, [0, 4, 8, 24, 30], [0.008, 0.008, 0.014, 0.014, 0.010])
UNIT = replace(BENCH_VALVE, diaphragm_area=1.0, pressure_reference=0.0)


@pytest.mark.parametrize("seed", range(4))
def test_a_force_that_falls_and_grows_while_the_stem_rests_proves_no_stop(seed):
    """Noise takes the stem across the limit of its end; that is no arrival with a small force."""
    noise = 40e-6 * np.random.default_rng(seed).standard_normal(TIME.size)
    found = stem_reach(Recording(0.01, FORCE, PLACE + noise), UNIT, 50.0)
    assert found.keys() == {"lowest_position", "highest_position"}


@pytest.mark.parametrize("seed", range(4))
def test_the_last_bit_of_a_converter_proves_none_either(seed):
    """Stamps that jitter hide it from the samples on the grid: they lie between two codes."""
    random = np.random.default_rng(seed)
    own = TIME + 3e-3 * random.uniform(-1.0, 1.0, TIME.size)
    wander = np.convolve(random.standard_normal(TIME.size), np.full(100, 0.1), "same")
    seen = np.interp(own, TIME, PLACE) + 1e-5 * wander
    seen = 50e-6 * np.round(seen / 50e-6 + 0.5)
    stamped = StampedRecord(StampedSignal(TIME, FORCE), StampedSignal(own, seen))
    record = Recording(0.01, FORCE, np.interp(TIME, own, seen), stamped=stamped)
    found = stem_reach(record, UNIT, 50.0)
    assert found.keys() == {"lowest_position", "highest_position"}
