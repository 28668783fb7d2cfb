# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a method offers to figures and reports: data that they draw for every method alike."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.model.valve import Valve


class Curve(NamedTuple):
    """Points in one style.

    Attributes
    ----------
    x, y : array_like
        Coordinates of the points.
    style : str
        A line, ``-`` or ``--``, or a marker: ``o``, ``^`` or ``v``.
    label : str
        Name in the legend; empty for none.
    half_width : array_like or None
        Half the interval of each y: bars at markers, a band about a line.
    """

    x: ArrayLike
    y: ArrayLike
    style: str = "-"
    label: str = ""
    half_width: ArrayLike | None = None

    @property
    def is_line(self) -> bool:
        """Whether the points are joined."""
        return self.style.startswith("-")

    def scaled(self, x_unit: float, y_unit: float) -> tuple[NDArray[np.float64], ...]:
        """Return the coordinates in units of this size."""
        return np.asarray(self.x) / x_unit, np.asarray(self.y) / y_unit


@dataclass(frozen=True, eq=False)
class Panel:
    """A panel of its own; the panels of a drawing share their x axis.

    Attributes
    ----------
    name : str
        Name of the axes.
    x_label, y_label : str
        Labels of the axes, with unit.
    curves : tuple of Curve
        In the units of the labels.
    title : str
        Text above the panel.
    chosen : float or None
        Place on the x axis that the method chose.
    level : Parameter or None
        Parameter on the y axis, drawn with its interval and verdict.
    is_logarithmic : bool
        Whether the y axis is.
    is_detail : bool
        Whether only a report shows the panel.
    """

    name: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    title: str = ""
    chosen: float | None = None
    level: Parameter | None = None
    is_logarithmic: bool = False
    is_detail: bool = False


@dataclass(frozen=True, eq=False)
class Drawing:
    """What is drawn beside the record and the simulated stem; empty for a method without more.

    Attributes
    ----------
    panels : tuple of Panel
        Panels of their own.
    heading, caption, alt : str
        Heading, caption and description of these panels in a report.
    region : tuple of float or None
        Part of their x axis that a report shades.
    stem : tuple of Curve
        Drawn on the stem position, m, over the time, s.
    stem_title : str
        What the stem's panel shows.
    loop : tuple of Curve
        Drawn on the stem position, m, over the drive, Pa or N.
    loop_title, loop_caption : str
        What the loop shows, in a figure and in a report.
    settings : mapping of str to str
        Further settings, in words.
    """

    panels: tuple[Panel, ...] = ()
    heading: str = ""
    caption: str = ""
    alt: str = ""
    region: tuple[float, float] | None = None
    stem: tuple[Curve, ...] = ()
    stem_title: str = "stem (dotted: model)"
    loop: tuple[Curve, ...] = ()
    loop_title: str = "valve signature"
    loop_caption: str = ""
    settings: Mapping[str, str] | None = None


class Exhibit(Protocol):
    """The evidence of a method, such as a sweep or a valve signature."""

    def drawing(self, parameters: Mapping[str, Parameter], valve: Valve) -> Drawing:
        """Return what is drawn of it, beside these parameters of the result."""
