"""From a result to the diagnosis: whether friction has grown or collapsed, and its consequence."""

import math
from dataclasses import dataclass, replace
from enum import Enum, IntEnum
from typing import Any

from valve_friction_ros.health.baseline import Baseline, Ratio
from valve_friction_ros.identification import Parameter, Result, plain
from valve_friction_ros.identification.trust.misfit import percentage
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

    A bound counts as passed only when the whole interval of the ratio lies beyond it.

    Attributes
    ----------
    warn_ratio : float
        Ratio from which the valve is worth maintenance.
    error_ratio : float
        Ratio from which friction is excessive.
    low_ratio : float
        Ratio below which friction has collapsed: the packing is worn and may leak.

    Raises
    ------
    ValueError
        Unless 0 < low_ratio < 1 < warn_ratio < error_ratio.

    Notes
    -----
    No standard gives such ratios; the defaults are chosen. 2 doubles the dead band (F_c + F_s)/k,
    0.5 halves it, and 1.25 is five times the half width that an identified friction may have
    (`WEAK_SHARE`). A plant may know better: the ratios are parameters.
    """

    warn_ratio: float = 1.25
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
    """The diagnosis of a valve: the state of its friction.

    Attributes
    ----------
    level : Level
        Severity.
    status_signal : StatusSignal
        The severity as a status signal of NE 107.
    message : str
        One sentence, with the consequence.
    ratio : Ratio or None
        Coulomb friction over its baseline, with its interval; None without a baseline or without
        an identifiable friction.
    """

    level: Level
    status_signal: StatusSignal
    message: str
    ratio: Ratio | None

    def to_dict(self) -> dict[str, Any]:
        """Return the diagnosis as a mapping of plain values, from which other forms are derived.

        Its keys are ``level`` (OK, WARN or ERROR), ``ne_107``, ``message``, ``ratio`` and
        ``ratio_interval``.
        """
        ratio = self.ratio
        return {
            "level": self.level.name,
            "ne_107": self.status_signal.value,
            "message": self.message,
            "ratio": None if ratio is None else plain(ratio.value),
            "ratio_interval": None if ratio is None else plain([ratio.low, ratio.high]),
        }

    def __str__(self) -> str:
        """Return level and message on one line."""
        return f"{self.level.name}: {self.message}"


def dead_band(result: Result, valve: Valve) -> float:
    """Return the dead band of the stem as a share of the travel.

    After a move the sliding friction F_c still holds the spring off balance; to move back, the
    actuator must reverse it and overcome F_s: the same change of pressure would move a
    frictionless stem by (F_c + F_s)/k. Without a slip jump F_s is F_c. The result is nan without a
    spring, without travel stops, or where F_c or k is not identifiable.
    """
    values = result.values
    if not values["spring_constant"] > 0:
        return math.nan
    coulomb_friction, static_friction = values["coulomb_friction"], values["static_friction"]
    if math.isnan(static_friction):
        static_friction = coulomb_friction
    force = coulomb_friction + static_friction
    return valve.share_of_travel(force / values["spring_constant"])


def _consequence(result: Result, valve: Valve) -> str:
    share = dead_band(result, valve)
    if math.isnan(share):
        friction = result.parameters["coulomb_friction"]
        return f"coulomb friction {friction.value:.4g} ± {friction.half_width:.2g} N"
    return f"the stem ignores reversals smaller than {percentage(share)} of its travel"


def _figures(ratio: Ratio) -> str:
    return f"{ratio.value:.2f} ({ratio.low:.2f} to {ratio.high:.2f})"


def diagnose(
    result: Result,
    valve: Valve,
    baseline: Baseline | None = None,
    limits: FrictionLimits | None = None,
) -> Diagnosis:
    """Compare the identified Coulomb friction with its baseline.

    Parameters
    ----------
    result : Result
        The latest identification.
    valve : Valve
        Gives the travel, for the dead band.
    baseline : Baseline, optional
        Coulomb friction of the healthy valve.
    limits : FrictionLimits, optional
        Bounds of the ratio.

    Returns
    -------
    Diagnosis
        A bound counts as passed when the 95 % interval of the ratio lies beyond it, so that an
        uncertain result raises no alarm: on an unchanged valve it would have to be wrong by the
        whole distance to the bound. A friction that is not identifiable has collapsed where even
        its largest possible value lies below the low bound. A valve that the model does not
        describe is WARN at least.
    """
    limits = limits or FrictionLimits()
    friction = result.parameters["coulomb_friction"]
    if math.isnan(friction.value):
        message = f"coulomb friction is not identifiable: {friction.reason}"
        diagnosis = Diagnosis(Level.OK, StatusSignal.GOOD, message, None)
        if baseline is not None and _has_vanished(friction, baseline, limits):
            message = (
                "friction collapsed, the packing may leak: coulomb friction is too small to be "
                f"identified, at most {friction.magnitude_bound:.2g} N; its baseline is "
                f"{baseline.coulomb_friction:.4g} N"
            )
            diagnosis = Diagnosis(Level.ERROR, StatusSignal.OUT_OF_SPECIFICATION, message, None)
        return _with_model_doubt(diagnosis, result)
    if friction.value < 0:
        message = (
            f"coulomb friction is {friction.value:.4g} ± {friction.half_width:.2g} N, and "
            "friction is above zero: check the direction of both signals"
        )
        return Diagnosis(Level.WARN, StatusSignal.CHECK_FUNCTION, message, None)
    effect = _consequence(result, valve)
    if baseline is None:
        diagnosis = Diagnosis(Level.OK, StatusSignal.GOOD, f"no baseline yet; {effect}", None)
    else:
        diagnosis = _against(baseline.compared_with(friction), limits, effect)
    return _with_model_doubt(diagnosis, result)


def _has_vanished(friction: Parameter, baseline: Baseline, limits: FrictionLimits) -> bool:
    """Return whether a friction that is too small to be identified lies below the low limit."""
    least = baseline.coulomb_friction - baseline.half_width
    return friction.magnitude_bound <= limits.low_ratio * least


def _with_model_doubt(diagnosis: Diagnosis, result: Result) -> Diagnosis:
    misfit = result.misfit
    if misfit is None or misfit.describes:
        return diagnosis
    doubt = (
        "the Karnopp model does not describe this valve "
        f"({misfit.words} of misfit); {diagnosis.message}"
    )
    if diagnosis.level >= Level.WARN:
        return replace(diagnosis, message=doubt)
    return replace(
        diagnosis, level=Level.WARN, status_signal=StatusSignal.CHECK_FUNCTION, message=doubt
    )


def _against(ratio: Ratio, limits: FrictionLimits, effect: str) -> Diagnosis:
    compared = f"coulomb friction is {_figures(ratio)} times its baseline"
    if ratio.low >= limits.error_ratio:
        return Diagnosis(
            Level.ERROR, StatusSignal.FAILURE, f"excess friction: {compared}; {effect}", ratio
        )
    if ratio.high <= limits.low_ratio:
        return Diagnosis(
            Level.ERROR,
            StatusSignal.OUT_OF_SPECIFICATION,
            f"friction collapsed, the packing may leak: {compared}; {effect}",
            ratio,
        )
    if ratio.low >= limits.warn_ratio:
        return Diagnosis(
            Level.WARN,
            StatusSignal.MAINTENANCE_REQUIRED,
            f"friction has grown: {compared}; {effect}",
            ratio,
        )
    words = "friction normal"
    if ratio.value >= limits.warn_ratio:
        words = "friction perhaps grown"
    elif ratio.value <= limits.low_ratio:
        words = "friction perhaps collapsed"
    return Diagnosis(Level.OK, StatusSignal.GOOD, f"{words}: {compared}; {effect}", ratio)
