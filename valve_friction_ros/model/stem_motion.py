# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One step of the Karnopp model: rest, breakaway, sliding, stopping, travel stops.

The stem is described by position and velocity alone; a velocity of exactly zero means rest.
Sliding is treated in a mirrored frame in which the stem moves up, so each rule is written once; the
friction of the two directions may differ. Chords follow friction that falls with the speed
(Stribeck): each chord is a Coulomb and a viscous friction over a short step.
"""

import math

from valve_friction_ros.model.compiled import compiled
from valve_friction_ros.model.linear_motion import (
    Dynamics,
    Motion,
    first_turn,
    impulse_response,
    motion_after,
    sliding_friction,
)
from valve_friction_ros.model.stem_tangent import (
    LET_GO,
    RESTS,
    SLIDES,
    STOPS,
    TURNS,
    WAITED,
    Phase,
    Tangent,
    carry_slide,
    leave,
)

_NARROW = 1e-3
"""Least width of a chord over its largest change of speed. Chosen: avoids a division by
rounding."""

_FALLEN = 20.0
"""Speed over the Stribeck velocity above which friction is constant: e⁻⁴⁰⁰ of the fall is left."""

_ROOT_ITERATIONS = 100
"""Most iterations of a root. Chosen: bisection alone needs 53 for double precision."""

_ROOT_TOLERANCE = 1e-11
"""Step of Newton's method, over the time searched, after which only rounding is left."""

_MOST_EVENTS = 1_000_000
"""Events within a sample, or turns within a slide, after which the simulation gives up.

Of 288 simulations with samples of 1 ms to 1 s the busiest had 1089 events and 117 turns; a million
take about a second.
"""

_MOST_TRIES = 64
"""Tries of a shorter chord. Each has at most two thirds of the length of the one before, so that
the 52nd is shorter than a billionth of the sample, and is accepted whatever it gives."""

STRIBECK_STEP = 0.04
"""Approximate change of speed per chord, over the Stribeck velocity.

Chosen: the error of the position against Radau's method stays below 0.1 µm on the bench."""


@compiled
def _time_of_velocity(
    start: Motion, jerk: float, dynamics: Dynamics, target: float, early: float, late: float
) -> float:
    """Time in [early, late] at which the velocity, falling there, reaches `target`."""
    damping = dynamics.viscous_friction / dynamics.mass
    stiffness = dynamics.spring_constant / dynamics.mass
    time = 0.5 * (early + late)
    for _ in range(_ROOT_ITERATIONS):
        now = motion_after(start, jerk, impulse_response(damping, stiffness, time), time)
        if now.velocity > target:
            early = time
        else:
            late = time
        newton = (
            time - (now.velocity - target) / now.acceleration if now.acceleration < 0 else early
        )
        if abs(newton - time) <= _ROOT_TOLERANCE * late:
            return min(max(newton, early), late)
        time = newton if early < newton < late else 0.5 * (early + late)
    return time


@compiled
def _time_of_position(
    start: Motion, jerk: float, dynamics: Dynamics, target: float, late: float
) -> float:
    """Time in [0, late] at which the position, rising there, reaches `target`."""
    damping = dynamics.viscous_friction / dynamics.mass
    stiffness = dynamics.spring_constant / dynamics.mass
    early = 0.0
    time = 0.5 * late
    for _ in range(_ROOT_ITERATIONS):
        now = motion_after(start, jerk, impulse_response(damping, stiffness, time), time)
        if now.position < target:
            early = time
        else:
            late = time
        newton = time - (now.position - target) / now.velocity if now.velocity > 0 else late
        if abs(newton - time) <= _ROOT_TOLERANCE * late:
            return min(max(newton, early), late)
        time = newton if early < newton < late else 0.5 * (early + late)
    return time


@compiled
def _time_to_rest(
    start: Motion, jerk: float, dynamics: Dynamics, force: float, slope: float, duration: float
) -> float:
    """Time at which the sliding stem comes to rest, inf if not within `duration`.

    It rests where its speed falls to the limit velocity while static friction can hold it, or
    reaches zero. `force` + `slope`·t is the actuator force less the preload.
    """
    damping = dynamics.viscous_friction / dynamics.mass
    stiffness = dynamics.spring_constant / dynamics.mass
    swing = stiffness - damping * damping / 4
    half_period = math.pi / math.sqrt(swing) if swing > 0 else math.inf
    early, early_velocity = 0.0, start.velocity
    late = min(first_turn(start.acceleration, jerk, damping, stiffness), duration)
    for _ in range(_MOST_EVENTS):
        end = motion_after(start, jerk, impulse_response(damping, stiffness, late), late)
        if early_velocity > dynamics.limit_velocity >= end.velocity:
            time = _time_of_velocity(start, jerk, dynamics, dynamics.limit_velocity, early, late)
            held = motion_after(start, jerk, impulse_response(damping, stiffness, time), time)
            pull = force + slope * time - dynamics.spring_constant * held.position
            if pull <= dynamics.static_friction:
                return time
        if end.velocity <= 0 and end.velocity < early_velocity:
            return _time_of_velocity(start, jerk, dynamics, 0.0, early, late)
        if not late < duration:  # so that an overflow ends here, too
            return math.inf
        early, early_velocity = late, end.velocity
        late = min(late + half_period, duration)
    raise ArithmeticError("the stem reverses a million times within one sample: sample faster")


@compiled
def _slide_up(
    start: Motion, dynamics: Dynamics, force: float, slope: float, duration: float, stop: float
) -> tuple[float, float, float]:
    """Slide upwards until rest, the travel stop at `stop`, or the end of `duration`.

    Returns the position, the velocity (zero at rest) and the time that has passed.
    """
    damping = dynamics.viscous_friction / dynamics.mass
    stiffness = dynamics.spring_constant / dynamics.mass
    jerk = slope / dynamics.mass - stiffness * start.velocity
    rest = _time_to_rest(start, jerk, dynamics, force, slope, duration)
    time = min(rest, duration)
    end = motion_after(start, jerk, impulse_response(damping, stiffness, time), time)
    if end.position >= stop:
        return stop, 0.0, _time_of_position(start, jerk, dynamics, stop, time)
    if rest <= duration:
        return end.position, 0.0, time
    return end.position, max(end.velocity, 0.0), time


@compiled
def _chord(dynamics: Dynamics, speed: float, other: float) -> Dynamics:
    """Linearise Stribeck friction between two different speeds.

    Where friction falls with the speed faster than its viscous part rises, the chord is taken
    level at the mean of both ends, which keeps the motion within a step monotone.
    """
    friction = sliding_friction(dynamics, speed)
    change = sliding_friction(dynamics, other) - friction
    slope = max(change / (other - speed), 0.0)
    if slope == 0.0:
        friction += 0.5 * change
    return Dynamics(
        dynamics.mass,
        slope,
        friction - slope * speed,
        dynamics.static_friction,
        dynamics.spring_constant,
        dynamics.limit_velocity,
        dynamics.travel,
        dynamics.stribeck_velocity,
    )


@compiled
def _chord_reach(dynamics: Dynamics, speed: float) -> float:
    """Change of speed over which a chord is valid: larger where friction has fallen further."""
    ratio = min(speed / dynamics.stribeck_velocity, _FALLEN)
    return STRIBECK_STEP * dynamics.stribeck_velocity * math.exp(0.25 * ratio * ratio)


@compiled
def _slide_one_way(
    position: float,
    speed: float,
    dynamics: Dynamics,
    force: float,
    slope: float,
    duration: float,
    stop: float,
) -> tuple[float, float, float, Dynamics]:
    """Slide upwards as `_slide_up`, at most while a chord of the friction is valid; return it, too.

    Where friction does not fall with the speed, the chord is the friction itself.
    """
    pull = force - dynamics.spring_constant * position
    if speed == 0.0:
        pull = max(pull, dynamics.static_friction)
    if dynamics.stribeck_velocity == 0.0:
        excess = pull - dynamics.coulomb_friction - dynamics.viscous_friction * speed
        start = Motion(position, speed, excess / dynamics.mass)
        reached, final, time = _slide_up(start, dynamics, force, slope, duration, stop)
        return reached, final, time, dynamics
    acceleration = (pull - sliding_friction(dynamics, speed)) / dynamics.mass
    largest = _chord_reach(dynamics, speed)
    change = abs(acceleration) * duration
    step = duration if change <= largest else duration * largest / change
    for _ in range(_MOST_TRIES):
        gain = min(max(acceleration * step, -0.5 * speed), largest)
        other = speed + (gain if abs(gain) > _NARROW * largest else _NARROW * largest)
        local = _chord(dynamics, speed, other)
        push = pull - local.coulomb_friction - local.viscous_friction * speed
        start = Motion(position, speed, push / dynamics.mass)
        reached, final, time = _slide_up(start, local, force, slope, step, stop)
        strays = abs(final - speed)
        allowed = min(largest, _chord_reach(dynamics, final))
        if final == 0.0 or strays <= 1.5 * allowed or step < 1e-9 * duration:
            return reached, final, time, local
        step *= max(allowed / strays, 0.01)
    raise ArithmeticError("no chord of the falling friction is short enough")


@compiled
def _stop_ahead(side: float, travel: float) -> float:
    """Mirrored position of the travel stop towards `side`; inf for a machine without stops."""
    return travel if side > 0 or travel == math.inf else 0.0


@compiled
def _breakaway(
    position: float, pull: float, slope: float, upward: Dynamics, downward: Dynamics
) -> tuple[float, float]:
    """Side (+1 up, −1 down) to which the resting stem leaves first, and the time until then.

    `pull` + `slope`·t is the actuator force less spring and preload. The stem leaves when it
    exceeds the static friction towards a side without a travel stop; the time is inf if it does
    not leave.
    """
    up, down = math.inf, math.inf
    if position < upward.travel:
        if pull > upward.static_friction:
            up = 0.0
        elif slope > 0:
            up = (upward.static_friction - pull) / slope
    if position > 0 or upward.travel == math.inf:
        if -pull > downward.static_friction:
            down = 0.0
        elif slope < 0:
            down = (downward.static_friction + pull) / -slope
    return (1.0, up) if up < down else (-1.0, down)


@compiled
def advance_stem(
    position: float,
    velocity: float,
    force: float,
    slope: float,
    duration: float,
    upward: Dynamics,
    downward: Dynamics,
    tangent: Tangent | None = None,
) -> tuple[float, float]:
    """Advance the stem by `duration` under a force that is linear in time.

    Exact, except for friction that falls with the speed, which chords approximate
    (`STRIBECK_STEP`).

    Parameters
    ----------
    position, velocity : float
        State of the stem at the start, m and m/s.
    force, slope : float
        Actuator force less the spring preload at the start, N, and its rate, N/s.
    duration : float
        Length of the step, s.
    upward, downward : Dynamics
        Parameters of the model for either way.
    tangent : Tangent, optional
        Derivatives of the stem, after `begin_step`; they are carried along.

    Returns
    -------
    position, velocity : float
        State of the stem at the end; the velocity is exactly zero at rest.
    """
    shortest_phase = 1e-12 * duration
    elapsed = 0.0
    spring = upward.spring_constant
    has_stopped = False
    for _ in range(_MOST_EVENTS):
        if not elapsed < duration:
            return position, velocity
        pull = force + slope * elapsed - spring * position
        if velocity == 0.0:
            side, wait = _breakaway(position, pull, slope, upward, downward)
            elapsed += wait
            if elapsed >= duration:
                return position, velocity
            if tangent is not None:
                way = upward if side > 0 else downward
                pull = side * (force + slope * elapsed - spring * position)
                pull = max(pull, way.static_friction)
                cause = WAITED if wait > 0.0 else TURNS if has_stopped else LET_GO
                falls = way.stribeck_velocity > 0.0
                held = way.static_friction if falls else way.coulomb_friction
                push = (pull - held) / way.mass
                leave(tangent, side, position, push, side * slope, spring, elapsed, cause)
        else:
            side = 1.0 if velocity > 0 else -1.0
        way = upward if side > 0 else downward
        stop = _stop_ahead(side, upward.travel)
        drive, left = side * (force + slope * elapsed), duration - elapsed
        reached, speed, time, chord = _slide_one_way(
            side * position, abs(velocity), way, drive, side * slope, left, stop
        )
        if tangent is not None:
            has_stopped = speed == 0.0
            end = SLIDES if speed > 0.0 else STOPS if reached == stop else RESTS
            pull = side * (force + slope * elapsed - spring * position)
            if velocity == 0.0:
                pull = max(pull, way.static_friction)
            at, rate = side * position, side * slope
            carry_slide(
                tangent,
                Phase(side, elapsed, time, at, abs(velocity), pull, rate, way, chord, end),
            )
        position, velocity = side * reached, side * speed
        elapsed += max(time, shortest_phase)
    raise ArithmeticError(
        "the stem starts or stops a million times within one sample: sample faster"
    )
