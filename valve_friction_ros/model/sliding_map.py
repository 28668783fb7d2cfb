# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One sample of sliding as a linear map, and the chords of a friction that falls with the speed."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.compiled import compiled, compiled_products
from valve_friction_ros.model.dynamics import Dynamics, sliding_friction
from valve_friction_ros.model.linear_motion import impulse_response, self_convolution
from valve_friction_ros.model.stem_motion import STRIBECK_STEP

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
    """Return the number of the range with a speed, Coulomb and viscous friction, and the map."""
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
