# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The least of a quadratic form where some coordinates have a least value."""

import numpy as np
from numpy.typing import NDArray

_ROUNDS = 12
_ROUNDING = 1e-9


def bounded_minimum(
    curvature: NDArray[np.float64], slope: NDArray[np.float64], lowest: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Minimise q'·A·q/2 − b'·q under q ≥ `lowest`, by an active set.

    A coordinate that would leave its range is held at its end, and the others are solved anew; one
    that is held though the form falls inwards is let go, for half of the rounds at most.

    Parameters
    ----------
    curvature : ndarray of float, shape (p, p)
        A, positive semi-definite, with a diagonal of about one.
    slope : ndarray of float, shape (p,)
        b.
    lowest : ndarray of float, shape (p,)
        At most zero; minus infinity where there is no end.

    Returns
    -------
    ndarray of float, shape (p,)
        q.
    """
    free = np.ones(slope.size, dtype=np.bool_)
    q = np.zeros_like(slope)
    for turn in range(_ROUNDS):
        rest = slope[free] - curvature[np.ix_(free, ~free)] @ q[~free]
        q[free] = np.linalg.lstsq(curvature[np.ix_(free, free)], rest, rcond=1e-13)[0]
        outside = free & (q < lowest)
        if outside.any():
            q[outside] = lowest[outside]
            free &= ~outside
            continue
        inwards = ~free & (curvature @ q - slope < -_ROUNDING)
        if not inwards.any() or turn > _ROUNDS // 2:
            break
        free |= inwards
    return np.asarray(np.maximum(q, lowest), dtype=np.float64)
