# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A valve in service, made up: rests and moves whose work balance is exact."""

from itertools import pairwise

import numpy as np

from valve_friction_ros.evidence import Move
from valve_friction_ros.model import Valve
from valve_friction_ros.streams import Arrivals, Kind

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
VALVE = Valve(diaphragm_area=0.0445, pressure_reference=41_740.0, travel=28.575e-3)
SPRING, PRELOAD, MASS = 2.05e5, 231.65, 1.6
STEP = 0.03 * VALVE.travel
REST, MOVING = 4.0, 2.0
"""Seconds of samples at rest before and after each motion, and of the motion."""


def levels(count, seed=0, step=STEP, low=0.3, high=0.7):
    """Positions, m, each a step above or below the one before."""
    random, found = np.random.default_rng(seed), [0.5 * VALVE.travel]
    for _ in range(count):
        way = random.choice([-1.0, 1.0])
        if not low <= (found[-1] + way * step) / VALVE.travel <= high:
            way = -way
        found.append(found[-1] + way * step)
    return np.array(found)


def signals(places, friction=300.0, period=12.0, rate=20.0, moving=MOVING, whole=True, start=0.0):
    """Stamps (ns), pressure (Pa) and position (m) of moves between places, one a `period`.

    The stem moves by a smooth S; friction is constant. At rest the pressure goes over to
    the next breakaway. Not `whole`: samples only near the motions.
    """
    times, pressures, positions = [], [], []
    force_at_rest = SPRING * places[0] + PRELOAD
    for number, (begin, end) in enumerate(pairwise(places)):
        length = period if whole else 2 * REST + moving
        time = np.arange(round(length * rate)) / rate
        rest = REST if not whole else 0.5 * (length - moving)
        share = np.clip((time - rest) / moving, 0.0, 1.0)
        place = begin + (end - begin) * (share - np.sin(2 * np.pi * share) / (2 * np.pi))
        bent = (end - begin) * 2 * np.pi * np.sin(2 * np.pi * share) / moving**2
        way = np.sign(end - begin)
        force = SPRING * place + PRELOAD + way * friction + MASS * bent
        onset = SPRING * begin + PRELOAD + way * friction
        before = share <= 0
        ramp = np.clip((time[before] - rest + 1.0), 0.0, 1.0)
        force[before] = force_at_rest + (onset - force_at_rest) * ramp
        force_at_rest = force[-1]
        times.append(start + number * period + time)
        pressures.append(force / VALVE.diaphragm_area + VALVE.pressure_reference)
        positions.append(place)
    stamps = START + np.round(np.concatenate(times) * 1e9).astype(np.int64)
    return stamps, np.concatenate(pressures), np.concatenate(positions)


def arrivals(stamps, pressure, position):
    """Both signals as they arrive: of each stamp the pressure, then the position."""
    kinds = np.tile(np.array([Kind.PRESSURE, Kind.POSITION], np.uint8), stamps.size)
    return Arrivals(kinds, np.repeat(stamps, 2), np.column_stack((pressure, position)).ravel())


def parts(whole, cuts):
    """Cut arrivals at these places."""
    ends = [0, *cuts, whole.stamps.size]
    return [Arrivals(*(column[begin:end] for column in whole)) for begin, end in pairwise(ends)]


def changing_at(hour, after=450.0):
    """A friction of 300 N that changes at an hour."""
    return lambda now: after if now >= hour else 300.0


def made_moves(hours, friction, seed=0, period=12.0, noise=4.0, offset=None, viscous=0.0, **ranges):
    """Moves without their samples: `friction` and `offset` (N) at an hour; viscous in N·s/m."""
    random = np.random.default_rng(seed)
    places = levels(int(hours * 3600 / period), seed, **ranges)
    found = []
    for number, (start, stop) in enumerate(
        zip(places[:-1].tolist(), places[1:].tolist(), strict=True)
    ):
        hour = number * period / 3600
        way, speed = np.sign(stop - start), float(random.uniform(0.5e-3, 2e-3))
        free = PRELOAD + (0.0 if offset is None else offset(hour))
        size = friction(hour) + viscous * speed
        force = SPRING * 0.5 * (start + stop) + free + way * size + noise * random.standard_normal()
        onset = SPRING * start + free + way * size + noise * random.standard_normal()
        begin = START + round(number * period * SECOND)
        rate = 100.0 * way
        found.append(
            Move(begin, begin + SECOND, start, stop, force, rate, speed, onset, start, rate)
        )
    return found
