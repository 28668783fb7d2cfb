# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""How far the stem went in a record, and whether a stop held it there."""

import math

import numpy as np
import scipy
from numpy.typing import NDArray

from valve_friction_ros.health.measured import Measured
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import quantisation_step, runs_of, sensor_noise

_MEAN = 0.1
"""Time, s, over which the stem is averaged."""

_NEAR = 2e-3
"""Share of the range within which the stem is at its end: a seat gives way a little."""

_NOISE = 6.0
"""Deviations of the averaged stem's noise within which it is there, too."""

_LEFT = 2.0
"""Distance from the end, over that within which the stem is there, at which it has left it."""

_SURELY = 2.0
"""Growth of the force over F_s − F_c: a stem that has jumped too far waits for twice as much."""

_SMALLEST = 0.05
"""Growth asked for at least, as a share of the force's range.

Chosen: within the near part of the way the force grows by the spring, too."""
_MOVING = 0.05
"""Speed over the top speed from which the stem counts as moving."""

_RECENT = 0.5
"""Time, s, before an arrival from which the speed is taken: a lag of the stem is no longer."""


def stem_reach(recording: Recording, valve: Valve, slip_force: float) -> dict[str, Measured]:
    """Return the ends of the stem's motion, m, and which of them are stops.

    A stem that has come to rest moves on as soon as the force has grown by F_s − F_c in the same
    direction. Where it rests at an end of its motion and the force grows by far more, a stop holds
    it. Where F_s − F_c is unknown, the rests between the ends show it; without one it is taken to
    be no larger than F_c.

    Parameters
    ----------
    recording : Recording
        Drive and stem.
    valve : Valve
        Makes the force from the drive.
    slip_force : float
        Largest F_s − F_c that there may be, N; nan where it is unknown.

    Returns
    -------
    dict
        ``lowest_position`` and ``highest_position``; ``lower_stop`` and ``upper_stop`` where met.
    """
    mean = max(round(_MEAN / recording.sample_period), 1)
    position = scipy.ndimage.uniform_filter1d(recording.position, mean, mode="nearest")
    force = valve.actuator_force(
        scipy.ndimage.uniform_filter1d(recording.drive, mean, mode="nearest")
    )
    noise = sensor_noise(recording.position) / math.sqrt(mean)
    sent = recording.position if recording.stamped is None else recording.stamped.position.value
    step = quantisation_step(sent)  # on the grid of the record it may be interpolated away
    near = max(_NEAR * float(np.ptp(position)), _NOISE * noise, step)
    least: NDArray[np.float64] = np.full(position.size, _SURELY * slip_force)
    if math.isnan(slip_force):
        least = _unknown_growth(position, force, recording.sample_period, near)
    least = np.maximum(least, _SMALLEST * float(np.ptp(force)))
    found = {}
    for side, end, stop in (
        (-1.0, "lowest_position", "lower_stop"),
        (1.0, "highest_position", "upper_stop"),
    ):
        farthest = float(np.max(side * position))
        found[end] = Measured(side * farthest, near)
        held = _held(farthest - side * position, near, side * force, least)
        if held.any():
            low, middle, high = np.quantile(position[held], (0.025, 0.5, 0.975)).tolist()
            found[stop] = Measured(middle, max(high - low, 0.5 * near))
    return found


def _unknown_growth(
    position: NDArray[np.float64], force: NDArray[np.float64], period: float, near: float
) -> NDArray[np.float64]:
    """Return the growth of the force, N, that proves a stop where nothing is known of F_s − F_c.

    It is F_c, or twice the largest F_s − F_c that a rest between the ends shows, and what the
    viscous friction of an arrival, or a lag of the stem, add to it.
    """
    speed = np.gradient(position, period)
    moving = np.abs(speed) > _MOVING * np.abs(speed).max()
    coulomb, viscous = _friction(position[moving], speed[moving], force[moving])
    growth = max(coulomb, _SURELY * _slip_of_rests(position, force, moving, near, coulomb))
    recent = max(round(_RECENT / period), 1)
    arriving = scipy.ndimage.maximum_filter1d(np.abs(speed), recent, origin=(recent - 1) // 2)
    return growth + viscous * arriving


def _friction(
    position: NDArray[np.float64], speed: NDArray[np.float64], force: NDArray[np.float64]
) -> tuple[float, float]:
    """Return Coulomb (N) and viscous friction (N·s/m) of the moving stem, by least squares.

    A lag of the stem adds to the viscous part. Where either comes out below zero, all is Coulomb's.
    """
    columns = [position - position.mean(), np.ones(position.size), np.sign(speed), speed]
    (*_, coulomb, viscous), *_ = np.linalg.lstsq(np.column_stack(columns), force, rcond=None)
    if min(coulomb, viscous) >= 0:
        return float(coulomb), float(viscous)
    (*_, loop), *_ = np.linalg.lstsq(np.column_stack(columns[:-1]), force, rcond=None)
    return abs(float(loop)), 0.0


def _slip_of_rests(
    position: NDArray[np.float64],
    force: NDArray[np.float64],
    moving: NDArray[np.bool_],
    near: float,
    coulomb: float,
) -> float:
    """Return the largest F_s − F_c, N, that a rest between the ends shows; 0 without one.

    The force changes by that before the stem moves on, and by F_s + F_c before it turns.
    """
    low, high = float(np.min(position)) + near, float(np.max(position)) - near
    largest = 0.0
    for begin, end in runs_of(~moving):
        if begin > 0 and end < moving.size and low < position[begin] < high:
            before = position[begin] - position[begin - 1]
            after = position[end] - position[end - 1]
            change = abs(force[end] - force[begin])
            largest = max(largest, change - (2 * coulomb if before * after < 0 else 0.0))
    return largest


def _held(
    below_end: NDArray[np.float64],
    near: float,
    force: NDArray[np.float64],
    least: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Return the visits of an end in which the force grows by more than `least` after arrival.

    A visit lasts until the stem is twice as far `below_end` as it was on arrival: noise ends none,
    so that a force which falls and grows again while the stem rests proves no stop. Nothing is
    known of the arrival of a visit with which the record begins.
    """
    held = np.zeros(below_end.size, dtype=np.bool_)
    for first, last in runs_of(below_end < _LEFT * near):
        (there,) = np.nonzero(below_end[first:last] <= near)
        if first == 0 or there.size == 0:
            continue
        begin, end = first + int(there[0]), first + int(there[-1]) + 1
        if np.max(force[begin:end]) - force[begin] > least[begin]:
            held[begin:end] = True
    return held
