# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The stem through all samples: short cuts without events, located events between them.

A sample of sliding is a linear map; a friction that falls with the speed is followed by its chords.

Friction may be graded by the sample, and the stem reset after a gap. numba leaves out the
branches of an argument that is None, so a simulation without them costs nothing more.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.compiled import compiled, compiled_products
from valve_friction_ros.model.linear_motion import (
    Dynamics,
    friction_fall,
    impulse_response,
    self_convolution,
    sliding_friction,
)
from valve_friction_ros.model.stem_motion import STRIBECK_STEP, advance_stem
from valve_friction_ros.model.stem_tangent import (
    Tangent,
    begin_step,
    face,
    keep,
    set_anew,
    unless_forgotten,
)

_FALLEN = 6.0
"""Speed over the Stribeck velocity above which the remaining fall is below rounding: e⁻³⁶."""


class SlidingMap(NamedTuple):
    """One sample of sliding, one way: the exact solution as a linear map.

    With the excess force e = f − F_c (F_c against the motion) and its change Δ,

        ẋ' = ẋ·velocity_kept + x·velocity_by_position + e·velocity_by_force + Δ·velocity_by_change
        x' = x·position_kept + ẋ·position_by_velocity + e·position_by_force + Δ·position_by_change

    `reach` is the largest change of the velocity by a unit of force within the sample.
    """

    position_kept: float
    position_by_velocity: float
    position_by_force: float
    position_by_change: float
    velocity_kept: float
    velocity_by_position: float
    velocity_by_force: float
    velocity_by_change: float
    reach: float


@compiled
def sliding_map(dynamics: Dynamics, period: float) -> SlidingMap:
    """Set up the map of one way of motion."""
    damping = dynamics.viscous_friction / dynamics.mass
    stiffness = dynamics.spring_constant / dynamics.mass
    response = impulse_response(damping, stiffness, period)
    # The impulse response rises no higher than 1/damping, nor than it would undamped.
    reach = min(period, 1 / damping if damping > 0 else math.inf) / dynamics.mass
    return SlidingMap(
        1.0 - stiffness * response.integral,
        response.value,
        response.integral / dynamics.mass,
        response.second_integral / (dynamics.mass * period),
        response.slope,
        -stiffness * response.value,
        response.value / dynamics.mass,
        response.integral / (dynamics.mass * period),
        reach,
    )


@compiled
def map_slopes(dynamics: Dynamics, period: float) -> NDArray[np.float64]:
    """Differentiate the map by viscous friction, spring constant and mass, shape (3, 8)."""
    mass = dynamics.mass
    damping, stiffness = dynamics.viscous_friction / mass, dynamics.spring_constant / mass
    response = impulse_response(damping, stiffness, period)
    lost = self_convolution(damping, stiffness, period, response)
    bend = response.value - damping * lost.slope - stiffness * lost.value
    slopes = np.empty((3, 8))
    directions = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-damping, -stiffness, 1.0))
    for row, direction in enumerate(directions):
        by_damping, by_stiffness = direction[0] / mass, direction[1] / mass
        by_mass = direction[2] / mass
        slope = -bend * by_damping - lost.slope * by_stiffness
        value = -lost.slope * by_damping - lost.value * by_stiffness
        integral = -lost.value * by_damping - lost.integral * by_stiffness
        second = -lost.integral * by_damping - lost.second_integral * by_stiffness
        slopes[row, 0] = -by_stiffness * response.integral - stiffness * integral
        slopes[row, 1] = value
        slopes[row, 2] = (integral - by_mass * response.integral) / mass
        slopes[row, 3] = (second - by_mass * response.second_integral) / (mass * period)
        slopes[row, 4] = slope
        slopes[row, 5] = -by_stiffness * response.value - stiffness * value
        slopes[row, 6] = (value - by_mass * response.value) / mass
        slopes[row, 7] = (integral - by_mass * response.integral) / (mass * period)
    return slopes


@compiled
def has_short_cut(dynamics: Dynamics, period: float) -> bool:
    """Return whether the velocity of a sliding stem turns at most once within a period.

    Chords of a falling friction damp less than the viscous friction, so the undamped oscillation
    decides there.
    """
    damping = dynamics.viscous_friction / dynamics.mass
    if dynamics.stribeck_velocity > 0.0:
        damping = 0.0
    stiffness = dynamics.spring_constant / dynamics.mass
    return (stiffness - damping * damping / 4) * period * period < math.pi**2


@compiled_products
def slid(
    slide: SlidingMap, position: float, velocity: float, excess: float, change: float
) -> tuple[float, float]:
    """Position and velocity after one sample of sliding."""
    place = (
        slide.position_kept * position
        + slide.position_by_velocity * velocity
        + (slide.position_by_force * excess + slide.position_by_change * change)
    )
    following = (
        slide.velocity_kept * velocity
        + slide.velocity_by_position * position
        + (slide.velocity_by_force * excess + slide.velocity_by_change * change)
    )
    return place, following


class ChordLadder(NamedTuple):
    """Chords of a falling friction over short ranges of speed, and their maps.

    The chords join, so the friction is continuous. The last range has no end; the friction does
    not fall in it.

    Attributes
    ----------
    spacing : float
        Width of a range, m/s.
    chords : ndarray of float, shape (r, 2)
        Coulomb and viscous friction of each chord.
    slides : ndarray of float, shape (r, 9)
        The map of each, in the order of `SlidingMap`.
    """

    spacing: float
    chords: NDArray[np.float64]
    slides: NDArray[np.float64]


@compiled_products
def rung_at(ladder: ChordLadder, speed: float) -> tuple[int, float, float, SlidingMap]:
    """Return the index of the range of a speed, Coulomb and viscous friction, and the map."""
    rung = min(int(speed / ladder.spacing), ladder.slides.shape[0] - 1)
    row = ladder.slides[rung]
    slide = SlidingMap(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8])
    return rung, ladder.chords[rung, 0], ladder.chords[rung, 1], slide


@compiled
def chord_ladder(way: Dynamics, period: float) -> ChordLadder:
    """Set up the chords of one direction; none where friction does not fall."""
    spacing = 0.5 * STRIBECK_STEP * way.stribeck_velocity
    rungs = int(_FALLEN * way.stribeck_velocity / spacing) + 1 if spacing > 0.0 else 0
    chords, slides = np.empty((rungs, 2)), np.empty((rungs, 9))
    for rung in range(rungs):
        speed = rung * spacing
        low, high = sliding_friction(way, speed), sliding_friction(way, speed + spacing)
        viscous = (high - low) / spacing
        chords[rung, 0], chords[rung, 1] = low - viscous * speed, viscous
        local = Dynamics(
            way.mass,
            max(viscous, 0.0),
            0.0,
            0.0,
            way.spring_constant,
            0.0,
            way.travel,
            0.0,
        )
        for index, value in enumerate(sliding_map(local, period)):
            slides[rung, index] = value
    return ChordLadder(spacing, chords, slides)


_Signal = NDArray[np.float64] | None


@compiled
def _more(grip: _Signal, sample: int) -> float:
    """Return the additional friction at a sample, N."""
    return 0.0 if grip is None else grip[sample]


@compiled
def _is_anew(anew: _Signal, sample: int) -> bool:
    """Return whether the stem is reset at a sample."""
    return False if anew is None else not np.isnan(anew[sample])


@compiled
def _rest_on(
    sample: int,
    position: float,
    forces: NDArray[np.float64],
    grip: _Signal,
    anew: _Signal,
    upward: Dynamics,
    downward: Dynamics,
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
) -> int:
    """Fill in the samples through which the stem certainly rests; return the last one."""
    held = upward.spring_constant * position
    highest, lowest = held + upward.static_friction, held - downward.static_friction
    for following in range(sample, forces.size):
        more = _more(grip, following)
        is_held = lowest - more <= forces[following] <= highest + more
        if following == sample and is_held:
            continue
        if not is_held or _is_anew(anew, following):
            return max(following - 1, sample)
        positions[following], velocities[following] = position, 0.0
    return forces.size - 1


@compiled_products
def _slide_on(
    sample: int,
    side: float,
    way: Dynamics,
    slide: SlidingMap,
    forces: NDArray[np.float64],
    grip: _Signal,
    anew: _Signal,
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
) -> int:
    """Fill in the samples through which the stem certainly slides to `side`; return the last one.

    That is certain if its speed exceeds the limit velocity at both ends of a sample and between
    them: the speed has no minimum there, or cannot fall so far. The stem must not reach a travel
    stop.
    """
    lowest, highest = (0.0, way.travel) if way.travel < np.inf else (-np.inf, np.inf)
    dry, spring, viscous = way.coulomb_friction, way.spring_constant, way.viscous_friction
    position, velocity = positions[sample], velocities[sample]
    excess = forces[sample] - side * (dry + _more(grip, sample))
    push = side * (excess - spring * position - viscous * velocity)
    if side * velocity <= way.limit_velocity:
        return sample
    left = forces.size - sample  # in a `for` loop numba fuses other products: other last digits
    while sample < forces.size - 1 and not _is_anew(anew, sample + 1):
        after = forces[sample + 1] - side * (dry + _more(grip, sample + 1))
        place, following = slid(slide, position, velocity, excess, after - excess)
        final_push = side * (after - spring * place - viscous * following)
        no_minimum = push >= 0 or final_push <= 0
        slowest = side * velocity + slide.reach * push
        if not (
            side * following > way.limit_velocity
            and (no_minimum or slowest > way.limit_velocity)
            and lowest < place < highest
        ):
            return sample
        sample += 1
        positions[sample], velocities[sample] = place, following
        position, velocity, excess, push = place, following, after, final_push
        left -= 1
        if left < 0:
            raise ArithmeticError("the stem slid on beyond the last sample")
    return sample


@compiled_products
def _slide_on_falling(
    sample: int,
    side: float,
    way: Dynamics,
    ladder: ChordLadder,
    forces: NDArray[np.float64],
    grip: _Signal,
    anew: _Signal,
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
) -> int:
    """Fill in samples as `_slide_on` where friction falls with the speed.

    Each sample takes the chord at its speed, if friction rises on it. The speed must not have a
    minimum within the sample, and must not leave the chord by more than half its width.
    """
    lowest, highest = (0.0, way.travel) if way.travel < np.inf else (-np.inf, np.inf)
    position, velocity = positions[sample], velocities[sample]
    if side * velocity <= way.limit_velocity:
        return sample
    top = ladder.slides.shape[0] - 1
    for _ in range(sample, forces.size - 1):
        if _is_anew(anew, sample + 1):
            return sample
        rung, dry, viscous, slide = rung_at(ladder, side * velocity)
        excess = forces[sample] - side * (dry + _more(grip, sample))
        after = forces[sample + 1] - side * (dry + _more(grip, sample + 1))
        place, following = slid(slide, position, velocity, excess, after - excess)
        push = side * (excess - way.spring_constant * position - viscous * velocity)
        final_push = side * (after - way.spring_constant * place - viscous * following)
        no_minimum = push >= 0 or final_push <= 0
        place_on_rung = side * following / ladder.spacing - rung
        if not (
            side * following > way.limit_velocity
            and no_minimum
            and viscous >= 0.0
            and place_on_rung >= -0.5
            and (place_on_rung <= 1.5 or rung == top)
            and lowest < place < highest
        ):
            return sample
        sample += 1
        positions[sample], velocities[sample] = place, following
        position, velocity = place, following
    return sample


@compiled_products
def _carry(
    tangent: Tangent | None,
    first: int,
    last: int,
    side: float,
    way: Dynamics,
    slide: SlidingMap,
    forces: NDArray[np.float64],
    grip: _Signal,
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
    period: float,
) -> None:
    """Carry the derivatives through the samples that `_slide_on` has filled in.

    The inner loop has few arrays, no call and no branch, so that the processor takes several
    parameters at once.
    """
    if tangent is None or first == last:
        return
    face(tangent, side)
    slopes, moved = map_slopes(way, period), np.empty((3, 2))
    signals, facing, state = tangent.signals, tangent.facing, tangent.state
    for sample in range(first, last):
        x, v = positions[sample], velocities[sample]
        e = forces[sample] - side * (way.coulomb_friction + _more(grip, sample))
        d = forces[sample + 1] - side * (way.coulomb_friction + _more(grip, sample + 1)) - e
        for row in range(3):
            by = slopes[row]
            moved[row, 0] = by[0] * x + by[1] * v + (by[2] * e + by[3] * d)
            moved[row, 1] = by[4] * v + by[5] * x + (by[6] * e + by[7] * d)
        x_viscous, x_spring, x_mass = moved[0, 0], moved[1, 0], moved[2, 0]
        v_viscous, v_spring, v_mass = moved[0, 1], moved[1, 1], moved[2, 1]
        for one in range(facing.shape[1]):
            force = facing[0, one] * signals[sample, one]
            change = facing[0, one] * signals[sample + 1, one] - force
            place, following = slid(
                slide, state[0, one], state[1, one], force + facing[1, one], change
            )
            viscous, spring, mass = facing[2, one], facing[3, one], facing[4, one]
            place += viscous * x_viscous + spring * x_spring + mass * x_mass
            following += viscous * v_viscous + spring * v_spring + mass * v_mass
            state[0, one] = unless_forgotten(place)
            state[1, one] = unless_forgotten(following)
            tangent.positions[sample + 1, one] = state[0, one]


@compiled_products
def _carry_falling(
    tangent: Tangent | None,
    first: int,
    last: int,
    side: float,
    way: Dynamics,
    ladder: ChordLadder,
    forces: NDArray[np.float64],
    grip: _Signal,
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
) -> None:
    """Carry the derivatives through the samples that `_slide_on_falling` has filled in.

    The change of the balance of forces by a parameter is taken as linear between both ends of a
    sample.
    """
    if tangent is None or first == last:
        return
    face(tangent, side)
    signals, facing, state = tangent.signals, tangent.facing, tangent.state
    for sample in range(first, last):
        _, dry, viscous, slide = rung_at(ladder, side * velocities[sample])
        x, v, w = positions[sample], velocities[sample], velocities[sample + 1]
        y = positions[sample + 1]
        a = forces[sample] - side * (dry + _more(grip, sample))
        a = (a - way.spring_constant * x - viscous * v) / way.mass
        b = forces[sample + 1] - side * (dry + _more(grip, sample + 1))
        b = (b - way.spring_constant * y - viscous * w) / way.mass
        now, then = friction_fall(way, side * v), friction_fall(way, side * w)
        for one in range(facing.shape[1]):
            slip, stribeck = side * tangent.slip_force[one], side * tangent.stribeck_velocity[one]
            force = facing[0, one] * signals[sample, one] + facing[1, one]
            force -= slip * now.share + stribeck * now.by_stribeck
            force -= facing[2, one] * v + facing[3, one] * x + facing[4, one] * a
            after = facing[0, one] * signals[sample + 1, one] + facing[1, one]
            after -= slip * then.share + stribeck * then.by_stribeck
            after -= facing[2, one] * w + facing[3, one] * y + facing[4, one] * b
            place, following = slid(slide, state[0, one], state[1, one], force, after - force)
            state[0, one] = unless_forgotten(place)
            state[1, one] = unless_forgotten(following)
            tangent.positions[sample + 1, one] = state[0, one]


@compiled
def _graded(way: Dynamics, more: float) -> Dynamics:
    """Return the dynamics with `more` Coulomb and static friction."""
    return Dynamics(
        way.mass,
        way.viscous_friction,
        max(way.coulomb_friction + more, 0.0),
        max(way.static_friction + more, 0.0),
        way.spring_constant,
        way.limit_velocity,
        way.travel,
        way.stribeck_velocity,
    )


@compiled
def run_stem(
    forces: NDArray[np.float64],
    period: float,
    upward: Dynamics,
    downward: Dynamics,
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
    grip: _Signal = None,
    anew: _Signal = None,
    leaving: _Signal = None,
    tangent: Tangent | None = None,
) -> int:
    """Step through `forces` (actuator less preload, N) from the state at sample 0.

    Rest and sliding over several samples take short cuts; `advance_stem` steps all samples between
    them, and so every sample with an event. `grip` (N) is added to the Coulomb and the static
    friction of each sample. Where `anew` is a number, the stem is reset to that position (m) and to
    the velocity `leaving` (m/s). A `tangent`, set up for the first sample, is carried along.
    Returns the number of samples that took no short cut.
    """
    up, down = sliding_map(upward, period), sliding_map(downward, period)
    steps_up, steps_down = chord_ladder(upward, period), chord_ladder(downward, period)
    is_quick = has_short_cut(upward, period) and has_short_cut(downward, period)
    falls = upward.stribeck_velocity > 0.0
    keep(tangent, -1, 0)
    sample = 0
    for stepped in range(forces.size):
        at, velocity, first = positions[sample], velocities[sample], sample
        side = 1.0 if velocity > 0 else -1.0
        way = upward if velocity > 0 else downward
        if velocity == 0.0:
            sample = _rest_on(
                sample, at, forces, grip, anew, upward, downward, positions, velocities
            )
            keep(tangent, first, sample)
        elif falls:
            ladder = steps_up if velocity > 0 else steps_down
            if is_quick:
                sample = _slide_on_falling(
                    sample, side, way, ladder, forces, grip, anew, positions, velocities
                )
            _carry_falling(
                tangent, first, sample, side, way, ladder, forces, grip, positions, velocities
            )
        else:
            step = up if velocity > 0 else down
            if is_quick:
                sample = _slide_on(
                    sample, side, way, step, forces, grip, anew, positions, velocities
                )
            _carry(
                tangent, first, sample, side, way, step, forces, grip, positions, velocities, period
            )
        if sample == forces.size - 1:
            return stepped
        if anew is not None and leaving is not None and not np.isnan(anew[sample + 1]):
            positions[sample + 1], velocities[sample + 1] = anew[sample + 1], leaving[sample + 1]
            set_anew(tangent, sample + 1)
        else:
            more = 0.5 * (_more(grip, sample) + _more(grip, sample + 1))
            begin_step(tangent, sample, period)
            positions[sample + 1], velocities[sample + 1] = advance_stem(
                positions[sample],
                velocities[sample],
                forces[sample],
                (forces[sample + 1] - forces[sample]) / period,
                period,
                _graded(upward, more),
                _graded(downward, more),
                tangent,
            )
            keep(tangent, sample, sample + 1)
        sample += 1
    raise ArithmeticError("the simulation did not reach its last sample")
