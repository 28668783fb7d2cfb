# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Conversion between messages and plain numbers."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from builtin_interfaces.msg import Time
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

from valve_friction_ros.identification import Sweep
from valve_friction_ros.streams import Arrivals, rows_arrived
from valve_friction_ros.streams.samples import joint_position

_NANOSECONDS = 1_000_000_000


def stamp_of(time: Time) -> int:
    """Time of a message in whole nanoseconds."""
    stamp: int = time.sec * _NANOSECONDS + time.nanosec
    return stamp


def time_message(stamp: int) -> Time:
    """Message of a time in whole nanoseconds."""
    seconds, nanoseconds = divmod(stamp, _NANOSECONDS)
    return Time(sec=seconds, nanosec=nanoseconds)


def position_of(message: JointState, joint: str) -> float | None:
    """Position of `joint` in m, of the first joint for an empty name; None if it is not there."""
    return joint_position(message.name, message.position, joint)


def rows_of(messages: Sequence[Float64MultiArray]) -> Arrivals:
    """Take the samples out of blocks that follow each other: a row each of s, Pa and m.

    Raises ValueError if the layout of one is not that of such a block; the message says what it
    should be.
    """
    tables, labels = zip(*map(_table_of, messages), strict=True)
    if any(one != labels[0] for one in labels):
        raise ValueError("the columns are not the same in all blocks")
    return rows_arrived(np.concatenate(tables), labels[0])


def _table_of(message: Float64MultiArray) -> tuple[NDArray[np.float64], list[str]]:
    """Return the numbers of a block, a row each sample, and what its columns are labelled."""
    dimensions = message.layout.dim
    if len(dimensions) != 2:
        raise ValueError(f"the layout has {len(dimensions)} dimensions, not sample × columns")
    rows, columns = dimensions
    if rows.label != "sample":
        raise ValueError(f"the first dimension is labelled {rows.label!r}, not 'sample'")
    count = rows.size * columns.size
    if message.layout.data_offset or len(message.data) != count:
        raise ValueError(
            f"there are {len(message.data)} numbers from offset {message.layout.data_offset}, "
            f"not {rows.size} × {columns.size} from 0"
        )
    table = np.asarray(message.data, dtype=np.float64).reshape(rows.size, columns.size)
    return table, columns.label.split(",")


def sweep_message(sweep: Sweep | None) -> Float64MultiArray:
    """Table of a sweep: a row a threshold, the columns named in the label of the second axis.

    Empty for a method without a sweep, so that an older latched sweep is replaced.
    """
    if sweep is None:
        return Float64MultiArray()
    columns: Mapping[str, np.ndarray] = {
        "threshold": sweep.thresholds,
        **sweep.estimates,
        "sigma": sweep.sigma,
        "r_squared": sweep.r_squared,
        "samples": sweep.samples.astype(np.float64),
    }
    table = np.column_stack([*columns.values()])
    rows, width = table.shape
    return Float64MultiArray(
        layout=MultiArrayLayout(
            dim=[
                MultiArrayDimension(label="threshold", size=rows, stride=math.prod(table.shape)),
                MultiArrayDimension(label=",".join(columns), size=width, stride=width),
            ]
        ),
        data=table.ravel().tolist(),
    )
