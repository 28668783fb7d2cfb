"""The stem of a Karnopp valve with imperfections, simulated for a fitted record."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.robust.coordinates import (
    MAIN,
    Coordinates,
    physical,
    straight,
)
from valve_friction_ros.identification.robust.driven_stem import (
    LOW_SPEED,
    Course,
    Place,
    read_stem,
    run_stem,
)

from valve_friction_ros.identification.robust.fitted_record import FittedRecord
from valve_friction_ros.identification.robust.imperfections import BOUNDS, IMPERFECTIONS
from valve_friction_ros.identification.robust.weights import reading_weights

__all__ = ["ABSENT", "BroadModel", "Simulated"]

ABSENT = dict.fromkeys(IMPERFECTIONS, 0.0)
"""Nothing imperfect; the mass has to be set."""

_STEP = 1e-4
"""Change of a main coordinate over its size by which to differentiate.

The main coordinates nearly make up for one another, so their derivatives must be good to four
digits; the simulation is exact, so the step may be small."""


class Simulated(NamedTuple):
    """The stem at each step: position (m) and velocity (m/s)."""

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BroadModel:
    """Simulates the stem of a fitted record.

    The slow terms are evaluated along the measured stem, which is known to within its noise. With
    the place ξ and the age τ (both −1 to 1), the force that drives the simulated stem is

        F(t) − c·k·R·(ξ² − 1/3) − c₃·k·R·(ξ³ − 3ξ/5) + d·ΔF·τ ,

    and the friction, sliding or at rest, has in addition

        (a·ξ + b·τ)·(F_c + F_v·|ẋ|) + e·F_c·exp(−|ẋ|/3 mm/s) .

    Attributes
    ----------
    record : FittedRecord
        The record.
    usual_spring : float
        Spring constant, N/m, by which noise of the force counts as noise of the stem. It is the
        same throughout a fit, so that no fit gains by a spring that makes the noise count less.
    """

    record: FittedRecord
    usual_spring: float

    @cached_property
    def weights(self) -> NDArray[np.float64]:
        """One over the effective deviation of each reading, 1/m."""
        return reading_weights(self.record, self.usual_spring)

    @cached_property
    def course(self) -> Course:
        """What drives the stem, and the slow terms along it."""
        record, slow = self.record, self.record.slow
        return Course(
            record.period,
            record.travel,
            slow.range,
            float(np.ptp(record.force)),
            record.force,
            record.rate,
            slow.place,
            slow.age,
            slow.speed,
            np.exp(slow.speed / -LOW_SPEED),
            record.anew,
            record.leaving,
        )

    def simulate(self, at: Coordinates) -> Simulated:
        """Simulate the stem itself."""
        force = np.empty_like(self.record.force)
        position, velocity = np.empty_like(force), np.empty_like(force)
        run_stem(self.course, Place(**at), force, position, velocity)
        return Simulated(position, velocity)

    def readings(self, at: Coordinates) -> NDArray[np.float64]:
        """Return what the stem's sensor would read, m, a value a cell."""
        readings = np.empty_like(self.record.position)
        read_stem(self.course, Place(**at), self.record.cells, readings)
        return readings

    def sensitivity(self, at: Coordinates, names: tuple[str, ...]) -> NDArray[np.float64]:
        """Differentiate the readings by the straight coordinates `names`, shape (c, p)."""
        slopes = np.empty((self.record.position.size, len(names)), order="F")
        centre = straight(at, names)
        for column, name in enumerate(names):
            step = self.step(at, name)
            low, high = centre[name] - step, centre[name] + step
            low = max(low, BOUNDS.get(name, low))
            after = self.readings(physical({**centre, name: high}, names))
            before = self.readings(physical({**centre, name: low}, names))
            slopes[:, column] = (after - before) / (high - low)
        return slopes

    def step(self, at: Coordinates, name: str) -> float:
        """Return the change of a straight coordinate by which to differentiate."""
        spring = max(at["spring_constant"], 1e-6)
        dry = max(abs(at["coulomb_friction"]), 1e-6) / spring
        if name == "slip_force":
            return IMPERFECTIONS[name].step * dry
        if name in IMPERFECTIONS:
            return IMPERFECTIONS[name].step
        sizes = {
            "coulomb_friction": dry,
            "spring_preload": dry,
            "viscous_friction": max(at["viscous_friction"] / spring, 10.0 * dry),
            "spring_constant": 1.0 / spring,
            "start_position": dry,
        }
        return _STEP * sizes[name]
