"""Parameters of the Karnopp friction model, equations (1) and (2)."""

from dataclasses import dataclass

from valve_friction_ros.model.checks import (
    require_finite,
    require_non_negative,
    require_positive,
)

__all__ = ["KarnoppParameters"]


@dataclass(frozen=True)
class KarnoppParameters:
    """Moving mass, friction and spring of a valve.

    The stem obeys ``m·ẍ = S_a·(P − P_ref) − k·x − F_0 − friction``.

    Attributes
    ----------
    mass : float
        Mass m of the moving parts, kg, above zero.
    viscous_friction : float
        Coefficient F_v, N·s/m.
    coulomb_friction : float
        Friction force F_c of the sliding stem, N.
    static_friction : float
        Largest friction force F_s of the resting stem, N, not below `coulomb_friction`.
        Where it is above, the stem jumps as it breaks away (slip jump).
    spring_constant : float
        Stiffness k of the actuator spring, N/m. Zero: no spring.
    spring_preload : float
        Spring force F_0 = k·x̄ at x = 0, N; x̄ is the bias of (10).
    limit_velocity : float
        Speed DV, m/s, at which a sliding stem comes to rest if the static friction can
        hold it. Zero is the exact limit: it rests when its speed reaches zero.

    Raises
    ------
    ValueError
        If a quantity is impossible; the message names it.
    """

    mass: float
    viscous_friction: float
    coulomb_friction: float
    static_friction: float
    spring_constant: float
    spring_preload: float = 0.0
    limit_velocity: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what cannot exist."""
        require_positive("mass", self.mass)
        require_non_negative("viscous_friction", self.viscous_friction)
        require_non_negative("coulomb_friction", self.coulomb_friction)
        require_non_negative("static_friction", self.static_friction)
        require_non_negative("spring_constant", self.spring_constant)
        require_finite("spring_preload", self.spring_preload)
        require_non_negative("limit_velocity", self.limit_velocity)
        if self.static_friction < self.coulomb_friction:
            raise ValueError(
                f"static_friction ({self.static_friction:g}) must not be below "
                f"coulomb_friction ({self.coulomb_friction:g})"
            )
