"""The sweep of the threshold as one would write it first, to compare with."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["plain_sweep"]


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
