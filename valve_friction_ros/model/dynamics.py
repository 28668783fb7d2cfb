# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Parameters of the Karnopp model as compiled kernels take them, and its sliding friction."""

import math
from typing import NamedTuple

from valve_friction_ros.model.compiled import compiled


class Dynamics(NamedTuple):
    """Parameters of one direction of motion, as floats for compiled kernels (SI units)."""

    mass: float
    viscous_friction: float
    coulomb_friction: float
    static_friction: float
    spring_constant: float
    limit_velocity: float
    travel: float
    stribeck_velocity: float


@compiled
def sliding_friction(dynamics: Dynamics, speed: float) -> float:
    """Friction of the sliding stem, N."""
    ratio = speed / dynamics.stribeck_velocity
    fall = (dynamics.static_friction - dynamics.coulomb_friction) * math.exp(-ratio * ratio)
    return dynamics.coulomb_friction + fall + dynamics.viscous_friction * speed


class FrictionFall(NamedTuple):
    """What is left at one speed of the slip force ΔF = F_s − F_c, which falls with the speed.

    Attributes
    ----------
    share : float
        The share that is left, exp(−(v/v_s)²); without a fall none is.
    by_stribeck : float
        Derivative of ΔF times that share by v_s, N·s/m.
    """

    share: float
    by_stribeck: float


@compiled
def friction_fall(dynamics: Dynamics, speed: float) -> FrictionFall:
    """Return what is left of the slip force at a speed, m/s."""
    if dynamics.stribeck_velocity == 0.0:
        return FrictionFall(0.0, 0.0)
    ratio = speed / dynamics.stribeck_velocity
    share = math.exp(-ratio * ratio)
    slip = dynamics.static_friction - dynamics.coulomb_friction
    return FrictionFall(share, 2.0 * slip * ratio * ratio * share / dynamics.stribeck_velocity)
