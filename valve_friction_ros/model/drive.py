# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The drive of the stem in a recording: the pressure of an actuator, or a force itself."""

from enum import Enum

DEFAULT_LAG = 1.3
"""Time constant of the V/P converter, s: 1.2 to 1.5 s reproduce the paper's |ẋ|max of 0.013 m/s."""


class Drive(Enum):
    """The drive of the stem: its name in a sentence, and the unit in which people read it.

    Attributes
    ----------
    words : str
        Name in a sentence.
    unit : str
        Unit in figures and tables.
    size : float
        Size of `unit` in the SI unit of the samples, Pa or N.

    Examples
    --------
    >>> Drive.PRESSURE.label, Drive.FORCE.label
    ('pressure [kPa]', 'drive force [N]')
    """

    PRESSURE = ("pressure", "kPa", 1e3)
    """The actuator's pressure on its diaphragm."""
    FORCE = ("drive force", "N", 1.0)
    """The force of a machine without a diaphragm."""

    def __init__(self, words: str, unit: str, size: float) -> None:
        self.words, self.unit, self.size = words, unit, size

    def __repr__(self) -> str:
        """Return the name, without the values."""
        return f"{type(self).__name__}.{self.name}"

    @property
    def label(self) -> str:
        """Name and unit, for an axis or a row."""
        return f"{self.words} [{self.unit}]"
