# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The simulated valves obey physics, and each other where they must agree."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from benchmark.reality.motions import Kind, drawn_drive
from benchmark.reality.plants import Body, Friction, Law, Plant, Trend, move
from benchmark.reality.plants.kernel import GRID, Loop
from benchmark.reality.valves import drawn_valve

LOOP = Loop(
    closed=False,
    flow=False,
    gain=0.0,
    integral_time=1.0,
    every=1000,
    process_lag=1.0,
    bottom=0.0,
    span=1e5,
    converter_lag=1e-3,
)
BODY = Body(1.6, 2e5, 500.0, pressure_reference=0.0)
FRICTION = Friction(400.0, 600.0, 2e4, stribeck_velocity=1e-3)


def ramps(*levels, seconds=2.0):
    """Commands that run from level to level."""
    points = round(seconds / GRID)
    return np.concatenate([np.linspace(a, b, points) for a, b in pairwise(levels)])


def moved(friction, signal, body=BODY, **options):
    return move(Plant(body, friction), LOOP, signal, np.zeros(signal.size), 0.0, **options)


@pytest.mark.parametrize("law", list(Law))
def test_work_is_not_lost(law):
    friction = replace(FRICTION, law=law, presliding=20e-6, limit_velocity=2e-4)
    motion = moved(friction, ramps(0.3, 0.8, 0.8, 0.3, 0.6))
    steps = np.diff(motion.position)

    def integral(force):
        return float(np.sum(0.5 * (force[1:] + force[:-1]) * steps))

    actuator = integral(BODY.area * motion.pressure)
    friction_work = integral(motion.friction)
    ends = motion.position[[0, -1]]
    stored = np.diff(0.5 * BODY.spring * ends**2 + BODY.preload * ends)[0]
    assert actuator == pytest.approx(stored + friction_work, rel=5e-3)
    assert friction_work > 0


@pytest.mark.parametrize("law", [Law.LUGRE, Law.MAXWELL])
def test_stiff_bristles_are_the_set_valued_law(law):
    signal = ramps(0.3, 0.8, 0.8, 0.3, 0.6)
    friction = replace(FRICTION, static=FRICTION.coulomb)
    rigid = moved(friction, signal)
    stiff = moved(replace(friction, law=law, presliding=1e-6), signal, step=1e-6)
    assert np.abs(rigid.position - stiff.position).max() < 8e-6
    assert stiff.work == pytest.approx(rigid.work, rel=1e-3)


@pytest.mark.parametrize("law", [Law.KARNOPP, Law.LATCHED])
def test_karnopp_without_a_dead_zone_is_the_set_valued_law(law):
    friction = replace(FRICTION, stribeck_velocity=0.0)
    signal = ramps(0.3, 0.8, 0.8, 0.3, 0.6)
    difference = (
        moved(friction, signal).position - moved(replace(friction, law=law), signal).position
    )
    assert np.abs(difference).max() < 1e-6


@pytest.mark.parametrize("law", list(Law))
def test_halving_the_step_changes_nothing(law):
    friction = replace(FRICTION, law=law, presliding=20e-6, limit_velocity=2e-4)
    signal = ramps(0.3, 0.8, 0.8, 0.3)
    coarse, fine = moved(friction, signal, step=4e-6), moved(friction, signal, step=2e-6)
    assert np.abs(coarse.position - fine.position).max() < 20e-6
    assert coarse.work == pytest.approx(fine.work, rel=2e-3)


@pytest.mark.parametrize("law", [Law.MOREAU, Law.KARNOPP, Law.LATCHED])
def test_sticks_below_static_friction(law):
    friction = replace(FRICTION, law=law)
    below = 0.5 + 0.95 * friction.static / (BODY.area * LOOP.span)
    above = 0.5 + 1.05 * friction.static / (BODY.area * LOOP.span)
    held, loose = moved(friction, ramps(0.5, below)), moved(friction, ramps(0.5, above))
    assert np.ptp(held.position) == 0
    assert held.distance == 0
    assert np.ptp(loose.position) > 1e-4


@pytest.mark.parametrize("law", [Law.LUGRE, Law.MAXWELL])
def test_bends_before_it_slides(law):
    friction = replace(FRICTION, law=law, presliding=20e-6)
    below = 0.5 + 0.8 * friction.static / (BODY.area * LOOP.span)
    there_and_back = moved(friction, ramps(0.5, below, 0.5))
    assert 2e-6 < np.ptp(there_and_back.position) < 40e-6


@pytest.mark.parametrize("law", list(Law))
def test_friction_at_constant_speed(law):
    friction = replace(FRICTION, law=law, presliding=10e-6, static=FRICTION.coulomb)
    motion = moved(friction, ramps(0.2, 1.2))
    later = motion.time > 1.0
    speed = np.polyfit(motion.time[later], motion.position[later], 1)[0]
    expected = friction.coulomb + friction.viscous * speed
    assert np.median(motion.friction[later]) == pytest.approx(expected, rel=2e-3)
    assert motion.work / motion.distance == pytest.approx(expected, rel=2e-2)


def test_slips_by_what_the_spring_holds():
    friction = Friction(400.0, 800.0, 4e3, stribeck_velocity=0.3e-3)
    motion = moved(friction, ramps(0.5, 0.75, seconds=20.0))
    jump = np.abs(motion.position[500:] - motion.position[:-500]).max()
    assert jump == pytest.approx(400.0 / BODY.spring, rel=0.2)


def test_friction_follows_travel_time_and_direction():
    there, back = slice(0, 20000), slice(40000, 60000)
    signal = ramps(0.2, 1.0, 1.0, 0.2)
    coulomb = replace(FRICTION, static=FRICTION.coulomb, viscous=0.0)

    def levels(friction, part):
        motion = moved(friction, signal)
        sliding = np.abs(np.gradient(motion.position, GRID)[part]) > 1e-3
        place = motion.position[part][sliding] / BODY.travel
        return place, np.abs(motion.friction[part][sliding])

    place, force = levels(replace(coulomb, along_travel=Trend(0.2)), there)
    assert force == pytest.approx(400.0 * (1 + 0.2 * (place - 0.5)), rel=1e-2)
    up, down = (levels(replace(coulomb, asymmetry=0.1), part)[1] for part in (there, back))
    assert np.median(up) == pytest.approx(440.0, rel=1e-2)
    assert np.median(down) == pytest.approx(360.0, rel=1e-2)
    first, last = (
        levels(replace(coulomb, in_record=Trend(0.2)), part)[1].mean() for part in (there, back)
    )
    assert first == pytest.approx(400.0 * (1 + 0.2 * (1 / 6 - 0.5)), rel=2e-2)
    assert last == pytest.approx(400.0 * (1 + 0.2 * (5 / 6 - 0.5)), rel=2e-2)


def test_stays_between_the_stops():
    body = replace(BODY, seat=0.3e-3, top=0.5e-3)
    motion = moved(FRICTION, ramps(0.5, -0.2, 2.0), body)
    assert motion.position.min() == pytest.approx(0.3e-3, abs=1e-9)
    assert motion.position.max() == pytest.approx(body.travel - 0.5e-3, abs=1e-9)


def test_volume_delays_the_stem():
    signal = ramps(0.3, 0.8)
    friction = replace(FRICTION, static=FRICTION.coulomb)
    prompt = moved(friction, signal)
    late = moved(friction, signal, replace(BODY, volume_lag=0.05))
    shift = round(0.05 / GRID)
    assert late.position[-1] == pytest.approx(prompt.position[-1 - shift], abs=5e-6)


@pytest.mark.parametrize("kind", [Kind.LOOP, Kind.STEPS])
def test_closed_loop_keeps_its_set_point(kind):
    valve = drawn_valve(np.random.default_rng(2), slips=False)
    drive = drawn_drive(kind, valve, np.random.default_rng(3))
    motion = move(valve.plant, drive.loop, drive.signal, drive.disturbance, drive.before)
    opening = motion.position / valve.plant.body.travel
    assert np.abs(opening - drive.signal)[opening.size // 2 :].mean() < 0.03
    assert np.ptp(opening) > 0.05
