"""The healthy valve: its friction, and what else was measured of it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.valve_numbers import valve_numbers
from valve_friction_ros.identification import SLIDING, Parameter, RefusalError, Result
from valve_friction_ros.identification.trust.rounding import percentage, two_digits
from valve_friction_ros.model.checks import require_non_negative, require_positive

__all__ = ["LARGEST_SHARE", "Baseline", "SlidingFriction"]

LARGEST_SHARE = 0.13
"""Largest half width of a friction, as a share of its value, that can be a baseline.

With it a friction that has grown by half, and is known no better, is still declared to have grown:
ln(1.5/1.25)/√2, with the 1.25 of `FrictionLimits`."""


_MORE = (
    "record more strokes, some fast and some slow, and state a timing_uncertainty if the clocks "
    "and lags of both signals are known"
)
_OTHER_METHOD = "identify by a method that gives intervals"


@dataclass(frozen=True)
class SlidingFriction:
    """Work of friction over the distance that the stem slides, and the speed that it belongs to.

    Attributes
    ----------
    value : float
        ∫|F_friction|·|dx| / ∫|dx|, N, above zero.
    half_width : float
        Half the width of its 95 % interval, N.
    speed : float
        Mean speed over the distance, ∫|v|·|dx| / ∫|dx|, m/s, above zero.
    """

    value: float
    half_width: float
    speed: float

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require_positive("sliding_friction", self.value)
        require_non_negative("half_width", self.half_width)
        require_positive("sliding_speed", self.speed)

    def __str__(self) -> str:
        """Return value, half width and speed."""
        width = f" ± {two_digits(self.half_width)}" if self.half_width > 0 else ""
        return f"{self.value:.6g}{width} N at {self.speed * 1e3:.3g} mm/s"


@dataclass(frozen=True)
class Baseline:
    """The healthy valve: its Coulomb friction, its sliding friction, or both; and other numbers.

    Its intervals leave out the uncertainties of area and sensor scales, which cancel in the ratio
    of two frictions that the same sensors measured.

    Attributes
    ----------
    coulomb_friction : float or None
        F_c, N, above zero.
    half_width : float
        Half the width of its 95 % interval, N; zero for a given value.
    sliding : SlidingFriction or None
        The sliding friction, which needs no split into F_c and F_v.
    numbers : mapping of str to Measured
        What else its result says of the valve (`valve_numbers`); empty for a friction alone. They
        take no part in a comparison of two baselines: the frictions tell results apart.

    Raises
    ------
    ValueError
        If a value is impossible, or there is none.

    Examples
    --------
    >>> import valve_friction_ros as vf
    >>> healthy = vf.Baseline(coulomb_friction=150.0, half_width=2.0)
    >>> print(healthy)
    coulomb friction 150 ± 2 N
    """

    coulomb_friction: float | None = None
    half_width: float = 0.0
    sliding: SlidingFriction | None = None
    numbers: Mapping[str, Measured] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        """Refuse a baseline that is not above zero."""
        if self.coulomb_friction is not None:
            require_positive("baseline_coulomb_friction", self.coulomb_friction)
        elif self.sliding is None:
            raise ValueError("a baseline needs a coulomb friction or a sliding friction")
        require_non_negative("half_width", self.half_width)

    def __str__(self) -> str:
        """Return its frictions on one line."""
        told = []
        if self.coulomb_friction is not None:
            width = f" ± {two_digits(self.half_width)}" if self.half_width > 0 else ""
            told.append(f"coulomb friction {self.coulomb_friction:.6g}{width} N")
        if self.sliding is not None:
            told.append(f"sliding friction {self.sliding}")
        return ", ".join(told)

    @classmethod
    def of(cls, result: Result) -> "Baseline":
        """Return a result as baseline, with those of its frictions that are known well enough.

        Raises RefusalError if neither is known to `LARGEST_SHARE`; the message names why.
        """
        names = ["coulomb_friction"]
        if SLIDING in result.parameters and result.sliding_speed > 0:
            names.append(SLIDING)
        frictions = {name: result.parameters[name].without_calibration for name in names}
        for one in frictions.values():
            if one.value < 0:
                raise RefusalError(
                    f"a {one.name.replace('_', ' ')} of {one.value:.4g} N cannot be a baseline: "
                    "check the direction of both signals, then identify again"
                )
        useful = {name: one for name, one in frictions.items() if not _why_not(one)}
        if not useful:
            why_not = "; ".join(map(_why_not, frictions.values()))
            without = all(math.isnan(one.half_width) for one in frictions.values())
            known = any(not math.isnan(one.value) for one in frictions.values())
            remedy = _OTHER_METHOD if without and known else _MORE
            raise RefusalError(f"this result cannot be the baseline: {why_not}: {remedy}")
        coulomb, slid = useful.get("coulomb_friction"), useful.get(SLIDING)
        return cls(
            None if coulomb is None else coulomb.value,
            0.0 if coulomb is None else coulomb.half_width,
            None
            if slid is None
            else SlidingFriction(slid.value, slid.half_width, result.sliding_speed),
            valve_numbers(result),
        )


def _why_not(friction: Parameter) -> str:
    """Return why a friction cannot be a baseline; empty if it can."""
    name, value, width = friction.name.replace("_", " "), friction.value, friction.half_width
    if math.isnan(value):
        return f"{name} is not identifiable ({friction.reason})"
    if value <= 0:
        return f"{name} is {value:.4g} N"
    if math.isnan(width):
        return f"{name} has no interval"
    if width > LARGEST_SHARE * value:
        return (
            f"{name} is known to ±{percentage(width / value)}, and a baseline needs "
            f"±{percentage(LARGEST_SHARE)}"
        )
    return ""
