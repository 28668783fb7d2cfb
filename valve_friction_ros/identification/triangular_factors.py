"""Triangular factors of the samples above each of many thresholds, in one pass."""

import math

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.compiled import compiled_reductions

__all__ = ["factors_above"]

_ROWS_AT_ONCE = 256
"""Rows that are rotated in at once; with six columns they stay in the nearest cache."""


@compiled_reductions
def factors_above(
    table: NDArray[np.float64], speed: NDArray[np.float64], thresholds: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Factorise the rows of `table` whose speed exceeds each threshold.

    From the highest threshold down each step only adds the rows between two thresholds, which
    Householder reflections take into the triangular factor that there is: ``[R; rows] = Q R'``.
    Every row is visited once, and, unlike in sums of products, the condition of the columns is
    not squared. Columns may be of any size, since reflections do not mix them.

    Parameters
    ----------
    table : ndarray of float, shape (n, p)
        Rows to be selected.
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
    columns, steps = table.shape[1], thresholds.size
    bins, ends = _sorted_places(speed, thresholds, columns)
    rows = np.zeros((columns, columns + speed.size))
    sums = np.zeros((steps, columns))
    for sample in range(speed.size):
        step = bins[sample]
        if step >= 0:
            place = ends[step]
            ends[step] += 1
            for column in range(columns):
                rows[column, place] = table[sample, column]
                sums[step, column] += table[sample, column]
    factors = np.empty((steps, columns, columns))
    counts = np.empty(steps, dtype=np.int64)
    first = columns
    for step in range(steps - 1, -1, -1):
        while first < ends[step]:
            last = min(first + _ROWS_AT_ONCE, ends[step])
            _take_in(rows, first, last)
            first = last
        counts[step] = first - columns
        if step < steps - 1:
            sums[step] += sums[step + 1]
        for row in range(columns):
            for column in range(columns):
                above = row <= column
                factors[step, row, column] = rows[column, first - columns + row] if above else 0.0
    return factors, sums, counts


@compiled_reductions
def _sorted_places(
    speed: NDArray[np.float64], thresholds: NDArray[np.float64], lead: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Find the last threshold below each speed, and where the rows of each threshold begin.

    Rows of the highest threshold come first, after `lead` free places. A threshold is guessed as
    if all were evenly spaced, as those of (8) are, and the guess is moved to where it is true.
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
    place = lead
    for step in range(steps - 1, -1, -1):
        places[step] = place
        place += sizes[step]
    return bins, places


@compiled_reductions
def _take_in(rows: NDArray[np.float64], first: int, last: int) -> None:
    """Reflect the rows `first` to `last` into the factor that lies just before them.

    The new factor is left just before `last`, over rows that are no longer needed.
    """
    columns = rows.shape[0]
    top = first - columns
    for column in range(columns):
        pivot = top + column
        x = rows[column]
        squares = 0.0
        for place in range(first, last):
            squares += x[place] * x[place]
        if squares == 0.0:
            continue
        norm = math.copysign(math.sqrt(x[pivot] * x[pivot] + squares), x[pivot])
        head = x[pivot] + norm
        for other in range(column + 1, columns):
            y = rows[other]
            product = head * y[pivot]
            for place in range(first, last):
                product += x[place] * y[place]
            share = product / (norm * head)
            y[pivot] -= share * head
            for place in range(first, last):
                y[place] -= share * x[place]
        x[pivot] = -norm
    shift = last - first
    for row in range(columns - 1, -1, -1):
        for column in range(row, columns):
            rows[column, top + row + shift] = rows[column, top + row]
