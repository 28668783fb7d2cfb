"""Parameters of the Karnopp model as compiled kernels take them, and its sliding friction."""

import math
from typing import NamedTuple

from valve_friction_ros.model.compiled import compiled

__all__ = ["Dynamics", "sliding_friction"]


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
