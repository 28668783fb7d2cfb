# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One identification of a benchmark record, and how far it is from the truth."""

import math
import time
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray

from benchmark.cases import PERIOD, Case, clean_record
from benchmark.plants import PLANTS
from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    Result,
    Verdict,
    identify,
)

SETTINGS = IdentificationSettings(assumed_mass=1.6)
"""Those of the bench valves' configuration."""

TRUE_NAMES = (
    "coulomb_friction",
    "viscous_friction",
    "static_friction",
    "spring_constant",
    "spring_preload",
    "stribeck_velocity",
)
"""Parameters that are compared with the truth."""

_MOVING = 0.01
_LARGEST_CLAIM = 0.05
_LARGEST_INTERVALS = 3.0


@dataclass(frozen=True)
class Outcome:
    """What became of one record.

    Attributes
    ----------
    case : Case
        The combination that was run.
    seed : int
        Seed of its noise.
    seconds : float
        Time it took.
    refusal : str
        Reason of a refusal; else empty.
    errors, half_widths : dict of str to float
        Relative to the true value, by parameter; nan where nothing was answered.
    verdicts : dict of str to str
        By parameter.
    force_error : float
        Worst relative error of the friction force over the speeds of the record.
    misfit, tolerated : float
        Systematic misfit and what of it is tolerated, m.
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
    """Speeds, m/s, from the 5th to the 95th percentile of those of the moving stem."""
    position = clean_record(plant_name, excitation).position
    speed = np.abs(np.diff(position)) / PERIOD
    lowest, highest = np.quantile(speed[speed > _MOVING * speed.max()], (0.05, 0.95))
    return np.linspace(lowest, highest, 50)


def force_error(case: Case, result: Result) -> float:
    """Return the worst relative error of the friction force, both ways."""
    speeds = run_speeds(case.plant_name, case.excitation)
    velocities = np.concatenate([-speeds, speeds])
    truth = case.plant.parameters.sliding_friction(velocities)
    found = result.model.sliding_friction(velocities)
    return float(np.max(np.abs(found / truth - 1)))


def run(case: Case, seed: int, method: str = "bench") -> Outcome:
    """Identify one record and compare with the truth."""
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
    """Parameters called identified that are beyond 5 %, or beyond three times their interval."""
    wrong = []
    for name, error in outcome.errors.items():
        allowed = min(_LARGEST_CLAIM, _LARGEST_INTERVALS * outcome.half_widths[name])
        if outcome.verdicts[name] == Verdict.IDENTIFIED.value and not abs(error) <= allowed:
            wrong.append(name)
    return wrong
