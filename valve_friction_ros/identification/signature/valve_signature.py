# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The valve signature: breakaway points, spring constant, bias and dead zone, (10) to (16)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from valve_friction_ros.identification.drawing import Curve, Drawing
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.signature.strokes import (
    BreakawayPoint,
    SignatureStroke,
    find_strokes,
    velocity_window,
)
from valve_friction_ros.identification.trust.excitation import require_drive
from valve_friction_ros.identification.trust.uncertainty import jackknife
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.model.checks import frozen
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.wording import percentage

TRIANGLE_NEEDED = (
    "drive the valve with a slow triangular pressure wave, such as a period of 60 s, for two "
    "periods or more"
)
"""The remedy in refusals: the excitation that gives a valve signature."""

_LEAST_STEADINESS = 0.6
"""Least median share of a stroke at constant speed.

0.89 and more in 32 simulated triangles; a square wave behind a lag has no constant speed. Chosen
between them."""

Ways = Sequence[Sequence[SignatureStroke]]
"""The strokes up, and the strokes down."""


@dataclass(frozen=True, eq=False)
class ValveSignature:
    """Spring constant, bias, dead zone and breakaway points of a valve signature.

    Attributes
    ----------
    strokes : tuple of SignatureStroke
        In time order, each with its breakaway point and its sliding instants.
    spring_constant : float
        k, N/m: mean of (15) over the sliding instants of each stroke, and over the strokes.
    position_bias : float
        x̄ of (14), m, between the mean P1 and the mean P2.
    dead_zone : float
        Width of the loop, Pa or N: the difference of the drives at which the stem slides up and
        down through one position, 2·(F_c + F_v·|ẋ|)/S_a.
    dead_zone_share : float
        `dead_zone` as a share of the pressure's span in the record.
    standard_errors : mapping of str to float
        Of `spring_constant`, `position_bias` and `dead_zone`, from the scatter between strokes;
        nan with a single stroke either way.
    window : int
        Derivative window of the velocity, samples.
    """

    strokes: tuple[SignatureStroke, ...] = field(repr=False)
    spring_constant: float
    position_bias: float
    dead_zone: float
    dead_zone_share: float
    standard_errors: Mapping[str, float]
    window: int

    @property
    def ways(self) -> tuple[tuple[SignatureStroke, ...], tuple[SignatureStroke, ...]]:
        """The strokes up, and the strokes down."""
        upward = tuple(stroke for stroke in self.strokes if stroke.direction > 0)
        return upward, tuple(stroke for stroke in self.strokes if stroke.direction < 0)

    def drawing(self, parameters: Mapping[str, Parameter], valve: Valve) -> Drawing:  # noqa: ARG002
        """Return P1, P2 and the lines of the sliding stem, as figures and reports show them."""
        drive, k = valve.driven_by, self.spring_constant
        lines = []
        for stroke in (way[0] for way in self.ways):
            place = stroke.sliding.position[[0, -1]]
            level = float(np.mean(stroke.sliding.force - k * stroke.sliding.position))
            label = f"slides {'up' if stroke.direction > 0 else 'down'}, slope $S_a$/k"
            lines.append(Curve(valve.actuator_drive(level + k * place), place, "--", label))
        points = breakaway_points(self.strokes)
        times, places = [one.time for one in points], [one.position for one in points]
        return Drawing(
            stem=(Curve(times, places, "o"),),
            stem_title="stem (dotted: model; ●: breakaway)",
            loop=(*lines, *self.breakaway_curves()),
            loop_title=f"valve signature: dead zone {self.dead_zone / drive.size:.4g} "
            f"{drive.unit}, x̄ {self.position_bias * 1e3:.3g} mm",
            loop_caption=" The stem breaks away upwards at P₁ and downwards at P₂; on the dashed "
            "lines it slides. The dead zone, the loop's width, is "
            f"{percentage(self.dead_zone_share)} of the {drive.words}'s span.",
        )

    def breakaway_curves(self) -> tuple[Curve, ...]:
        """Return P1 and P2 of every stroke: stem position, m, over the drive, Pa or N."""
        return tuple(
            Curve([one.drive for one in points], [one.position for one in points], style, label)
            for label, style, points in (
                ("$P_1$", "^", self.upward_points),
                ("$P_2$", "v", self.downward_points),
            )
        )

    @property
    def upward_points(self) -> tuple[BreakawayPoint, ...]:
        """P1 of each stroke up that began from a recorded rest."""
        return breakaway_points(self.ways[0])

    @property
    def downward_points(self) -> tuple[BreakawayPoint, ...]:
        """P2 of each stroke down that began from a recorded rest."""
        return breakaway_points(self.ways[1])


def breakaway_points(strokes: Sequence[SignatureStroke]) -> tuple[BreakawayPoint, ...]:
    """Return the breakaway points of those strokes that have one."""
    return tuple(stroke.breakaway for stroke in strokes if stroke.breakaway is not None)


def mean_spring_constant(ways: Ways) -> float:
    """Return k of (15), N/m, averaged over the strokes of both ways.

    Raises
    ------
    RefusalError
        If it is not above zero.
    """
    found = float(np.mean([stroke.spring_constant for way in ways for stroke in way]))
    if not found > 0:
        raise RefusalError(
            f"the drive does not rise as the stem slides (spring constant {found:.3g} N/m): check "
            "that both signals belong to this valve, and that they share one clock"
        )
    return found


def mean_position_bias(ways: Ways, spring_constant: float) -> float:
    """Return x̄ of (14), m, between the mean breakaway point of either way."""
    force, position = (
        sum(
            float(np.mean([getattr(point, name) for point in breakaway_points(way)]))
            for way in ways
        )
        for name in ("force", "position")
    )
    return 0.5 * (force / spring_constant - position)


def sliding_friction(ways: Ways, spring_constant: float) -> float:
    """Return half the difference of F_ext − k·x between strokes up and down, N: F_c + F_v·|ẋ|."""
    upward, downward = (
        float(
            np.mean(
                [
                    np.mean(stroke.sliding.force - spring_constant * stroke.sliding.position)
                    for stroke in way
                ]
            )
        )
        for way in ways
    )
    return 0.5 * (upward - downward)


def sliding_places(ways: Ways) -> float:
    """Return the mean position while sliding up minus that while sliding down, m."""
    upward, downward = (
        float(np.mean([np.mean(stroke.sliding.position) for stroke in way])) for way in ways
    )
    return upward - downward


def sliding_speed(ways: Ways) -> float:
    """Return the mean speed at which the stem slides, m/s."""
    strokes = [stroke for way in ways for stroke in way]
    return float(np.mean([np.mean(np.abs(stroke.sliding.velocity)) for stroke in strokes]))


def leaving_speed(ways: Ways) -> float:
    """Return the mean speed at which the stem breaks away, m/s; 0 if any stroke shows no jump."""
    speeds = [point.speed for way in ways for point in breakaway_points(way)]
    return float(np.mean(speeds)) if min(speeds) > 0 else 0.0


def valve_signature(
    recording: Recording, valve: Valve, window: int | None = None
) -> ValveSignature:
    """Read spring constant, bias and dead zone off a valve signature.

    The breakaway points, which the paper reads off its Fig. 2 by eye, are found by `fit_onset`.
    A stroke from a travel stop is included too: as the stem leaves, the stop carries no force.

    Parameters
    ----------
    recording : Recording
        Strokes in both directions at a constant speed, each from a rest, as a triangular pressure
        gives: `TriangleWave` with its period of 60 s suits the bench valve.
    valve : Valve
        Diaphragm area and pressure reference.
    window : int, optional
        Derivative window of the velocity, samples, odd; by default the noise determines it.

    Returns
    -------
    ValveSignature
        Strokes, breakaway points and the figures from them.

    Raises
    ------
    RefusalError
        If a direction has no such stroke, or the stem does not slide at a constant speed.
    """
    require_drive(recording, valve)
    window = window or velocity_window(recording)
    strokes = find_strokes(recording, valve, window)
    ways = [[one for one in strokes if one.direction == way] for way in (1, -1)]
    counts = [len(breakaway_points(way)) for way in ways]
    if strokes:
        steadiness = float(np.median([stroke.steadiness for stroke in strokes]))
        if steadiness < _LEAST_STEADINESS:
            raise RefusalError(
                "a valve signature needs a stem that slides at a constant speed (only "
                f"{100 * steadiness:.0f} % of a stroke is steady): {TRIANGLE_NEEDED}"
            )
    if not all(counts):
        raise RefusalError(
            "a valve signature needs strokes from rest in both directions at a constant speed; "
            f"the record has {counts[0]} up and {counts[1]} down: {TRIANGLE_NEEDED}"
        )

    def figures(ways: Ways) -> dict[str, float]:
        spring_constant = mean_spring_constant(ways)
        return {
            "spring_constant": spring_constant,
            "position_bias": mean_position_bias(ways, spring_constant),
            "dead_zone": 2 * sliding_friction(ways, spring_constant) / valve.force_per_drive,
        }

    pointed = [[stroke for stroke in way if stroke.breakaway is not None] for way in ways]
    found = jackknife(pointed, figures)
    return ValveSignature(
        strokes,
        **found.values,
        dead_zone_share=found.values["dead_zone"] / float(np.ptp(recording.drive)),
        standard_errors=frozen(found.standard_errors),
        window=window,
    )
