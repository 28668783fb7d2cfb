# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One identification of a benchmark record, and its distance from the truth."""

import math
import time
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from benchmark.cases import NOISES, PERIOD, PLANTS, Case, Plant, clean_record
from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    Result,
    Verdict,
    identify,
)
from valve_friction_ros.model import StemState, simulate

_FREE = ("coulomb_friction", "viscous_friction", "spring_constant", "spring_preload")
_SLIP, _START = "static_friction", "start"
_STEP = 1e-4
"""Step of the numerical derivatives: relative for a parameter, over the travel for the start."""

_SLOWEST = 1e-5
"""Speed, m/s, below which the stem is at rest, so that noise of the pressure does not matter."""


@dataclass(frozen=True)
class Information:
    """Smallest standard errors of a Karnopp valve on the square wave (Cramér and Rao).

    Attributes
    ----------
    plant_name, noise : str
        Valve and sensor noise.
    pressure_known : dict of str to float
        Relative standard errors if the pressure is known exactly.
    pressure_measured : dict of str to float
        Relative standard errors if the pressure is known only from its noisy samples.
    """

    plant_name: str
    noise: str
    pressure_known: dict[str, float]
    pressure_measured: dict[str, float]


def _stem(
    plant: Plant, pressure: NDArray[np.float64], start: float, name: str, step: float
) -> NDArray[np.float64]:
    """Simulate with one parameter changed by a relative step; F_s − F_c stays constant."""
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

    The Fisher information is SᵀW⁻¹S with the sensitivities S of the true model's stem. White noise
    of the stem sensor alone gives W = σ_x². Noise of the pressure sensor moves the predicted stem
    of a sliding valve by the factor S_a/k (the valve's own lag is negligible at the slow rates of
    the sensitivities). This adds (σ_P·S_a/k)² wherever the stem slides. A method that knows the
    pressure to be smooth, for example behind a lag, may lie between the two.
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


SETTINGS = IdentificationSettings(assumed_mass=1.6)
"""Settings from the configuration of the bench valves."""

TRUE_NAMES = (
    "coulomb_friction",
    "viscous_friction",
    "static_friction",
    "spring_constant",
    "spring_preload",
    "stribeck_velocity",
)
"""Parameters to compare with the truth."""

_MOVING = 0.01
_LARGEST_CLAIM = 0.05
_LARGEST_INTERVALS = 3.0


@dataclass(frozen=True)
class Outcome:
    """The outcome of one record.

    Attributes
    ----------
    case : Case
        The combination that was run.
    seed : int
        Seed of the noise.
    seconds : float
        Time of the identification, s.
    refusal : str
        Reason of a refusal; else empty.
    errors, half_widths : dict of str to float
        Errors and half widths relative to the true value, by parameter; nan without a value.
    verdicts : dict of str to str
        Verdicts by parameter.
    force_error : float
        Worst relative error of the friction force over the speeds of the record.
    misfit, tolerated : float
        Systematic misfit and its tolerated size, m.
    """

    case: Case
    seed: int
    seconds: float
    refusal: str = ""
    errors: dict[str, float] = field(default_factory=dict)
    half_widths: dict[str, float] = field(default_factory=dict)
    verdicts: dict[str, str] = field(default_factory=dict)
    force_error: float = math.nan
    misfit: float = math.nan
    tolerated: float = math.nan


@cache
def run_speeds(plant_name: str, excitation: str) -> NDArray[np.float64]:
    """Return speeds, m/s, from the 5th to the 95th percentile of the speeds of the moving stem."""
    position = clean_record(plant_name, excitation).position
    speed = np.abs(np.diff(position)) / PERIOD
    lowest, highest = np.quantile(speed[speed > _MOVING * speed.max()], (0.05, 0.95))
    return np.linspace(lowest, highest, 50)


def force_error(case: Case, result: Result) -> float:
    """Return the worst relative error of the friction force in both directions."""
    speeds = run_speeds(case.plant_name, case.excitation)
    velocities = np.concatenate([-speeds, speeds])
    truth = case.plant.parameters.sliding_friction(velocities)
    found = result.model.sliding_friction(velocities)
    return float(np.max(np.abs(found / truth - 1)))


def run(case: Case, seed: int, method: str = "bench") -> Outcome:
    """Identify one record, and compare the result with the truth."""
    recording = case.record(seed)
    begin = time.perf_counter()
    try:
        result = identify(recording, case.plant.valve, SETTINGS, method)
    except RefusalError as refusal:
        return Outcome(case, seed, time.perf_counter() - begin, str(refusal))
    seconds = time.perf_counter() - begin
    truth = vars(PLANTS[case.plant_name].parameters)
    known = [name for name in TRUE_NAMES if name in result.parameters and truth[name]]
    parameters = result.parameters
    misfit = result.misfit
    return Outcome(
        case,
        seed,
        seconds,
        "",
        {name: parameters[name].value / truth[name] - 1 for name in known},
        {name: parameters[name].half_width / abs(truth[name]) for name in known},
        {name: one.verdict.value for name, one in parameters.items()},
        force_error(case, result),
        math.nan if misfit is None else misfit.systematic,
        math.nan if misfit is None else misfit.tolerated,
    )


def wrong_claims(outcome: Outcome) -> list[str]:
    """Return identified parameters with errors above 5 % or three half widths."""
    wrong = []
    for name, error in outcome.errors.items():
        allowed = min(_LARGEST_CLAIM, _LARGEST_INTERVALS * outcome.half_widths[name])
        if outcome.verdicts[name] == Verdict.IDENTIFIED.value and not abs(error) <= allowed:
            wrong.append(name)
    return wrong
