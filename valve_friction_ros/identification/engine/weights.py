# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Weight of each reading: noise of both sensors, and misfit that lasts."""

import math

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.engine.fitted_record import FittedRecord
from valve_friction_ros.signals import runs_of

_MOVING = 0.1
_FEWEST_BLOCKS = 8


def reading_weights(record: FittedRecord, spring_constant: float) -> NDArray[np.float64]:
    """Return one over the effective deviation of each cell, 1/m.

    The noise of the stem is white: s_x²/n in a cell of n samples. The noise of the smoothed force,
    of variance s_F², moves the stem by s_F/k, equally in all cells over which it lasts: those of
    the smoothing window, or of a rest, which keeps the error at the stop. L such cells have the
    weight of one if each has the variance s_x²/n + L·s_F²/k².
    """
    still = record.still[np.rint(record.cells).astype(np.intp)]
    lasting = np.full(still.size, record.memory)
    variance = record.force_variance.copy()
    reach = math.ceil(record.memory)
    for begin, end in runs_of(still):
        at_stop = record.force_variance[max(begin - reach, 0) : begin + reach]
        variance[begin:end] = np.max(at_stop)
        lasting[begin:end] = max(end - begin, record.memory)
    white = record.noise**2 / record.samples
    weights: NDArray[np.float64] = 1.0 / np.sqrt(white + lasting * variance / spring_constant**2)
    return weights


def stroke_cells(record: FittedRecord) -> int:
    """Return the mean number of cells between two reversals of the measured stem."""
    velocity = record.slow.velocity
    moving = velocity[np.abs(velocity) > _MOVING * np.max(np.abs(velocity))]
    reversals = int(np.count_nonzero(np.diff(np.sign(moving))))
    return record.position.size // (reversals + 1)


def inflation(scaled: NDArray[np.float64], stroke: int) -> float:
    """Return the variance of the mean of scaled residuals over that of independent ones, ≥ 1.

    Blocks of 1, 2, 4 … cells up to a stroke are averaged; the result is the largest product of
    their length and the mean square of their averages. It is 1 for noise as foreseen, and grows
    with the size and the duration of a misfit.
    """
    largest, length = max(float(np.mean(scaled**2)), 1.0), 2
    while length <= stroke and scaled.size // length >= _FEWEST_BLOCKS:
        blocks = scaled.size // length
        means = scaled[: blocks * length].reshape(blocks, length).mean(axis=1)
        largest = max(largest, length * float(np.mean(means**2)))
        length *= 2
    return largest
