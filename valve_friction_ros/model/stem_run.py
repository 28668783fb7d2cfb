"""The stem through all samples: short cuts without events, located events between them."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.compiled import compiled, compiled_products
from valve_friction_ros.model.linear_motion import impulse_response
from valve_friction_ros.model.stem_motion import (
    STRIBECK_STEP,
    Dynamics,
    advance_stem,
    sliding_friction,
)

__all__ = ["run_stem"]

_FALLEN = 6.0
"""Speed over the Stribeck velocity above which the remaining fall is below rounding: e⁻³⁶."""


class _Slide(NamedTuple):
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
def _slide(dynamics: Dynamics, period: float) -> _Slide:
    """Set up the map of one way of motion."""
    damping = dynamics.viscous_friction / dynamics.mass
    stiffness = dynamics.spring_constant / dynamics.mass
    response = impulse_response(damping, stiffness, period)
    # The impulse response rises no higher than 1/damping, nor than it would undamped.
    reach = min(period, 1 / damping if damping > 0 else math.inf) / dynamics.mass
    return _Slide(
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
def _has_short_cut(dynamics: Dynamics, period: float) -> bool:
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
def _slid(
    slide: _Slide, position: float, velocity: float, excess: float, change: float
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
    while sample < forces.size - 1 and lowest <= forces[sample + 1] <= highest:
        sample += 1
        positions[sample], velocities[sample] = position, 0.0
    return sample


@compiled_products
def _slide_on(
    sample: int,
    side: float,
    way: Dynamics,
    slide: _Slide,
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
    while sample < forces.size - 1:
        after = forces[sample + 1] - friction
        change = after - excess
        place, following = _slid(slide, position, velocity, excess, change)
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
    return sample


class _Ladder(NamedTuple):
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
        The map of each, in the order of `_Slide`.
    """

    spacing: float
    chords: NDArray[np.float64]
    slides: NDArray[np.float64]


@compiled
def _ladder(way: Dynamics, period: float) -> _Ladder:
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
        for index, value in enumerate(_slide(local, period)):
            slides[rung, index] = value
    return _Ladder(spacing, chords, slides)


@compiled_products
def _slide_on_falling(
    sample: int,
    side: float,
    way: Dynamics,
    ladder: _Ladder,
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
    while sample < forces.size - 1:
        rung = min(int(side * velocity / ladder.spacing), top)
        friction, viscous = side * ladder.chords[rung, 0], ladder.chords[rung, 1]
        row = ladder.slides[rung]
        slide = _Slide(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8])
        excess, after = forces[sample] - friction, forces[sample + 1] - friction
        place, following = _slid(slide, position, velocity, excess, after - excess)
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
    up, down = _slide(upward, period), _slide(downward, period)
    steps_up, steps_down = _ladder(upward, period), _ladder(downward, period)
    is_quick = _has_short_cut(upward, period) and _has_short_cut(downward, period)
    falls = upward.stribeck_velocity > 0.0
    sample = 0
    while True:
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
