"""Runs of samples of which something holds."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["runs_of"]


def runs_of(active: NDArray[np.bool_]) -> list[list[int]]:
    """First and one-past-last index of each run of True."""
    edges: list[list[int]] = (
        np.flatnonzero(np.diff(active, prepend=False, append=False)).reshape(-1, 2).tolist()
    )
    return edges
