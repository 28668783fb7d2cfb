"""From an estimate to a verdict: whether friction has grown or collapsed, and what it costs."""

import math
from dataclasses import dataclass
from enum import Enum, IntEnum

from valve_friction_ros.identification.estimate import Estimate
from valve_friction_ros.model.checks import require_positive
from valve_friction_ros.model.valve import Valve

__all__ = [
    "Diagnosis",
    "FrictionLimits",
    "Level",
    "StatusSignal",
    "dead_band",
    "diagnose",
    "percentage",
]


class Level(IntEnum):
    """Severity, numbered as in diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


class StatusSignal(Enum):
    """Status signals of NAMUR NE 107."""

    GOOD = ""
    FAILURE = "F"
    CHECK_FUNCTION = "C"
    OUT_OF_SPECIFICATION = "S"
    MAINTENANCE_REQUIRED = "M"


@dataclass(frozen=True)
class FrictionLimits:
    """Bounds of the Coulomb friction, as ratios to its baseline.

    Attributes
    ----------
    warn_ratio : float
        From here on the valve is worth maintenance.
    error_ratio : float
        From here on friction is excessive.
    low_ratio : float
        From here down friction has collapsed: the packing is worn and may leak.

    Raises
    ------
    ValueError
        Unless 0 < low_ratio < 1 < warn_ratio < error_ratio.
    """

    warn_ratio: float = 1.5
    error_ratio: float = 2.0
    low_ratio: float = 0.5

    def __post_init__(self) -> None:
        """Refuse limits that are out of order."""
        if not 0 < self.low_ratio < 1 < self.warn_ratio < self.error_ratio:
            raise ValueError(
                "limits must obey 0 < low_ratio < 1 < warn_ratio < error_ratio, got "
                f"low_ratio {self.low_ratio:g}, warn_ratio {self.warn_ratio:g}, "
                f"error_ratio {self.error_ratio:g}"
            )


@dataclass(frozen=True)
class Diagnosis:
    """A verdict on the friction of a valve.

    Attributes
    ----------
    level : Level
        Severity.
    status_signal : StatusSignal
        The same in the words of NE 107.
    message : str
        One sentence for people, with the consequence.
    ratio : float or None
        Coulomb friction over its baseline; None without a baseline.
    """

    level: Level
    status_signal: StatusSignal
    message: str
    ratio: float | None


def dead_band(estimate: Estimate, valve: Valve) -> float:
    """Return the dead band of the stem as a share of the travel.

    After a move the sliding friction F_c still holds the spring off balance; to move back, the
    actuator must undo it and overcome F_s: the pressure that does so would move a frictionless
    stem by (F_c + F_s)/k. The result is nan without a spring or without travel stops.
    """
    if estimate.spring_constant <= 0:
        return float("nan")
    friction = estimate.coulomb_friction + estimate.static_friction
    return valve.share_of_travel(friction / estimate.spring_constant)


def percentage(share: float) -> str:
    """Write a share in percent for people: two digits, or whole percents from 100 % on."""
    percent = 100 * share
    return f"{percent:.2g} %" if percent < 99.5 else f"{percent:.0f} %"


def _consequence(estimate: Estimate, valve: Valve) -> str:
    share = dead_band(estimate, valve)
    if math.isnan(share):
        return f"coulomb friction {estimate.coulomb_friction:.4g} N"
    return f"the stem ignores reversals smaller than {percentage(share)} of its travel"


def diagnose(
    estimate: Estimate,
    valve: Valve,
    baseline: float | None = None,
    limits: FrictionLimits | None = None,
) -> Diagnosis:
    """Compare the identified Coulomb friction with its baseline.

    Parameters
    ----------
    estimate : Estimate
        The latest identification.
    valve : Valve
        Tells the travel, for the dead band.
    baseline : float, optional
        Coulomb friction of the healthy valve, N, above zero.
    limits : FrictionLimits, optional
        Bounds of the ratio.

    Returns
    -------
    Diagnosis
        OK within the limits, or without a baseline to compare with.
    """
    limits = limits or FrictionLimits()
    effect = _consequence(estimate, valve)
    if baseline is None:
        return Diagnosis(Level.OK, StatusSignal.GOOD, f"no baseline yet; {effect}", None)
    ratio = estimate.coulomb_friction / require_positive("baseline", baseline)
    compared = f"coulomb friction is {ratio:.2f} times its baseline"
    if ratio >= limits.error_ratio:
        return Diagnosis(
            Level.ERROR, StatusSignal.FAILURE, f"excess friction: {compared}; {effect}", ratio
        )
    if ratio <= limits.low_ratio:
        return Diagnosis(
            Level.ERROR,
            StatusSignal.OUT_OF_SPECIFICATION,
            f"friction collapsed, the packing may leak: {compared}; {effect}",
            ratio,
        )
    if ratio >= limits.warn_ratio:
        return Diagnosis(
            Level.WARN,
            StatusSignal.MAINTENANCE_REQUIRED,
            f"friction has grown: {compared}; {effect}",
            ratio,
        )
    return Diagnosis(Level.OK, StatusSignal.GOOD, f"friction normal: {compared}; {effect}", ratio)
