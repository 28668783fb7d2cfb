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
from sys import float_info
from typing import NamedTuple

import numpy as np
import scipy
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from valve_friction_ros.identification.drawing import Curve, Drawing
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.trust.excitation import require_drive
from valve_friction_ros.identification.trust.uncertainty import jackknife
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.model.checks import frozen
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import differentiate, measured, runs_of, velocity_noise
from valve_friction_ros.wording import percentage

_JUMP_GAIN = 12.0
"""Decrease of the sum of squares, in variances of the residual, above which a jump is kept.

With one further parameter chance exceeds it in 5 of 10,000 records (χ² of 1 degree of freedom)."""

_FEWEST = 8
"""Samples of a fit: it has five parameters with a jump. Chosen: three samples more."""

_LAGS = (0.02, 0.1, 0.4)
_LATER = (0.0, 0.03)
"""Starts of the fit, as shares of its time span: lags, and delays of a jump after the onset of the
fit without a jump. Chosen: the best of all starts is kept."""


class Onset(NamedTuple):
    """Time at which a stem leaves its rest, s on the axis of the samples, and its position then, m.

    `jump_speed`, m/s, is the speed in the direction of motion at which the stem leaves: above zero
    after a visible slip jump.
    """

    time: float
    level: float
    jump_speed: float


def _unit_motion(since: NDArray[np.float64], lag: float, growth: float) -> NDArray[np.float64]:
    """Displacement of a first-order lag under ``t + growth·t²/2`` that begins at 0."""
    ramp = np.maximum(since, 0.0)
    linear = ramp + lag * np.expm1(-ramp / lag)
    return np.asarray(linear + growth * (0.5 * ramp**2 - lag * linear), dtype=np.float64)


def _unit_jump(since: NDArray[np.float64], lag: float) -> NDArray[np.float64]:
    """Displacement of a first-order lag that leaves 0 at speed 1."""
    return np.asarray(-lag * np.expm1(-np.maximum(since, 0.0) / lag), dtype=np.float64)


def _columns(
    time: NDArray[np.float64], onset: float, lag: float, growth: float, jumps: bool
) -> NDArray[np.float64]:
    since = time - onset
    shapes = [np.ones_like(time), _unit_motion(since, lag, growth)]
    if jumps:
        shapes.append(_unit_jump(since, lag))
    return np.column_stack(shapes)


def _fit(
    time: NDArray[np.float64],
    position: NDArray[np.float64],
    start: tuple[float, float],
    growth: float,
    jumps: bool,
) -> tuple[float, float, NDArray[np.float64], float]:
    """Least squares over onset and lag; the linear coefficients are solved within.

    Returns onset, lag, the linear coefficients and the sum of squares.
    """
    span = float(time[-1] - time[0])
    shortest = span / time.size
    scale = max(float(np.ptp(position)), float_info.min)

    def misfit(place: NDArray[np.float64]) -> NDArray[np.float64]:
        columns = _columns(time, place[0], float(np.exp(place[1])), growth, jumps)
        linear, *_ = np.linalg.lstsq(columns, position, rcond=None)
        return np.asarray((columns @ linear - position) / scale, dtype=np.float64)

    lowest, highest = np.log(shortest), np.log(span)
    fitted = scipy.optimize.least_squares(  # type: ignore[operator]  # the stubs take it for a module
        misfit,
        [start[0], float(np.clip(np.log(start[1]), lowest, highest))],
        bounds=([time[0], lowest], [time[-1], highest]),
        x_scale=[span / 10, 1.0],
        xtol=1e-12,
        ftol=1e-12,
        gtol=1e-12,
    )
    onset, lag = float(fitted.x[0]), float(np.exp(fitted.x[1]))
    columns = _columns(time, onset, lag, growth, jumps)
    linear, *_ = np.linalg.lstsq(columns, position, rcond=None)
    residual = columns @ linear - position
    return onset, lag, np.asarray(linear, dtype=np.float64), float(residual @ residual)


def fit_onset(
    time: NDArray[np.float64], position: NDArray[np.float64], guess: float, growth: float = 0.0
) -> Onset:
    """Find when a stem leaves its rest, from all samples around it, eight at least.

    A stem without inertia that breaks away under a force growing at a constant rate approaches a
    constant speed v as a first-order lag does, with τ = F_v/k:

        x(t) = x_r + v·(t' − τ·(1 − e^(−t'/τ))) + v_j·τ·(1 − e^(−t'/τ)),  t' = max(t − t_0, 0) .

    Where the rate itself changes, as behind a V/P converter, the ramp bends accordingly: `growth`,
    1/s, is its relative change at the onset. The last term belongs to a slip jump, at whose onset
    the stem has the speed v_j. It is kept where it explains more than chance and v_j is above v: a
    stem that leaves more slowly than it slides later did not jump. All samples of the rest and of
    the motion take part, so sensor noise moves t_0 far less than the crossing of a level. The
    times, s, are evenly spaced, and `guess` is near the onset.
    """
    span = float(time[-1] - time[0])
    plain = min(
        (_fit(time, position, (guess, lag * span), growth, False) for lag in _LAGS),
        key=lambda one: one[-1],
    )
    jumping = min(
        (
            _fit(time, position, (plain[0] + later * span, lag * span), growth, True)
            for later in _LATER
            for lag in _LAGS
        ),
        key=lambda one: one[-1],
    )
    variance = jumping[-1] / (time.size - 5)
    sliding, leaving = jumping[2][1:] * np.sign(plain[2][1])
    is_jump = leaving > sliding and plain[-1] - jumping[-1] > _JUMP_GAIN * variance
    chosen = jumping if is_jump else plain
    return Onset(chosen[0], float(chosen[2][0]), float(leaving) if is_jump else 0.0)


_ORDER = 3
"""Polynomial order of the derivatives: the paper's n."""

_RUN_SHARE = 0.5
_REST_SHARE = 0.1
"""Speeds above which a stroke runs and below which the stem rests, as shares of the usual speed.

Chosen: a triangle has the usual speed and zero only, so any pair well apart separates them."""

_LEAST_SPEED_SHARE = 0.1
"""Least speed, as a share of the top speed, of a sample in the usual speed. Chosen: it leaves out
rests."""

_LEAST_STROKE_SHARE = 0.1
"""Least length of a stroke, as a share of the stem's range.

Chosen: shorter runs are slips or disturbances."""

_STEADY = 0.05
"""The stem slides steadily while its velocity is within this share of the stroke's median.

Chosen: more than three times `_VELOCITY_NOISE`, so that noise leaves steady samples in."""

_VELOCITY_NOISE = 0.015
"""Noise of the velocity over the usual speed; the derivative window grows until it is reached.

Chosen: see `_STEADY`."""

_ONSET_SHARE = 0.05
"""Share of a stroke's length that is fitted to locate the onset.

Chosen: several time constants of the bench's stem; further on the rate of force may change."""

_SHORTEST_RECORD = 20
"""Fewest derivative windows in a record: the window grows no further.

Chosen: five strokes each way hold two windows each."""


class BreakawayPoint(NamedTuple):
    """Where a resting stem begins to slide: P1 of the valve signature on the way up, P2 down.

    Time since the first sample, s; stem position of the rest, m; drive (pressure, Pa, or force, N)
    and actuator force F_ext, N, at that instant; and the speed at which the stem leaves, m/s: above
    zero after a visible slip jump.
    """

    time: float
    position: float
    drive: float
    force: float
    speed: float


class SteadySliding(NamedTuple):
    """The instants of a stroke at which the stem slides at a constant speed, shape (n,) each.

    Time since the first sample, s; stem position, m; actuator force F_ext, N; stem velocity, m/s;
    and the derivative of the force with time, N/s.
    """

    time: NDArray[np.float64]
    position: NDArray[np.float64]
    force: NDArray[np.float64]
    velocity: NDArray[np.float64]
    force_rate: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SignatureStroke:
    """One stroke of the stem: its direction, +1 up or −1 down, and its instants at constant speed.

    `breakaway` is None without a recorded rest before it; `steadiness` is the share of the stroke's
    length at constant speed.
    """

    direction: int
    breakaway: BreakawayPoint | None
    steadiness: float
    sliding: SteadySliding = field(repr=False)

    @property
    def spring_constant(self) -> float:
        """Mean of (15) over the distance that the stem slides, N/m.

        The mean over the distance, Σ dF_ext / Σ dx, equals the mean over the instants at a constant
        speed, and noise of the speed does not bias it.
        """
        return float(np.sum(self.sliding.force_rate) / np.sum(self.sliding.velocity))


def _usual_speed(speed: NDArray[np.float64]) -> float:
    """Return the median speed, m/s, of the moving stem."""
    return float(np.median(speed[speed >= _LEAST_SPEED_SHARE * speed.max()]))


def velocity_window(recording: Recording) -> int:
    """Return a derivative window, samples, with noise of at most 1.5 % of the usual speed."""
    record, period = measured(recording), recording.sample_period
    window = record.fitting_window(_ORDER)
    while window <= len(recording) // _SHORTEST_RECORD:
        velocity = record.derivatives(window, _ORDER).velocity
        allowed = _VELOCITY_NOISE * _usual_speed(np.abs(velocity))
        if velocity_noise(record.white_noise, period, window, _ORDER) <= allowed:
            break
        window = (3 * window // 2) | 1
    return window


def find_strokes(recording: Recording, valve: Valve, window: int) -> tuple[SignatureStroke, ...]:
    """Cut a record into strokes, and find the breakaway and the steady part of each, in time order.

    A stroke is a run at more than half the usual speed over at least a tenth of the stem's range.
    The breakaway is located by `fit_onset`, from the rest before the stroke and the first 5 % of
    its length; a parabola through as many samples gives the drive there. The derivative window,
    samples, is odd (`velocity_window`).
    """
    position, period = recording.position, recording.sample_period
    force = valve.actuator_force(recording.drive)
    if len(recording) < window:
        return ()
    velocity, _, margin = measured(recording).derivatives(window, _ORDER)
    force_rate, _, _ = differentiate(force, period, window, _ORDER)
    speed = np.abs(velocity)
    usual = _usual_speed(speed)
    still = speed < _REST_SHARE * usual
    span = float(np.ptp(position))
    strokes = []
    last_end = 0
    for begin, end in runs_of(speed > _RUN_SHARE * usual):
        way = position[end - 1 + margin] - position[begin + margin]
        direction = 1 if way > 0 else -1
        run = velocity[begin:end]
        if abs(way) < _LEAST_STROKE_SHARE * span or (direction * run < 0).any():
            continue
        steady = begin + _steady_instants(run)
        sliding = SteadySliding(
            recording.time[steady + margin],
            position[steady + margin],
            force[steady + margin],
            velocity[steady],
            force_rate[steady],
        )
        rests = [(a + last_end, b + last_end) for a, b in runs_of(still[last_end:begin])]
        rest = max(rests, key=lambda one: one[1] - one[0], default=(begin, begin))
        strokes.append(
            SignatureStroke(
                direction,
                _breakaway(recording, valve, (rest[0], begin, end), window),
                float(np.sum(np.abs(velocity[steady])) / np.sum(np.abs(run))),
                sliding,
            )
        )
        last_end = end
    return tuple(strokes)


def _steady_instants(run: NDArray[np.float64]) -> NDArray[np.intp]:
    """Find the steady samples of a run, within its longest nearly steady stretch.

    Elsewhere a stem that jumps or stops passes through the steady velocity.
    """
    pace = float(np.median(run))
    distance = np.abs(run - pace)
    begin, end = max(runs_of(distance <= 2 * _STEADY * abs(pace)), key=lambda one: one[1] - one[0])
    return begin + np.flatnonzero(distance[begin:end] <= _STEADY * abs(pace))


def _breakaway(
    recording: Recording, valve: Valve, places: tuple[int, int, int], window: int
) -> BreakawayPoint | None:
    """Locate the onset of a stroke, from the first samples of its rest and motion, and its end.

    A derivative window shows a jump half its length too early, so the fit is half a window longer.
    """
    rest, begin, end = (place + window // 2 for place in places)
    position, period = recording.position, recording.sample_period
    moved = np.abs(position[begin:end] - position[begin])
    length = int(np.argmax(moved > _ONSET_SHARE * moved[-1])) + window // 2
    first = max(rest, begin - length)
    if begin - first < max(length // 4, _FEWEST) or length < _FEWEST:
        return None
    around = slice(first, begin + length)
    time = recording.time[around]
    drive_then = Polynomial.fit(time, recording.drive[around], 2)
    rate = float(drive_then.deriv()(begin * period))
    growth = float(drive_then.deriv(2)(begin * period)) / rate if rate else 0.0
    most = 1 / float(time[-1] - time[0])
    growth = min(max(growth, -most), most)
    onset = fit_onset(time, position[around], begin * period, growth)
    middle = round(onset.time / period)
    near = slice(max(middle - length // 2, first), middle + length // 2 + 1)
    drive = float(Polynomial.fit(recording.time[near], recording.drive[near], 2)(onset.time))
    return BreakawayPoint(
        onset.time,
        onset.level,
        drive,
        valve.actuator_force(drive),
        onset.jump_speed,
    )


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
    """Return k of (15), N/m, the mean over all strokes; RefusalError if it is not above zero."""
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
        np.mean([np.mean(one.force - spring_constant * one.position) for one in slidings])
        for slidings in ([stroke.sliding for stroke in way] for way in ways)
    )
    return 0.5 * float(upward - downward)


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
