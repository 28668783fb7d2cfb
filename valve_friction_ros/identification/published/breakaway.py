# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Static friction from the instants of breakaway, equation (9)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.signals import measured, runs_of, velocity_noise

_AT_REST = 4.0
"""A stem rests while its speed is below this many standard deviations of the velocity's noise.

White noise exceeds 4 standard deviations in 6 of 100,000 samples."""

_AT_REST_SHARE = 1e-3
"""In a noiseless record a stem rests while its speed is below this share of its top speed.

Chosen: above zero by far more than rounding, and below every speed that the sweep uses."""

_FIRST_MARK, _SECOND_MARK = 4.0, 16.0
"""Displacements, in standard deviations of the rest, whose instants locate the onset of motion.

The first is above nearly all noise, as `_AT_REST`. The second is four times the first, chosen:
far enough to measure the growth, near enough that the force still grows steadily."""

_ROUNDING = 1e-12
"""Rounding error of a displacement, m: a noiseless rest has the mark zero, and still lies within
it.

Four decades above the rounding of a position of 30 mm, 3e-18·m, and far below any sensor."""


class Breakaway(NamedTuple):
    """The last sample of a rest, and the direction of the motion that follows (+1 up, −1 down)."""

    sample: int
    direction: int


def _last_within(displacement: NDArray[np.float64], mark: float) -> int:
    """Last index before the displacement stays beyond `mark`, −1 if it is never within."""
    within = np.flatnonzero(displacement <= mark + _ROUNDING)
    return int(within[-1]) if within.size else -1


def _onset(displacement: NDArray[np.float64], spread: float) -> int | None:
    """Index of the last sample at rest of a displacement that grows, None if it is not visible."""
    first = _last_within(displacement, _FIRST_MARK * spread)
    second = _last_within(displacement, _SECOND_MARK * spread)
    if first < 0 or second == displacement.size - 1:
        return None
    if second <= first:
        return first
    place = np.arange(second + 1)
    trials = []
    for power in (1, 2):
        start = first - (second - first) / ((_SECOND_MARK / _FIRST_MARK) ** (1 / power) - 1)
        growth = (np.maximum(place - start, 0) / (second - start)) ** power
        misfit = displacement[: second + 1] - _SECOND_MARK * spread * growth
        trials.append((float(misfit @ misfit), start))
    onset = round(min(trials)[1])
    return onset if onset >= 0 else None


def find_breakaways(recording: Recording, settings: IdentificationSettings) -> list[Breakaway]:
    """Find the instants at which the stem leaves a rest.

    A rest is a stretch of at least two derivative windows without a speed that the noise cannot
    explain. The part of the rest before the next motion gives its position and its noise.
    The instants t₁ and t₂ at which the displacement passes 4 and 16 standard deviations of that
    noise put the onset at t₁ − (t₂ − t₁)/(4^(1/p) − 1) if it grows with the time to the power p:
    p = 2 under a growing force, p = 1 after a slip jump, whichever has the smaller residual.
    Without noise the three instants coincide.

    Parameters
    ----------
    recording : Recording
        Stem position and pressure.
    settings : IdentificationSettings
        Window and order of the derivatives.

    Returns
    -------
    list of Breakaway
        In the order of time; indices into the samples of `recording`.
    """
    window = settings.published_window
    record = measured(recording)
    derivatives = record.derivatives(window, settings.order)
    speed = np.abs(derivatives.velocity)
    noise = velocity_noise(record.white_noise, record.sample_period, window, settings.order)
    moving = speed > max(_AT_REST * noise, _AT_REST_SHARE * float(speed.max()))
    for begin, end in runs_of(moving):
        # The filter spreads any true motion over a window: a shorter burst is noise.
        moving[begin:end] = end - begin >= window // 2
    still = ~moving
    found = []
    for begin, end in runs_of(still):
        if end - begin < 2 * window or end == still.size:
            continue
        first_moving = end + derivatives.margin
        rest = recording.position[begin + window : first_moving - window // 2]
        level, spread = float(np.median(rest)), float(np.std(rest))
        stretch = recording.position[first_moving - window : first_moving + 2 * window] - level
        onset = _onset(np.abs(stretch), spread)
        if onset is not None:
            found.append(Breakaway(first_moving - window + onset, int(np.sign(stretch[-1]))))
    return found
