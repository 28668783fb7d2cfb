# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One compiled time step of each friction law.

A step takes the plant's constants, the state, the net force on the stem (N), the scale of friction
at this place and time, and the step (s). It writes the new speed into the state and returns the
friction force, N, positive against upward motion. The state contains position, speed, whether the
stem has broken away (1 or 0), and internal displacements or forces.
"""

import math

import numba
import numpy as np
from numpy.typing import NDArray

from benchmark.reality.plants.parameters import ELEMENTS, Constants

X, V, SLIDING, INNER = 0, 1, 2, 3
"""Indices in the state: position, speed, broken away, and the first internal variable."""

_State = NDArray[np.float64]


@numba.njit(inline="always")
def _way(value: float) -> float:
    return 1.0 if value > 0.0 else -1.0


@numba.njit(inline="always")
def _level(c: Constants, speed: float) -> float:
    """Return the friction, N, without its viscous part, at a speed ≥ 0 (Stribeck curve)."""
    if speed == 0.0:
        return c.static
    if c.stribeck_velocity == 0.0 or c.static == c.coulomb:
        return c.coulomb
    ratio = speed / c.stribeck_velocity
    if ratio > 6.0:
        return c.coulomb
    return c.coulomb + (c.static - c.coulomb) * math.exp(-ratio * ratio)


@numba.njit
def moreau(c: Constants, state: _State, pull: float, scale: float, step: float) -> float:
    """Step the set-valued law implicitly (Moreau, 1988), with rest at exactly zero speed."""
    impulse = c.mass * state[V] + step * pull
    way = _way(impulse)
    level = scale * (1.0 + way * c.asymmetry) * _level(c, abs(state[V]))
    if abs(impulse) <= step * level:
        state[V] = 0.0
        return impulse / step
    state[V] = (impulse - way * step * level) / (c.mass + step * c.viscous)
    return way * level + c.viscous * state[V]


@numba.njit(inline="always")
def _slide(c: Constants, state: _State, pull: float, scale: float, step: float) -> float:
    """Step a sliding stem with Coulomb and viscous friction; stop it where it would reverse."""
    way = _way(state[V]) if state[V] != 0.0 else _way(pull)
    level = scale * (1.0 + way * c.asymmetry) * c.coulomb
    before = c.mass * state[V] + step * pull
    after = (before - way * step * level) / (c.mass + step * c.viscous)
    if after * way < 0.0:
        state[V] = 0.0
        return before / step
    state[V] = after
    return way * level + c.viscous * after


@numba.njit
def karnopp(c: Constants, state: _State, pull: float, scale: float, step: float) -> float:
    """Step equation (2): below the limit velocity only static friction acts."""
    if abs(state[V]) < c.limit_velocity or state[V] == 0.0:
        way = _way(pull)
        limit = scale * (1.0 + way * c.asymmetry) * c.static
        if abs(pull) <= limit:
            state[V] = 0.0
            return pull
        state[V] += step * (pull - way * limit) / c.mass
        return way * limit
    return _slide(c, state, pull, scale, step)


@numba.njit
def latched(c: Constants, state: _State, pull: float, scale: float, step: float) -> float:
    """Step the Karnopp law with static friction only at rest and on a stem that slows down."""
    way = _way(pull)
    limit = scale * (1.0 + way * c.asymmetry) * c.static
    if state[V] == 0.0:
        if abs(pull) <= limit:
            return pull
        state[SLIDING] = 0.0
    speed = abs(state[V])
    if speed >= c.limit_velocity:
        state[SLIDING] = 1.0
    elif state[SLIDING] == 1.0 and abs(pull) <= limit:
        state[V], state[SLIDING] = 0.0, 0.0
        return pull
    return _slide(c, state, pull, scale, step)


@numba.njit
def lugre(c: Constants, state: _State, pull: float, scale: float, step: float) -> float:
    """Step a linear bristle, implicit in speed and deflection, explicit in their product."""
    speed = state[V]
    level = scale * (1.0 + _way(speed) * c.asymmetry) * _level(c, abs(speed))
    decay = c.stiffness * abs(speed) / level
    share = (c.stiffness - c.bristle_damping * decay) / (1.0 + step * decay)
    damping = share * step + c.bristle_damping + c.viscous
    held = share * state[INNER]
    after = (c.mass * speed + step * (pull - held)) / (c.mass + step * damping)
    state[INNER] = (state[INNER] + step * after) / (1.0 + step * decay)
    state[V] = after
    return held + damping * after


@numba.njit
def maxwell(c: Constants, state: _State, pull: float, scale: float, step: float) -> float:
    """Step parallel springs, each of which carries an equal share of the friction, then slips."""
    held = 0.0
    for element in range(ELEMENTS):
        held += state[INNER + element]
    after = (c.mass * state[V] + step * (pull - held)) / (c.mass + step * c.viscous)
    way = _way(after)
    share = scale * (1.0 + way * c.asymmetry) * _level(c, abs(after)) / ELEMENTS
    for element in range(ELEMENTS):
        stiffness = c.stiffness / (element + 1.0)
        force = state[INNER + element] + stiffness * step * after
        state[INNER + element] = min(max(force, -share), share)
    state[V] = after
    return held + c.viscous * after
