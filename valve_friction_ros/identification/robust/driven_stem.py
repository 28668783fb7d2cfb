"""The stem of a Karnopp valve with imperfections, and what its sensor reads, as machine code."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.compiled import compiled
from valve_friction_ros.model.stem_motion import Dynamics
from valve_friction_ros.model.stem_run import run_stem

__all__ = ["Course", "Place", "drive_stem", "read_stem"]

_LEAST_LAG = 1e-9
_LARGEST_ASYMMETRY = 0.9


class Course(NamedTuple):
    """What drives the stem at each step of the simulation, and the slow terms there.

    Attributes
    ----------
    period : float
        Step, s.
    travel : float
        Of the valve, m.
    stroke, span : float
        Range of the measured positions, m, and of the force, N.
    force : ndarray of float, shape (g,)
        Actuator force, N.
    place, age : ndarray of float, shape (g,)
        Measured position and time, −1 to 1.
    slowness : ndarray of float, shape (g,)
        Share of the friction at rest that is left at the measured speed.
    anew, leaving : ndarray of float, shape (g,)
        Where the stem is set anew, m, nan elsewhere; its velocity there, m/s.
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


@compiled
def _lag(signal: NDArray[np.float64], lag: float, period: float) -> None:
    """Pass a signal, linear between its samples, through a first-order lag.

    Before its first sample the signal is taken to have gone on as it begins: a record may begin in
    the midst of a move.
    """
    decay = math.exp(-period / lag)
    newest = 1.0 - lag * (1.0 - decay) / period
    before = signal[0]
    lagged = signal[0] - lag * (signal[1] - signal[0]) / period
    signal[0] = lagged
    for step in range(1, signal.size):
        after = signal[step]
        lagged = decay * lagged + newest * after + (1.0 - decay - newest) * before
        signal[step] = lagged
        before = after


@compiled
def drive_stem(
    course: Course,
    at: Place,
    force: NDArray[np.float64],
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
) -> int:
    """Fill in the force less the preload (N), the positions (m) and the velocities (m/s).

    Return what `run_stem` does.
    """
    stiff = at.spring_constant * course.stroke
    curved, cubic = at.curvature * stiff, at.cubic * stiff
    drift = at.drift * course.span
    viscous, dry = at.viscous_friction, at.coulomb_friction
    bent = at.spring_constant * at.presliding
    force[:] = course.force
    if at.force_lag > _LEAST_LAG:
        _lag(force, at.force_lag, course.period)
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
    )


@compiled
def read_stem(
    course: Course, at: Place, cells: NDArray[np.float64], readings: NDArray[np.float64]
) -> None:
    """Fill in what the stem's sensor reads, m, at places between the steps.

    A bristle that is bent by δ at full friction adds δ·F/F_s while the stem rests, ±δ while it
    slides. A slow sensor is a first-order lag, a late clock a shift.
    """
    force = np.empty_like(course.force)
    positions, velocities = np.empty_like(force), np.empty_like(force)
    drive_stem(course, at, force, positions, velocities)
    if at.presliding != 0.0:
        bent = at.spring_constant * at.presliding
        full = at.coulomb_friction + bent + at.slip_force + 1e-9
        for step in range(force.size):
            held = math.copysign(1.0, velocities[step])
            if velocities[step] == 0.0:
                share = (force[step] - at.spring_constant * positions[step]) / full
                held = min(max(share, -1.0), 1.0)
            positions[step] += at.presliding * held
    if at.stem_lag > _LEAST_LAG:
        _lag(positions, at.stem_lag, course.period)
    shift = at.delay / course.period
    last = force.size - 2
    for cell in range(cells.size):
        place = cells[cell] - shift
        step = min(max(math.floor(place), 0), last)
        share = place - step
        share = min(share, 1.0)
        readings[cell] = positions[step] + share * (positions[step + 1] - positions[step])
