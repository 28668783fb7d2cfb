# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""False alarms of an unchanged valve, and alarms of one whose friction has grown."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from benchmark.cases import EXCITATIONS, NOISES, PERIOD
from benchmark.runs import SETTINGS
from valve_friction_ros.health import Baseline, FrictionLimits, diagnose
from valve_friction_ros.identification import RefusalError, Result, identify_bench
from valve_friction_ros.model import (
    BENCH_VALVE,
    LOW_FRICTION,
    Recording,
    SensorNoise,
    converter_response,
    simulate,
)

GROWTH = 1.5
"""Friction of the valve whose packing was tightened, over that of the unchanged one."""

_BASELINE_SEED = 1_000_000


@dataclass(frozen=True)
class Diagnosed:
    """The diagnosis of one identification.

    Attributes
    ----------
    side : str
        "high" or "low" for an alarm, else empty.
    ratio : float
        Friction over the baseline; nan where none was identified.
    """

    side: str
    ratio: float


@dataclass(frozen=True)
class AlarmCounts:
    """All identifications of the two valves.

    Attributes
    ----------
    unchanged : list of str
        Alarm of each identification of the unchanged valve.
    declared : list of bool
        Whether growth was declared, for each pair of identifications.
    ratios : tuple of list of float
        Friction over the baseline, of either valve.
    """

    unchanged: list[str]
    declared: list[bool]
    ratios: tuple[list[float], list[float]]


@cache
def _clean(growth: float) -> Recording:
    command, duration = EXCITATIONS["square"]
    pressure = converter_response(command(np.arange(round(duration / PERIOD)) * PERIOD), PERIOD)
    friction = growth * LOW_FRICTION.coulomb_friction
    valve = replace(LOW_FRICTION, coulomb_friction=friction, static_friction=friction)
    return Recording(PERIOD, pressure, simulate(BENCH_VALVE, valve, pressure, PERIOD).position)


def _identified(growth: float, seed: int) -> Result:
    noise = NOISES["28.6 µm"]
    recording = SensorNoise(noise.position, noise.pressure, seed).applied_to(_clean(growth))
    return identify_bench(recording, BENCH_VALVE, SETTINGS)


@cache
def _baseline() -> Baseline:
    return Baseline.of(_identified(1.0, _BASELINE_SEED))


def diagnosed(growth: float, seed: int) -> Diagnosed:
    """Identify a valve with its friction grown, and diagnose it by the unchanged one."""
    try:
        result = _identified(growth, seed)
    except RefusalError:
        return Diagnosed("", float("nan"))
    limits = FrictionLimits()
    ratio = diagnose(result, BENCH_VALVE, _baseline(), limits).ratio
    if ratio is None:
        return Diagnosed("", float("nan"))
    if ratio.low >= limits.warn_ratio:
        return Diagnosed("high", ratio.value)
    return Diagnosed("low" if ratio.high <= limits.low_ratio else "", ratio.value)
