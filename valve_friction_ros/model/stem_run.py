"""The stem through all samples: short cuts without events, located events between them."""

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.compiled import compiled, compiled_products
from valve_friction_ros.model.sliding_map import (
    ChordLadder,
    SlidingMap,
    chord_ladder,
    has_short_cut,
    slid,
    sliding_map,
)
from valve_friction_ros.model.stem_motion import Dynamics, advance_stem

__all__ = ["run_stem"]


@compiled
def _rest_on(
    sample: int,
    position: float,
    forces: NDArray[np.float64],
    upward: Dynamics,
    downward: Dynamics,
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
) -> int:
    """Fill in the samples through which the stem certainly rests; return the last one."""
    held = upward.spring_constant * position
    highest, lowest = held + upward.static_friction, held - downward.static_friction
    if not lowest <= forces[sample] <= highest:
        return sample
    for following in range(sample + 1, forces.size):
        if not lowest <= forces[following] <= highest:
            return following - 1
        positions[following], velocities[following] = position, 0.0
    return forces.size - 1


@compiled_products
def _slide_on(
    sample: int,
    side: float,
    way: Dynamics,
    slide: SlidingMap,
    forces: NDArray[np.float64],
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
) -> int:
    """Fill in the samples through which the stem certainly slides to `side`; return the last one.

    That is certain if its speed exceeds the limit velocity at both ends of a sample and between
    them: the speed has no minimum there, or cannot fall so far. The stem must not reach a travel
    stop.
    """
    lowest, highest = (0.0, way.travel) if way.travel < np.inf else (-np.inf, np.inf)
    friction, spring, viscous = (
        side * way.coulomb_friction,
        way.spring_constant,
        way.viscous_friction,
    )
    position, velocity = positions[sample], velocities[sample]
    excess = forces[sample] - friction
    push = side * (excess - spring * position - viscous * velocity)
    if side * velocity <= way.limit_velocity:
        return sample
    left = forces.size - sample  # in a `for` loop numba fuses other products: other last digits
    while sample < forces.size - 1:
        after = forces[sample + 1] - friction
        change = after - excess
        place, following = slid(slide, position, velocity, excess, change)
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
        rung = min(int(side * velocity / ladder.spacing), top)
        friction, viscous = side * ladder.chords[rung, 0], ladder.chords[rung, 1]
        row = ladder.slides[rung]
        slide = SlidingMap(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8])
        excess, after = forces[sample] - friction, forces[sample + 1] - friction
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


@compiled
def run_stem(
    forces: NDArray[np.float64],
    period: float,
    upward: Dynamics,
    downward: Dynamics,
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
) -> None:
    """Step through `forces` (actuator less preload, N) from the state at sample 0.

    Rest and sliding over several samples take short cuts; `advance_stem` steps all samples between
    them, and so every sample with an event.
    """
    up, down = sliding_map(upward, period), sliding_map(downward, period)
    steps_up, steps_down = chord_ladder(upward, period), chord_ladder(downward, period)
    is_quick = has_short_cut(upward, period) and has_short_cut(downward, period)
    falls = upward.stribeck_velocity > 0.0
    sample = 0
    for _ in range(forces.size):
        velocity = velocities[sample]
        side = 1.0 if velocity > 0 else -1.0
        way = upward if velocity > 0 else downward
        if velocity == 0.0:
            sample = _rest_on(
                sample, positions[sample], forces, upward, downward, positions, velocities
            )
        elif is_quick and falls:
            ladder = steps_up if velocity > 0 else steps_down
            sample = _slide_on_falling(sample, side, way, ladder, forces, positions, velocities)
        elif is_quick:
            slide = up if velocity > 0 else down
            sample = _slide_on(sample, side, way, slide, forces, positions, velocities)
        if sample == forces.size - 1:
            return
        force, change = forces[sample], forces[sample + 1] - forces[sample]
        positions[sample + 1], velocities[sample + 1] = advance_stem(
            positions[sample],
            velocities[sample],
            force,
            change / period,
            period,
            upward,
            downward,
        )
        sample += 1
    raise ArithmeticError("the simulation did not reach its last sample")
