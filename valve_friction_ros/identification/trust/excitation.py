# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a record must hold to determine friction; a refusal names what is missing.

Where a limit is given with "simulated records", it lies between two sets of records: those that
`benchmark/cases.py` makes (4 excitations, 4 levels of noise, 1 kHz and 100 Hz, of the packings low,
high, graphite and stribeck), which all determine the friction, and records that do not.
"""

import math
from sys import float_info
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.held_signals import sent_dead_band
from valve_friction_ros.identification.refusal import LittleMotionError, RefusalError
from valve_friction_ros.identification.trust.plausible_units import position_question
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import measured
from valve_friction_ros.wording import lasting, percentage

_LEAST_WINDOWS = 10
"""Derivative windows in a record. Chosen: fewer give no two strokes with a rest and a motion."""

_SHORTEST_PERIOD = 1e-6
_LONGEST_PERIOD = 3600.0
"""Sample periods, s. Chosen: a hundred times beyond recorders of valves either way; further out the
simulation would divide by zero, or take a million steps per sample."""

_MOTION_OVER_NOISE = 10.0
"""Range of the position over its white noise.

White noise alone spans 9 standard deviations in 60,000 samples; simulated records span 70 and
more."""

_SEVERAL_PERCENT = 0.05
"""Range of the position over the travel above which a stem that only seems to be noisy did move."""

_SHORT_MOVE, _FEWEST_AVERAGED = 0.5, 3
"""Time, s, over which the position is averaged at most, and samples at least, to see both
directions. Chosen: 31 samples at 10 Hz are as long as the period of a loop that hunts."""

_LEAST_SHARE_OF_DIRECTION = 0.02
"""Least distance in the rarer direction, as a share of the whole distance.

Zero for one direction; 0.41 and more in simulated records. Chosen: one short stroke back is
enough."""

_ELASTIC = 3e-3
"""Distance that a stem may move elastically before its packing slides, as a share of the travel.

Chosen: packings give by some 50 µm; 60 µm are 0.3 % of a small travel."""

_LEAST_TRAVEL = 0.01
"""Range of the position over the travel.

0.14 and more in simulated records. Chosen: a motion below 1 % is mostly within the dead band."""

_OUTSIDE = 0.05
"""Distance beyond a travel stop over the travel.

Chosen: a sensor's zero may be off by a few percent; swapped signals or wrong units by far more."""

_LEAST_FOLLOWED = 0.1
"""Share of the pressure's variance that the moving stem explains.

0.18 and more in simulated records; below 0.005 for the signals of two valves. Chosen between
them."""

_SURELY_FOLLOWED = 0.5
"""The same share above which a negative slope means an inverted position. Chosen: near 1 for an
inverted record; a small share has a slope by chance."""

_FOLLOWED_BLOCK = 0.1
"""Time, s, over which pressure and position are averaged before the test of `_LEAST_FOLLOWED`.

Chosen: 100 samples at 1 kHz average noise. It is absolute, a tenth of the bench's lag; a share of
the time of a stroke would suit other valves."""

_FEWEST_BLOCKS = 20
"""Fewest of these blocks. Chosen: a fit of three numbers; a short record has shorter ones."""

_MOVING_SHARE = 0.05
"""Speed, as a share of the top speed, above which the stem is moving in that test. Chosen: it
leaves out rests, where pressure changes within the dead band."""

_LEAST_SAMPLES_A_STROKE = 10
"""Samples that the whole range takes at the top speed; 11 and more in simulated records.

Chosen: with fewer a stroke has no resting and sliding part, or the sample is a sensor's glitch."""

_HELD = 0.5
"""Share of the moves that begin after equal samples above which the values are held, as a historian
does with stored ones."""


def require_drive(recording: Recording, valve: Valve) -> None:
    """Refuse a recorded force for a valve with a diaphragm, or a pressure for a valve without one.

    Raises ValueError with the remedy.
    """
    if recording.driven_by is not valve.driven_by:
        raise ValueError(
            f"the recording holds a {recording.driven_by.words}, but the valve is driven by a "
            f"{valve.driven_by.words}: omit diaphragm_area for a recorded force, and give it for "
            "a recorded pressure"
        )


def require_enough_samples(recording: Recording, window: int) -> None:
    """Refuse a recording shorter than ten windows of so many samples.

    A sample period that no recorder has is refused, too: its unit of time is wrong.
    """
    if not _SHORTEST_PERIOD <= recording.sample_period <= _LONGEST_PERIOD:
        raise RefusalError(
            f"a sample every {lasting(recording.sample_period)} is not plausible for a valve: "
            "check the time unit"
        )
    least = _LEAST_WINDOWS * window
    if len(recording) < least:
        raise LittleMotionError(
            f"the record is too short: {len(recording)} samples ({lasting(recording.duration)}), "
            f"at least {least} are needed; record longer or sample faster"
        )


def require_unbroken(recording: Recording) -> None:
    """Refuse a recording with a gap."""
    if recording.gap:
        raise RefusalError(recording.gap)


def _faster(recording: Recording, is_held: bool = False) -> str:
    """Return what helps a record that is compressed beside faster sampling; else ''."""
    own = recording.stamped
    is_sent = own is not None and max(map(sent_dead_band, (own.drive, own.position))) > 0.0
    return "export it without compression, " if is_held or is_sent else ""


def require_motion(recording: Recording, travel: float = math.inf) -> None:
    """Refuse a recording whose stem did not move by more than its noise.

    A stem that moves far between two samples looks like noise: its range is a large share of the
    `travel`, m.
    """
    span = float(np.ptp(recording.position))
    noise = measured(recording).white_noise
    if span == 0 or span < _MOTION_OVER_NOISE * noise:
        if span > _SEVERAL_PERCENT * travel:
            raise RefusalError(
                f"the stem jumps from sample to sample, {lasting(recording.sample_period)} apart "
                f"(its position spans {span * 1e6:.3g} µm with {noise * 1e6:.3g} µm of noise or "
                f"unseen motion): {_faster(recording)}sample faster, or check the stem sensor"
            )
        raise LittleMotionError(
            f"the stem did not move: its position spans {span * 1e6:.3g} µm with "
            f"{noise * 1e6:.3g} µm of noise; move the valve over several percent of its travel"
        )


def _distances(position: NDArray[np.float64], deadband: float) -> tuple[float, float]:
    """Return the distances moved up and down, ignoring turns smaller than `deadband`."""
    up = down = 0.0
    highest = lowest = turn = float(position[0])
    direction = 0
    for place in position.tolist():
        highest, lowest = max(highest, place), min(lowest, place)
        if direction >= 0 and place < highest - deadband:
            up += highest - turn
            turn, lowest, direction = highest, place, -1
        elif direction <= 0 and place > lowest + deadband:
            down += turn - lowest
            turn, highest, direction = lowest, place, 1
    if direction >= 0:
        up += highest - turn
    if direction <= 0:
        down += turn - lowest
    return up, down


def require_two_directions(recording: Recording, window: int, travel: float = math.inf) -> None:
    """Refuse a stem that moves in one direction only, or hardly in the other.

    The position is averaged over `window` samples first, and over fewer where these take longer
    than a move may. Turns within its noise are ignored, and so are those that a packing may yield
    elastically before it slides, a share of the `travel` of the valve, m. Few samples do not show
    how large the noise of an interpolated record is: there a turn is also a share of the range.
    """
    require_enough_samples(recording, window)
    elastic = _ELASTIC * travel if math.isfinite(travel) else 0.0
    shorter = max(int(_SHORT_MOVE / recording.sample_period), _FEWEST_AVERAGED)
    ways = []
    for length in dict.fromkeys((window, min(window, shorter))):
        means = len(recording) // length
        position = recording.position[: means * length].reshape(means, length).mean(axis=1)
        noise = measured(recording).white_noise / np.sqrt(length)
        least = 0.0 if length == window else _LEAST_SHARE_OF_DIRECTION * float(np.ptp(position))
        ways.append(_distances(position, max(_MOTION_OVER_NOISE * noise, least, elastic)))
    if all(min(one) < max(_LEAST_SHARE_OF_DIRECTION * sum(one), elastic) for one in ways):
        if (span := float(np.ptp(recording.position))) < elastic:
            raise LittleMotionError(
                f"the stem moved over {span * 1e3:.3g} mm only, no more than a packing may yield "
                "before it slides: move the valve over several percent of its travel"
            )
        up, down = ways[0]
        way = "up" if up > down else "down"
        raise LittleMotionError(
            f"the stem moved only {way} ({up * 1e3:.3g} mm up, {down * 1e3:.3g} mm down): "
            "friction and spring cannot be separated; record at least one stroke in each direction"
        )


def require_within_travel(recording: Recording, valve: Valve) -> None:
    """Refuse a stem that leaves the travel."""
    travel = valve.travel
    lowest, highest = float(recording.position.min()), float(recording.position.max())
    if not np.isfinite(travel):
        return
    if lowest < -_OUTSIDE * travel or highest > (1 + _OUTSIDE) * travel:
        question = position_question(max(-lowest, highest), travel)
        raise RefusalError(
            f"the stem position runs from {lowest:.4g} to {highest:.4g} m, but the travel is 0 to "
            f"{travel:.4g} m: check that the signals are not swapped, and check unit (m), zero "
            f"and travel{question and f': {question}'}"
        )


def require_travel(recording: Recording, valve: Valve) -> None:
    """Refuse a stem that leaves the travel, or moves over less than 1 % of it."""
    require_within_travel(recording, valve)
    way = float(np.ptp(recording.position))
    if np.isfinite(valve.travel) and way < _LEAST_TRAVEL * valve.travel:
        raise LittleMotionError(
            f"too little travel: the stem moved {way * 1e3:.3g} mm, "
            f"{percentage(way / valve.travel)} of its travel; move it over several percent of the "
            "travel"
        )


class _Followed(NamedTuple):
    """How the drive follows the moving stem.

    The slope of drive over position, Pa/m or N/m; the share of the drive's variance that position
    and direction explain; and whether the drive does work on the stem, which friction dissipates.
    """

    slope: float
    share: float
    dissipates: bool


def _followed(recording: Recording) -> _Followed:
    """Fit the drive of the moving stem by its position and its direction.

    While the stem moves, its drive follows position, shifted up or down by the friction. While it
    rests, any drive within the dead band is possible, so rests are left out.
    """
    longest = max(len(recording) // _FEWEST_BLOCKS, 1)
    length = max(min(round(_FOLLOWED_BLOCK / recording.sample_period), longest), 1)
    blocks = len(recording) // length
    position, drive = (
        signal[: blocks * length].reshape(blocks, length).mean(axis=1)
        for signal in (recording.position, recording.drive)
    )
    moves = np.diff(position)
    moving = np.abs(moves) > _MOVING_SHARE * np.abs(moves).max()
    if not moving.any():
        return _Followed(0.0, 0.0, False)
    place, target = (0.5 * (one[1:] + one[:-1])[moving] for one in (position, drive))
    columns = np.column_stack([place - place.mean(), np.sign(moves[moving]), np.ones(place.size)])
    fitted, *_ = np.linalg.lstsq(columns, target, rcond=None)
    left = target - columns @ fitted
    total = float(np.sum((target - target.mean()) ** 2))
    share = 1 - float(left @ left) / total if total > 0 else 0.0
    away = columns[:, 0]
    along = float(away @ target) / max(float(away @ away), float_info.min)
    # From the samples, not the blocks: blocks lose the phase of a stem that swings fast.
    between = [0.5 * (one[1:] + one[:-1]) for one in (recording.position, recording.drive)]
    off_line = between[1] - target.mean() - along * (between[0] - place.mean())
    work = float(off_line @ np.diff(recording.position))
    return _Followed(float(fitted[0]), share, work > 0.0)


_JUMPED = 0.5
"""Share of the distance that a sticking stem may cover in jumps between two samples."""


def require_changing_drive(recording: Recording) -> None:
    """Refuse a drive that is the same all the time."""
    words = recording.driven_by.words
    if np.ptp(recording.drive) == 0:
        raise LittleMotionError(
            f"the {words} did not change: move the valve, or check the {words} sensor"
        )


def require_related_signals(recording: Recording) -> None:
    """Refuse drive and stem that do not move together, or move too fast for the sampling."""
    words, position = recording.driven_by.words, recording.position
    require_changing_drive(recording)
    slope, share, dissipates = _followed(recording)
    if share < _LEAST_FOLLOWED:
        stamped = recording.stamped
        period = recording.sample_period if stamped is None else stamped.drive.period
        is_slow = period > _LEAST_SAMPLES_A_STROKE * recording.sample_period
        slow = f"; a {words} every {lasting(period)} does not show shorter moves" if is_slow else ""
        raise RefusalError(
            f"{words} and stem do not move together (position and direction of the moving stem "
            f"explain {100 * share:.0f} % of the {words}): check that both signals belong to this "
            "valve, are not swapped, come from working sensors and share one clock, and that the "
            f"stem moves further than its friction holds it{slow}"
        )
    if slope < 0 and share > _SURELY_FOLLOWED and not dissipates:
        raise RefusalError(
            f"the stem moves against the {words}: invert the position (for a file: "
            f"inverted_position) so that it increases in the direction in which {words} pushes the "
            "stem"
        )
    steps, span = np.diff(position), float(np.ptp(position))
    step = float(np.max(np.abs(steps)))
    jumps = np.where(_LEAST_SAMPLES_A_STROKE * np.abs(steps) > span, steps, 0.0)
    is_glitch = bool(np.any(jumps[1:] * jumps[:-1] < 0))
    if is_glitch or np.sum(np.abs(jumps)) > _JUMPED * np.sum(np.abs(steps)):
        is_held = np.mean(steps[:-1][steps[1:] != 0.0] == 0.0) > _HELD
        raise RefusalError(
            f"sampling is too slow for the motion: the stem moves {100 * step / span:.0f} % of "
            f"its range between two samples, {lasting(recording.sample_period)} apart; "
            f"{_faster(recording, is_held)}sample faster, or check the stem sensor for a glitch"
        )
