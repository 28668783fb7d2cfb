"""Output error: the simulated minus the measured stem, and its dependence on the model."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.units import CLOCK_OFFSET
from valve_friction_ros.model.karnopp_parameters import KarnoppParameters
from valve_friction_ros.model.simulation import StemState, simulate
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals.conditioned_record import ConditionedRecord

__all__ = ["SLIP", "START", "Coordinates", "OutputError"]

SLIP = "slip_force"
"""F_s − F_c, refined in place of F_s, because it cannot be negative."""

START = "start_position"
"""Position at the first sample, refined beside the parameters."""

Coordinates = Mapping[str, float]
"""Value of every parameter of the model, `SLIP` in place of F_s, `START` and `CLOCK_OFFSET`."""

_STEP = 1e-2
"""Step of the differences, over the natural size (`OutputError.units`).

Chosen: wide enough to average over single stick events, narrow enough for a linear change."""

_SIGNED = frozenset(
    {"spring_preload", "coulomb_asymmetry", "viscous_asymmetry", START, CLOCK_OFFSET}
)
_FORCES = frozenset({"coulomb_friction", "spring_preload", SLIP})
_UNITY = frozenset({"coulomb_asymmetry", "viscous_asymmetry", CLOCK_OFFSET})
_LARGEST_ASYMMETRY = 0.95
"""Largest asymmetry in a simulation. Chosen just below 1, where friction vanishes one way."""

_LEAST_MASS = 1e-3
"""Least mass in a simulation, kg. Chosen: below every real stem, above zero for (1)."""

_UNIT_MASS = 1.0
"""Least natural size of a change of the mass, kg. Chosen: the order of a stem; scales steps
only."""

_UNIT_SPEED = 0.1
"""Speed, m/s, at which F_v·ẋ reaches F_c in the least natural size of F_v.

Chosen: above the top speeds of valves (0.013 m/s on the bench); scales steps only."""


@dataclass(frozen=True, eq=False)
class OutputError:
    """The misfit of simulated positions as a function of a model's coordinates.

    Attributes
    ----------
    record : ConditionedRecord
        The measured stem. Each method takes the pressure, because a record has three forms of it.
    valve : Valve
        Geometry.
    position_bias : float or None
        x̄ of (10), where the preload follows from the spring constant.
    static_friction : float or None
        F_s, N, where it is fixed; it then replaces `SLIP`, and the model takes at least F_c.
    """

    record: ConditionedRecord
    valve: Valve
    position_bias: float | None = None
    static_friction: float | None = None

    def model(self, at: Coordinates) -> KarnoppParameters:
        """Return the model at these coordinates, limited to possible values."""
        coulomb_friction = max(at["coulomb_friction"], 0.0)
        static_friction = (
            coulomb_friction + max(at[SLIP], 0.0)
            if self.static_friction is None
            else max(self.static_friction, coulomb_friction)
        )
        spring_constant = max(at["spring_constant"], 0.0)
        bias = self.position_bias
        limit = _LARGEST_ASYMMETRY
        return KarnoppParameters(
            mass=max(at["mass"], _LEAST_MASS),
            viscous_friction=max(at["viscous_friction"], 0.0),
            coulomb_friction=coulomb_friction,
            static_friction=static_friction,
            spring_constant=spring_constant,
            spring_preload=at["spring_preload"] if bias is None else spring_constant * bias,
            stribeck_velocity=max(at["stribeck_velocity"], 0.0),
            coulomb_asymmetry=float(np.clip(at["coulomb_asymmetry"], -limit, limit)),
            viscous_asymmetry=float(np.clip(at["viscous_asymmetry"], -limit, limit)),
        )

    def simulated(self, at: Coordinates, pressure: NDArray[np.float64]) -> NDArray[np.float64]:
        """Simulate the stem under `pressure`: positions in m, shape (n,)."""
        travel = self.valve.travel
        stops = (0.0, travel) if np.isfinite(travel) else (-np.inf, np.inf)
        start = StemState(float(np.clip(at[START], *stops)))
        period = self.record.sample_period
        if at[CLOCK_OFFSET] != 0:
            place = np.arange(pressure.size, dtype=np.float64)
            pressure = np.interp(place - at[CLOCK_OFFSET] / period, place, pressure)
        return simulate(self.valve, self.model(at), pressure, period, start).position

    def residual(self, at: Coordinates, pressure: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return simulated minus measured positions, m, shape (n,)."""
        return self.simulated(at, pressure) - self.record.position

    def sensitivity(
        self,
        at: Coordinates,
        pressure: NDArray[np.float64],
        units: Mapping[str, float],
    ) -> NDArray[np.float64]:
        """Differentiate the positions with respect to the coordinates in `units`, in those units.

        Returns
        -------
        ndarray of float, shape (n, p)
            In m.
        """
        columns = np.empty((self.record.position.size, len(units)))
        for index, (name, unit) in enumerate(units.items()):
            lowest, highest = self._range(name)
            place, step = min(max(at[name], lowest), highest), _STEP * unit
            below, above = max(place - step, lowest), min(place + step, highest)
            after = self.simulated({**at, name: above}, pressure)
            before = self.simulated({**at, name: below}, pressure)
            columns[:, index] = (after - before) * (unit / (above - below))
        return columns

    def _range(self, name: str) -> tuple[float, float]:
        """Range in which a coordinate changes the motion; `model` limits it to this range."""
        if name == START and np.isfinite(self.valve.travel):
            return 0.0, self.valve.travel
        return (-np.inf if name in _SIGNED else 0.0), np.inf

    def units(self, names: tuple[str, ...], at: Coordinates) -> dict[str, float]:
        """Return the natural size of a change of each coordinate."""
        force = max(abs(at["coulomb_friction"]), 1e-6)
        sizes = {
            **dict.fromkeys(_FORCES, force),
            **dict.fromkeys(_UNITY, 1.0),
            "mass": max(at["mass"], _UNIT_MASS),
            "viscous_friction": max(at["viscous_friction"], force / _UNIT_SPEED),
            START: force / max(at["spring_constant"], 1e-6),
        }
        return {name: sizes.get(name, abs(at[name])) or 1.0 for name in names}
