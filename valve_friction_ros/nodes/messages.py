"""Between messages and plain numbers."""

import math
from collections.abc import Mapping

import numpy as np
from builtin_interfaces.msg import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

from valve_friction_ros.identification import Sweep

__all__ = ["position_of", "stamp_of", "sweep_message", "time_message"]

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
    index = 0
    if joint and message.name:
        if joint not in message.name:
            return None
        index = message.name.index(joint)
    return message.position[index] if index < len(message.position) else None


def sweep_message(sweep: Sweep | None) -> Float64MultiArray:
    """Table of a sweep: a row a threshold, the columns named in the label of the second axis.

    Empty for a method without a sweep, so that a latched one of before does not stay.
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
