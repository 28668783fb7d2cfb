# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The part of a recorded file to read."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.streams.samples import nanoseconds


def _nanoseconds(seconds: float) -> float:
    """Convert seconds to whole nanoseconds, the unit of stamps; infinity stays infinity."""
    return nanoseconds(seconds) if math.isfinite(seconds) else seconds


@dataclass(frozen=True)
class Stretch:
    """A part of a recording; by default the whole recording.

    Attributes
    ----------
    begin, end : float
        Times since the first sample of the file, s; both belong to the stretch.
    last : float
        Length of its end, s. A recording that ends when a node identified, read with the
        node's `window`, equals the node's buffer.

    Raises
    ------
    ValueError
        If a time is not a number, or the stretch is empty.
    """

    begin: float = -math.inf
    end: float = math.inf
    last: float = math.inf

    def __post_init__(self) -> None:
        """Refuse empty stretches."""
        if not self.begin < self.end:
            raise ValueError(f"a stretch cannot begin at {self.begin:g} s and end at {self.end:g}")
        if not self.last > 0:
            raise ValueError(f"the last seconds must be above zero, got {self.last:g}")

    def contains(self, since_first: int) -> bool:
        """Return whether a time after the first sample, ns, lies between begin and end."""
        return _nanoseconds(self.begin) <= since_first <= _nanoseconds(self.end)

    def select(
        self, times: NDArray[np.float64] | NDArray[np.int64], first: float
    ) -> NDArray[np.bool_]:
        """Choose from times, ns, shape (n,); return an array of bool, true within the stretch.

        `first` is the time of the file's first sample, ns. A time that is not a number stays, to be
        refused.
        """
        with np.errstate(invalid="ignore"):
            since = np.rint(times - first)
            outside = (since < _nanoseconds(self.begin)) | (since > _nanoseconds(self.end))
            inside: NDArray[np.bool_] = ~outside | ~np.isfinite(times)
            if inside.any():
                newest = times[inside][-1]
                inside &= ~(np.rint(newest - times) > _nanoseconds(self.last))
        return inside
