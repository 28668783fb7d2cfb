"""From a result to the diagnosis: whether friction has grown or collapsed, and its consequence."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Protocol

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.comparison import LARGEST_SPEED_RATIO, Ratio, carried, compared
from valve_friction_ros.health.levels import Finding, Level, StatusSignal
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.identification import SLIDING, Parameter, Result, plain
from valve_friction_ros.identification.trust.rounding import percentage, two_digits
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams import utc_minute

__all__ = [
    "DOUBT",
    "Diagnosis",
    "EarlierEstimate",
    "FrictionLimits",
    "FrictionState",
    "Frictions",
    "Side",
    "StandingAlarm",
    "against",
    "dead_band",
    "dead_band_half_width",
    "diagnose",
    "diagnose_again",
    "friction_state",
    "leading_ratio",
    "percentage",
]

DOUBT = "the Karnopp model does not describe this valve"
"""How the diagnosis of a valve begins that the model does not describe."""

_AGAIN = "identify it again from a longer record with more strokes to be sure"


@dataclass(frozen=True)
class FrictionLimits:
    """Bounds of the friction, as ratios to its baseline.

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

    @property
    def low_warn_ratio(self) -> float:
        """Ratio below which a valve is worth maintenance, between `low_ratio` and 1.

        The inverse of `warn_ratio`, but halfway to `low_ratio` by logarithm where that is nearer
        to 1.
        """
        return max(1 / self.warn_ratio, math.sqrt(self.low_ratio))


class FrictionState(Enum):
    """How the friction of a record compares with its baseline, in words."""

    UNKNOWN = ""
    """It is not compared."""
    IMPOSSIBLE = "friction below zero"
    NORMAL = "friction normal"
    UNCLEAR = "friction cannot be told from its baseline"
    """It is beyond a limit, and may be unchanged all the same."""
    PERHAPS_GROWN = "friction perhaps grown"
    GROWN = "friction has grown"
    EXCESS = "excess friction"
    PERHAPS_FALLEN = "friction perhaps fallen"
    FALLEN = "friction has fallen"
    COLLAPSED = "friction collapsed, the packing may leak"

    @property
    def side(self) -> "Side | None":
        """The side on which the friction surely is; None where it is not sure."""
        return _SIDES.get(self)

    @property
    def is_uncertain(self) -> bool:
        """Whether the friction is beyond a limit, and its interval is not."""
        return self in _PERHAPS

    @property
    def level(self) -> Level:
        """Severity of what the record says of the friction."""
        return _SEVERITY[self][0]


class Side(Enum):
    """Where the friction is, seen from its baseline."""

    HIGH = "high"
    LOW = "low"


_SIDES = {
    FrictionState.GROWN: Side.HIGH,
    FrictionState.EXCESS: Side.HIGH,
    FrictionState.FALLEN: Side.LOW,
    FrictionState.COLLAPSED: Side.LOW,
}

_SEVERITY = {
    FrictionState.UNKNOWN: (Level.OK, StatusSignal.GOOD),
    FrictionState.IMPOSSIBLE: (Level.WARN, StatusSignal.CHECK_FUNCTION),
    FrictionState.NORMAL: (Level.OK, StatusSignal.GOOD),
    FrictionState.UNCLEAR: (Level.OK, StatusSignal.GOOD),
    FrictionState.PERHAPS_GROWN: (Level.WARN, StatusSignal.CHECK_FUNCTION),
    FrictionState.GROWN: (Level.WARN, StatusSignal.MAINTENANCE_REQUIRED),
    FrictionState.EXCESS: (Level.ERROR, StatusSignal.FAILURE),
    FrictionState.PERHAPS_FALLEN: (Level.WARN, StatusSignal.CHECK_FUNCTION),
    FrictionState.FALLEN: (Level.WARN, StatusSignal.MAINTENANCE_REQUIRED),
    FrictionState.COLLAPSED: (Level.ERROR, StatusSignal.OUT_OF_SPECIFICATION),
}
_PERHAPS = (FrictionState.UNCLEAR, FrictionState.PERHAPS_GROWN, FrictionState.PERHAPS_FALLEN)


@dataclass(frozen=True)
class StandingAlarm:
    """An alarm on the friction that later records have not ended.

    Attributes
    ----------
    level : Level
        Severity.
    status_signal : StatusSignal
        The severity as a status signal of NE 107.
    state : FrictionState
        What the record said that raised it, or what later ones leave of it.
    message : str
        Its sentence, dated.
    time : int
        When that record was identified, ns since 1970 (UTC).
    """

    level: Level
    status_signal: StatusSignal
    state: FrictionState
    message: str
    time: int


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
        Friction over its baseline, with its interval and the friction that is compared; None
        without a baseline, or where the result has no friction to compare with it.
    state : FrictionState
        What the record says of the friction.
    doubt : str
        Why the model does not describe the valve, with which the message begins; empty if it does.
    alarm : StandingAlarm or None
        The alarm of an earlier record that stands.
    latest : Diagnosis or None
        What the record itself says, where an alarm stands.
    """

    level: Level
    status_signal: StatusSignal
    message: str
    ratio: Ratio | None
    state: FrictionState = FrictionState.UNKNOWN
    doubt: str = ""
    alarm: StandingAlarm | None = None
    latest: "Diagnosis | None" = None

    @property
    def own(self) -> "Diagnosis":
        """What the record itself says."""
        return self.latest or self

    def possible(self, side: Side, limits: FrictionLimits) -> Level:
        """Return the level that the friction may have on a side, by the interval of its ratio.

        A record whose friction is not compared leaves any level possible.
        """
        if self.ratio is None:
            return Level.OK if self.state.side not in (None, side) else Level.ERROR
        if side is Side.HIGH:
            is_below = [self.ratio.high < one for one in (limits.warn_ratio, limits.error_ratio)]
        else:
            is_below = [self.ratio.low > one for one in (limits.low_warn_ratio, limits.low_ratio)]
        return Level(2 - sum(is_below))

    def of_before(self, time: int | None) -> "Diagnosis":
        """Return what is said of a valve that is not watched now, by its record of a time, ns.

        What was normal then need not be so now.
        """
        if self.state is not FrictionState.NORMAL or self.ratio is None:
            return self
        dated = "" if time is None else f" (identified {utc_minute(time)})"
        message = f"{self.ratio.what} was {_figures(self.ratio)} times its baseline{dated}"
        doubt = f"{self.doubt}; " if self.doubt else ""
        return replace(self, message=doubt + message)

    def to_dict(self) -> dict[str, Any]:
        """Return the diagnosis as a mapping of plain values, from which other forms are derived.

        Its keys are ``level`` (OK, WARN or ERROR), ``ne_107``, ``message``, ``ratio``,
        ``ratio_interval``, ``ratio_of`` and ``ratio_speed``.
        """
        ratio = self.ratio
        return {
            "level": self.level.name,
            "ne_107": self.status_signal.value,
            "message": self.message,
            "ratio": None if ratio is None else plain(ratio.value),
            "ratio_interval": None if ratio is None else plain([ratio.low, ratio.high]),
            "ratio_of": None if ratio is None else ratio.of,
            "ratio_speed": None if ratio is None else plain(ratio.speed),
        }

    def __str__(self) -> str:
        """Return level and message on one line; the level is unknown where nothing was compared."""
        is_unknown = self.level is Level.OK and self.ratio is None
        return f"{'unknown' if is_unknown else self.level.name}: {self.message}"


class Frictions(Protocol):
    """The numbers that a diagnosis compares: those of a `Result`, or kept ones."""

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Parameters by name."""

    @property
    def values(self) -> Mapping[str, float]:
        """Their values."""

    @property
    def sliding_speed(self) -> float:
        """Speed that the sliding friction belongs to, m/s."""


class EarlierEstimate(Frictions, Protocol):
    """An estimate that was kept, with the diagnosis that was made by it."""

    @property
    def time(self) -> int:
        """When it was identified, ns since 1970 (UTC)."""

    @property
    def diagnosis(self) -> Diagnosis:
        """The diagnosis of that time."""

    @property
    def baseline(self) -> Baseline | None:
        """The baseline of that time."""

    @property
    def limits(self) -> FrictionLimits:
        """The limits of that time."""

    @property
    def numbers(self) -> Mapping[str, Measured]:
        """What else was measured of the valve."""

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain values, with the keys of `Result.to_dict`."""


def dead_band(result: Frictions, valve: Valve) -> float:
    """Return the dead band of the stem as a share of the travel.

    After a move the sliding friction F_c still holds the spring off balance; to move back, the
    actuator must reverse it and overcome F_s: the same change of pressure would move a
    frictionless stem by (F_c + F_s)/k. Without a slip jump F_s is F_c. The result is nan without a
    spring, without travel stops, or where F_c or k is not identifiable.
    """
    names = ("spring_constant", "coulomb_friction", "static_friction")
    spring_constant, coulomb_friction, static_friction = (
        result.values.get(name, math.nan) for name in names
    )
    if not spring_constant > 0:
        return math.nan
    if math.isnan(static_friction):
        static_friction = coulomb_friction
    return valve.share_of_travel((coulomb_friction + static_friction) / spring_constant)


def dead_band_half_width(result: Frictions, valve: Valve) -> float:
    """Return half the width of the 95 % interval of the dead band, as a share of the travel.

    The errors of F_c and F_s are taken as one, which is the widest; that of k is independent. The
    result is nan where the dead band is.
    """
    band = dead_band(result, valve)
    if math.isnan(band):
        return math.nan
    spring, coulomb = (result.parameters[one] for one in ("spring_constant", "coulomb_friction"))
    static = result.parameters.get("static_friction", coulomb)
    if math.isnan(static.value):
        static = coulomb
    friction = (coulomb.half_width + static.half_width) / (coulomb.value + static.value or math.nan)
    return abs(band) * math.hypot(friction, spring.half_width / spring.value)


def leading_ratio(diagnosis: Diagnosis, findings: Iterable[Finding], level: Level) -> float:
    """Return the friction over its baseline that a level of a valve rests on; nan if on none.

    A finding on the friction that leads comes before the latest identification, any other after it.
    """
    known = [f for f in findings if f.level == level and not math.isnan(f.friction_ratio)]
    leading = [f.friction_ratio for f in known if f.leads]
    if diagnosis.level == level and diagnosis.ratio is not None:
        leading.append(diagnosis.ratio.value)
    return [*leading, *(f.friction_ratio for f in known), math.nan][0]


def _consequence(result: Frictions, valve: Valve) -> str:
    share = dead_band(result, valve)
    if math.isnan(share):
        friction = next(one for one in _frictions(result) if not math.isnan(one.value))
        return f"{_words(friction)} {friction.value:.4g} ± {two_digits(friction.half_width)} N"
    return f"the stem ignores reversals smaller than {percentage(share)} of its travel"


def _frictions(result: Frictions) -> list[Parameter]:
    """Return F_c and, where the result has one, the sliding friction."""
    return [result.parameters[n] for n in ("coulomb_friction", SLIDING) if n in result.parameters]


def _words(friction: Parameter) -> str:
    return friction.name.replace("_", " ")


def _figures(ratio: Ratio) -> str:
    return f"{ratio.value:.2f} ({ratio.low:.2f} to {ratio.high:.2f})"


def diagnose(
    result: Result,
    valve: Valve,
    baseline: Baseline | None = None,
    limits: FrictionLimits | None = None,
) -> Diagnosis:
    """Compare the identified friction with its baseline (`compared`).

    Parameters
    ----------
    result : Result
        The latest identification.
    valve : Valve
        Gives the travel, for the dead band.
    baseline : Baseline, optional
        Friction of the healthy valve.
    limits : FrictionLimits, optional
        Bounds of the ratio.

    Returns
    -------
    Diagnosis
        A bound counts as passed when the 95 % interval of the ratio lies beyond it, so that an
        uncertain result raises no alarm: on an unchanged valve it would have to be wrong by the
        whole distance to the bound. Where only the ratio itself lies beyond one, and the interval
        excludes an unchanged friction, the valve is to be identified again (WARN, check function).
        A friction that is not identifiable has collapsed where even its largest possible value
        lies below the low bound. A model that does not describe the valve is said, and raises no
        alarm: one record is no sign of a fault.
    """
    limits = limits or FrictionLimits()
    for friction in _frictions(result):
        if friction.value < 0:
            width = two_digits(friction.half_width)
            message = (
                f"{_words(friction)} is {friction.value:.4g} ± {width} N, and "
                "friction is above zero: check the direction of both signals"
            )
            return Diagnosis(
                Level.WARN, StatusSignal.CHECK_FUNCTION, message, None, FrictionState.IMPOSSIBLE
            )
    return _with_model_doubt(_by_size(result, valve, baseline, limits), result)


def diagnose_again(
    earlier: EarlierEstimate,
    kept: Diagnosis,
    valve: Valve,
    baseline: Baseline | None,
    limits: FrictionLimits,
) -> Diagnosis:
    """Return the diagnosis of an estimate that was kept.

    It is `kept`, that of its time, unless another baseline, or other limits, are in force and the
    frictions can be compared with them. Without a baseline it stays: an alarm does not end because
    the baseline of that time was not kept. A doubt about the model stays.
    """
    is_same = (baseline, limits) == (earlier.baseline, earlier.limits)
    if baseline is None or is_same or any(one.value < 0 for one in _frictions(earlier)):
        return kept
    if compared(earlier.parameters, earlier.sliding_speed, baseline) is None:
        return kept
    again = _by_size(earlier, valve, baseline, limits)
    return _doubted(again, kept.doubt) if kept.doubt else again


def _by_size(
    result: Frictions, valve: Valve, baseline: Baseline | None, limits: FrictionLimits
) -> Diagnosis:
    found = None
    if baseline is not None:
        found = compared(result.parameters, result.sliding_speed, baseline)
        if vanished := _vanished(result, baseline, limits):
            level, signal = _SEVERITY[FrictionState.COLLAPSED]
            return Diagnosis(level, signal, vanished, None, FrictionState.COLLAPSED)
    if all(math.isnan(one.value) for one in _frictions(result)):
        friction = _frictions(result)[0]
        message = f"{_words(friction)} is not identifiable: {friction.reason}"
        return Diagnosis(Level.OK, StatusSignal.GOOD, message, None)
    effect = _consequence(result, valve)
    if found is not None:
        return against(found.ratio, limits, effect)
    why = "no baseline yet" if baseline is None else _why_not_compared(result, baseline)
    return Diagnosis(Level.OK, StatusSignal.GOOD, f"{why}; {effect}", None)


def _why_not_compared(result: Frictions, baseline: Baseline) -> str:
    """Return why a result has no friction to compare with a baseline, in one sentence."""
    reasons = []
    for one in _frictions(result):
        if math.isnan(one.value):
            reasons.append(f"{_words(one)} is not identifiable: {one.reason}")
        elif one.name == SLIDING and baseline.sliding is not None:
            reasons.append(
                f"the stem slides at {result.sliding_speed * 1e3:.2g} mm/s, and at "
                f"{baseline.sliding.speed * 1e3:.2g} mm/s in the baseline: move it at a speed "
                f"within a factor of {LARGEST_SPEED_RATIO:g}"
            )
        else:
            reasons.append(f"the baseline has no {_words(one)}: set it anew")
    return f"no comparison with the baseline ({baseline}): {'; '.join(reasons)}"


def _vanished(result: Frictions, baseline: Baseline, limits: FrictionLimits) -> str:
    """Return that a friction too small to be identified lies below the low limit, or nothing.

    The sliding friction decides where both have it. F_c decides only where no sliding friction
    contradicts it: what F_c loses to F_v is no collapse. At a higher speed a sliding friction is
    larger, at most by the ratio of the speeds.
    """
    healthy = {"coulomb_friction": (baseline.coulomb_friction or 0.0, baseline.half_width)}
    if (slid := baseline.sliding) is not None:
        healthy[SLIDING] = (slid.value, slid.half_width)
        now = carried(result.parameters, result.sliding_speed, slid)
        if now is not None and now.value + now.half_width >= slid.value - slid.half_width:
            return ""
    for one in _frictions(result):
        value, width = healthy.get(one.name, (0.0, 0.0))
        largest = one.magnitude_bound
        if one.name == SLIDING and slid is not None:
            largest *= max(slid.speed / result.sliding_speed, 1.0)
        if math.isnan(one.value) and largest <= limits.low_ratio * (value - width):
            return (
                f"friction collapsed, the packing may leak: {_words(one)} is too small to be "
                f"identified, at most {largest:.2g} N; its baseline is {value:.4g} N"
            )
    return ""


def _with_model_doubt(diagnosis: Diagnosis, result: Result) -> Diagnosis:
    misfit = result.misfit
    if misfit is None or misfit.describes:
        return diagnosis
    return _doubted(diagnosis, f"{DOUBT} ({misfit.words} of misfit)")


def _doubted(diagnosis: Diagnosis, doubt: str) -> Diagnosis:
    return replace(diagnosis, message=f"{doubt}; {diagnosis.message}", doubt=doubt)


def against(
    ratio: Ratio, limits: FrictionLimits, effect: str, healthy: str = "its baseline"
) -> Diagnosis:
    """Return the diagnosis of a friction over the `healthy` one, with its `effect` in words."""
    state = friction_state(ratio, limits)
    level, signal = _SEVERITY[state]
    finding = f"{ratio.what} is {_figures(ratio)} times {healthy}"
    advice = f"; {_AGAIN}" if state.is_uncertain else ""
    return Diagnosis(level, signal, f"{state.value}: {finding}; {effect}{advice}", ratio, state)


def friction_state(ratio: Ratio, limits: FrictionLimits) -> FrictionState:
    """Return what a ratio says: a limit is passed where the whole interval lies beyond it.

    Where the ratio itself lies beyond a limit and the interval does not, friction has perhaps
    changed so far, provided that it surely has changed at all.
    """
    is_high, is_low = ratio.value >= limits.warn_ratio, ratio.value <= limits.low_warn_ratio
    passed = (
        (ratio.low >= limits.error_ratio, FrictionState.EXCESS),
        (ratio.high <= limits.low_ratio, FrictionState.COLLAPSED),
        (ratio.low >= limits.warn_ratio, FrictionState.GROWN),
        (ratio.high <= limits.low_warn_ratio, FrictionState.FALLEN),
        (is_high and not ratio.low <= 1.0, FrictionState.PERHAPS_GROWN),
        (is_low and not ratio.high >= 1.0, FrictionState.PERHAPS_FALLEN),
        (is_high or is_low, FrictionState.UNCLEAR),
    )
    return next((state for is_passed, state in passed if is_passed), FrictionState.NORMAL)
