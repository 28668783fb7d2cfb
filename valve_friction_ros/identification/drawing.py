# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Data that every method gives to figures and reports, which draw all methods alike."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.trust.uncertainty import NORMAL_QUANTILE
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.model.valve import KarnoppParameters
from valve_friction_ros.wording import with_width


class Curve(NamedTuple):
    """Points in one style: a line, ``-`` or ``--``, or a marker: ``o``, ``^``, ``v`` or ``D``.

    The `label` is its name in the legend, empty for none; `half_width` is half the interval of each
    y: bars at markers, a band about a line.
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
    """A separate panel; the panels of a drawing share their x axis.

    The axes have a `name`, and labels with the units of the curves. `chosen` is the value on the x
    axis that the method chose; `level` is a parameter on the y axis, drawn with its interval and
    verdict. A panel that `is_detail` is shown by a report only.
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
    """Evidence drawn beside the record and the simulated stem; empty for a method without any.

    A report gives its panels a heading, a caption and, in `alt`, a description, and shades the
    `region` of their x axis. The curves `stem` are of the stem position, m, over time, s, and those
    of the `loop` of the stem position over the drive, Pa or N. Further `settings` are in words.
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


FRICTION_CURVE = "friction_curve"
"""Name of the evidence that holds friction over speed, SI units (`FrictionCurve`)."""

IMPERFECTIONS_FOUND = "imperfections"
"""Name of the evidence that holds lag, slip force and asymmetry, with half widths
(`found_sizes`)."""

_Array = NDArray[np.float64]


_SHARES: _Array = np.geomspace(1e-4, 1.0, 200, dtype=np.float64)
"""Shares of the top speed at which the law is drawn: dense where friction falls with speed."""


def friction_drawing(
    drawing: Drawing,
    evidence: Mapping[str, Any],
    parameters: Mapping[str, Parameter],
    model: KarnoppParameters | None,
    sliding_speed: float,
) -> Drawing:
    """Return a drawing with friction over speed in place of its own panels.

    The `evidence` holds the friction curve, which may be empty, and the lag of the fit; the
    `parameters` give the fitted law, with its band, and the `model` what the record does not
    determine. The sliding friction holds at the `sliding_speed`, m/s.
    """
    curve = evidence[FRICTION_CURVE]
    if not curve:
        return replace(drawing, panels=(), region=None)
    speed, friction, error = (
        np.asarray(curve[name]) for name in ("speed", "friction", "standard_error")
    )
    friction = friction + _viscous_by_lag(evidence, parameters, model) * speed
    fastest = float(np.nanmax([*np.abs(speed), sliding_speed]))
    curves = [
        Curve(speed * 1e3, friction, "o", "record, in bins ± 95 %", NORMAL_QUANTILE * error),
        *_law(fastest * _SHARES, parameters, model, sliding_speed),
    ]
    sliding = parameters.get(SLIDING)
    if sliding is not None and math.isfinite(sliding.value):
        curves.append(
            Curve(
                [-1e3 * sliding_speed, 1e3 * sliding_speed],
                [-sliding.value, sliding.value],
                "D",
                f"sliding friction {with_width(sliding.value, sliding.half_width)} N",
                [sliding.half_width] * 2,
            )
        )
    axes = "stem speed [mm/s]", "friction [N]"
    return replace(
        drawing,
        panels=(Panel("friction", *axes, tuple(curves), "friction over speed"),),
        heading="Friction over speed",
        caption="What the valve did: the actuator force less spring and preload while the stem "
        "clearly slides, averaged in bins of its speed (upwards positive), with the lag of the "
        "fit. No law of friction is assumed. Line: the fitted law. Diamonds: the sliding "
        "friction, which is the mean over the distance, at the mean speed.",
        alt="Points of friction over the speed of the stem, in both directions, with the fitted "
        "law as a line through them.",
        region=None,
    )


def _viscous_by_lag(
    evidence: Mapping[str, Any],
    parameters: Mapping[str, Parameter],
    model: KarnoppParameters | None,
) -> float:
    """Return the F_v, N·s/m, that the curve lacks because its lag differs from that of the fit.

    While the stem slides, taking it as seen later by τ lowers F_v by k·τ.
    """
    lag = evidence.get(IMPERFECTIONS_FOUND, {}).get("lag")
    spring, _ = _known(
        parameters.get("spring_constant"), getattr(model, "spring_constant", math.nan)
    )
    if lag is None or not math.isfinite(spring):
        return 0.0
    return spring * float(evidence[FRICTION_CURVE]["lag"] - lag["value"])


def _law(
    speed: _Array,
    parameters: Mapping[str, Parameter],
    model: KarnoppParameters | None,
    sliding_speed: float,
) -> list[Curve]:
    """Return the law at these speeds, m/s, in both directions; none where it is unknown.

    The intervals of F_c, of F_v and of the sliding friction, which is F_c + F_v·v at its speed,
    determine the covariance of F_c and F_v, and so the interval of the law at each speed.
    """
    names = ("coulomb_friction", "viscous_friction", "static_friction", "stribeck_velocity")
    known = [_known(parameters.get(name), getattr(model, name, math.nan)) for name in names]
    (coulomb, coulomb_width), (viscous, viscous_width), (static, static_width), (fall, _) = known
    if not math.isfinite(coulomb + viscous):
        return []
    slips = fall > 0 and static > coulomb
    left = np.exp(-((speed / fall) ** 2)) if slips else np.zeros_like(speed)
    dry = 1.0 - left
    law = dry * coulomb + viscous * speed + (left * static if slips else 0.0)
    _, width = _known(parameters.get(SLIDING), math.nan)
    both = (width**2 - coulomb_width**2 - (sliding_speed * viscous_width) ** 2) / sliding_speed
    both = float(np.clip(both, *(2.0 * coulomb_width * viscous_width * np.array([-1.0, 1.0]))))
    squares = (dry * coulomb_width) ** 2 + dry * speed * both + (speed * viscous_width) ** 2
    if slips:
        squares = squares + (left * static_width) ** 2
    band = np.sqrt(np.maximum(squares, 0.0))
    velocity, force, half_width = (
        np.concatenate([sign * one[::-1], one]) for sign, one in ((-1, speed), (-1, law), (1, band))
    )
    label = "fitted law" if np.isnan(band).all() else "fitted law ± 95 %"
    return [Curve(velocity * 1e3, force, "-", label, half_width)]


def _known(parameter: Parameter | None, otherwise: float) -> tuple[float, float]:
    """Value and half width of a parameter, even if withheld; nan where there is none."""
    if parameter is None:
        return otherwise, math.nan
    if math.isfinite(parameter.value):
        return parameter.value, parameter.half_width
    value, half_width = parameter.withheld
    return (value if math.isfinite(value) else otherwise), half_width
