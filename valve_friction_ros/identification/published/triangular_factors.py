# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Triangular factors of the samples above each of many thresholds, in one pass."""

import math

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.compiled import compiled_reductions

_ROWS_AT_ONCE = 256
"""Rows that are reflected in at once; with six columns they take 12 kB of a 32 kB cache."""


@compiled_reductions
def factors_above(
    regressors: NDArray[np.float64],
    force: NDArray[np.float64],
    speed: NDArray[np.float64],
    thresholds: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Factorise ``[Φ_s F_s]``, the samples faster than each threshold.

    From the highest threshold down each step only adds the rows between two thresholds, which
    Householder reflections take into the triangular factor that there is: ``[R; rows] = Q R'``.
    Every row is visited once, and, unlike in sums of products, the condition of the columns is
    not squared. Columns may be of any size, since reflections do not mix them.

    Parameters
    ----------
    regressors : ndarray of float, shape (n, p − 1)
        Regressors Φ.
    force : ndarray of float, shape (n,)
        Force F, the last column.
    speed : ndarray of float, shape (n,)
        Speed that decides.
    thresholds : ndarray of float, shape (S,)
        Thresholds, increasing.

    Returns
    -------
    factors : ndarray of float, shape (S, p, p)
        Upper triangular R with RᵀR = ΦᵀΦ of the selected rows, signs of its rows free.
    sums : ndarray of float, shape (S, p)
        Sums of the selected rows.
    counts : ndarray of int, shape (S,)
        Number of selected rows.
    """
    free, steps = regressors.shape[1], thresholds.size
    columns = free + 1
    bins, ends = _sorted_places(speed, thresholds)
    rows = np.empty((speed.size, columns))
    sums = np.zeros((steps, columns))
    for sample in range(speed.size):
        step = bins[sample]
        if step >= 0:
            place = ends[step]
            ends[step] += 1
            for column in range(free):
                rows[place, column] = regressors[sample, column]
                sums[step, column] += regressors[sample, column]
            rows[place, free] = force[sample]
            sums[step, free] += force[sample]
    factors = np.empty((steps, columns, columns))
    counts = np.empty(steps, dtype=np.int64)
    work = np.zeros((columns, columns + _ROWS_AT_ONCE))
    taken = 0
    for step in range(steps - 1, -1, -1):
        while taken < ends[step]:
            last = min(taken + _ROWS_AT_ONCE, ends[step])
            _take_in(work, rows, taken, last)
            taken = last
        counts[step] = taken
        if step < steps - 1:
            sums[step] += sums[step + 1]
        factors[step] = work[:, :columns].T
    return factors, sums, counts


@compiled_reductions
def _sorted_places(
    speed: NDArray[np.float64], thresholds: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Find the last threshold below each speed, and where the rows of each threshold begin.

    Rows of the highest threshold come first. A threshold is guessed as if all were evenly spaced,
    as those of (8) are, and the guess is moved to where it is true.
    """
    steps = thresholds.size
    spacing = (thresholds[-1] - thresholds[0]) / max(steps - 1, 1)
    bins = np.empty(speed.size, dtype=np.int64)
    sizes = np.zeros(steps, dtype=np.int64)
    for sample in range(speed.size):
        step = 0
        if spacing > 0:
            guess = (speed[sample] - thresholds[0]) / spacing
            step = int(min(max(guess, 0.0), steps - 1.0))
        while step >= 0 and speed[sample] <= thresholds[step]:
            step -= 1
        while step < steps - 1 and speed[sample] > thresholds[step + 1]:
            step += 1
        bins[sample] = step
        if step >= 0:
            sizes[step] += 1
    places = np.empty(steps, dtype=np.int64)
    place = 0
    for step in range(steps - 1, -1, -1):
        places[step] = place
        place += sizes[step]
    return bins, places


@compiled_reductions
def _take_in(work: NDArray[np.float64], rows: NDArray[np.float64], first: int, end: int) -> None:
    """Reflect the rows from `first` to `end` into the triangular factor.

    Column by column: `work` holds in row j the j-th column of the factor, upper triangular, and
    behind it room for the column of the new rows.
    """
    columns = rows.shape[1]
    last = columns + end - first
    for row in range(end - first):
        for column in range(columns):
            work[column, columns + row] = rows[first + row, column]
    for column in range(columns):
        x = work[column]
        squares = 0.0
        for place in range(columns, last):
            squares += x[place] * x[place]
        if squares == 0.0:
            continue
        norm = math.copysign(math.sqrt(x[column] * x[column] + squares), x[column])
        head = x[column] + norm
        for other in range(column + 1, columns):
            y = work[other]
            product = head * y[column]
            for place in range(columns, last):
                product += x[place] * y[place]
            share = product / (norm * head)
            y[column] -= share * head
            for place in range(columns, last):
                y[place] -= share * x[place]
        x[column] = -norm
