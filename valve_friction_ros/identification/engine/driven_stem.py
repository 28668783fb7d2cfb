# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The stem of a Karnopp valve with imperfections, and what its sensor reads, as machine code."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.compiled import compiled
from valve_friction_ros.model.linear_motion import Dynamics
from valve_friction_ros.model.stem_run import run_stem
from valve_friction_ros.model.stem_tangent import Tangent, no_tangent, unless_forgotten

_LEAST_LAG = 1e-9
_LARGEST_ASYMMETRY = 0.9

_AT_STEP = 1e-6
"""Distance from a step, in steps, within which a reading has the slopes of both sides."""


class Course(NamedTuple):
    """Drive of the stem at each step of the simulation, and the slow terms there, shape (g,).

    Period, s, travel, m, and the ranges of the measured positions, m, and of the sensor of the
    force, N. Then the force, N; position and time, −1 to 1; the share of the friction at rest that
    is left at the measured speed; the position to which the stem is reset, m, nan elsewhere; and
    its velocity there, m/s.
    """

    period: float
    travel: float
    stroke: float
    span: float
    force: NDArray[np.float64]
    place: NDArray[np.float64]
    age: NDArray[np.float64]
    slowness: NDArray[np.float64]
    anew: NDArray[np.float64]
    leaving: NDArray[np.float64]


class Place(NamedTuple):
    """All coordinates of the model, by the names of `MAIN` and `IMPERFECTIONS`."""

    coulomb_friction: float
    viscous_friction: float
    spring_constant: float
    spring_preload: float
    start_position: float
    delay: float
    stem_lag: float
    force_lag: float
    along_travel: float
    in_record: float
    at_low_speed: float
    curvature: float
    cubic: float
    drift: float
    presliding: float
    limit_velocity: float
    viscous_asymmetry: float
    mass: float
    slip_force: float
    stribeck_velocity: float


(
    _COULOMB,
    _VISCOUS,
    _SPRING,
    _PRELOAD,
    _START,
    _DELAY,
    _STEM_LAG,
    _FORCE_LAG,
    _ALONG_TRAVEL,
    _IN_RECORD,
    _AT_LOW_SPEED,
    _CURVATURE,
    _CUBIC,
    _DRIFT,
    _PRESLIDING,
    _LIMIT_VELOCITY,
    _ASYMMETRY,
    _MASS,
    _SLIP,
    _STRIBECK,
) = range(len(Place._fields))
"""Indices of the coordinates in kernels."""

_OF_FRICTION = (_COULOMB, _ALONG_TRAVEL, _IN_RECORD, _AT_LOW_SPEED)
"""Coordinates that grade the friction, and not the force."""


@compiled
def _lag(signals: NDArray[np.float64], lag: float, period: float) -> None:
    """Pass signals, shape (g, p) and linear between their samples, through a first-order lag.

    Before its first sample a signal is extrapolated by its first slope: a record may begin in the
    middle of a move. A lag of `_LEAST_LAG` or less is none.
    """
    if lag <= _LEAST_LAG:
        return
    decay = math.exp(-period / lag)
    newest = 1.0 - lag * (1.0 - decay) / period
    before = signals[0].copy()
    for one in range(before.size):
        signals[0, one] = before[one] - lag * (signals[1, one] - before[one]) / period
    for step in range(1, signals.shape[0]):
        for one in range(before.size):
            after = signals[step, one]
            lagged = decay * signals[step - 1, one] + newest * after
            lagged += (1.0 - decay - newest) * before[one]
            signals[step, one] = unless_forgotten(lagged)
            before[one] = after


@compiled
def _lag_slope(
    signal: NDArray[np.float64], lag: float, period: float, slope: NDArray[np.float64]
) -> None:
    """Differentiate the output of `_lag` by the lag; towards larger lags where it is zero."""
    decay = math.exp(-period / lag) if lag > _LEAST_LAG else 0.0
    newest = 1.0 - lag * (1.0 - decay) / period
    slower = decay * period / (lag * lag) if lag > _LEAST_LAG else 0.0
    newer = (lag * slower - 1.0 + decay) / period
    first = (signal[1] - signal[0]) / period
    lagged, before, slope[0] = signal[0] - lag * first, signal[0], -first
    for step in range(1, signal.size):
        after = signal[step]
        slope[step] = (
            decay * slope[step - 1] + newer * (after - before) + slower * (lagged - before)
        )
        lagged = decay * lagged + newest * after + (1.0 - decay - newest) * before
        before = after


@compiled
def _lead_slope(signal: NDArray[np.float64], period: float, slope: NDArray[np.float64]) -> None:
    """Differentiate a signal with a small lead by its lag: minus its slope."""
    last = signal.size - 1
    for step in range(signal.size):
        before, after = max(step - 1, 0), min(step + 1, last)
        slope[step] = -(signal[after] - signal[before]) / ((after - before) * period)


@compiled
def _constants(at: Place, travel: float) -> NDArray[np.float64]:
    """Differentiate the constants of the motion by each coordinate of `Place`.

    They are mass, spring constant, Coulomb friction, slip force, limit velocity, viscous friction
    upwards and downwards, the first position, and the Stribeck velocity.
    """
    table = np.zeros((_STRIBECK + 1, 9))
    side = min(max(at.viscous_asymmetry, -_LARGEST_ASYMMETRY), _LARGEST_ASYMMETRY)
    table[_MASS, 0] = table[_SPRING, 1] = table[_COULOMB, 2] = table[_SLIP, 3] = 1.0
    table[_LIMIT_VELOCITY, 4] = table[_STRIBECK, 8] = 1.0
    table[_SPRING, 2], table[_PRESLIDING, 2] = at.presliding, at.spring_constant
    table[_VISCOUS, 5], table[_VISCOUS, 6] = 1.0 + side, 1.0 - side
    if side == at.viscous_asymmetry:
        table[_ASYMMETRY, 5], table[_ASYMMETRY, 6] = at.viscous_friction, -at.viscous_friction
    if 0.0 <= at.start_position <= travel:
        table[_START, 7] = 1.0
    return table


@compiled
def _shares(course: Course, at: Place) -> NDArray[np.float64]:
    """Differentiate the shares of the signals in force and friction by each coordinate of `Place`.

    The signals of the force are one, the two polynomials of the place, the age and the slope by the
    lag; those of the graded friction are the place, the age and the slowness.
    """
    table = np.zeros((_STRIBECK + 1, 8))
    stroke, dry = course.stroke, at.coulomb_friction
    table[_PRELOAD, 0], table[_DRIFT, 3], table[_FORCE_LAG, 4] = -1.0, course.span, 1.0
    table[_SPRING, 1], table[_SPRING, 2] = -at.curvature * stroke, -at.cubic * stroke
    table[_CURVATURE, 1] = table[_CUBIC, 2] = -at.spring_constant * stroke
    table[_COULOMB, 5], table[_COULOMB, 6] = at.along_travel, at.in_record
    table[_COULOMB, 7] = at.at_low_speed
    table[_ALONG_TRAVEL, 5] = table[_IN_RECORD, 6] = table[_AT_LOW_SPEED, 7] = dry
    return table


@compiled
def _tangent(
    course: Course, at: Place, coordinates: NDArray[np.int64], room: NDArray[np.float64]
) -> Tangent:
    """Differentiate the drive of the stem and its start by some coordinates."""
    tangent = no_tangent(coordinates.size, room[0], room[1])
    constants, shares = _constants(at, course.travel), _shares(course, at)
    lagged = np.empty_like(course.force)
    if at.force_lag >= 0.0:
        _lag_slope(course.force, at.force_lag, course.period, lagged)
    else:
        _lead_slope(course.force, course.period, lagged)
    for one, coordinate in enumerate(coordinates):
        row = constants[coordinate]
        tangent.mass[one], tangent.spring_constant[one] = row[0], row[1]
        tangent.coulomb_friction[one], tangent.slip_force[one] = row[2], row[3]
        tangent.limit_velocity[one], tangent.state[0, one] = row[4], row[7]
        tangent.upward[one], tangent.downward[one] = row[5], row[6]
        tangent.stribeck_velocity[one] = row[8]
        tangent.of_friction[one] = 1.0 if coordinate in _OF_FRICTION else 0.0
    for step in range(course.force.size):
        place, age = course.place[step], course.age[step]
        square = place * place
        signals = (
            1.0,
            square - 1.0 / 3.0,
            place * (square - 0.6),
            age,
            lagged[step],
            place,
            age,
            course.slowness[step],
        )
        for one, coordinate in enumerate(coordinates):
            total = 0.0
            for index, signal in enumerate(signals):
                total += shares[coordinate, index] * signal
            tangent.signals[step, one] = total
    return tangent


@compiled
def drive_stem(
    course: Course,
    at: Place,
    force: NDArray[np.float64],
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
    tangent: Tangent | None = None,
) -> int:
    """Fill in the force less the preload (N), the positions (m) and the velocities (m/s).

    Return the result of `run_stem`, which carries a `tangent` along.
    """
    stiff = at.spring_constant * course.stroke
    curved, cubic = at.curvature * stiff, at.cubic * stiff
    drift = at.drift * course.span
    viscous, dry = at.viscous_friction, at.coulomb_friction
    bent = at.spring_constant * at.presliding
    for step in range(force.size):
        force[step] = course.force[step]
    _lag(force.reshape(-1, 1), at.force_lag, course.period)
    grip = np.empty_like(force)
    for step in range(force.size):
        place, age = course.place[step], course.age[step]
        if at.force_lag < 0.0:
            before, after = max(step - 1, 0), min(step + 1, force.size - 1)
            rise = course.force[after] - course.force[before]
            force[step] -= at.force_lag * rise / ((after - before) * course.period)
        square = place * place
        force[step] += (
            drift * age
            - at.spring_preload
            - curved * (square - 1.0 / 3.0)
            - cubic * place * (square - 0.6)
        )
        trend = at.along_travel * place + at.in_record * age
        grip[step] = dry * (trend + at.at_low_speed * course.slowness[step])
    side = min(max(at.viscous_asymmetry, -_LARGEST_ASYMMETRY), _LARGEST_ASYMMETRY)
    falling = at.stribeck_velocity if at.slip_force > 0.0 else 0.0
    dry += bent  # the reading of a sliding stem is off by the bristle's bend
    static = dry + at.slip_force
    spring, zone, travel = at.spring_constant, at.limit_velocity, course.travel
    upward = Dynamics(at.mass, viscous * (1.0 + side), dry, static, spring, zone, travel, falling)
    downward = Dynamics(at.mass, viscous * (1.0 - side), dry, static, spring, zone, travel, falling)
    positions[0] = at.start_position
    if travel < np.inf:
        positions[0] = min(max(at.start_position, 0.0), travel)
    velocities[0] = course.leaving[0]
    return run_stem(
        force,
        course.period,
        upward,
        downward,
        positions,
        velocities,
        grip,
        course.anew,
        course.leaving,
        tangent,
    )


@compiled
def _held(at: Place, force: float, position: float, velocity: float) -> tuple[float, float]:
    """Return the bend of the bristle over the largest, and whether it follows the force."""
    if velocity != 0.0:
        return math.copysign(1.0, velocity), 0.0
    full = at.coulomb_friction + at.spring_constant * at.presliding + at.slip_force + 1e-9
    share = (force - at.spring_constant * position) / full
    return min(max(share, -1.0), 1.0), 1.0 / full if abs(share) < 1.0 else 0.0


@compiled
def read_stem(
    course: Course, at: Place, cells: NDArray[np.float64], readings: NDArray[np.float64]
) -> None:
    """Fill in the readings of the stem's sensor, m, at places between the steps.

    A bristle that is bent by δ at full friction adds δ·F/F_s while the stem rests, ±δ while it
    slides. A slow sensor is a first-order lag, a late clock a shift.
    """
    force = np.empty_like(course.force)
    positions, velocities = np.empty_like(force), np.empty_like(force)
    drive_stem(course, at, force, positions, velocities)
    if at.presliding != 0.0:
        for step in range(force.size):
            held, _ = _held(at, force[step], positions[step], velocities[step])
            positions[step] += at.presliding * held
    _lag(positions.reshape(-1, 1), at.stem_lag, course.period)
    shift = at.delay / course.period
    last = force.size - 2
    for cell in range(cells.size):
        place = cells[cell] - shift
        step = min(max(math.floor(place), 0), last)
        share = place - step
        share = min(share, 1.0)
        readings[cell] = positions[step] + share * (positions[step + 1] - positions[step])


@compiled
def _bend(
    at: Place,
    force: NDArray[np.float64],
    coordinates: NDArray[np.int64],
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
    tangent: Tangent,
) -> None:
    """Add the bend of the bristle to the positions and to their derivatives."""
    found, bristle = tangent.positions, -1
    for one, coordinate in enumerate(coordinates):
        if coordinate == _PRESLIDING:
            bristle = one
    if bristle < 0 and at.presliding == 0.0:
        return
    for step in range(force.size):
        held, share = _held(at, force[step], positions[step], velocities[step])
        if share > 0.0:
            share *= at.presliding
            for one in range(coordinates.size):
                pull = (1.0 - tangent.of_friction[one]) * tangent.signals[step, one]
                pull -= tangent.spring_constant[one] * positions[step]
                pull -= at.spring_constant * found[step, one]
                full = tangent.coulomb_friction[one] + tangent.slip_force[one]
                found[step, one] += share * (pull - held * full)
        if bristle >= 0:
            found[step, bristle] += held
        positions[step] += at.presliding * held


@compiled
def _mixed(turned: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which columns have several entries other than zero."""
    found = np.empty(turned.shape[1], dtype=np.bool_)
    for one in range(found.size):
        parts = 0
        for other in range(turned.shape[0]):
            parts += turned[other, one] != 0.0
        found[one] = parts > 1
    return found


@compiled
def _read_cells(
    cells: NDArray[np.float64],
    shift: float,
    found: NDArray[np.float64],
    coordinates: NDArray[np.int64],
    late: NDArray[np.float64],
    turned: NDArray[np.float64],
    slopes: NDArray[np.float64],
) -> None:
    """Interpolate derivatives between the steps, and convert them to other coordinates."""
    size = coordinates.size
    read, is_mixed = np.empty(size), _mixed(turned)
    for cell in range(cells.size):
        place = cells[cell] - shift
        step = min(max(math.floor(place), 0), late.size - 1)
        share = min(place - step, 1.0)
        slope = late[step] if share < 1.0 else 0.0
        if share < _AT_STEP and step > 0:
            slope = 0.5 * (late[step - 1] + late[step])
        elif 1.0 - _AT_STEP < share < 1.0 and step + 1 < late.size:
            slope = 0.5 * (late[step] + late[step + 1])
        for one in range(size):
            read[one] = found[step, one] + share * (found[step + 1, one] - found[step, one])
            if coordinates[one] == _DELAY:
                read[one] += slope
            slopes[cell, one] = turned[one, one] * read[one]
        for one in range(size):
            if is_mixed[one]:
                slopes[cell, one] = 0.0
                for other in range(size):
                    slopes[cell, one] += turned[other, one] * read[other]


@compiled
def read_slopes(
    course: Course,
    at: Place,
    coordinates: NDArray[np.int64],
    turned: NDArray[np.float64],
    cells: NDArray[np.float64],
    room: NDArray[np.float64],
    slopes: NDArray[np.float64],
) -> None:
    """Differentiate the readings of `read_stem`, (c, p), all in one simulation.

    The `coordinates`, (p,), are numbered as in `Place`; `turned`, (p, p), are their derivatives by
    the coordinates of the result (columns); `cells`, (c,), are the times of the readings, in steps.
    The `room`, (2, g, p), is work space: allocating it at each call would cost more than the work.
    """
    force = np.empty_like(course.force)
    positions, velocities = np.empty_like(force), np.empty_like(force)
    tangent = _tangent(course, at, coordinates, room)
    drive_stem(course, at, force, positions, velocities, tangent)
    _bend(at, force, coordinates, positions, velocities, tangent)
    slow = np.zeros_like(force)
    _lag_slope(positions, at.stem_lag, course.period, slow)
    _lag(tangent.positions, at.stem_lag, course.period)
    _lag(positions.reshape(-1, 1), at.stem_lag, course.period)
    late = np.empty(positions.size - 1)
    for step in range(late.size):
        late[step] = (positions[step] - positions[step + 1]) / course.period
    for one, coordinate in enumerate(coordinates):
        if coordinate == _STEM_LAG:
            for step in range(slow.size):
                tangent.positions[step, one] = slow[step]
    shift = at.delay / course.period
    _read_cells(cells, shift, tangent.positions, coordinates, late, turned, slopes)
