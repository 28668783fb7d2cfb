"""How far an identified number can be trusted."""

import math
from dataclasses import dataclass, replace
from enum import Enum

from valve_friction_ros.identification.units import PARAMETER_UNITS

__all__ = ["WEAK_SHARE", "Parameter", "Verdict", "fixed", "judged", "not_identifiable"]

WEAK_SHARE = 0.05
"""An interval that reaches further than this share of the value makes it weak."""


class Verdict(Enum):
    """What an identified number is worth."""

    IDENTIFIED = "identified"
    WEAK = "weak"
    NOT_IDENTIFIABLE = "not identifiable"
    FIXED = "fixed"


@dataclass(frozen=True)
class Parameter:
    """A parameter with its interval and its verdict.

    Attributes
    ----------
    name : str
        Name of the parameter.
    value : float
        Its value, SI unit; nan where it is not identifiable.
    standard_error : float
        Standard error, SI unit; 0 where it is fixed, nan where it is not identifiable.
    half_width : float
        Half the width of its 95 % interval.
    verdict : Verdict
        What the value is worth.
    reason : str
        Why it is weak or not identifiable; else empty.
    magnitude_bound : float
        Of a value that is withheld for its wide interval the largest magnitude in that interval,
        SI unit; else nan.
    published : float
        What the published method finds for it, SI unit; nan where it has no answer.
    """

    name: str
    value: float
    standard_error: float
    half_width: float
    verdict: Verdict
    reason: str = ""
    magnitude_bound: float = math.nan
    published: float = math.nan

    @property
    def unit(self) -> str:
        """SI unit, as written for people."""
        return PARAMETER_UNITS.get(self.name, "")

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval."""
        return self.value - self.half_width, self.value + self.half_width


def judged(
    name: str, value: float, standard_error: float, half_width: float, doubt: str = ""
) -> Parameter:
    """Judge a value by the width of its interval.

    Parameters
    ----------
    name, value, standard_error, half_width
        As in `Parameter`.
    doubt : str
        A reason, if there is one, why the value cannot be more than weak, however narrow its
        interval is; otherwise the width of the interval is the reason.

    Returns
    -------
    Parameter
        Identified, weak beyond `WEAK_SHARE` of the value, not identifiable beyond the value.
    """
    share = half_width / abs(value) if value else math.inf
    if share <= WEAK_SHARE and not doubt:
        return Parameter(name, value, standard_error, half_width, Verdict.IDENTIFIED)
    if share < 1:
        reason = doubt or f"its interval is ±{100 * share:.2g} % of its value"
        return Parameter(name, value, standard_error, half_width, Verdict.WEAK, reason)
    reason = doubt or "its interval is wider than its value"
    return replace(not_identifiable(name, reason), magnitude_bound=abs(value) + half_width)


def not_identifiable(name: str, reason: str) -> Parameter:
    """Withhold a value that means nothing, with the reason."""
    return Parameter(name, math.nan, math.nan, math.nan, Verdict.NOT_IDENTIFIABLE, reason)


def fixed(name: str, value: float, reason: str = "given") -> Parameter:
    """Pass on a value that was given."""
    return Parameter(name, value, 0.0, 0.0, Verdict.FIXED, reason)
