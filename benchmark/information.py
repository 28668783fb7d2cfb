# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""How exactly any method could tell the friction: the information that a record holds."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmark.cases import NOISES, PERIOD, clean_record
from benchmark.plants import PLANTS, Plant
from valve_friction_ros.model import StemState, simulate

_FREE = ("coulomb_friction", "viscous_friction", "spring_constant", "spring_preload")
_SLIP, _START = "static_friction", "start"
_STEP = 1e-4
"""Change of a parameter, and of the start over the travel, by which the stem is differentiated."""

_SLOWEST = 1e-5
"""Speed below which the stem holds its place whatever the pressure sensor says, m/s."""


@dataclass(frozen=True)
class Information:
    """Smallest standard errors of a Karnopp valve on the square wave (Cramér and Rao).

    Attributes
    ----------
    plant_name, noise : str
        Valve and sensor noise.
    pressure_known : dict of str to float
        Relative standard errors where the pressure is known exactly.
    pressure_measured : dict of str to float
        The same where it is known by its noisy samples alone.
    """

    plant_name: str
    noise: str
    pressure_known: dict[str, float]
    pressure_measured: dict[str, float]


def _stem(
    plant: Plant, pressure: NDArray[np.float64], start: float, name: str, step: float
) -> NDArray[np.float64]:
    """Simulate with one parameter changed by a share of itself; F_s follows F_c without a slip."""
    parameters = plant.parameters
    if name == _START:
        start += step * plant.valve.travel
    else:
        changes = {name: (1 + step) * getattr(parameters, name)}
        if name == "coulomb_friction":
            slip = parameters.static_friction - parameters.coulomb_friction
            changes["static_friction"] = changes[name] + slip
        parameters = replace(parameters, **changes)
    return simulate(plant.valve, parameters, pressure, PERIOD, StemState(start, 0.0)).position


def information(plant_name: str, noise: str) -> Information:
    """Compute the Cramér–Rao bound of a Karnopp valve on the square wave at 1 kHz.

    The Fisher information is SᵀW⁻¹S with the sensitivities S of the true model's stem. White
    noise of the stem sensor alone gives W = σ_x². That of the pressure sensor moves the predicted
    stem of a sliding valve by S_a/k of it (the valve's own lag shifts none of it at the slow rates
    of the sensitivities), which adds (σ_P·S_a/k)² wherever the stem slides. A method that knows
    the pressure to be smooth, as behind a lag, may come between the two.
    """
    plant, sensors = PLANTS[plant_name], NOISES[noise]
    recording, parameters = clean_record(plant_name, "square"), plant.parameters
    pressure, start = recording.pressure, float(recording.position[0])
    names = (*_FREE, _START)
    if parameters.static_friction > parameters.coulomb_friction:
        names = (*names, _SLIP)
    higher, lower = (
        np.column_stack([_stem(plant, pressure, start, name, step) for name in names])
        for step in (_STEP, -_STEP)
    )
    sensitivity = (higher - lower) / (2 * _STEP)
    slides = np.abs(np.gradient(recording.position, PERIOD)) > _SLOWEST
    stem = np.full(pressure.size, sensors.position**2)
    lever = plant.valve.diaphragm_area / parameters.spring_constant
    both = stem + np.where(slides, (sensors.pressure * lever) ** 2, 0.0)

    def errors(variance: NDArray[np.float64]) -> dict[str, float]:
        covariance = np.linalg.inv(sensitivity.T @ (sensitivity / variance[:, None]))
        scatter = np.sqrt(np.diag(covariance)).tolist()
        return {name: error for name, error in zip(names, scatter, strict=True) if name in _FREE}

    return Information(plant_name, noise, errors(stem), errors(both))
