# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The stem through all samples: short cuts without events, located events between them.

Friction may be graded by the sample, and the stem set anew after a gap. numba leaves out the
branches of an argument that is None, so a simulation without them costs nothing more.
"""

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.compiled import compiled, compiled_products
from valve_friction_ros.model.dynamics import Dynamics, friction_fall
from valve_friction_ros.model.sliding_map import (
    ChordLadder,
    SlidingMap,
    chord_ladder,
    has_short_cut,
    map_slopes,
    rung_at,
    slid,
    sliding_map,
)
from valve_friction_ros.model.stem_motion import advance_stem
from valve_friction_ros.model.stem_tangent import (
    Tangent,
    begin_step,
    face,
    keep,
    set_anew,
)

_Signal = NDArray[np.float64] | None


@compiled
def _more(grip: _Signal, sample: int) -> float:
    """Return by how much friction is graded at a sample, N."""
    return 0.0 if grip is None else grip[sample]


@compiled
def _is_anew(anew: _Signal, sample: int) -> bool:
    """Return whether the stem is set anew at a sample."""
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
            state[0, one], state[1, one] = place, following
            tangent.positions[sample + 1, one] = place


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

    What a parameter changes in the balance of forces at both ends of a sample is taken for linear
    between them.
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
            state[0, one], state[1, one] = slid(
                slide, state[0, one], state[1, one], force, after - force
            )
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
    friction of each sample. Where `anew` is a number, the stem is set to that place (m) and to the
    velocity `leaving` (m/s). A `tangent`, set up for the first sample, is carried along. The
    samples that took no short cut are counted and returned.
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
        elif is_quick and falls:
            ladder = steps_up if velocity > 0 else steps_down
            sample = _slide_on_falling(
                sample, side, way, ladder, forces, grip, anew, positions, velocities
            )
        elif is_quick:
            slide = up if velocity > 0 else down
            sample = _slide_on(sample, side, way, slide, forces, grip, anew, positions, velocities)
        if velocity == 0.0:
            keep(tangent, first, sample)
        elif falls:
            ladder = steps_up if velocity > 0 else steps_down
            _carry_falling(
                tangent, first, sample, side, way, ladder, forces, grip, positions, velocities
            )
        else:
            slide = up if velocity > 0 else down
            _carry(
                tangent,
                first,
                sample,
                side,
                way,
                slide,
                forces,
                grip,
                positions,
                velocities,
                period,
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
