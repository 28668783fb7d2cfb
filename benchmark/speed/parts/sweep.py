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
from functools import partial

import numba
import numpy as np
from numpy.typing import NDArray

from benchmark.harness.rows import Row
from benchmark.speed.measuring import VALVES, Settings, medians, noisy_record
from valve_friction_ros.identification import IdentificationSettings, sweep_thresholds
from valve_friction_ros.identification.published.sweep import (
    ForceBalanceRegression,
    force_balance_regression,
)
from valve_friction_ros.model import BENCH_VALVE, SensorNoise
from valve_friction_ros.signals import differentiate

Floats = NDArray[np.float64]

_ENOUGH = 200
"""Minimum number of samples above a threshold for a comparison of both sweeps."""

_TIMES_FASTER = 100
_AGREEMENT = 1e-7


def plain_sweep(
    columns: Floats, force: Floats, speed: Floats, thresholds: Floats
) -> tuple[Floats, Floats, Floats]:
    """Solve (7) with `numpy.linalg.lstsq` above each threshold δv(s), with (17) and (18).

    The regressors (5) have shape (n, p), and the estimates (S, p). All results are nan where too
    few samples remain for the regressors.
    """
    free = columns.shape[1]
    estimates = np.full((thresholds.size, free), np.nan)
    sigma, r_squared = np.full((2, thresholds.size), np.nan)
    for step, threshold in enumerate(thresholds):
        moving = speed > threshold
        count = np.count_nonzero(moving)
        if count <= free + 1:
            continue
        estimates[step] = np.linalg.lstsq(columns[moving], force[moving], rcond=None)[0]
        modelled = columns[moving] @ estimates[step]
        sigma[step] = np.sqrt(np.sum((force[moving] - modelled) ** 2) / (count - free))
        mean = force[moving].mean()
        r_squared[step] = np.sum((modelled - mean) ** 2) / np.sum((force[moving] - mean) ** 2)
    return estimates, sigma, r_squared


def incremental_sweep(
    columns: Floats, force: Floats, speed: Floats, thresholds: Floats
) -> tuple[Floats, Floats, Floats]:
    """Do the same with `numpy.linalg.qr`, adding only the new rows at each threshold.

    The triangular factor of the rows above a threshold, stacked on the rows between it and the next
    lower threshold, gives the triangular factor of all rows above the latter. Parameters and result
    are those of `plain_sweep`.
    """
    free = columns.shape[1]
    estimates = np.full((thresholds.size, free), np.nan)
    sigma, r_squared = np.full((2, thresholds.size), np.nan)
    steps = np.searchsorted(thresholds, speed)
    order = np.argsort(steps, kind="stable")
    ends = np.searchsorted(steps[order], np.arange(1, thresholds.size + 1))
    parts = np.split(np.column_stack((columns, force))[order], ends)
    factor, sums, count = np.empty((0, free + 1)), np.zeros(free + 1), 0
    for step in range(thresholds.size - 1, -1, -1):
        rows = parts[step + 1]
        factor = np.linalg.qr(np.vstack((factor, rows)), mode="r")
        sums, count = sums + rows.sum(axis=0), count + len(rows)
        if count > free + 1:
            estimates[step] = np.linalg.solve(factor[:free, :free], factor[:free, free])
            sigma[step] = abs(factor[free, free]) / np.sqrt(count - free)
            mean = sums[free] / count
            modelled = factor[:free, free] @ factor[:free, free]
            modelled += mean * (count * mean - 2 * sums[:free] @ estimates[step])
            r_squared[step] = modelled / (factor[:, free] @ factor[:, free] - count * mean**2)
    return estimates, sigma, r_squared


@numba.njit
def _read_through(columns: Floats) -> float:
    """Add up all columns, to measure the cost of merely reading them."""
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


def _thresholds(regression: ForceBalanceRegression, steps: int) -> Floats:
    return float(regression.speed.max()) * 330 / 350 * np.arange(1, steps + 1) / steps


def _largest_difference(regression: ForceBalanceRegression) -> float:
    """Return the largest relative difference between the estimates of both sweeps."""
    thresholds = _thresholds(regression, 330)
    ours = sweep_thresholds(regression, thresholds)
    plain, *_ = plain_sweep(regression.columns, regression.force, regression.speed, thresholds)
    compared = (ours.samples >= _ENOUGH) & np.isfinite(ours.sigma)
    return max(
        float(np.max(np.abs(ours.estimates[name][compared] / plain[compared, index] - 1)))
        for index, name in enumerate(regression.names)
    )


def measure(settings: Settings) -> Iterator[Row]:
    """Measure the sweep against its peers, against reading the columns, and with growing size."""
    for name in VALVES:
        regression, double = _regression(name, 62_400), _regression(name, 124_800)
        thresholds, few = _thresholds(regression, 330), _thresholds(regression, 33)
        known = regression.columns, regression.force, regression.speed, thresholds
        settings.say(f"sweep, {name} friction")
        seconds = medians(
            {
                "ours": partial(sweep_thresholds, regression, thresholds),
                "few": partial(sweep_thresholds, regression, few),
                "double": partial(sweep_thresholds, double, thresholds),
                "floor": partial(_read_through, regression.columns),
                "incremental": partial(incremental_sweep, *known),
            },
            8 * settings.repeats,
        ) | medians({"plain": partial(plain_sweep, *known)}, settings.repeats)
        time = {what: 1e3 * one for what, one in seconds.items()}
        item, ours = f"sweep, {name} friction", time["ours"]
        peer, goal = "numpy.linalg.lstsq for each threshold", f"{_TIMES_FASTER} times faster"
        met = time["plain"] >= _TIMES_FASTER * ours
        yield Row(item, ours, "ms", time["plain"], peer, goal, met)
        peer = "numpy.linalg.qr, each row taken in once"
        yield Row(item, ours, "ms", time["incremental"], peer)
        difference = _largest_difference(regression)
        told, met = (
            f"largest relative difference from it, {name} friction",
            difference <= _AGREEMENT,
        )
        goal = f"{_AGREEMENT:g} wherever {_ENOUGH} samples are left"
        yield Row(told, difference, goal=goal, met=met)
        yield Row(item, ours, "ms", time["floor"], "one compiled pass that reads the columns")
        item, twice = f"twice the samples, {name} friction", time["double"]
        told = "62 400 samples", "linear: at most 2.5 times", twice <= 2.5 * ours
        yield Row(item, twice, "ms", ours, *told)
        yield Row(f"33 thresholds, {name} friction", time["few"], "ms", ours, "330 thresholds")
