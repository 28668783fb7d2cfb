# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The stem of a Karnopp valve with imperfections, simulated for a fitted record."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.engine.coordinates import (
    IMPERFECTIONS,
    TIMING,
    Coordinates,
    jacobian,
    physical,
    sensor_span,
    straight,
)
from valve_friction_ros.identification.engine.driven_stem import (
    Course,
    Place,
    drive_stem,
    read_slopes,
    read_stem,
)
from valve_friction_ros.identification.engine.fitted_record import FittedRecord, reading_weights

ABSENT = dict.fromkeys(IMPERFECTIONS, 0.0)
"""No imperfections; the mass has to be set."""

_LARGEST_COARSENESS = 10.0
"""Largest coarseness of the imperfections except timing: their steps are wide already."""

_CONSTANT, _FALLING = (1, 30), (4, 360)
"""Cost of a step that takes a short cut and of one with an event, over a short cut under constant
friction; where friction falls with speed, chords follow it."""

SWINGING = 2e-3
_OVER_SWING = 1e-3
"""Delay F_v/k, s, below which a stem may swing, and the step of differentiation there: across the
swings a small step means nothing."""

_STEP = 1e-5
"""Step of differentiation by a main coordinate, over its size.

The main coordinates nearly compensate one another, so their derivatives must be good to four
digits and more; the simulation is exact, so the step may be small."""

_STEEPEST = 1e100
"""Derivative beyond which nothing is left of it but overflow: it grows at each event of a stem that
sticks and slips without end."""


class Simulated(NamedTuple):
    """The stem at each step, position (m) and velocity (m/s), and the number of events."""

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    events: int


@dataclass(frozen=True, eq=False)
class BroadModel:
    """Simulates the stem of a fitted record.

    The slow terms are evaluated along the measured stem, which is known to within its noise. With
    the place ξ and the age τ (both −1 to 1), the force that drives the simulated stem is

        F(t) − c·k·R·(ξ² − 1/3) − c₃·k·R·(ξ³ − 3ξ/5) + d·ΔF·τ ,

    and the friction, sliding or at rest, has in addition

        (a·ξ + b·τ)·F_c + e·F_c·exp(−|ẋ|/3 mm/s) .

    The `usual_spring`, N/m, converts noise of the force to noise of the stem. It is the same
    throughout a fit, so that no fit gains by a spring that lowers the noise. The `coarseness`
    multiplies the steps of differentiation: far from the end of a fit, wide steps bridge the kinks
    at which a stem stops or breaks away; with 1 the derivatives are exact.
    """

    record: FittedRecord
    usual_spring: float
    coarseness: float = 1.0

    @cached_property
    def weights(self) -> NDArray[np.float64]:
        """One over the effective deviation of each reading, 1/m."""
        return reading_weights(self.record, self.usual_spring)

    @cached_property
    def foreseen_difference(self) -> float:
        """Sum of the squares of half the difference of both halves' weighted readings, by noise."""
        shares = self.weights**2 * self.record.force_variance
        return float(np.sum(shares)) / self.usual_spring**2

    def course(self, force: NDArray[np.float64]) -> Course:
        """Return the drive of the stem, and the slow terms along it."""
        record, slow = self.record, self.record.slow
        return Course(
            record.period,
            record.travel,
            slow.range,
            sensor_span(record.force),
            force,
            slow.place,
            slow.age,
            slow.slowness,
            record.anew,
            record.leaving,
        )

    @cached_property
    def halves(self) -> tuple[Course, ...]:
        """Course driven by each half of the samples of the pressure, or by both if they agree."""
        even, odd = self.record.halves
        return tuple(map(self.course, (even,) if np.array_equal(even, odd) else (even, odd)))

    @cached_property
    def _room(self) -> NDArray[np.float64]:
        """Work space for the derivatives of one simulation by all coordinates."""
        return np.empty(2 * self.record.force.size * len(Place._fields))

    def simulate(self, at: Coordinates) -> Simulated:
        """Simulate the stem itself."""
        force = np.empty_like(self.record.force)
        position, velocity = np.empty_like(force), np.empty_like(force)
        course = self.course(self.record.force)
        stepped = drive_stem(course, Place(**at), force, position, velocity)
        return Simulated(position, velocity, stepped)

    def effort(self, at: Coordinates) -> int:
        """Return the work of one simulation, in steps that take a short cut."""
        short_cut, event = _FALLING if at["stribeck_velocity"] else _CONSTANT
        return short_cut * self.record.force.size + event * self.simulate(at).events

    def readings(self, at: Coordinates) -> NDArray[np.float64]:
        """Return the readings of the stem's sensor, m, one per cell, by each half: (2, c)."""
        place = Place(**at)
        readings = np.empty((len(self.halves), self.record.position.size))
        for course, row in zip(self.halves, readings, strict=True):
            read_stem(course, place, self.record.cells, row)
        return np.broadcast_to(readings, (2, readings.shape[1]))

    def sensitivity(
        self, at: Coordinates, names: tuple[str, ...], readings: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Differentiate the `readings` by the straight coordinates `names`, shape (2, p, c).

        One simulation carries the exact derivatives along (`read_slopes`). Differences replace them
        where the coarseness asks for wide steps, and for a slip force or a dead zone that is still
        zero: their effect begins with the square.
        """
        centre, differed = straight(at, names), names
        slopes: NDArray[np.float64] = np.empty((2, len(names), self.record.position.size))
        if self.coarseness == 1.0:
            slopes = self._exact_slopes(at, names)
            differed = tuple(
                name
                for name in ("slip_force", "limit_velocity")
                if name in names and centre[name] < self.step(at, name)
            )
        for name in differed:
            step = self.step(at, name)
            after = self.readings(physical({**centre, name: centre[name] + step}, names))
            slopes[:, names.index(name)] = (after - readings) / step
        if not max(slopes.max(initial=0.0), -slopes.min(initial=0.0)) < _STEEPEST:
            slopes[~(np.abs(slopes) < _STEEPEST)] = 0.0
        return slopes

    def _exact_slopes(self, at: Coordinates, names: tuple[str, ...]) -> NDArray[np.float64]:
        """Differentiate the readings by straight coordinates, all in one simulation."""
        coordinates = np.array([Place._fields.index(name) for name in names])
        turned = jacobian(at, names)
        shape = (2, self.record.force.size, len(names))
        room = self._room[: math.prod(shape)].reshape(shape)
        slopes = np.empty((2, self.record.position.size, len(names)))
        for course, rows in zip(self.halves, slopes, strict=False):
            read_slopes(course, Place(**at), coordinates, turned, self.record.cells, room, rows)
        slopes[len(self.halves) :] = slopes[0]
        return slopes.transpose(0, 2, 1)

    def step(self, at: Coordinates, name: str) -> float:
        """Return the step of differentiation by a straight coordinate."""
        spring = max(at["spring_constant"], 1e-6)
        dry = max(abs(at["coulomb_friction"]), 1e-6) / spring
        if name == "viscous_friction" and at[name] / spring < SWINGING:
            return _OVER_SWING
        if name == "slip_force":
            return IMPERFECTIONS[name].step * dry
        if name in TIMING:
            return IMPERFECTIONS[name].step * self.coarseness
        if name in IMPERFECTIONS:
            return IMPERFECTIONS[name].step * min(self.coarseness, _LARGEST_COARSENESS)
        sizes = {
            "coulomb_friction": dry,
            "spring_preload": dry,
            "viscous_friction": max(at["viscous_friction"] / spring, 10.0 * dry),
            "spring_constant": 1.0 / spring,
            "start_position": dry,
        }
        return _STEP * self.coarseness * sizes[name]
