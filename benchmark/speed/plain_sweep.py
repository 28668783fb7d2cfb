# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sweep of the threshold in numpy alone, as first written and better, to compare with."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["incremental_sweep", "plain_sweep"]


def plain_sweep(
    columns: NDArray[np.float64],
    force: NDArray[np.float64],
    speed: NDArray[np.float64],
    thresholds: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Solve (7) by `numpy.linalg.lstsq` above each threshold, with (17) and (18).

    Parameters
    ----------
    columns : ndarray of float, shape (n, p)
        Regressors (5).
    force, speed : ndarray of float, shape (n,)
        Actuator force and speed.
    thresholds : ndarray of float, shape (S,)
        δv(s).

    Returns
    -------
    estimates : ndarray of float, shape (S, p)
    sigma, r_squared : ndarray of float, shape (S,)
        All nan where no more samples than regressors are left.
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
    columns: NDArray[np.float64],
    force: NDArray[np.float64],
    speed: NDArray[np.float64],
    thresholds: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Do the same by `numpy.linalg.qr`: from one threshold to the next only new rows are taken in.

    The triangular factor of the rows above a threshold, and the rows between it and the next lower
    one, have the triangular factor of all rows above that. Parameters and result as `plain_sweep`.
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
