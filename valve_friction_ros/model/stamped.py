# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Two signals with the stamps of their samples, on no common grid."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.drive import Drive


@dataclass(frozen=True, eq=False)
class StampedSignal:
    """Samples of one sensor with their stamps.

    Attributes
    ----------
    time : ndarray of float, shape (n,)
        Time of each sample, s, increasing; kept as a read-only copy.
    value : ndarray of float, shape (n,)
        Values at those times, SI unit; kept as a read-only copy.

    Raises
    ------
    ValueError
        If the arrays differ in shape, hold fewer than three samples or a number that is not
        finite, or the times do not increase.
    """

    FEWEST: ClassVar[int] = 3

    time: NDArray[np.float64] = field(repr=False)
    value: NDArray[np.float64] = field(repr=False)

    def __post_init__(self) -> None:
        """Refuse arrays that do not make a signal, and freeze them."""
        for name in ("time", "value"):
            values = np.array(getattr(self, name), dtype=np.float64)
            if values.ndim != 1 or values.size < self.FEWEST or not np.isfinite(values).all():
                raise ValueError(f"{name} must be a row of {self.FEWEST} or more finite numbers")
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        if self.time.shape != self.value.shape:
            raise ValueError(f"{self.time.size} times for {self.value.size} values")
        if not (np.diff(self.time) > 0).all():
            raise ValueError("times must increase")

    def __setstate__(self, state: dict[str, object]) -> None:
        """Freeze the arrays of a copy, too."""
        self.__dict__.update(state)
        self.time.flags.writeable = self.value.flags.writeable = False

    @property
    def period(self) -> float:
        """Median time between two samples, s."""
        return float(np.median(np.diff(self.time)))


@dataclass(frozen=True, eq=False)
class StampedRecord:
    """Drive (Pa or N) and stem position (m), their times counted from one origin."""

    drive: StampedSignal
    position: StampedSignal
    driven_by: Drive = Drive.PRESSURE
