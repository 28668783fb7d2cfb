# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sweep of the velocity threshold, 62.4 s at 1 kHz, 330 thresholds."""

from collections.abc import Iterator

import numba
import numpy as np
from numpy.typing import NDArray

from benchmark.speed.plain_sweep import incremental_sweep, plain_sweep
from benchmark.speed.records import VALVES, noisy_record
from benchmark.speed.rows import Row, Settings, medians
from valve_friction_ros.identification import (
    IdentificationSettings,
    sweep_thresholds,
)
from valve_friction_ros.identification.published.regression import (
    ForceBalanceRegression,
    force_balance_regression,
)
from valve_friction_ros.model import BENCH_VALVE, SensorNoise
from valve_friction_ros.signals import differentiate

__all__ = ["measure"]

_ENOUGH = 200
"""Samples above a threshold from which on both sweeps are compared."""

_TIMES_FASTER = 100
_AGREEMENT = 1e-7


@numba.njit
def _read_through(columns: NDArray[np.float64]) -> float:
    """Add up all columns: what merely reading them costs."""
    total = 0.0
    for row in range(columns.shape[0]):
        for column in range(columns.shape[1]):
            total += columns[row, column]
    return total


def _regression(valve_name: str, samples: int) -> ForceBalanceRegression:
    record = noisy_record(VALVES[valve_name], SensorNoise(10e-6, 100.0, 1), samples)
    settings = IdentificationSettings()
    derivatives = differentiate(
        record.position, record.sample_period, settings.published_window, settings.order
    )
    force = BENCH_VALVE.actuator_force(record.pressure)
    return force_balance_regression(force, record.position, derivatives, settings)


def _thresholds(regression: ForceBalanceRegression, steps: int) -> NDArray[np.float64]:
    return float(regression.speed.max()) * 330 / 350 * np.arange(1, steps + 1) / steps


def _largest_difference(regression: ForceBalanceRegression) -> float:
    """Largest relative difference of the estimates from those of the plain sweep."""
    thresholds = _thresholds(regression, 330)
    ours = sweep_thresholds(regression, thresholds)
    plain, *_ = plain_sweep(regression.columns, regression.force, regression.speed, thresholds)
    compared = (ours.samples >= _ENOUGH) & np.isfinite(ours.sigma)
    return max(
        float(np.max(np.abs(ours.estimates[name][compared] / plain[compared, index] - 1)))
        for index, name in enumerate(regression.names)
    )


def measure(settings: Settings) -> Iterator[Row]:
    """Measure the sweep against the plain one, against reading the columns, and as it grows."""
    for name in VALVES:
        regression, double = _regression(name, 62_400), _regression(name, 124_800)
        thresholds, few = _thresholds(regression, 330), _thresholds(regression, 33)
        settings.say(f"sweep, {name} friction")
        seconds = medians(
            {
                "ours": lambda one=regression, at=thresholds: sweep_thresholds(one, at),
                "few": lambda one=regression, at=few: sweep_thresholds(one, at),
                "double": lambda one=double, at=thresholds: sweep_thresholds(one, at),
                "floor": lambda one=regression: _read_through(one.columns),
                "incremental": lambda one=regression, at=thresholds: incremental_sweep(
                    one.columns, one.force, one.speed, at
                ),
            },
            8 * settings.repeats,
        ) | medians(
            {
                "plain": lambda one=regression, at=thresholds: plain_sweep(
                    one.columns, one.force, one.speed, at
                )
            },
            settings.repeats,
        )
        milliseconds = {what: 1e3 * one for what, one in seconds.items()}
        yield Row(
            f"sweep, {name} friction",
            milliseconds["ours"],
            "ms",
            milliseconds["plain"],
            "numpy.linalg.lstsq for each threshold",
            f"{_TIMES_FASTER} times faster",
            milliseconds["plain"] >= _TIMES_FASTER * milliseconds["ours"],
        )
        yield Row(
            f"sweep, {name} friction",
            milliseconds["ours"],
            "ms",
            milliseconds["incremental"],
            "numpy.linalg.qr, each row taken in once",
        )
        difference = _largest_difference(regression)
        yield Row(
            f"largest relative difference from it, {name} friction",
            difference,
            "",
            goal=f"{_AGREEMENT:g} wherever {_ENOUGH} samples are left",
            met=difference <= _AGREEMENT,
        )
        yield Row(
            f"sweep, {name} friction",
            milliseconds["ours"],
            "ms",
            milliseconds["floor"],
            "one compiled pass that reads the columns",
        )
        yield Row(
            f"twice the samples, {name} friction",
            milliseconds["double"],
            "ms",
            milliseconds["ours"],
            "62 400 samples",
            "linear: at most 2.5 times",
            milliseconds["double"] <= 2.5 * milliseconds["ours"],
        )
        yield Row(
            f"33 thresholds, {name} friction",
            milliseconds["few"],
            "ms",
            milliseconds["ours"],
            "330 thresholds",
        )
