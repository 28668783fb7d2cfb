"""The stem through all samples: short cuts where nothing happens, exact events in between."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.compiled import compiled, compiled_products
from valve_friction_ros.model.linear_motion import impulse_response
from valve_friction_ros.model.stem_motion import Dynamics, advance_stem

__all__ = ["run_stem"]


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
    """Tell whether sliding is linear, and its velocity turns once at the most within a period."""
    damping = dynamics.viscous_friction / dynamics.mass
    stiffness = dynamics.spring_constant / dynamics.mass
    turns_once = (stiffness - damping * damping / 4) * period * period < math.pi**2
    return turns_once and dynamics.stribeck_velocity == 0.0


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
    """Fill in the samples through which the stem surely rests; return the last one."""
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
    """Fill in the samples through which the stem surely slides on to `side`; return the last one.

    It surely does if it is faster than the limit velocity at both ends of a sample, and its speed
    does not fall below that in between: it has no minimum there, or cannot fall so far. Nor may
    it pass a travel stop.
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
        following = (
            slide.velocity_kept * velocity
            + slide.velocity_by_position * position
            + (slide.velocity_by_force * excess + slide.velocity_by_change * change)
        )
        place = (
            slide.position_kept * position
            + slide.position_by_velocity * velocity
            + (slide.position_by_force * excess + slide.position_by_change * change)
        )
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

    Stretches of rest and of sliding take short cuts; all samples between them, those with an
    event among them, go through `advance_stem`.
    """
    up, down = _slide(upward, period), _slide(downward, period)
    is_quick = _has_short_cut(upward, period) and _has_short_cut(downward, period)
    sample = 0
    while True:
        velocity = velocities[sample]
        if velocity == 0.0:
            sample = _rest_on(
                sample, positions[sample], forces, upward, downward, positions, velocities
            )
        elif is_quick and velocity > 0:
            sample = _slide_on(sample, 1.0, upward, up, forces, positions, velocities)
        elif is_quick:
            sample = _slide_on(sample, -1.0, downward, down, forces, positions, velocities)
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
