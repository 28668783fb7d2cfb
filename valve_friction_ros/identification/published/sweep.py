# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The regression of the force balance, (3) to (7), and the sweep of δv, (6) to (8), (17), (18)."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.settings import REGRESSED, IdentificationSettings
from valve_friction_ros.model.compiled import compiled_reductions
from valve_friction_ros.signals import Derivatives


@dataclass(frozen=True, eq=False)
class ForceBalanceRegression:
    """Regressors φ(t) of (5), the force that they explain, and the speed that selects samples.

    Attributes
    ----------
    names : tuple of str
        The free parameters, one per column.
    columns : ndarray of float, shape (n, p)
        Regressor of each free parameter.
    force : ndarray of float, shape (n,)
        Actuator force minus the contribution of the fixed parameters, N.
    speed : ndarray of float, shape (n,)
        Absolute velocity, m/s.
    fixed : mapping of str to float
        Parameters outside the regression.
    position_bias : float or None
        x̄ of (10) where the preload follows from it.
    """

    names: tuple[str, ...]
    columns: NDArray[np.float64]
    force: NDArray[np.float64]
    speed: NDArray[np.float64]
    fixed: Mapping[str, float]
    position_bias: float | None

    def complete(self, estimates: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Name the free `estimates`, shape (..., p), and add the fixed values."""
        shape = estimates.shape[:-1]
        named = {name: estimates[..., index] for index, name in enumerate(self.names)}
        for name in REGRESSED:
            if name not in named and name in self.fixed:
                named[name] = np.full(shape, self.fixed[name])
        if self.position_bias is not None:
            named["spring_preload"] = named["spring_constant"] * self.position_bias
        return {name: named[name] for name in REGRESSED}

    def fixing(self, name: str, value: float) -> "ForceBalanceRegression":
        """Fix a free parameter: its contribution to the force leaves the regression."""
        index = self.names.index(name)
        return replace(
            self,
            names=tuple(each for each in self.names if each != name),
            columns=np.delete(self.columns, index, axis=1),
            force=self.force - value * self.columns[:, index],
            fixed={**self.fixed, name: value},
        )


def force_balance_regression(
    force: NDArray[np.float64],
    position: NDArray[np.float64],
    derivatives: Derivatives,
    settings: IdentificationSettings,
) -> ForceBalanceRegression:
    """Set up the regression (4) for the m = n − d + 1 samples that have derivatives.

    Force (N) and position (m) have the shape (n,). The settings name the fixed parameters, and the
    position bias if it is known.
    """
    bias = settings.position_bias
    velocity = derivatives.velocity
    place = derivatives.inner(position)
    regressors = {
        "mass": derivatives.acceleration,
        "coulomb_friction": np.sign(velocity),
        "viscous_friction": velocity,
        "spring_constant": place if bias is None else place + bias,
        "spring_preload": np.ones_like(velocity),
    }
    if bias is not None:
        del regressors["spring_preload"]
    target = derivatives.inner(force).copy()
    for name in settings.fixed:
        if name in regressors:
            target -= settings.fixed[name] * regressors.pop(name)
    fixed = {name: value for name, value in settings.fixed.items() if name in REGRESSED}
    return ForceBalanceRegression(
        tuple(regressors),
        np.column_stack([*regressors.values()]) if regressors else np.empty((target.size, 0)),
        target,
        np.abs(velocity),
        fixed,
        bias,
    )


_ROWS_AT_ONCE = 256
"""Rows reflected into the factor at once; with six columns they take 12 kB of a 32 kB cache."""


@compiled_reductions
def factors_above(
    regressors: NDArray[np.float64],
    force: NDArray[np.float64],
    speed: NDArray[np.float64],
    thresholds: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Factorise ``[Φ_s F_s]``, the samples faster than each threshold.

    From the highest threshold down each step only adds the rows between two thresholds, which
    Householder reflections merge into the current triangular factor: ``[R; rows] = Q R'``.
    Every row is visited once, and, unlike in sums of products, the condition of the columns is
    not squared. Columns may be of any size, since reflections do not mix them.

    Parameters
    ----------
    regressors : ndarray of float, shape (n, p − 1)
        Regressors Φ.
    force : ndarray of float, shape (n,)
        Force F, the last column.
    speed : ndarray of float, shape (n,)
        Speed that selects the rows.
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
        for row in range(columns):
            if step < steps - 1:
                sums[step, row] += sums[step + 1, row]
            for column in range(columns):
                factors[step, row, column] = work[column, row]
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


_DEPENDENT = 1e-10
"""Share of a column's length below which its independent part counts as zero.

Chosen between rounding (1e-15) and the smallest share in 54 simulated records (6e-7, F_0 on a
square wave without noise)."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """Estimates for each threshold δv(s), s = 1 … S, in increasing order.

    Where a threshold leaves too few samples, or samples that do not determine the free
    parameters, its estimates, `sigma`, `r_squared` and `log_information` are nan.

    Attributes
    ----------
    thresholds : ndarray of float, shape (S,)
        δv(s), m/s.
    estimates : mapping of str to ndarray of float, shape (S,) each
        Parameters by name, in SI units.
    sigma : ndarray of float, shape (S,)
        Standard deviation σ_s of the force residual (17), N.
    r_squared : ndarray of float, shape (S,)
        R²_s of (18).
    samples : ndarray of int, shape (S,)
        Number n_s of samples faster than the threshold.
    log_information : ndarray of float, shape (S,)
        ln det ΦᵀΦ of the selected regressors, for the choice of the threshold.
    free : int
        Number n_P of free parameters.
    """

    thresholds: NDArray[np.float64]
    estimates: Mapping[str, NDArray[np.float64]]
    sigma: NDArray[np.float64]
    r_squared: NDArray[np.float64]
    samples: NDArray[np.int64]
    log_information: NDArray[np.float64]
    free: int


def sweep_thresholds(regression: ForceBalanceRegression, thresholds: NDArray[np.float64]) -> Sweep:
    """Solve (7) on the samples above each threshold, in one pass over the samples.

    Parameters
    ----------
    regression : ForceBalanceRegression
        Regressors and force.
    thresholds : ndarray of float, shape (S,)
        Speeds δv(s), m/s, increasing.

    Returns
    -------
    Sweep
        One estimate for each threshold.

    Notes
    -----
    The triangular factor of the regressors with the force beside them, ``[Φ_s F_s] = Q R``, is
    carried from the highest threshold down (`factors_above`). Its leading block gives the
    estimates, its last diagonal entry the residual norm.
    """
    free = len(regression.names)
    factors, sums, samples = factors_above(
        regression.columns, regression.force, regression.speed, thresholds
    )
    regressors, force = factors[:, :free, :free], factors[:, :free, free]
    own = np.abs(np.diagonal(regressors, axis1=1, axis2=2))
    lengths = np.linalg.norm(regressors, axis=1)
    determined = (samples > free + 1) & np.all(own > _DEPENDENT * lengths, axis=1)

    estimates = np.full((thresholds.size, free), np.nan)
    sigma, r_squared, log_information = (np.full(thresholds.size, np.nan) for _ in range(3))
    solved = np.linalg.solve(regressors[determined], force[determined][..., None])[..., 0]
    count, residual = samples[determined], factors[determined, free, free]
    mean = sums[determined, free] / count
    explained = np.sum(force[determined] ** 2, axis=1)
    modelled = np.sum(sums[determined, :free] * solved, axis=1)
    spread = explained - 2 * mean * modelled + count * mean**2
    total = explained + residual**2 - count * mean**2
    estimates[determined] = solved
    sigma[determined] = np.abs(residual) / np.sqrt(count - free)
    r_squared[determined] = np.divide(
        spread, total, out=np.full(total.size, np.nan), where=total > 0
    )
    log_information[determined] = 2 * np.sum(np.log(own[determined]), axis=1)
    return Sweep(
        thresholds,
        regression.complete(estimates),
        sigma,
        r_squared,
        samples,
        log_information,
        free,
    )
