# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

r"""Derivatives of the simulated stem by its parameters, carried along with it.

Between two events the motion is linear, and so is its derivative: a change of the start, of the
force, of the friction and of mass, damping and spring adds up. At an event it jumps, as the time of
the event changes too (saltation). With the derivative δ at a fixed time and the acceleration a,

- a stem that comes to rest at the speed w (zero, or the limit velocity) does so later by
  dt = (dw − δv)/a; from then on δx is δx + w·dt, and δv is 0;
- a stem that breaks away does so later by dt = (dF_s − δ(F − k·x))/Ḟ; from then on δv is −a·dt,
  with the acceleration a after the breakaway, and δx is as before;
- a stem that turns without a rest breaks away when it has stopped: both with the same dt;
- at a travel stop both are 0.

Friction that falls with the speed is a chord between two speeds there. At the second one it drops,
later by dt = −δv/a, so that from then on δv is δv·a′/a with the acceleration a′ after the drop.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.compiled import compiled
from valve_friction_ros.model.linear_motion import (
    Dynamics,
    Motion,
    friction_fall,
    impulse_response,
    motion_after,
    self_convolution,
    sliding_friction,
)

_STEEPEST = 4.0
"""Largest ratio of the accelerations at the end of a chord: next to a steady speed, where a is
zero, the time of the drop has no derivative."""


_FORGOTTEN = 1e-100
"""Derivative below which it is zero: one that decayed on to 1e-308 would slow the processor down
tenfold."""


@compiled
def unless_forgotten(derivative: float) -> float:
    """Return a derivative that decays, or zero where nothing of it is left."""
    return derivative if abs(derivative) > _FORGOTTEN else 0.0


class Tangent(NamedTuple):
    """Derivatives by p parameters: of the drive of the stem, and of the stem itself.

    Attributes
    ----------
    mass, spring_constant, coulomb_friction, slip_force, limit_velocity, stribeck_velocity : ndarray
        Of the constants of `Dynamics`, shape (p,) each; the slip force is F_s − F_c.
    upward, downward : ndarray of float, shape (p,)
        Of the viscous friction of either way.
    signals : ndarray of float, shape (g, p)
        At each sample, of the force, or of the graded friction of `run_stem`.
    of_friction : ndarray of float, shape (p,)
        One where `signals` are of the graded friction, zero where they are of the force.
    state : ndarray of float, shape (2, p)
        Of the stem's position and velocity, where the simulation is.
    facing : ndarray of float, shape (5, p)
        Values that `face` sets up.
    late : ndarray of float, shape (p,)
        Of the time at which it last came to rest.
    pull, rate, grip : ndarray of float, shape (p,)
        Of the force, its rate and the graded friction of one step.
    positions : ndarray of float, shape (g, p)
        Of the position at each sample: the result.
    """

    mass: NDArray[np.float64]
    spring_constant: NDArray[np.float64]
    coulomb_friction: NDArray[np.float64]
    slip_force: NDArray[np.float64]
    limit_velocity: NDArray[np.float64]
    stribeck_velocity: NDArray[np.float64]
    upward: NDArray[np.float64]
    downward: NDArray[np.float64]
    signals: NDArray[np.float64]
    of_friction: NDArray[np.float64]
    state: NDArray[np.float64]
    facing: NDArray[np.float64]
    late: NDArray[np.float64]
    pull: NDArray[np.float64]
    rate: NDArray[np.float64]
    grip: NDArray[np.float64]
    positions: NDArray[np.float64]


class Phase(NamedTuple):
    """A stretch of sliding one way, mirrored so that it is upwards.

    Attributes
    ----------
    side : float
        1 for upwards, −1 for downwards.
    begin, duration : float
        Time since the beginning of the step, s, and length, s.
    position, speed, pull : float
        At its beginning, m, m/s, and the force less spring and preload, N.
    slope : float
        Rate of the force, N/s.
    way : Dynamics
        Parameters of that way.
    chord : Dynamics
        The same with the Coulomb and the viscous friction of the chord, where friction falls with
        the speed.
    end : int
        How it ends: of `SLIDES`, `RESTS` and `STOPS`.
    """

    side: float
    begin: float
    duration: float
    position: float
    speed: float
    pull: float
    slope: float
    way: Dynamics
    chord: Dynamics
    end: int


SLIDES, RESTS, STOPS = 0, 1, 2
"""How a phase ends: the stem slides on, comes to rest, or is at a travel stop."""

WAITED, TURNS, LET_GO = 0, 1, 2
"""Why a stem breaks away: the force has grown, it had come to rest in that instant and turns, or
the step began with less friction than the one before."""


@compiled
def no_tangent(
    parameters: int, signals: NDArray[np.float64], positions: NDArray[np.float64]
) -> Tangent:
    """Return derivatives that are zero, in the arrays of `signals` and `positions`."""
    signals[:] = 0.0
    return Tangent(
        np.zeros(parameters),
        np.zeros(parameters),
        np.zeros(parameters),
        np.zeros(parameters),
        np.zeros(parameters),
        np.zeros(parameters),
        np.zeros(parameters),
        np.zeros(parameters),
        signals,
        np.zeros(parameters),
        np.zeros((2, parameters)),
        np.zeros((5, parameters)),
        np.zeros(parameters),
        np.zeros(parameters),
        np.zeros(parameters),
        np.zeros(parameters),
        positions,
    )


@compiled
def set_anew(tangent: Tangent | None, sample: int) -> None:
    """Restart at a measured position, which depends on no parameter."""
    if tangent is None:
        return
    for one in range(tangent.late.size):
        tangent.state[0, one] = tangent.state[1, one] = tangent.positions[sample, one] = 0.0


@compiled
def keep(tangent: Tangent | None, first: int, last: int) -> None:
    """Store the derivative of the position for the samples after `first` up to `last`."""
    if tangent is None:
        return
    for sample in range(first + 1, last + 1):
        for one in range(tangent.late.size):
            tangent.positions[sample, one] = tangent.state[0, one]


@compiled
def begin_step(tangent: Tangent | None, sample: int, period: float) -> None:
    """Set up the drive of the stem between a sample and the next, its friction as their mean."""
    if tangent is None:
        return
    for one in range(tangent.late.size):
        now, then = tangent.signals[sample, one], tangent.signals[sample + 1, one]
        friction = tangent.of_friction[one]
        tangent.pull[one] = (1.0 - friction) * now
        tangent.rate[one] = (1.0 - friction) * (then - now) / period
        tangent.grip[one] = friction * 0.5 * (now + then)


@compiled
def leave(
    tangent: Tangent,
    side: float,
    place: float,
    acceleration: float,
    slope: float,
    stiffness: float,
    time: float,
    cause: int,
) -> None:
    """Break away from a rest to `side` at a position (not mirrored), `time` into the step.

    `acceleration` is that after the breakaway, m/s², and `slope` the rate of the force, N/s,
    both mirrored, `stiffness` that of the spring, N/m; `cause` is one of `WAITED`, `TURNS` and
    `LET_GO`.
    """
    for one in range(tangent.late.size):
        late = 0.0
        if cause == WAITED:
            pull = tangent.pull[one] + tangent.rate[one] * time
            pull -= tangent.spring_constant[one] * place + stiffness * tangent.state[0, one]
            held = tangent.coulomb_friction[one] + tangent.slip_force[one] + tangent.grip[one]
            late = (held - side * pull) / slope
        elif cause == TURNS:
            late = tangent.late[one]
        tangent.state[1, one] = -side * acceleration * late


@compiled
def _come_to_rest(tangent: Tangent, side: float, end: Motion, limit_velocity: float) -> None:
    """Let the stem rest from a mirrored motion on, at the limit velocity or where it turns."""
    is_limit = 2.0 * end.velocity > limit_velocity
    speed = limit_velocity if is_limit else 0.0
    for one in range(tangent.late.size):
        tangent.late[one] = 0.0
        if end.acceleration < 0.0:
            changed = tangent.limit_velocity[one] if is_limit else 0.0
            tangent.late[one] = (changed - side * tangent.state[1, one]) / end.acceleration
        tangent.state[0, one] += side * speed * tangent.late[one]
        tangent.state[1, one] = 0.0


@compiled
def carry_slide(tangent: Tangent, phase: Phase) -> None:
    """Carry the derivatives through a phase of sliding and the event that ends it."""
    way, side, time, speed = phase.chord, phase.side, phase.duration, phase.speed
    mass, spring, viscous = way.mass, way.spring_constant, way.viscous_friction
    damping, stiffness = viscous / mass, spring / mass
    acceleration = (phase.pull - way.coulomb_friction - viscous * speed) / mass
    jerk = phase.slope / mass - stiffness * speed
    response = impulse_response(damping, stiffness, time)
    lost = self_convolution(damping, stiffness, time, response)
    end = motion_after(Motion(phase.position, speed, acceleration), jerk, response, time)
    fall, later = friction_fall(phase.way, speed), friction_fall(phase.way, end.velocity)
    share = 0.5 * (fall.share + later.share)
    by_stribeck = 0.5 * (fall.by_stribeck + later.by_stribeck)
    falls = phase.way.stribeck_velocity > 0.0
    if falls and speed > 0.0:
        true = (phase.pull - sliding_friction(phase.way, speed)) / mass
        if true != 0.0:
            tangent.state[1] *= min(max(acceleration / true, 1.0 / _STEEPEST), _STEEPEST)
    for one in range(tangent.late.size):
        place, motion = side * tangent.state[0, one], side * tangent.state[1, one]
        of_spring, of_mass = tangent.spring_constant[one], tangent.mass[one]
        of_viscous = tangent.upward[one] if side > 0.0 else tangent.downward[one]
        force = side * (tangent.pull[one] + tangent.rate[one] * phase.begin)
        force -= tangent.coulomb_friction[one] + tangent.grip[one]
        force -= tangent.slip_force[one] * share
        force -= tangent.stribeck_velocity[one] * by_stribeck
        force -= of_spring * phase.position + spring * place
        of_push = (force - of_viscous * speed - viscous * motion - acceleration * of_mass) / mass
        of_jerk = side * tangent.rate[one] - of_spring * speed - spring * motion - jerk * of_mass
        of_jerk /= mass
        of_damping = (of_viscous - damping * of_mass) / mass
        of_stiffness = (of_spring - stiffness * of_mass) / mass
        by_push = lost.value * of_damping + lost.integral * of_stiffness
        by_jerk = lost.integral * of_damping + lost.second_integral * of_stiffness
        final = place + motion * time + of_push * response.integral
        final += of_jerk * response.second_integral - acceleration * by_push - jerk * by_jerk
        faster = motion + of_push * response.value + of_jerk * response.integral
        faster -= acceleration * (lost.slope * of_damping + lost.value * of_stiffness)
        faster -= jerk * by_push
        tangent.state[0, one], tangent.state[1, one] = side * final, side * faster
    if phase.end == STOPS:
        tangent.state[:] = 0.0
    elif phase.end == RESTS:
        _come_to_rest(tangent, side, end, way.limit_velocity)
    elif falls and end.acceleration != 0.0:
        left = way.coulomb_friction + viscous * end.velocity
        change = (left - sliding_friction(phase.way, end.velocity)) / mass
        tangent.state[1] *= min(max(1.0 + change / end.acceleration, 1.0 / _STEEPEST), _STEEPEST)


@compiled
def face(tangent: Tangent, side: float) -> None:
    """Set up the derivatives that `run_stem` uses, for sliding to one side."""
    ways = tangent.upward if side > 0.0 else tangent.downward
    for one in range(tangent.late.size):
        tangent.facing[0, one] = 1.0 - (1.0 + side) * tangent.of_friction[one]
        tangent.facing[1, one] = -side * tangent.coulomb_friction[one]
        tangent.facing[2, one] = ways[one]
        tangent.facing[3, one] = tangent.spring_constant[one]
        tangent.facing[4, one] = tangent.mass[one]
