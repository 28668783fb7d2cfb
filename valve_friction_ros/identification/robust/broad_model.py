"""The stem of a Karnopp valve with imperfections, simulated for a fitted record."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from valve_friction_ros.identification.robust.fitted_record import FittedRecord
from valve_friction_ros.identification.robust.imperfections import BOUNDS, IMPERFECTIONS
from valve_friction_ros.model.stem_motion import Dynamics
from valve_friction_ros.model.stem_run import run_stem

__all__ = ["ABSENT", "MAIN", "BroadModel", "Coordinates", "Simulated"]

Coordinates = Mapping[str, float]
"""Value of each coordinate of the model."""

MAIN = (
    "coulomb_friction",
    "viscous_friction",
    "spring_constant",
    "spring_preload",
    "start_position",
)
"""Coordinates of the Karnopp model without its imperfections."""

ABSENT = dict.fromkeys(IMPERFECTIONS, 0.0)
"""Nothing imperfect; the mass has to be set."""

_STEP = 1e-2
_LOW_SPEED = 3e-3
"""Speed, m/s, below which packings are known to hold faster: the v_s published for graphite."""

_LEAST_LAG = 1e-9
_LARGEST_ASYMMETRY = 0.9
_LINEAR = frozenset(
    {
        "spring_preload",
        "spring_constant",
        "start_position",
        "along_travel",
        "in_record",
        "at_low_speed",
        "curvature",
        "cubic",
        "drift",
        "presliding",
        "viscous_asymmetry",
        "mass",
        "delay",
        "stem_lag",
    }
)
"""Coordinates on which the motion depends smoothly: one simulation differentiates them."""


class Simulated(NamedTuple):
    """The stem at each step: position (m) and velocity (m/s)."""

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]


def _lagged(signal: NDArray[np.float64], lag: float, period: float) -> NDArray[np.float64]:
    """Pass a signal, linear between its samples, through a first-order lag.

    Before its first sample the signal is taken to have gone on as it begins: a record may begin in
    the midst of a move.
    """
    decay = math.exp(-period / lag)
    newest = 1.0 - lag * (1.0 - decay) / period
    first = signal[0] - lag * (signal[1] - signal[0]) / period
    held: NDArray[np.float64] = scipy.signal.lfilter(
        [newest, 1.0 - decay - newest], [1.0, -decay], signal, zi=[first - newest * signal[0]]
    )[0]
    return held


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
    """

    record: FittedRecord

    def driving_force(self, at: Coordinates) -> NDArray[np.float64]:
        """Return the force on the stem less the preload, N."""
        record, slow = self.record, self.record.slow
        force = record.force
        lag = at["force_lag"]
        if lag > _LEAST_LAG:
            force = _lagged(force, lag, record.period)
        elif lag < 0:
            force = force - lag * record.rate
        stiff = at["spring_constant"] * slow.range
        if at["curvature"]:
            force = force - (at["curvature"] * stiff) * (slow.place * slow.place - 1 / 3)
        if at["cubic"]:
            cube = slow.place * slow.place * slow.place
            force = force - (at["cubic"] * stiff) * (cube - 0.6 * slow.place)
        if at["drift"]:
            force = force + (at["drift"] * float(np.ptp(record.force))) * slow.age
        return force - at["spring_preload"]

    def grip(self, at: Coordinates) -> NDArray[np.float64]:
        """Return the friction beyond that of the Karnopp model, N."""
        slow, dry = self.record.slow, at["coulomb_friction"]
        grip = np.zeros_like(slow.place)
        if at["along_travel"] or at["in_record"]:
            trend = at["along_travel"] * slow.place + at["in_record"] * slow.age
            grip += trend * (dry + at["viscous_friction"] * slow.speed)
        if at["at_low_speed"]:
            grip += (at["at_low_speed"] * dry) * np.exp(slow.speed / -_LOW_SPEED)
        return grip

    def simulate(self, at: Coordinates) -> Simulated:
        """Simulate the stem itself."""
        return self._run(at, self.driving_force(at))

    def _run(self, at: Coordinates, force: NDArray[np.float64]) -> Simulated:
        record = self.record
        slip = at["slip_force"]
        side = min(max(at["viscous_asymmetry"], -_LARGEST_ASYMMETRY), _LARGEST_ASYMMETRY)
        upward = Dynamics(
            at["mass"],
            at["viscous_friction"] * (1 + side),
            at["coulomb_friction"],
            at["coulomb_friction"] + slip,
            at["spring_constant"],
            at["limit_velocity"],
            record.travel,
            at["stribeck_velocity"] if slip > 0 else 0.0,
        )
        downward = upward._replace(viscous_friction=at["viscous_friction"] * (1 - side))
        position, velocity = np.empty_like(force), np.empty_like(force)
        start = at["start_position"]
        position[0] = min(max(start, 0.0), record.travel) if math.isfinite(record.travel) else start
        velocity[0] = record.leaving[0]
        run_stem(
            force,
            record.period,
            upward,
            downward,
            position,
            velocity,
            self.grip(at),
            record.anew,
            record.leaving,
        )
        return Simulated(position, velocity)

    def readings(self, at: Coordinates) -> NDArray[np.float64]:
        """Return what the stem's sensor would read, m, a value a cell.

        A bristle that is bent by δ at full friction adds δ·F/F_s while the stem rests, ±δ while it
        slides. A slow sensor is a first-order lag, a late clock a shift.
        """
        record = self.record
        force = self.driving_force(at)
        seen, velocity = self._run(at, force)
        if at["presliding"]:
            full = at["coulomb_friction"] + at["slip_force"] + 1e-9
            held = np.clip((force - at["spring_constant"] * seen) / full, -1.0, 1.0)
            seen = seen + at["presliding"] * np.where(velocity == 0.0, held, np.sign(velocity))
        if at["stem_lag"] > _LEAST_LAG:
            seen = _lagged(seen, at["stem_lag"], record.period)
        if at["delay"]:
            steps = np.arange(seen.size, dtype=np.float64)
            shift = at["delay"] / record.period
            before = np.minimum(steps - shift, 0.0) * (seen[1] - seen[0])
            seen = np.interp(steps - shift, steps, seen) + before
        read: NDArray[np.float64] = record.reading @ seen
        return read

    def sensitivity(
        self, at: Coordinates, names: tuple[str, ...], base: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Differentiate the readings by the coordinates `names`, shape (c, p); `base` are those."""
        slopes = np.empty((base.size, len(names)))
        for column, name in enumerate(names):
            step = self.step(at, name)
            low, high = at[name] - step, at[name] + step
            after = self.readings({**at, name: high})
            if name in _LINEAR:
                slopes[:, column] = (after - base) / step
                continue
            low = max(low, BOUNDS.get(name, low))
            before = self.readings({**at, name: low})
            slopes[:, column] = (after - before) / (high - low)
        return slopes

    def step(self, at: Coordinates, name: str) -> float:
        """Return the change of a coordinate by which to differentiate."""
        dry = max(abs(at["coulomb_friction"]), 1e-6)
        if name == "slip_force":
            return IMPERFECTIONS[name].step * dry
        if name in IMPERFECTIONS:
            return IMPERFECTIONS[name].step
        sizes = {
            "coulomb_friction": dry,
            "spring_preload": dry,
            "viscous_friction": max(at["viscous_friction"], 10.0 * dry),
            "spring_constant": at["spring_constant"],
            "start_position": dry / max(at["spring_constant"], 1e-6),
        }
        return _STEP * sizes[name]
