# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sweep of the velocity threshold δv, equations (6) to (8), (17) and (18)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.published.regression import ForceBalanceRegression
from valve_friction_ros.identification.published.triangular_factors import factors_above

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
