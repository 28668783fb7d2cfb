"""The friction of the healthy valve, and how far an estimate has moved away from it."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from valve_friction_ros.identification import Parameter, RefusalError, Result
from valve_friction_ros.model.checks import require_non_negative, require_positive

__all__ = ["Baseline", "Ratio"]


class Ratio(NamedTuple):
    """A ratio of two frictions with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Baseline:
    """Coulomb friction of the healthy valve.

    Attributes
    ----------
    coulomb_friction : float
        F_c, N, above zero.
    half_width : float
        Half the width of its 95 % interval, N; zero for a given value.

    Examples
    --------
    >>> import valve_friction_ros as vf
    >>> healthy = vf.Baseline(coulomb_friction=150.0, half_width=2.0)
    >>> healthy.coulomb_friction
    150.0
    """

    coulomb_friction: float
    half_width: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a baseline that is not above zero."""
        require_positive("baseline_coulomb_friction", self.coulomb_friction)
        require_non_negative("half_width", self.half_width)

    @classmethod
    def of(cls, result: Result) -> "Baseline":
        """Return the Coulomb friction of a result as baseline.

        Raises RefusalError if it is not identifiable, or not above zero.
        """
        friction = result.parameters["coulomb_friction"]
        if math.isnan(friction.value):
            raise RefusalError(
                "coulomb friction is not identifiable, so it cannot be the baseline: "
                f"{friction.reason}"
            )
        if friction.value <= 0:
            raise RefusalError(
                f"a coulomb friction of {friction.value:.4g} N cannot be a baseline: check the "
                "direction of both signals, then identify again"
            )
        return cls(friction.value, friction.half_width)

    def compared_with(self, friction: Parameter) -> Ratio:
        """Ratio of an identified friction to the baseline; nan where it is not identifiable.

        The relative half widths of two independent estimates add in squares, and the interval
        is symmetric in the logarithm, so that a ratio and its inverse have the same interval.
        """
        ratio = friction.value / self.coulomb_friction
        if not ratio > 0:
            return Ratio(ratio, math.nan, math.nan)
        share = math.hypot(
            friction.half_width / friction.value, self.half_width / self.coulomb_friction
        )
        return Ratio(ratio, ratio * math.exp(-share), ratio * math.exp(share))
