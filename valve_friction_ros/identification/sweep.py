"""The sweep of the velocity threshold δv, equations (6) to (8), (17) and (18)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from valve_friction_ros.identification.force_balance_regression import ForceBalanceRegression

__all__ = ["Sweep", "sweep_thresholds"]

_DEPENDENT = 1e-10
"""A column of which less than this share is its own counts as a combination of the others."""


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
        One estimate a threshold.

    Notes
    -----
    From the highest threshold down, each step only adds the samples between two thresholds, so
    the triangular factor of the regressors with the force beside them is updated by those rows:
    ``[Φ_s F_s] = Q R``. The leading block of R gives the estimates, its last diagonal entry the
    residual norm. The columns, nine orders of magnitude apart, are scaled to unit length first;
    a triangular factor, unlike the sums of products in (7), does not square their condition.
    """
    free = len(regression.names)
    table = np.column_stack([regression.columns, regression.force])
    scale = np.linalg.norm(table, axis=0)
    scale[scale == 0] = 1.0
    table = table / scale
    steps = thresholds.size
    bins = np.searchsorted(thresholds, regression.speed, side="left") - 1
    order = np.argsort(bins, kind="stable")
    table = table[order]
    starts = np.searchsorted(bins[order], np.arange(steps + 1))

    estimates = np.full((steps, free), np.nan)
    sigma, r_squared, log_information = (np.full(steps, np.nan) for _ in range(3))
    samples = (table.shape[0] - starts[:-1]).astype(np.int64)
    factor = np.empty((0, free + 1))
    sums = np.zeros(free + 1)
    for step in range(steps - 1, -1, -1):
        rows = table[starts[step] : starts[step + 1]]
        sums += rows.sum(axis=0)
        factor = np.asarray(np.linalg.qr(np.vstack([factor, rows]), mode="r"))
        count = samples[step]
        if count <= free + 1:
            continue
        lengths = np.linalg.norm(factor[:, :free], axis=0)
        own = np.abs(np.diag(factor)[:free])
        if np.any(own <= _DEPENDENT * lengths):
            continue
        solution = solve_triangular(factor[:free, :free], factor[:free, free])
        estimates[step] = solution * scale[free] / scale[:free]
        sigma[step] = abs(factor[free, free]) * scale[free] / np.sqrt(count - free)
        mean = sums[free] / count
        explained = factor[:free, free] @ factor[:free, free]
        spread = explained - 2 * mean * (sums[:free] @ solution) + count * mean**2
        total = explained + factor[free, free] ** 2 - count * mean**2
        r_squared[step] = spread / total if total > 0 else np.nan
        log_information[step] = 2 * np.sum(np.log(own * scale[:free]))
    return Sweep(
        thresholds,
        regression.complete(estimates),
        sigma,
        r_squared,
        samples,
        log_information,
        free,
    )
