# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A stamped record prepared for the fit: a force to simulate with, a stem to compare with."""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from sys import float_info
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.held_signals import without_repeats
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.trust.uncertainty import MEDIAN_MAGNITUDE
from valve_friction_ros.model.recording import StampedRecord, StampedSignal
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import (
    rounding_noise,
    runs_of,
    smooth_between,
    smoothing_leverage,
    smoothing_of,
    stamped_noise,
)

_LONGEST_PERIOD = 5e-3
"""Longest step of the simulation, s: within it a corner of the pressure may lie."""

_MOST_STEPS = 12_500
"""Steps of the simulation in a record; those of a longer record are longer, up to four times."""

_MOST_FINE_STEPS = 5_000_000
"""Steps finer than the samples. Chosen: 28 h, some GB; a wrong unit of time asks for far more."""

_MOST_SAMPLES = 64_000
"""Steps of a record whose pressure cannot be smoothed: there they are means of its samples."""

_NOISELESS = 1e-6
"""Least noise over the range of a signal that was measured.

A drive with less was simulated, and is used unchanged; a stem is taken to have at least as much."""

_SAMPLES_A_WINDOW = 32
_SLOW = 0.1
"""Time, s, over which the measured stem is averaged, twice, to evaluate slow terms along it."""

LOW_SPEED = 3e-3
"""Speed, m/s, below which packings are known to hold faster: the v_s published for graphite."""

_CALM = 1e-3
"""Noise of the speed, over `LOW_SPEED`, to which longer averages reduce it: through a friction that
falls with speed, the simulated stem would follow the noise of the measured one."""

_CALM_PARTS = 20
"""Parts of the record; the speed is averaged over one of them at most."""

_GAP_PERIODS = 10
_GAP_TIME = 0.05
"""Pauses longer than this many periods, and this time, s, are gaps: the motion there is lost."""

_LINE_TIME = 0.05
_LINE_SAMPLES = 4
_SURELY = 5.0
"""Standard errors by which a stem must move at the start, to be set moving."""

_MEMORY = 2.5
"""Length of the smoothing window over the length through which its error stays the same."""

_FEWEST = 100
_STILL = 0.01
_STILL_NOISE = 4.0
"""Speed below which the averaged stem rests: share of its top speed, or deviations of its noise."""

_REST_MEAN = 0.1
_REST_MARGIN = 0.15
"""Time, s, over which the place of a rest is averaged, and before the averaged stem leaves it."""


@dataclass(frozen=True, eq=False)
class SlowView:
    """Slow terms along the measured stem and along time, at each step of the simulation.

    Place and age run from −1 at the lowest position and the beginning to 1 at the highest and the
    end. Velocity, m/s, and actuator force, N, are averaged alike; `slowness` is
    exp(−speed/`LOW_SPEED`), with the speed averaged until its noise hardly matters.
    """

    place: NDArray[np.float64]
    age: NDArray[np.float64]
    speed: NDArray[np.float64]
    slowness: NDArray[np.float64]
    velocity: NDArray[np.float64]
    force: NDArray[np.float64]
    lowest: float
    highest: float

    @property
    def range(self) -> float:
        """Distance between the ends, m."""
        return self.highest - self.lowest


@dataclass(frozen=True, eq=False)
class FittedRecord:
    """A record prepared for the fit: g steps of a simulation, and c cells of the stem's samples.

    Attributes
    ----------
    period, travel, lost, start : float
        Step, s; travel, m; time in gaps, s; position at the first step, m.
    force, halves : ndarray of float, shapes (g,) and (2, g)
        Smoothed actuator force, N; the same from the even samples alone and from the odd samples,
        whose noise is independent.
    anew, leaving : ndarray of float, shape (g,)
        Position to which the stem is reset after a gap, m, nan elsewhere; and its velocity there
        and at the start, m/s.
    cells, time, samples : ndarray of float, shape (c,)
        Mean stamp of the positions between two steps, in steps and in s; and their number.
    position, noise : ndarray of float, shape (c,), and float
        Mean position in each cell, and deviation of the noise of one sample, m.
    force_variance, memory : ndarray of float, shape (c,), and float
        Variance of the smoothed force, N², and cells through which its error stays the same.
    slow : SlowView
        Slow terms.
    """

    period: float
    force: NDArray[np.float64] = field(repr=False)
    halves: NDArray[np.float64] = field(repr=False)
    anew: NDArray[np.float64] = field(repr=False)
    leaving: NDArray[np.float64] = field(repr=False)
    cells: NDArray[np.float64] = field(repr=False)
    position: NDArray[np.float64] = field(repr=False)
    time: NDArray[np.float64] = field(repr=False)
    samples: NDArray[np.float64] = field(repr=False)
    noise: float
    force_variance: NDArray[np.float64] = field(repr=False)
    memory: float
    slow: SlowView = field(repr=False)
    travel: float
    lost: float
    start: float

    @property
    def duration(self) -> float:
        """Time from the first step to the last, s."""
        return (self.force.size - 1) * self.period

    @cached_property
    def still(self) -> NDArray[np.bool_]:
        """Steps at which the measured stem rests, shape (g,).

        The derivative of a signal averaged twice over T, with n samples in it, has the noise
        s·√(2/n)/T.
        """
        averaged = max(float(np.sum(self.samples)) * _SLOW / self.duration, 1.0)
        noise = self.noise * math.sqrt(2.0 / averaged) / _SLOW
        top = float(np.quantile(self.slow.speed, 0.98))
        return self.slow.speed < max(_STILL * top, min(_STILL_NOISE * noise, 0.2 * top))


class _Smoothed(NamedTuple):
    """A signal smoothed over a `window` of steps, its halves, (2, g), and its variance, (g,)."""

    whole: NDArray[np.float64]
    halves: NDArray[np.float64]
    variance: NDArray[np.float64]
    window: int

    def at(self, grid: NDArray[np.float64], steps: NDArray[np.float64]) -> "_Smoothed":
        """Return the signal at other steps."""
        whole, even, odd, variance = (
            np.interp(steps, grid, row) for row in (self.whole, *self.halves, self.variance)
        )
        return _Smoothed(whole, np.stack([even, odd]), variance, self.window)

    def averaged(self, length: int) -> "_Smoothed":
        """Return means over `length` steps about each step; their variance stays as it is."""
        whole, even, odd = (_averaged(row, length) for row in (self.whole, *self.halves))
        return _Smoothed(whole, np.stack([even, odd]), self.variance, self.window)


def _averaged(signal: NDArray[np.float64], length: int) -> NDArray[np.float64]:
    """Average over `length` samples about each, the outermost by half if even."""
    half = length // 2
    kernel = np.full(2 * half + 1, 1.0 / length)
    if length % 2 == 0:
        kernel[[0, -1]] /= 2.0
    return np.asarray(np.convolve(np.pad(signal, half, mode="edge"), kernel, "valid"))


def _noise_on_grid(signal: StampedSignal, grid: NDArray[np.float64], noise: float) -> float:
    """Return the deviation of white noise that averages as the interpolated noise does.

    A sample with the weight of w steps adds w²·s² to the variance of a sum of steps.
    """
    after = np.clip(np.searchsorted(signal.time, grid, side="right"), 1, signal.time.size - 1)
    share = (grid - signal.time[after - 1]) / (signal.time[after] - signal.time[after - 1])
    share = np.clip(share, 0.0, 1.0)
    counts = np.bincount(after, share, signal.time.size)
    counts += np.bincount(after - 1, 1.0 - share, signal.time.size)
    return noise * math.sqrt(float(np.sum(counts**2)) / grid.size)


_OF_FOURTH = math.sqrt(70.0)
"""Deviation of the fourth differences of white noise, over its own: 1, 4, 6, 4 and 1 squared."""


def _roughness(values: NDArray[np.float64]) -> float:
    """Return the deviation of white noise by fourth differences, including rounding.

    They hold no curvature, which `stamped_noise` takes for noise where a signal has none.
    """
    white = float(np.median(np.abs(np.diff(values, 4)))) / (MEDIAN_MAGNITUDE * _OF_FOURTH)
    return math.hypot(white, rounding_noise(values))


def _smoothed(signal: StampedSignal, grid: NDArray[np.float64]) -> _Smoothed:
    """Smooth a signal between its corners."""
    period = float(grid[1] - grid[0])
    whole = np.interp(grid, signal.time, signal.value)
    noise = _noise_on_grid(signal, grid, stamped_noise(signal))
    if min(noise, _roughness(signal.value)) < _NOISELESS * float(np.ptp(whole)):
        return _Smoothed(whole, np.stack([whole, whole]), np.zeros(grid.size), 1)
    corners, window = smoothing_of(whole, noise, period)
    if window == 1:
        return _Smoothed(whole, np.stack([whole, whole]), np.full(grid.size, noise**2), window)
    parts = [np.interp(grid, signal.time[i::2], signal.value[i::2]) for i in (0, 1)]
    whole, even, odd = (smooth_between(one, corners, window) for one in (whole, *parts))
    variance = noise**2 * smoothing_leverage(grid.size, corners, window)
    return _Smoothed(whole, np.stack([even, odd]), variance, window)


def _averaged_twice(signal: NDArray[np.float64], length: int) -> NDArray[np.float64]:
    """Average over `length` samples, twice; the ends are held."""
    kernel = np.full(length, 1.0 / length)
    for _ in range(2):
        padded = np.pad(signal, length, mode="edge")
        signal = np.convolve(padded, kernel, "same")[length:-length]
    return signal


def _gaps(signal: StampedSignal, grid: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which steps lie in a gap of the signal."""
    pauses = np.diff(signal.time)
    longest = max(_GAP_PERIODS * signal.period, _GAP_TIME)
    lost = np.zeros(grid.size, dtype=np.bool_)
    for index in np.flatnonzero(pauses > longest).tolist():
        lost |= (grid > signal.time[index]) & (grid < signal.time[index + 1])
    return lost


def _line(stem: StampedSignal, noise: float, begin: float) -> tuple[float, float]:
    """Return place and velocity of the stem at `begin`; the velocity is 0 where it may be noise."""
    first = int(np.searchsorted(stem.time, begin))
    last = max(int(np.searchsorted(stem.time, begin + _LINE_TIME)), first + _LINE_SAMPLES)
    since, place = stem.time[first:last] - begin, stem.value[first:last]
    if since.size < 3:
        return float(place[0] if place.size else stem.value[-1]), 0.0
    spread = float(np.sqrt(np.sum((since - since.mean()) ** 2)))
    velocity, intercept = np.polyfit(since, place, 1).tolist()
    if abs(velocity) * spread < _SURELY * noise:
        return float(np.median(place)), 0.0
    return intercept, velocity


def _set_anew(
    lost: NDArray[np.bool_], grid: NDArray[np.float64], stem: StampedSignal, noise: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return place and velocity of the stem at the first step and after each gap.

    The place is nan elsewhere, and at the first step, where the fit finds it.
    """
    anew, leaving = np.full(grid.size, np.nan), np.zeros(grid.size)
    leaving[0] = _line(stem, noise, float(stem.time[0]))[1]
    for step in (np.flatnonzero(lost[:-1] & ~lost[1:]) + 1).tolist():
        if grid[step] < stem.time[-1]:
            anew[step], leaving[step] = _line(stem, noise, float(grid[step]))
    return anew, leaving


def _require_enough(positions: int, inside: int) -> None:
    """Refuse a record with few positions, in all or `inside` the time of both signals."""
    if positions < _FEWEST:
        raise RefusalError(
            f"the record has only {positions} positions, a repeated value taken once (at least "
            f"{_FEWEST} are needed): record longer, sample faster, or export it without compression"
        )
    if inside < _FEWEST:
        raise RefusalError(
            f"the two signals overlap in only {inside} positions (at least {_FEWEST} are needed): "
            "their clocks differ, or the record is too short"
        )


def fitted_record(record: StampedRecord, valve: Valve) -> FittedRecord:
    """Smooth the pressure on a uniform grid, and leave the stem at its own stamps.

    The pressure is smooth except at its corners, so it may be interpolated; the positions may not.
    The simulated stem is read where the stem was stamped, so jitter, drops and rates cost no more
    than the samples that they take. The positions of one step are averaged, which loses nothing.

    Raises RefusalError if the signals have too little time in common, or far too much for their
    sampling.
    """
    sampled, measured = without_repeats(record.drive), without_repeats(record.position)
    begin = max(sampled.time[0], measured.time[0])
    end = min(sampled.time[-1], measured.time[-1])
    inside = (measured.time >= begin) & (measured.time <= end)
    _require_enough(measured.time.size, np.count_nonzero(inside))
    stem = StampedSignal(measured.time[inside] - begin, measured.value[inside])
    drive = StampedSignal(sampled.time - begin, sampled.value)
    finest = min(stem.period, drive.period)
    grid: NDArray[np.float64] = np.arange(0.0, end - begin, finest, dtype=np.float64)
    pressure = _smoothed(drive, grid)
    longest = min(max((end - begin) / _MOST_STEPS, _LONGEST_PERIOD), 4.0 * _LONGEST_PERIOD)
    if finest > longest:
        if end - begin > _MOST_FINE_STEPS * longest:
            raise RefusalError(
                f"the record is too long for its sampling: {(end - begin) / 3600:.3g} h with a "
                f"sample every {finest:.3g} s; use a stretch of "
                f"{_MOST_FINE_STEPS * longest / 3600:.0f} h at most, and check the time unit"
            )
        period = finest / math.ceil(finest / longest - 1e-9)
        fine = np.arange(0.0, grid[-1], period, dtype=np.float64)
        pressure, grid = pressure.at(grid, fine), fine
    else:
        stride = max(min(pressure.window // _SAMPLES_A_WINDOW, int(longest / finest + 1e-9)), 1)
        if grid.size > _MOST_SAMPLES * stride and pressure.variance.any():
            stride = math.ceil(grid.size / _MOST_SAMPLES)
            pressure = pressure.averaged(stride)
        period = stride * finest
        pressure, grid = pressure.at(grid, grid[::stride]), grid[::stride]
    lost = _gaps(drive, grid) | _gaps(stem, grid)
    place = stem.time / period
    step = np.minimum(place.astype(np.intp), grid.size - 2)
    share = place - step
    used = (share <= 1.0) & ~(lost[step] | lost[step + 1])
    step, share = step[used], share[used]
    first, cell, count = np.unique(step, return_inverse=True, return_counts=True)
    weight: NDArray[np.float64] = 1.0 / count[cell]
    position = np.bincount(cell, weight * stem.value[used])
    time = np.bincount(cell, weight * stem.time[used])
    force = valve.actuator_force(pressure.whole)
    stem_noise = max(stamped_noise(stem), _NOISELESS * float(np.ptp(position)))
    return FittedRecord(
        period,
        force,
        valve.actuator_force(pressure.halves),
        *_set_anew(lost, grid, stem, stem_noise),
        first + np.bincount(cell, weight * share),
        np.asarray(position, dtype=np.float64),
        np.asarray(time, dtype=np.float64),
        count.astype(np.float64),
        stem_noise,
        np.interp(time, grid, pressure.variance) * valve.force_per_drive**2,
        max(pressure.window * finest / (_MEMORY * period), 1.0),
        _slow_view(
            np.interp(grid, time, position),
            force,
            period,
            stem_noise * math.sqrt((end - begin) / used.size),
        ),
        valve.travel,
        float(np.count_nonzero(lost)) * period,
        _line(stem, stem_noise, float(stem.time[0]))[0],
    )


def _slow_view(
    position: NDArray[np.float64], force: NDArray[np.float64], period: float, density: float
) -> SlowView:
    """Average stem and force, given at each step; `density` is the stem's noise, m·√s.

    Averaged twice over T, the speed has the noise √2·density/T^1.5.
    """
    length = max(round(_SLOW / period), 1)
    stem = _averaged_twice(position, length)
    velocity = np.gradient(stem, period)
    calm = (math.sqrt(2.0) * density / (_CALM * LOW_SPEED)) ** (2.0 / 3.0)
    longest = min(round(calm / period), stem.size // _CALM_PARTS)
    calmer = _averaged_twice(velocity, longest) if longest > length else velocity
    lowest, highest = float(stem.min()), float(stem.max())
    return SlowView(
        (2.0 * stem - lowest - highest) / max(highest - lowest, float_info.min),
        np.linspace(-1.0, 1.0, stem.size, dtype=np.float64),
        np.abs(velocity),
        np.exp(-np.abs(calmer) / LOW_SPEED),
        velocity,
        _averaged_twice(force, length),
        lowest,
        highest,
    )


def set_anew_at_rests(record: FittedRecord) -> FittedRecord:
    """Return the record with the stem reset to its measured position at the end of each rest.

    A resting stem has forgotten all but its position, so each move is independent: a single jump
    that is simulated at the wrong time then spoils no other. The price is the noise of that
    position. A stem that clearly creeps does not rest.
    """
    positions = np.interp(
        np.arange(record.force.size) * record.period, record.time, record.position
    )
    anew = record.anew.copy()
    mean, margin = (max(round(time / record.period), 1) for time in (_REST_MEAN, _REST_MARGIN))
    averaged = max(float(np.sum(record.samples)) * _REST_MEAN / record.duration, 1.0)
    creeping = _SURELY * record.noise * math.sqrt(4.0 / averaged)
    for begin, end in runs_of(record.still):
        last = end - margin
        if last - mean > begin and last > 0:
            rest = positions[last - mean : last]
            if abs(np.mean(rest[mean // 2 :]) - np.mean(rest[: mean // 2 + 1])) < creeping:
                anew[last] = float(np.mean(rest))
    return replace(record, anew=anew)


_MOVING = 0.1
_FEWEST_BLOCKS = 8


def reading_weights(record: FittedRecord, spring_constant: float) -> NDArray[np.float64]:
    """Return one over the effective deviation of each cell, 1/m.

    The noise of the stem is white: s_x²/n in a cell of n samples. The noise of the smoothed force,
    of variance s_F², moves the stem by s_F/k, equally in all cells over which it lasts: those of
    the smoothing window, or of a rest, which keeps the error at the stop. L such cells have the
    weight of one if each has the variance s_x²/n + L·s_F²/k².
    """
    still = record.still[np.rint(record.cells).astype(np.intp)]
    lasting = np.full(still.size, record.memory)
    variance = record.force_variance.copy()
    reach = math.ceil(record.memory)
    for begin, end in runs_of(still):
        at_stop = record.force_variance[max(begin - reach, 0) : begin + reach]
        variance[begin:end] = np.max(at_stop)
        lasting[begin:end] = max(end - begin, record.memory)
    white = record.noise**2 / record.samples
    weights: NDArray[np.float64] = 1.0 / np.sqrt(white + lasting * variance / spring_constant**2)
    return weights


def stroke_cells(record: FittedRecord) -> int:
    """Return the mean number of cells between two reversals of the measured stem."""
    velocity = record.slow.velocity
    moving = velocity[np.abs(velocity) > _MOVING * np.max(np.abs(velocity))]
    reversals = int(np.count_nonzero(np.diff(np.sign(moving))))
    return record.position.size // (reversals + 1)


def inflation(scaled: NDArray[np.float64], stroke: int) -> float:
    """Return the variance of the mean of scaled residuals over that of independent ones, ≥ 1.

    Blocks of 1, 2, 4 … cells up to a stroke are averaged; the result is the largest product of
    their length and the mean square of their averages. It is 1 for noise as foreseen, and grows
    with the size and the duration of a misfit.
    """
    largest, length = max(float(np.mean(scaled**2)), 1.0), 2
    while length <= stroke and scaled.size // length >= _FEWEST_BLOCKS:
        blocks = scaled.size // length
        means = scaled[: blocks * length].reshape(blocks, length).mean(axis=1)
        largest = max(largest, length * float(np.mean(means**2)))
        length *= 2
    return largest
