# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""How the errors of identified numbers go together."""

from collections.abc import Mapping
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

CORRELATION = "correlation"
"""Name of the evidence that holds it."""


class Correlation(TypedDict):
    """Names of numbers, and a row of correlations for each, in that order."""

    names: list[str]
    matrix: list[list[float]]


def correlation_of(
    gradients: Mapping[str, NDArray[np.float64]],
    covariance: NDArray[np.float64],
    own: Mapping[str, float] | None = None,
) -> Correlation:
    """Return the correlation of numbers that depend on correlated coordinates.

    Parameters
    ----------
    gradients : mapping of str to ndarray of float, shape (p,)
        Derivatives of each number by the coordinates. A number that does not vary is left out.
    covariance : ndarray of float, shape (p, p)
        Covariance of the coordinates.
    own : mapping of str to float, optional
        Variance of a number that no other shares.

    Examples
    --------
    The sum of two independent numbers of variance 1 and 3 goes with the first by 1/2.

    >>> import numpy as np
    >>> gradients = {"one": np.array([1.0, 0.0]), "sum": np.array([1.0, 1.0])}
    >>> found = correlation_of(gradients, np.diag([1.0, 3.0]))
    >>> found["names"], found["matrix"][0]
    (['one', 'sum'], [1.0, 0.5])
    """
    rows = np.array(list(gradients.values()))
    whole = rows @ covariance @ rows.T
    whole += np.diag([(own or {}).get(name, 0.0) for name in gradients])
    kept = np.diag(whole) > 0
    whole = whole[np.ix_(kept, kept)]
    deviation = np.sqrt(np.diag(whole))
    matrix = np.clip(whole / np.outer(deviation, deviation), -1.0, 1.0)
    np.fill_diagonal(matrix, 1.0)
    names = [name for name, is_kept in zip(gradients, kept.tolist(), strict=True) if is_kept]
    return {"names": names, "matrix": matrix.tolist()}
