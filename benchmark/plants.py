# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Valves to be identified, with their true friction: Karnopp, Stribeck and LuGre."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    KarnoppParameters,
    Valve,
    simulate,
)
from valve_friction_ros.model.compiled import compiled

Motion = Callable[["Plant", NDArray[np.float64], float], NDArray[np.float64]]

BRISTLE_STIFFNESS = 942.4 / 20e-6
"""σ_0 of the LuGre valve, N/m: its stem creeps 20 µm before it breaks away."""

_SUBSTEPS = 100


def _karnopp(plant: "Plant", pressure: NDArray[np.float64], period: float) -> NDArray[np.float64]:
    return simulate(plant.valve, plant.parameters, pressure, period).position


def _lugre(plant: "Plant", pressure: NDArray[np.float64], period: float) -> NDArray[np.float64]:
    p = plant.parameters
    forces = plant.valve.actuator_force(pressure) - p.spring_preload
    bristle_damping = float(np.sqrt(BRISTLE_STIFFNESS * p.mass))
    return _step_lugre(
        forces,
        period / _SUBSTEPS,
        p.mass,
        p.spring_constant,
        p.coulomb_friction,
        p.static_friction,
        p.stribeck_velocity,
        p.viscous_friction,
        BRISTLE_STIFFNESS,
        bristle_damping,
        plant.valve.travel,
    )


@compiled
def _step_lugre(
    forces: NDArray[np.float64],
    step: float,
    mass: float,
    spring: float,
    coulomb: float,
    static: float,
    stribeck: float,
    viscous: float,
    stiffness: float,
    damping: float,
    travel: float,
) -> NDArray[np.float64]:
    """LuGre friction, ż = v − σ_0·|v|/g(v)·z, by linearly implicit steps (Canudas de Wit, 1995).

    The travel stops take the stem's whole speed.
    """
    positions = np.empty_like(forces)
    position, velocity, bristle = min(max(forces[0] / spring, 0.0), travel), 0.0, 0.0
    positions[0] = position
    for sample in range(1, forces.size):
        before, change = forces[sample - 1], forces[sample] - forces[sample - 1]
        for substep in range(1, _SUBSTEPS + 1):
            force = before + change * substep / _SUBSTEPS
            level = coulomb + (static - coulomb) * np.exp(-((velocity / stribeck) ** 2))
            side = 1.0 if velocity >= 0 else -1.0
            grip = 1.0 - side * stiffness * bristle / level
            resisting = viscous + damping * grip + step * (spring + stiffness * grip)
            pull = force - spring * position - stiffness * bristle
            velocity = (mass * velocity + step * pull) / (mass + step * resisting)
            position += step * velocity
            rate = stiffness * abs(velocity) / level
            bristle = (bristle + step * velocity) / (1.0 + step * rate)
            if position < 0.0 or position > travel:
                position, velocity = min(max(position, 0.0), travel), 0.0
        positions[sample] = position
    return positions


@dataclass(frozen=True)
class Plant:
    """A simulated valve and the truth about it.

    Attributes
    ----------
    name : str
        Short name.
    valve : Valve
        Geometry.
    parameters : KarnoppParameters
        Its true friction, spring and mass.
    motion : callable
        Function of the plant, pressure (Pa) and sample period (s): stem position, m.
    is_karnopp : bool
        Whether its friction is the published model's.
    """

    name: str
    valve: Valve
    parameters: KarnoppParameters
    motion: Motion = _karnopp
    is_karnopp: bool = True

    def respond(self, pressure: NDArray[np.float64], period: float) -> NDArray[np.float64]:
        """Stem position in m under `pressure` (Pa) sampled every `period` (s)."""
        return self.motion(self, pressure, period)


_FALLING = replace(GRAPHITE_PACKING, stribeck_velocity=3.26e-3)

PLANTS = {
    plant.name: plant
    for plant in (
        Plant("low", BENCH_VALVE, LOW_FRICTION),
        Plant("high", BENCH_VALVE, HIGH_FRICTION),
        Plant("graphite", GRAPHITE_VALVE, GRAPHITE_PACKING),
        Plant("stribeck", GRAPHITE_VALVE, _FALLING, is_karnopp=False),
        Plant("lugre", GRAPHITE_VALVE, _FALLING, _lugre, is_karnopp=False),
    )
}
"""By name: the paper's valve in two states, graphite with slip jump, and beyond Karnopp."""
