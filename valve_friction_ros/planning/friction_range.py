"""The frictions for which a stroke test must serve: what is known, and how well."""

from dataclasses import dataclass, replace

from valve_friction_ros.model.checks import require_finite, require_positive
from valve_friction_ros.model.karnopp_parameters import KarnoppParameters
from valve_friction_ros.model.valve import Valve

__all__ = ["FrictionRange", "known_friction", "unknown_friction"]

_USUAL_DELAY = 0.1
"""F_v/k, s, where F_v is not known. The packings of the paper's bench have 0.02 to 0.34 s."""

_UNKNOWN = ((0.015, 0.03, 1.0), (0.05, 0.1, 1.2), (0.15, 0.3, 1.4))
"""F_c over the spring's force along the travel, F_v/k (s) and F_s/F_c, of three valves.

Chosen about the three packings of the paper's bench, whose shares are 2.6 %, 10 % and 11 %, whose
delays 0.02, 0.22 and 0.34 s, and whose ratios 1.0, 1.0 and 1.4."""


@dataclass(frozen=True)
class FrictionRange:
    """Valves among which the true one is taken to be.

    Attributes
    ----------
    draws : tuple of KarnoppParameters
        The valves; the middle one is the most likely. All have the same spring.
    names : tuple of str
        What to call each.

    Raises
    ------
    ValueError
        If they cannot be planned for.
    """

    draws: tuple[KarnoppParameters, ...]
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        """Refuse an empty range, and valves without a spring or with several."""
        if not self.draws or len(self.draws) != len(self.names):
            raise ValueError(f"{len(self.draws)} valves with {len(self.names)} names")
        springs = {(one.spring_constant, one.spring_preload) for one in self.draws}
        if len(springs) != 1 or not self.draws[0].spring_constant > 0:
            raise ValueError("a stroke test needs one spring: give spring_constant above zero")

    @property
    def middle(self) -> int:
        """Place of the most likely valve."""
        return len(self.draws) // 2

    @property
    def spring(self) -> tuple[float, float]:
        """Spring constant, N/m, and preload, N."""
        return self.draws[0].spring_constant, self.draws[0].spring_preload


def known_friction(
    coulomb_friction: float,
    spring: tuple[float, float],
    mass: float,
    *,
    static_friction: float | None = None,
    viscous_friction: float | None = None,
    factor: float = 2.0,
) -> FrictionRange:
    """Return valves about a friction that is known to within a factor.

    Parameters
    ----------
    coulomb_friction : float
        F_c, N, above zero.
    spring : tuple of float
        Spring constant, N/m, and preload, N.
    mass : float
        Mass, kg.
    static_friction : float, optional
        F_s, N; by default F_c.
    viscous_friction : float, optional
        F_v, N·s/m; by default that of a delay F_v/k of 0.1 s.
    factor : float
        All frictions may be so many times larger or smaller, at least 1.
    """
    require_positive("coulomb_friction", coulomb_friction)
    if not require_finite("factor", factor) >= 1:
        raise ValueError(f"the factor of the friction must be at least 1, got {factor:g}")
    constant, preload = spring
    likely = KarnoppParameters(
        mass=mass,
        viscous_friction=_USUAL_DELAY * constant if viscous_friction is None else viscous_friction,
        coulomb_friction=coulomb_friction,
        static_friction=coulomb_friction if static_friction is None else static_friction,
        spring_constant=constant,
        spring_preload=preload,
    )
    if factor == 1:
        return FrictionRange((likely,), ("as assumed",))
    return FrictionRange(
        (_scaled(likely, 1 / factor), likely, _scaled(likely, factor)),
        (f"{factor:g} times smaller", "as assumed", f"{factor:g} times larger"),
    )


def _scaled(valve: KarnoppParameters, factor: float) -> KarnoppParameters:
    return replace(
        valve,
        coulomb_friction=valve.coulomb_friction * factor,
        static_friction=valve.static_friction * factor,
        viscous_friction=valve.viscous_friction * factor,
    )


def unknown_friction(valve: Valve, spring: tuple[float, float], mass: float) -> FrictionRange:
    """Return three valves for a friction that nobody knows: 1.5, 5 and 15 % of the spring's force.

    `spring` is as for `known_friction`; the valve gives the travel.
    """
    constant, preload = spring
    draws = tuple(
        KarnoppParameters(
            mass=mass,
            viscous_friction=delay * constant,
            coulomb_friction=share * constant * valve.travel,
            static_friction=share * ratio * constant * valve.travel,
            spring_constant=constant,
            spring_preload=preload,
        )
        for share, delay, ratio in _UNKNOWN
    )
    return FrictionRange(draws, ("light", "medium", "heavy"))
