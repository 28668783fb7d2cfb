# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Response of a valve to steps of its input: T_d, T63, T86, overshoot, gain, dead band, resolution.

These are the figures that ANSI/ISA-75.25.01, *Test Procedure for Control Valve Response
Measurement from Step Inputs*, asks for; the attributes state how each is computed here. The input
may be a command signal or a pressure, in any unit. With input and position both in percent of
their spans the gain is the response gain of the standard.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.checks import equal_by_fields, require_positive
from valve_friction_ros.signals import (
    find_corners,
    longest_faithful_window,
    position_noise,
    sensor_noise,
    smooth_between,
)

_GATE = 6.0
"""Standard deviations of the noise beyond which a sample has left its level: 2 of 10⁹ by chance."""

_LEAST_SHARE = 1e-6
"""Noise assumed for a noiseless signal, as a share of its range.

Chosen: above rounding, below every step."""

_LEVEL_SAMPLES = 10
"""Samples of a level. Chosen: their mean has a third of the noise of one sample."""

_JUMP_SAMPLES = 3
"""Samples within which a command has jumped. Chosen: three in a row are not a single glitch."""

_JUMP_SHARE = 0.9
"""Share of the change that these samples hold in a jump. Chosen: a lag of 30 samples reaches
0.1."""

_CORNER_SAMPLES = 40
"""Samples on either side of a corner over which slopes are compared (`find_corners`).

Chosen: 40 ms at 1 kHz, as for a pressure, short against the lag of a converter. A number of
samples, because the function does not know the sample period: at 10 Hz it is 4 s."""


def find_steps(signal: NDArray[np.float64]) -> list[int]:
    """Find the samples at which a signal leaves its level for another.

    A command jumps: the first of three samples in a row beyond six standard deviations of the
    noise from the level before begins the step. A pressure behind a lag bends instead, and its
    steps begin where its slope jumps (`find_corners`). Without noise a millionth of the range
    takes the place of its standard deviation.

    Parameters
    ----------
    signal : ndarray of float, shape (n,)
        Input signal, at least ten samples per level.

    Returns
    -------
    list of int
        Increasing; empty for a signal on one level.
    """
    # A command has levels without noise; they are not codes of a converter.
    measured = position_noise(signal) > 0
    noise = max(sensor_noise(signal) if measured else 0.0, _LEAST_SHARE * float(np.ptp(signal)))
    if noise == 0 or signal.size <= _LEVEL_SAMPLES:
        return []
    starts = _departures(signal, _GATE * noise)
    edges = [] if starts is None else [*starts, signal.size]
    if starts is not None and all(_is_jump(signal, a, b) for a, b in pairwise(edges)):
        return starts
    return [int(corner) for corner in find_corners(signal, noise, _CORNER_SAMPLES)]


def _is_jump(signal: NDArray[np.float64], start: int, end: int) -> bool:
    """Return whether three samples hold nearly the whole change."""
    before = float(np.mean(signal[max(start - _LEVEL_SAMPLES, 0) : start]))
    at_once = float(np.mean(signal[start : start + _JUMP_SAMPLES])) - before
    in_the_end = float(np.mean(signal[max(end - _LEVEL_SAMPLES, start) : end])) - before
    return abs(at_once) >= _JUMP_SHARE * abs(in_the_end)


def _departures(signal: NDArray[np.float64], gate: float) -> list[int] | None:
    """Find where a signal leaves a level, which lasts ten samples at least, by more than `gate`.

    None where it takes more than three samples to reach the next level.
    """
    windows = np.lib.stride_tricks.sliding_window_view(signal, _LEVEL_SAMPLES)
    levels = np.flatnonzero(np.ptp(windows, axis=1) <= 2 * gate)
    starts: list[int] = []
    begin = 0
    while (place := int(np.searchsorted(levels, begin))) < levels.size:
        if starts and levels[place] > begin + _JUMP_SAMPLES:
            return None
        begin = int(levels[place])
        away = np.abs(signal[begin:] - np.mean(signal[begin : begin + _LEVEL_SAMPLES])) > gate
        lasting = np.convolve(away, np.ones(_JUMP_SAMPLES), "valid") == _JUMP_SAMPLES
        if not lasting.any():
            break
        begin += int(np.argmax(lasting))
        starts.append(begin)
    return starts


_T63 = -math.expm1(-1.0)
_T86 = -math.expm1(-2.0)
"""Shares that a first-order lag reaches after one and two time constants (ANSI/ISA-75.25.01)."""

_SETTLED_SHARE = 0.05
"""Share of a hold, at its end, that gives the steady value. Chosen: long enough to average
noise."""

_VISIBLE = 5.0
"""Standard deviations of the smoothed noise above which a movement counts: 6 of 10⁷ by chance."""

_LEAST_VISIBLE = 1e-3
"""Least movement that counts, as a share of the stem's range.

Chosen: about the movement of a stem that still settles after a hold of 10 s."""

_LONGEST_SMOOTHING = 0.2
"""Longest window that smooths the position, s. Chosen: it bounds the error of a dead time. It is
absolute, and does not follow the speed of the valve."""

_NO_CORNERS = np.empty(0, dtype=np.intp)
"""A position has inertia: its slope does not jump."""


class Bracket(NamedTuple):
    """Bounds of a quantity, in the unit of the input.

    The largest change of the input that the stem ignored, 0 if it ignored none; and the smallest
    that it answered, infinite if it answered none.
    """

    ignored: float
    answered: float


@equal_by_fields
@dataclass(frozen=True)
class StepMetrics:
    """Response to one step of the input.

    Attributes
    ----------
    time : float
        Beginning of the step, s since the first sample.
    input_change : float
        Steady input after minus before the step, unit of the input. Steady values are
        means over the last twentieth of the time before the next step.
    output_change : float
        Steady position after minus before the step, unit of the position.
    moved : bool
        Whether the position changed by more than its noise.
    dead_time : float
        T_d: from the beginning of the step to the first detectable movement in its direction, s.
    t63, t86 : float
        From the beginning of the step to 63.2 % (1 − 1/e) and 86.5 % (1 − 1/e²) of the steady
        change, s, dead time included. A first-order lag τ behind a delay has T_d + τ and T_d + 2·τ.
    overshoot : float
        How far the position goes beyond its final steady value, as a share of the steady change.

    Notes
    -----
    Times and overshoot are nan where the stem did not move.
    """

    time: float
    input_change: float
    output_change: float
    moved: bool
    dead_time: float
    t63: float
    t86: float
    overshoot: float

    @property
    def gain(self) -> float:
        """Steady-state gain: change of the position over change of the input."""
        return self.output_change / self.input_change


@equal_by_fields
@dataclass(frozen=True)
class StepTest:
    """Step responses, dead band and resolution from a record of steps.

    Attributes
    ----------
    steps : tuple of StepMetrics
        In time order.
    dead_band : Bracket
        Range of the input, after a reversal, without a movement. Lower bound: the largest range
        that the input swept while the stem rested. Upper bound: the smallest change that moved
        the stem at a reversal directly after a movement.
    resolution : Bracket
        Smallest change of the input, in the direction of the last movement, that moves the stem.
        Lower bound: the largest such change, over several steps, without a movement. Upper
        bound: the smallest such change with a movement.
    smallest_movement : float
        Least movement that counts, unit of the position.
    """

    steps: tuple[StepMetrics, ...]
    dead_band: Bracket
    resolution: Bracket
    smallest_movement: float

    def __str__(self) -> str:
        """Return dead band and resolution, and the response to each step, one line each."""
        brackets = (
            f"{name} between {bracket.ignored:.4g} and {bracket.answered:.4g}"
            for name, bracket in (("dead band", self.dead_band), ("resolution", self.resolution))
        )
        rows = (
            f"step of {step.input_change:.4g}: gain {step.gain:.4g}, dead time "
            f"{step.dead_time:.3g} s, T63 {step.t63:.3g} s, T86 {step.t86:.3g} s, overshoot "
            f"{step.overshoot:.3g}"
            for step in self.steps
        )
        return "\n".join([*brackets, *rows])


def step_test(
    input_signal: ArrayLike,
    position: ArrayLike,
    sample_period: float,
    starts: Sequence[int] | None = None,
    smallest_movement: float | None = None,
) -> StepTest:
    """Evaluate a record of steps, such as the test of ANSI/ISA-75.25.01.

    Parameters
    ----------
    input_signal : array_like of float, shape (n,)
        Command signal or pressure, any unit.
    position : array_like of float, shape (n,)
        Stem position, any unit. Take both signals from a recording without a `gap`.
    sample_period : float
        Time between two samples, s.
    starts : sequence of int, optional
        Sample at which each step begins, increasing; by default found in the input (`find_steps`).
        Steps smaller than the noise of a measured input are not found.
    smallest_movement : float, optional
        Change of the position that counts as a movement; by default five standard deviations of
        the smoothed noise of the position, and at least 0.1 % of its range in the record, about
        the movement of a stem that still settles after a hold.

    Returns
    -------
    StepTest
        Response to each step, dead band and resolution.

    Raises
    ------
    ValueError
        If the signals differ in length, hold values that are not finite, or a step lies outside.
    RefusalError
        If the input has no step.

    Examples
    --------
    A command of two steps, and a stem that follows it with a lag of 0.5 s.

    >>> import numpy as np
    >>> import valve_friction_ros as vf
    >>> time = np.arange(4000) / 100
    >>> command = np.where(time < 10, 0.2, np.where(time < 25, 0.5, 0.3))
    >>> lag = 1 - np.exp(-np.maximum(time - 10, 0) / 0.5)
    >>> back = 1 - np.exp(-np.maximum(time - 25, 0) / 0.5)
    >>> test = vf.step_test(command, 0.2 + 0.3 * lag - 0.2 * back, sample_period=0.01)
    >>> len(test.steps)
    2
    """
    period = require_positive("sample_period", sample_period)
    signal, measured = _rows(input_signal, position)
    edges = [*(find_steps(signal) if starts is None else starts), signal.size]
    if len(edges) == 1:
        raise RefusalError(
            "the input contains no step: record steps, or give the samples at which they begin"
        )
    if edges[0] < 1 or min(np.diff(edges)) < 1:
        raise ValueError(f"steps must begin at increasing samples from 1 to {signal.size - 1}")
    smooth, noise = _smoothed(measured, period)
    least = smallest_movement
    if least is None:
        least = max(_VISIBLE * noise, _LEAST_VISIBLE * float(np.ptp(measured)))
    holds = [slice(a, b) for a, b in zip([0, *edges[:-1]], edges, strict=True)]
    inputs = [_steady(signal[hold]) for hold in holds]
    outputs = [_steady(measured[hold]) for hold in holds]
    steps = tuple(
        _metrics(smooth[hold], hold.start * period, period, (u, y), least)
        for hold, u, y in zip(holds[1:], pairwise(inputs), pairwise(outputs), strict=True)
    )
    return StepTest(steps, _dead_band(inputs, steps), _resolution(steps), least)


def _rows(
    input_signal: ArrayLike, position: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return both signals as rows of equal length; raises ValueError if they are not."""
    signal = np.asarray(input_signal, dtype=np.float64)
    measured = np.asarray(position, dtype=np.float64)
    if signal.ndim != 1 or signal.shape != measured.shape or signal.size == 0:
        raise ValueError(
            f"input and position must be rows of equal length, got shapes {signal.shape} and "
            f"{measured.shape}"
        )
    for name, values in (("input", signal), ("position", measured)):
        if not np.isfinite(values).all():
            raise ValueError(f"the {name} is not finite at sample {np.argmin(np.isfinite(values))}")
    return signal, measured


def _smoothed(position: NDArray[np.float64], period: float) -> tuple[NDArray[np.float64], float]:
    """Smooth a position as far as its noise requires; return it and the remaining noise."""
    noise = sensor_noise(position)
    longest = max(round(_LONGEST_SMOOTHING / period), 1)
    window = longest_faithful_window(position, _NO_CORNERS, noise, longest)
    if window == 1:
        return position, noise
    kept = 1.5 / math.sqrt(window)  # of white noise by a cubic, in the middle of its window
    return smooth_between(position, _NO_CORNERS, window), kept * noise


def _steady(hold: NDArray[np.float64]) -> float:
    """Mean of the last twentieth of a hold."""
    return float(np.mean(hold[-max(round(_SETTLED_SHARE * hold.size), 1) :]))


def first_beyond(response: NDArray[np.float64], level: float) -> float:
    """Return where a response first reaches a level, in samples, interpolated; nan if never."""
    reached = np.flatnonzero(response >= level)
    if not reached.size:
        return math.nan
    after = int(reached[0])
    if after == 0:
        return 0.0
    before = response[after - 1]
    return after - 1 + float((level - before) / (response[after] - before))


def _metrics(
    hold: NDArray[np.float64],
    time: float,
    period: float,
    steady: tuple[tuple[float, float], tuple[float, float]],
    least: float,
) -> StepMetrics:
    """Evaluate a step from the positions up to the next step and the steady values."""
    (input_before, input_after), (before, after) = steady
    input_change, output_change = input_after - input_before, after - before
    moved = abs(output_change) > least
    dead_time = t63 = t86 = overshoot = math.nan
    if moved:
        way = math.copysign(1.0, output_change)
        response = way * (hold - before)
        change = abs(output_change)
        dead_time, t63, t86 = (
            period * first_beyond(response, level)
            for level in (least, _T63 * change, _T86 * change)
        )
        beyond = float(response.max()) - change
        overshoot = beyond / change if beyond > least else 0.0
    return StepMetrics(time, input_change, output_change, moved, dead_time, t63, t86, overshoot)


def _dead_band(inputs: Sequence[float], steps: Sequence[StepMetrics]) -> Bracket:
    """Bracket the dead band by the ranges that the stem ignored and the reversals that moved it."""
    ignored, answered = 0.0, math.inf
    lowest = highest = inputs[0]
    last_way, turn = 0.0, inputs[0]
    for level, step in zip(inputs[1:], steps, strict=True):
        way = math.copysign(1.0, step.input_change)
        if step.moved:
            if way == -last_way:
                answered = min(answered, abs(level - turn))
            last_way, turn, lowest, highest = way, level, level, level
        else:
            lowest, highest = min(lowest, level), max(highest, level)
            ignored = max(ignored, highest - lowest)
    return Bracket(ignored, answered)


def _resolution(steps: Sequence[StepMetrics]) -> Bracket:
    """Bracket the resolution by changes in the direction of the last movement."""
    ignored, answered = 0.0, math.inf
    last_way, change = 0.0, 0.0
    for step in steps:
        way = math.copysign(1.0, step.input_change)
        change = change + abs(step.input_change) if way == last_way else 0.0
        if step.moved:
            if way == last_way:
                answered = min(answered, change)
            last_way, change = way, 0.0
        elif way == last_way:
            ignored = max(ignored, change)
        else:
            last_way = 0.0
    return Bracket(ignored, answered)
