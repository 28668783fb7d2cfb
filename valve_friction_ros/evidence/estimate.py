# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Friction from a ledger of moves: its value since it last changed, and that change.

Changes are found and dated in the series of sliding friction by block. Only large changes are
declared.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.evidence.balance import (
    FEWEST_BLOCKS,
    FEWEST_MOVES,
    MOST_BLOCKS,
    PRELOAD,
    SLIDING,
    SPEED,
    SPRING,
    STATIC,
    Balance,
    balance_of,
    blocks_of,
    design_of,
    priors,
    robust,
)
from valve_friction_ros.evidence.moves import Move, Moves
from valve_friction_ros.identification.settings import TIMING_UNCERTAINTY, IdentificationSettings
from valve_friction_ros.identification.trust.uncertainty import MEDIAN_MAGNITUDE
from valve_friction_ros.identification.trust.verdict import (
    WEAK_SHARE,
    Parameter,
    Verdict,
    calibrated,
    calibration_share,
    fixed,
    not_identifiable,
    with_verdict,
)
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.wording import numbered, percentage


@dataclass(frozen=True, eq=False)
class Series:
    """Sliding friction by block, at one speed and one position."""

    begin: NDArray[np.float64]
    end: NDArray[np.float64]
    """Times of the first and the last move of each block, as in `Moves`, s, shape (b,)."""
    friction: NDArray[np.float64]
    """Sliding friction, N, shape (b,)."""
    covariance: NDArray[np.float64]
    """Covariance from the scatter of moves, and from what speed and position leave undetermined,
    shape (b, b)."""
    first: NDArray[np.intp]
    """First move of each block, shape (b,)."""


def series_of(moves: Moves, travel: float) -> Series | None:
    """Return the friction by block; None with fewer than two blocks.

    Spring, speed and position have one coefficient each, determined within the blocks. Neither a
    new range of set points nor other speeds are therefore taken for a change of friction.
    """
    blocks = blocks_of(moves)
    count = int(blocks[-1]) + 1 if len(moves) else 0
    if count < 2:
        return None
    design, scales = design_of(moves, blocks)
    precision = priors(design, scales, moves, travel)
    values, weight = robust(design, design.force, precision, scales.friction)
    covariance = design.normal(weight, precision).friction_covariance()
    first = np.flatnonzero(np.diff(blocks, prepend=-1))
    last = np.append(first[1:], len(moves)) - 1
    return Series(moves.time[first], moves.time[last], values[-count:], covariance, first)


_LEAST_BLOCKS = 2
"""Least blocks on either side of a change: a single block may be an outlier."""

_SCATTER = 0.015
"""Least standard deviation of a block, as a share of the friction, however quiet it is."""

_SURE_ERRORS = 5.0
"""Standard errors from which two parts of a series differ in friction.

Normal errors exceed it once in 2·10⁶ comparisons; 1,000 hours have some 10⁵."""

_RESET_THRESHOLD = 0.04
"""Relative change from which earlier moves are dropped from the estimate."""

DECLARED = 0.15
"""Relative change from which it is declared. Chosen: well beyond what a nonlinear spring, or a
friction that varies along the travel, can imitate, and below the 25 % of the first alarm."""

_DATE = 9.0
"""Drop of the squared statistic below its maximum up to which a date is possible: 3²."""


class Split(NamedTuple):
    """A change of friction between two blocks of a series."""

    block: int
    """First block after the change."""
    earliest: float
    latest: float
    """Interval of its time, as in `Moves`, s."""
    size: float
    """Mean of all blocks after the change over the mean of all blocks before."""
    ratio: float
    """Friction after the change over friction before."""
    low: float
    high: float
    """Interval of the ratio."""

    @property
    def is_declared(self) -> bool:
        """Whether it is large enough to be declared, with and without the blocks beside it."""
        return _is_large(self.size) and _is_large(self.ratio)


def splits_of(series: Series) -> tuple[int, tuple[Split, ...]]:
    """Return the first block after the last change of a series, and its large changes.

    The test is the generalized likelihood ratio of one step over all its possible times. It is
    repeated on the blocks after the step, and before it for a large one: of two changes, the later
    may be found first. Each large change is between the blocks since the one before and to the
    next. The scatter between blocks comes from successive blocks, so slow growth of friction widens
    it little.
    """
    count = series.friction.size
    found = _steps(series, 0, count)
    edges = [0, *(block for block, size in found if _is_large(size)), count]
    parts = zip(edges, edges[1:], edges[2:], strict=False)
    splits = (_split(_Part(series, begin, end), place) for begin, place, end in parts)
    return (found[-1][0] if found else 0), tuple(splits)


def _is_large(ratio: float) -> bool:
    return abs(math.log(ratio)) >= math.log1p(DECLARED)


def _steps(series: Series, begin: int, end: int) -> list[tuple[int, float]]:
    """Return the first block after each step between two blocks, and its size as a ratio."""
    if end - begin < 2 * _LEAST_BLOCKS or not np.all(series.friction[begin:end] > 0):
        return []
    step = _step(_Part(series, begin, end))
    if step is None:
        return []
    if before := [one for one in _steps(series, begin, step[0]) if _is_large(one[1])]:
        return [*before, *_steps(series, before[-1][0], end)]
    return [step, *_steps(series, step[0], end)]


class _Part:
    """Some blocks of a series, from `begin` on, and a step of friction at each place in them.

    `old` and `new` are the means before and from each place on, N; `statistics` are their distances
    in standard errors. The places are 1, 2, … All use sums over parts of the covariance, so
    hundreds of places cost little.
    """

    def __init__(self, series: Series, begin: int, end: int) -> None:
        friction, covariance = series.friction[begin:end], series.covariance[begin:end, begin:end]
        self.series, self.begin, self.count = series, begin, friction.size
        self._sums = np.concatenate(([0.0], np.cumsum(friction)))
        self._parts = np.zeros((friction.size + 1, friction.size + 1))
        self._parts[1:, 1:] = np.cumsum(np.cumsum(covariance, axis=0), axis=1)
        self._scatter = _scatter_of(friction)
        places = np.arange(1, friction.size)
        self.old, self.new, errors = self.means(places, places)
        self.statistics = np.abs(self.new - self.old) / errors

    def means(
        self, ends: NDArray[np.intp], begins: NDArray[np.intp]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return mean before each end, mean from each begin on, and error of the difference, N."""
        sums, parts, last = self._sums, self._parts, self._sums.size - 1
        before, after = ends, last - begins
        upper = parts[ends, ends]
        lower = parts[last, last] - 2.0 * parts[last, begins] + parts[begins, begins]
        mixed = parts[ends, last] - parts[ends, begins]
        variance = upper / before**2 + lower / after**2 - 2.0 * mixed / (before * after)
        scattered = self._scatter**2 * (1.0 / before + 1.0 / after)
        errors = np.sqrt(np.maximum(variance, 0.0) + scattered)
        return sums[ends] / before, (sums[last] - sums[begins]) / after, errors


def _step(part: _Part) -> tuple[int, float] | None:
    """Return the first block after the step of a part, and its size; None without a sure step."""
    count = part.count
    inner = slice(_LEAST_BLOCKS - 1, count - _LEAST_BLOCKS)
    likeliest = inner.start + int(np.argmax(part.statistics[inner]))
    size = float(part.new[likeliest] / part.old[likeliest])
    # Few blocks need more: their scatter may be small by chance.
    sure = _SURE_ERRORS * math.sqrt(1.0 + 4.0 / count)
    if part.statistics[likeliest] < sure or max(size, 1.0 / size) < 1.0 + _RESET_THRESHOLD:
        return None
    place = int(np.argmax(part.statistics)) + 1
    if place == count - 1:  # the last block may hold the change itself, or be an outlier
        return None
    return part.begin + place, size


def _split(part: _Part, block: int) -> Split:
    """Return the step of a part at a block, with its ratio and its possible dates."""
    series, begin, statistics = part.series, part.begin, part.statistics
    best = block - begin - 1
    (possible,) = np.nonzero(statistics**2 >= statistics[best] ** 2 - _DATE)
    first, last = int(possible[0]) + begin, int(possible[-1]) + begin + 1
    # The change lies within a block next to the place, so the ratio uses neither of the two.
    ends, begins = (np.array([min(max(best + one, 1), part.count - 1)]) for one in (0, 2))
    found = part.means(ends, begins)
    before, after, error = (float(one[0]) for one in found)
    ratio, share = after / before, 2.0 * error / min(before, after)
    return Split(
        block=block,
        earliest=float(series.begin[first]),
        latest=float(series.end[min(last, series.end.size - 1)]),
        size=float(part.new[best] / part.old[best]),
        ratio=ratio,
        low=ratio * math.exp(-share),
        high=ratio * math.exp(share),
    )


def _scatter_of(friction: NDArray[np.float64]) -> float:
    """Return the standard deviation of a block, N, from differences of successive blocks."""
    steps = np.abs(np.diff(friction))
    scatter = float(np.median(steps)) / (MEDIAN_MAGNITUDE * math.sqrt(2.0))
    return max(scatter, _SCATTER * float(np.median(friction)))


MOST_MOVES = 4096
"""Most moves worth keeping in a ledger: about half a day of a valve that never rests, or weeks of a
quiet valve. Chosen: they are combined in under 0.1 s."""

_NAMES = (
    "coulomb_friction",
    "viscous_friction",
    "static_friction",
    "spring_constant",
    "spring_preload",
    "sliding_friction",
    "dead_band",
)
_MAX_SPRING_REL_HALF_WIDTH = 0.25
"""Half width of the spring constant, over its value, beyond which no dead band is given.

Chosen: moves over some tenths of the travel determine it to ±4 %, moves around one position to
±50 %; a friction that is nonlinear in speed then shifts the dead band by 10 %."""

_MEAN_SLOPE = "the change of friction with speed across the moves, whatever its law"
_COULOMB = "moves in service do not separate friction into F_c and F_v"


@equal_by_fields
@dataclass(frozen=True)
class FrictionChange:
    """A declared change of friction.

    Attributes
    ----------
    earliest, latest : int
        Interval of its time, ns since 1970 (UTC).
    ratio, low, high : float
        Sliding friction after the change over that before, with its interval.
    """

    earliest: int
    latest: int
    ratio: float
    low: float
    high: float


@equal_by_fields
@dataclass(frozen=True)
class Evidence:
    """Combined result of the moves since the last change of friction.

    Attributes
    ----------
    moves : int
        Number of moves used.
    since, until : int
        Begin of the first move and end of the last, ns since 1970 (UTC); 0 without moves.
    parameters : mapping of str to Parameter
        ``sliding_friction``, ``static_friction``, ``spring_constant``, ``spring_preload``,
        ``viscous_friction``, ``dead_band`` (m), and ``coulomb_friction``, which moves in service
        do not determine.
    sliding_speed : float
        Speed to which the sliding friction applies, m/s.
    changes : tuple of FrictionChange
        The declared changes that the ledger still shows, oldest first.
    """

    moves: int
    since: int
    until: int
    parameters: Mapping[str, Parameter]
    sliding_speed: float = math.nan
    changes: tuple[FrictionChange, ...] = ()

    @property
    def change(self) -> FrictionChange | None:
        """The last declared change that the ledger still shows."""
        return self.changes[-1] if self.changes else None

    @property
    def is_known(self) -> bool:
        """Whether the sliding friction is known."""
        return math.isfinite(self.parameters["sliding_friction"].value)


def evidence_of(
    ledger: Sequence[Move], valve: Valve, settings: IdentificationSettings | None = None
) -> Evidence:
    """Combine the moves of a ledger.

    Parameters
    ----------
    ledger : sequence of Move
        Oldest first.
    valve : Valve
        Gives the travel.
    settings : IdentificationSettings, optional
        Gives timing uncertainty, calibration and fixed spring constant.

    Returns
    -------
    Evidence
        With too few moves, all parameters are not identifiable, with the reason.
    """
    settings = settings or IdentificationSettings()
    every = Moves.of(ledger)
    timing = settings.timing_uncertainty
    timing = TIMING_UNCERTAINTY if timing is None else timing
    first, changes = _since_change(ledger, every, valve.travel, timing)
    used, moves = ledger[first:], every[first:]
    spring = settings.fixed.get("spring_constant")
    balance = balance_of(moves, timing, valve.travel, spring)
    span = (used[0].begin, used[-1].end) if used else (0, 0)
    if balance is None:
        reason = _too_few(moves, bool(changes))
        parameters = {name: not_identifiable(name, reason) for name in _NAMES}
        return Evidence(len(used), *span, parameters, math.nan, changes)
    found = {
        name: calibrated(one, calibration_share(name, settings, valve.driven_by))
        for name, one in _parameters(balance, spring).items()
    }
    share = settings.position_scale_uncertainty
    found["dead_band"] = calibrated(found["dead_band"], share)
    return Evidence(len(used), *span, found, balance.speed, changes)


def _since_change(
    ledger: Sequence[Move], every: Moves, travel: float, timing: float
) -> tuple[int, tuple[FrictionChange, ...]]:
    """Return the index of the first move after the last change, and the declared changes."""
    series = series_of(every, travel)
    if series is None:
        return 0, ()
    start, splits = splits_of(series)
    begins = [0, *(split.block for split in splits), series.first.size]
    shifts = [_lag_share(series, every, *one) for one in pairwise(begins)]
    changes = tuple(
        _change(split, ledger[0].begin, 2.0 * timing * abs(after - before))
        for split, (before, after) in zip(splits, pairwise(shifts), strict=True)
        if split.is_declared
    )
    return int(series.first[start]), changes


def _lag_share(series: Series, every: Moves, begin: int, end: int) -> float:
    """Return what a lag of 1 s adds to the friction of several blocks, as a share of it."""
    last = int(series.first[end]) if end < series.first.size else len(every)
    moves = every[int(series.first[begin]) : last]
    rate = float(np.average(moves.direction * moves.force_rate, weights=moves.distance))
    return rate / float(np.mean(series.friction[begin:end]))


def _change(split: Split, origin: int, lag: float) -> FrictionChange:
    """Return a change; its interval includes a lag, which adds the same force to both frictions."""
    earliest, latest = (origin + round(1e9 * time) for time in (split.earliest, split.latest))
    width = math.hypot(math.log(split.high / split.ratio), lag)
    ends = (split.ratio * math.exp(way * width) for way in (-1.0, 1.0))
    return FrictionChange(earliest, latest, split.ratio, *ends)


def _too_few(moves: Moves, has_changed: bool) -> str:
    up, down = (int(np.sum(moves.direction == way)) for way in (1, -1))
    blocks = len(set(blocks_of(moves, MOST_BLOCKS).tolist()))
    some = f"{numbered(blocks, 'block')} of time"
    since = " since friction changed" if has_changed else ""
    return (
        f"{numbered(up, 'move')} up and {down} down in {some}{since}: {FEWEST_MOVES} of each "
        f"in {FEWEST_BLOCKS} blocks are needed; leave the valve in service"
    )


def _parameters(balance: Balance, spring: float | None) -> dict[str, Parameter]:
    values = balance.values

    def along(slopes: Mapping[int, float]) -> NDArray[np.float64]:
        slope = np.zeros(values.size)
        slope[list(slopes)] = list(slopes.values())
        return slope

    sliding, static, k = (float(values[one]) for one in (SLIDING, STATIC, SPRING))
    numbers = {
        "sliding_friction": (sliding, along({SLIDING: 1.0})),
        "viscous_friction": (float(values[SPEED]), along({SPEED: 1.0})),
        "static_friction": (static, along({STATIC: 1.0})),
        "spring_constant": (k, along({SPRING: 1.0})),
        "spring_preload": (
            float(values[PRELOAD]) - k * balance.place,
            along({PRELOAD: 1.0, SPRING: -balance.place}),
        ),
    }
    if k > 0:
        band = (sliding + static) / k
        slope = along({SLIDING: 1 / k, STATIC: 1 / k, SPRING: -band / k})
        numbers["dead_band"] = (band, slope)
    found = {
        name: with_verdict(
            name, float(value), *balance.number(slope), _doubt(balance, value, slope)
        )
        for name, (value, slope) in numbers.items()
    }
    # Kept even if its interval includes zero: it converts friction from one speed to another.
    slope = numbers["viscous_friction"][1]
    error, width = balance.number(slope)
    found["viscous_friction"] = Parameter(
        "viscous_friction", float(values[SPEED]), error, width, Verdict.WEAK, _MEAN_SLOPE
    )
    if spring is not None:
        found["spring_constant"] = fixed("spring_constant", spring)
    if balance.onsets < FEWEST_MOVES:
        reason = f"{balance.onsets} breakaways from rest: {FEWEST_MOVES} are needed"
        for name in ("static_friction", "dead_band"):
            found[name] = not_identifiable(name, reason)
    spread = balance.number(along({SPRING: 1.0}))[1] / k if k > 0 else math.inf
    if spring is None and spread > _MAX_SPRING_REL_HALF_WIDTH:
        found["dead_band"] = not_identifiable("dead_band", _vague_spring(k, spread))
    found["coulomb_friction"] = not_identifiable("coulomb_friction", _COULOMB)
    return found


def _vague_spring(spring: float, share: float) -> str:
    if not spring > 0:
        return "the valve shows no spring"
    return (
        "it is friction over spring constant, and moves around one position determine the spring "
        f"constant only to ±{percentage(share)}: move the set point over a wider range, or set "
        "fixed.spring_constant if it is known"
    )


def _doubt(balance: Balance, value: float, slope: NDArray[np.float64]) -> str:
    """Return a remark if most of a wide interval is due to the lag of the signals, else ""."""
    _, width = balance.number(slope)
    lag = 2.0 * balance.timing * abs(float(slope @ balance.lag))
    if width <= WEAK_SHARE * abs(value) or 2.0 * lag**2 < width**2:
        return ""
    return (
        f"its interval is ±{percentage(width / abs(value))} of its value, mostly due to the lag "
        f"between the signals: set timing_uncertainty below {balance.timing:g} s if their clocks "
        "and lags are known"
    )
