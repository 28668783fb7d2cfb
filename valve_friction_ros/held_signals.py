# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a source does to its signal: it repeats, omits or interpolates values; no ROS."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.recording import StampedSignal
from valve_friction_ros.signals import quantisation_step

_FEWEST_CHANGES = 20
_SHORTER_HOLD = 0.6
_FEW_SHORTER = 0.02
"""A held signal has at least `_FEWEST_CHANGES` changes, and fewer than `_FEW_SHORTER` of its runs
of equal values are shorter than `_SHORTER_HOLD` of the usual run: noise changes at any time."""

_LARGER_STEP = 1.5
_MANY_LARGER = 0.2
"""More than `_MANY_LARGER` of its changes exceed the least change by the factor `_LARGER_STEP`: a
converter that follows a slow stem changes by single steps, at any time."""


def numbers_in_runs(lengths: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return 0, 1, … within each of the runs with these lengths, one run after the other."""
    return np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)


LONG_PAUSE = 10
"""Periods of a signal above which a pause is long: samples are missing, or it was silent.

Chosen: at 100 Hz or faster such a pause is 0.1 s at most, short against a stroke."""

FEWEST_BUNCHES = 10
"""Least pauses of about one length between samples in bunches. Chosen: outages differ in length."""

_SCAN = 0.05
_ALIKE = 0.3
_USUAL, _STEPS = 0.9, 3.0
"""Conditions of silences.

The period of the scans is the `_SCAN` quantile of the pauses. Samples are in bunches if at least
`FEWEST_BUNCHES` of them and their pauses are of one length, to within the share `_ALIKE`. After a
silence the value differs by at most `_STEPS` usual steps, the `_USUAL` quantile of those between
two neighbours."""


class Pauses(NamedTuple):
    """The pauses between the samples of a signal, and the period of its scans, ns."""

    length: NDArray[np.int64]
    scan: float
    is_long: NDArray[np.bool_]
    is_usual: NDArray[np.bool_]
    """Whether the signal goes on with a usual step, as one that rested does."""
    bunches: int
    """Number of bunches that the samples come in, pauses of one length apart; else 0."""
    is_telling: bool
    """Whether that means a rest: usual steps are small, and samples do not come in bunches."""

    @classmethod
    def of(cls, stamps: NDArray[np.int64], values: NDArray[np.float64]) -> "Pauses":
        """Judge the pauses of a signal at these stamps, ns."""
        length, steps = np.diff(stamps), np.abs(np.diff(values))
        scan = float(np.quantile(length, _SCAN, method="lower"))
        is_long = length > LONG_PAUSE * scan
        most = _STEPS * float(np.quantile(steps if is_long.all() else steps[~is_long], _USUAL))
        where, bunches = np.flatnonzero(is_long), 0
        if where.size >= FEWEST_BUNCHES:
            both = length[where], np.diff(where)
            alike = all(np.ptp(one) <= _ALIKE * np.median(one) for one in both)
            bunches = where.size + 1 if alike and np.median(both[1]) > 1 else 0
        is_telling = not bunches and 2.0 * most < float(np.ptp(values))
        return cls(length, scan, is_long, steps <= most, bunches, is_telling)

    @property
    def silences(self) -> NDArray[np.bool_]:
        """Which long pauses are no gaps, as the signal rested.

        A source that omits what does not change is silent while its signal rests, and goes on with
        a usual step. A source that has lost samples goes on from elsewhere.
        """
        return self.is_long & self.is_usual & self.is_telling


def without_repeats(signal: StampedSignal) -> StampedSignal:
    """Keep only the fresh values of a held signal, at the stamps of their first appearance.

    A repeated value adds nothing and is wrong at the time of its repetition. A signal that is not
    held is returned unchanged. If the source sent the same value again, the sample at that time is
    kept.
    """
    steps = np.diff(signal.value)
    changes = np.flatnonzero(steps) + 1
    if changes.size < _FEWEST_CHANGES:
        return signal
    runs, jumps = np.diff(changes), np.abs(steps[changes - 1])
    shortest = float(np.quantile(runs, 2 * _FEW_SHORTER))
    hold = float(np.median(runs[runs < 2 * shortest]))
    is_steady = np.mean(runs < _SHORTER_HOLD * hold) < _FEW_SHORTER
    is_free = np.mean(jumps > _LARGER_STEP * jumps.min()) > _MANY_LARGER
    if hold < 2 or not (is_steady and is_free):
        return signal
    sent = np.maximum(np.rint(runs / hold), 1.0).astype(np.intp)
    again = numbers_in_runs(sent)
    fresh = np.repeat(changes[:-1], sent) + np.rint(again * np.repeat(runs / sent, sent)).astype(
        np.intp
    )
    fresh = np.append(fresh, changes[-1])
    if fresh.size < StampedSignal.FEWEST:
        return signal
    return StampedSignal(signal.time[fresh], signal.value[fresh])


_IRREGULAR_GAP = 3.0
_REGULAR_SHARE = 0.8
_EVEN_STEP = 0.5
"""Conditions of a signal that is sent on change. Its longest pause exceeds `_IRREGULAR_GAP` usual
pauses, at most `_REGULAR_SHARE` of its pauses are about as short as the shortest, and its steps are
hardly ever smaller than `_EVEN_STEP` of the usual step. Lost samples leave the other pauses equal;
a sensor that samples at its own rate has steps of any size."""

_JUMP = 2.0
"""Dead bands beyond which a change after a pause is a jump: slower ones are sent as they occur."""


def sent_dead_band(signal: StampedSignal) -> float:
    """Estimate the dead band of a source that sends on change, in the signal's unit; else 0.

    It is the least change that is sent.
    """
    pauses, steps = np.diff(signal.time), np.abs(np.diff(signal.value))
    usual = float(np.median(pauses))
    if steps.size < _FEWEST_CHANGES or pauses.max() < _IRREGULAR_GAP * usual:
        return 0.0
    soon = steps[pauses < 0.5 * pauses.max()]
    least = float(np.quantile(soon, 0.05))
    is_regular = np.mean(pauses < 1.5 * _shortest(pauses)) > _REGULAR_SHARE
    return 0.0 if is_regular or least < _EVEN_STEP * float(np.median(steps)) else least


def _shortest(pauses: NDArray[np.float64]) -> float:
    """Return the shortest usual pause between two values that are sent on change."""
    return float(np.quantile(pauses, _FEW_SHORTER))


def as_sent_on_change(signal: StampedSignal, least: float) -> StampedSignal:
    """Hold each value of a signal that is sent on change until just before the next jump.

    A source with a dead band (`sent_dead_band`), `least`, is silent while its value hardly changes.
    A straight line over such a pause would move a stem that sticks while the force on it grows.
    """
    if least == 0.0:
        return signal
    pauses, steps = np.diff(signal.time), np.abs(np.diff(signal.value))
    shortest = _shortest(pauses)
    jumps = np.flatnonzero((steps > _JUMP * least) & (pauses > 2.0 * shortest)) + 1
    return StampedSignal(
        np.insert(signal.time, jumps, signal.time[jumps] - shortest),
        np.insert(signal.value, jumps, signal.value[jumps - 1]),
    )


SLOW_SAMPLING = 0.15
"""Sampling period, s, above which a lag of one sample is larger than any usual lag."""

_ROUNDING = 1e-7
_ON_LINE, _OFF_LINE = 0.51, 5.0
_LARGEST_CHANGE = 0.1
_UNEQUAL = 2.0
"""Conditions of a signal that is interpolated between stored values.

Values are rounded to the least difference between two of them, of at least `_ROUNDING` of their
range. A sample lies on the line between its neighbours if it is within `_ON_LINE` of that step. The
others are typically `_OFF_LINE` steps and more off the line, which noise of a coarse converter is
not. A change beyond `_LARGEST_CHANGE` of the range is a move. The longest lines are `_UNEQUAL`
times as long as the shortest: a regular scan has no dead band."""


class _Evidence(NamedTuple):
    """What a signal needs to be taken as interpolated.

    The least number of lines, their least share of the samples that change, and the largest change
    over most of them, as a share of the range.
    """

    lines: int
    inside: float
    change: float


_ALONE = _Evidence(50, 0.15, 0.02)
_BESIDE = _Evidence(10, 0.05, 0.05)
"""Evidence without and with another signal of the record that is interpolated.

Chosen: 52 of 80 interpolated records with dead bands of 0.1 to 1 % fulfil the former in one signal
or both, and 3 of 196 others."""


class _Lines(NamedTuple):
    """A signal as lines between its stored values.

    The step of its rounding; for each line its first sample, its length in samples and its change;
    whether the signal changes on it, or rests; and how far the stored values are off the lines
    between their neighbours.
    """

    step: float
    first: NDArray[np.intp]
    length: NDArray[np.intp]
    change: NDArray[np.float64]
    is_line: NDArray[np.bool_]
    is_still: NDArray[np.bool_]
    off: NDArray[np.float64]


def _lines_of(signal: StampedSignal) -> _Lines | None:
    """Divide a signal into lines; None if it is sampled faster than historians do, or too short."""
    time, value = signal.time, signal.value
    if signal.period <= SLOW_SAMPLING or value.size < 3 * _ALONE.lines:
        return None
    steps = np.diff(np.unique(value))
    steps = steps[steps > _ROUNDING * np.sum(steps)]
    if not steps.size:
        return None
    step = float(steps.min())
    share = (time[2:] - time[1:-1]) / (time[2:] - time[:-2])
    off = np.abs(value[1:-1] - share * value[:-2] - (1.0 - share) * value[2:])
    stored = np.concatenate([[True], off > _ON_LINE * step, [True]])
    first, last = np.flatnonzero(stored)[:-1], np.flatnonzero(stored)[1:]
    run = np.repeat(np.arange(first.size), last - first)
    change = value[last] - value[first]
    slope = change / (time[last] - time[first])
    line = value[first][run] + slope[run] * (time[:-1] - time[first][run])
    apart = np.maximum.reduceat(np.abs(value[:-1] - line), first)
    is_long, moves = last - first > 1, np.abs(change) > step
    is_line = is_long & (apart <= 2.0 * _ON_LINE * step) & moves
    return _Lines(step, first, last - first, change, is_line, is_long & ~moves, off[stored[1:-1]])


def _is_archived(signal: StampedSignal, lines: _Lines, evidence: _Evidence) -> bool:
    """Return whether a signal shows that much evidence of a historian."""
    if np.count_nonzero(lines.is_line) < evidence.lines:
        return False
    length, change = lines.length[lines.is_line], np.abs(lines.change[lines.is_line])
    changing = signal.value.size - float(np.sum(lines.length[lines.is_still]))
    shortest, longest = np.quantile(length, (0.1, 0.9))
    return bool(
        np.sum(length) >= evidence.inside * changing
        and np.median(lines.off) >= _OFF_LINE * lines.step
        and np.median(change) <= evidence.change * np.ptp(signal.value)
        and longest > _UNEQUAL * shortest
    )


def as_archived(*signals: StampedSignal) -> tuple[StampedSignal, ...]:
    """Hold each stored value of signals that a historian has interpolated, up to the next one.

    A historian with a dead band stores a value only when it has left the band, and draws lines
    between the stored values. Such a line has no noise, and it moves a stem that rests. Other
    signals are returned unchanged, and so is one that is sampled faster than historians do. Where
    one signal of a record is interpolated, less evidence is needed for the others.
    """
    pairs = [(signal, _lines_of(signal)) for signal in signals]
    if not any(lines and _is_archived(signal, lines, _ALONE) for signal, lines in pairs):
        return signals
    return tuple(_held(signal, lines) if lines else signal for signal, lines in pairs)


def _held(signal: StampedSignal, lines: _Lines) -> StampedSignal:
    """Hold the stored values of a signal, beside or itself one that is interpolated."""
    if not _is_archived(signal, lines, _BESIDE):
        return signal
    is_small = np.abs(lines.change) <= _LARGEST_CHANGE * np.ptp(signal.value)
    held = np.repeat(lines.is_line & is_small, lines.length)
    found = signal.value.copy()
    found[:-1][held] = np.repeat(signal.value[lines.first], lines.length)[held]
    return StampedSignal(signal.time, found)


_LEAST_HOLD, _LEAST_HELD = 3, 0.3
_FEWEST_HOLDS, _EARLY = 8, 0.9
_BETWEEN, _SMALLEST = 2, 0.1
_CONVERTER = 1.5
"""Conditions of a signal that a historian has held, and of its dead band.

A hold has at least `_LEAST_HOLD` equal samples; the holds take the share `_LEAST_HELD` of the
record. At least `_FEWEST_HOLDS` of them end before `_EARLY` of the longest: a historian also stores
a value when none has been stored for some time, however little it has changed. If the next hold is
not among the `_BETWEEN` runs of equal samples that follow, the signal moves in between. No change
is smaller than a dead band, so the `_SMALLEST` quantile of the changes is taken; one of up to
`_CONVERTER` steps is the resolution of a converter."""


def archive_dead_band(signal: StampedSignal) -> float:
    """Estimate the dead band of a historian, in the signal's unit; 0 for one that is not held.

    It is the smallest usual change from a hold, to the next value or to the next hold.
    """
    value = signal.value
    if signal.period <= SLOW_SAMPLING:
        return 0.0
    first = np.flatnonzero(np.diff(value, prepend=np.nan))
    length = np.diff(first, append=value.size)
    holds = np.flatnonzero(length >= _LEAST_HOLD)
    held, later = holds[:-1], holds[1:]
    further = value[first[np.stack([held + 1, later])]] - value[first[held]]
    is_early = length[held] < _EARLY * length[holds].max(initial=0)
    changes = np.abs(further).max(axis=0)[is_early & (later - held <= _BETWEEN)]
    changes = changes[changes <= _LARGEST_CHANGE * np.ptp(value)]
    if changes.size < _FEWEST_HOLDS or np.sum(length[holds]) < _LEAST_HELD * value.size:
        return 0.0
    smallest = float(np.quantile(changes, _SMALLEST))
    return smallest if smallest > _CONVERTER * quantisation_step(value) else 0.0
