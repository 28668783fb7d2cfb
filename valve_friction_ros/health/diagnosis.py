# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Diagnosis of friction: whether it has grown or collapsed, and the consequence for the valve."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from typing import Any, TypeAlias

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.comparison import Ratio, carried, compared
from valve_friction_ros.health.levels import (
    Finding,
    Level,
    StatusSignal,
    Survey,
    SurveyLimits,
    surveyed,
)
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.valve_numbers import comparable_numbers
from valve_friction_ros.identification.rendering import plain
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.wording import Code, Statement, said, sentence

_SURELY = 1.5
"""Half widths of its 95 % interval by which a ratio must differ from 1 to show a change.

With normal errors, 3 of 1000 records of an unchanged valve exceed this. At one half width 5 %
would, and in a plant of a hundred valves some would always be in doubt."""


@dataclass(frozen=True)
class FrictionLimits:
    """Bounds of the friction, as ratios to its baseline.

    `friction_state` defines when a bound is exceeded.

    Attributes
    ----------
    warn_ratio : float
        Ratio from which the valve requires maintenance.
    error_ratio : float
        Ratio from which friction is excessive.
    low_ratio : float
        Ratio below which friction has collapsed: the packing is worn and may leak.
    survey : SurveyLimits
        Bounds of the dead band for a valve without a baseline; ignored by equality.

    Raises
    ------
    ValueError
        Unless 0 < low_ratio < 1 < warn_ratio < error_ratio.

    Notes
    -----
    No standard gives such ratios; the defaults are chosen. 2 doubles the dead band (F_c + F_s)/k,
    0.5 halves it, and the growth of 0.25 is five times the largest half width of an identified
    friction (`WEAK_SHARE`). The ratios are parameters, so a plant can set better values.
    """

    warn_ratio: float = 1.25
    error_ratio: float = 2.0
    low_ratio: float = 0.5
    survey: SurveyLimits = field(default_factory=SurveyLimits, compare=False)

    def __post_init__(self) -> None:
        if not 0 < self.low_ratio < 1 < self.warn_ratio < self.error_ratio:
            raise ValueError(
                "limits must satisfy 0 < low_ratio < 1 < warn_ratio < error_ratio, got low_ratio "
                f"{self.low_ratio:g}, warn_ratio {self.warn_ratio:g}, error_ratio "
                f"{self.error_ratio:g}"
            )

    @property
    def ratios(self) -> dict[str, float]:
        """The ratios by name, as stored."""
        return {name: getattr(self, name) for name in ("warn_ratio", "error_ratio", "low_ratio")}

    @property
    def low_warn_ratio(self) -> float:
        """Ratio below which the valve requires maintenance, between `low_ratio` and 1.

        It is the inverse of `warn_ratio`, or halfway to `low_ratio` by logarithm if that is nearer
        to 1.
        """
        return max(1 / self.warn_ratio, math.sqrt(self.low_ratio))


class Side(Enum):
    """Side of the baseline on which the friction lies."""

    HIGH = "high"
    LOW = "low"


class FrictionState(Enum):
    """State of the friction of a record against its baseline."""

    UNKNOWN = auto()
    """Not compared."""
    IMPOSSIBLE = auto()
    """Below zero."""
    NORMAL = auto()
    UNCLEAR = auto()
    """Beyond a limit, but possibly unchanged."""
    GROWN = auto()
    """Clearly changed, and most probably beyond the warning bound."""
    EXCESS = auto()
    FALLEN = auto()
    COLLAPSED = auto()

    @classmethod
    def moved(cls, side: Side, level: Level) -> "FrictionState":
        """Return the state of a friction that has moved to a side, by its level, WARN or ERROR."""
        return next(one for one in cls if one.side is side and one.level is level)

    @property
    def side(self) -> Side | None:
        """The side to which the friction has clearly moved; None if that is not sure."""
        return _MEANINGS[self][2]

    @property
    def level(self) -> Level:
        """Severity of the state."""
        return _MEANINGS[self][0]

    @property
    def status_signal(self) -> StatusSignal:
        """The severity as a status signal of NE 107."""
        return _MEANINGS[self][1]


_MEANINGS: dict[FrictionState, tuple[Level, StatusSignal, Side | None]] = {
    FrictionState.UNKNOWN: (Level.OK, StatusSignal.GOOD, None),
    FrictionState.IMPOSSIBLE: (Level.WARN, StatusSignal.CHECK_FUNCTION, None),
    FrictionState.NORMAL: (Level.OK, StatusSignal.GOOD, None),
    FrictionState.UNCLEAR: (Level.OK, StatusSignal.GOOD, None),
    FrictionState.GROWN: (Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, Side.HIGH),
    FrictionState.EXCESS: (Level.ERROR, StatusSignal.FAILURE, Side.HIGH),
    FrictionState.FALLEN: (Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, Side.LOW),
    FrictionState.COLLAPSED: (Level.ERROR, StatusSignal.OUT_OF_SPECIFICATION, Side.LOW),
}


@dataclass(frozen=True)
class StandingAlarm:
    """A friction alarm that later records have not cleared.

    Attributes
    ----------
    level : Level
        Severity.
    status_signal : StatusSignal
        The severity as a status signal of NE 107.
    state : FrictionState
        State of the record that raised it, or what later records leave of it.
    statement : Statement
        Dated statement of that record.
    time : int
        Time of identification of that record, ns since 1970 (UTC).
    """

    level: Level
    status_signal: StatusSignal
    state: FrictionState
    statement: Statement
    time: int


@dataclass(frozen=True)
class Diagnosis:
    """Diagnosis of the friction of a valve.

    Attributes
    ----------
    level : Level
        Severity.
    status_signal : StatusSignal
        The severity as a status signal of NE 107.
    statement : Statement
        The finding and its consequence.
    ratio : Ratio or None
        Friction over its baseline, with its interval and the compared friction; None without a
        baseline, or where the result has no friction comparable with it.
    state : FrictionState
        State of the friction.
    doubt : Statement or None
        Why the model does not describe the valve, at the start of the statement; None if it does.
    alarm : StandingAlarm or None
        The alarm of an earlier record that is still active.
    latest : Diagnosis or None
        The diagnosis of the latest record by itself, where such an alarm is active.
    """

    level: Level
    status_signal: StatusSignal
    statement: Statement
    ratio: Ratio | None
    state: FrictionState = FrictionState.UNKNOWN
    doubt: Statement | None = None
    alarm: StandingAlarm | None = None
    latest: "Diagnosis | None" = None

    @classmethod
    def of(
        cls, state: FrictionState, statement: Statement, ratio: Ratio | None = None
    ) -> "Diagnosis":
        """Return the diagnosis of a state, with its severity."""
        return cls(state.level, state.status_signal, statement, ratio, state)

    @property
    def message(self) -> str:
        """The finding in one sentence."""
        return sentence(self.statement)

    @property
    def survey(self) -> Survey:
        """Grade of a valve without a baseline in a first survey."""
        return Survey[self.statement.innermost.facts.get("survey", Survey.UNKNOWN.name)]

    @property
    def lacks_comparison(self) -> bool:
        """Whether there is a baseline, but no friction comparable with it."""
        return self.statement.innermost.code is Code.NOT_COMPARED

    @property
    def own(self) -> "Diagnosis":
        """The diagnosis of the latest record by itself."""
        return self.latest or self

    def possible(self, side: Side, limits: FrictionLimits) -> Level:
        """Return the highest level on a side that the interval of the ratio allows.

        Without a ratio every level stays possible, unless friction has clearly moved to the other
        side.
        """
        if self.ratio is None:
            return Level.OK if self.state.side not in (None, side) else Level.ERROR
        if side is Side.HIGH:
            is_below = [self.ratio.high < one for one in (limits.warn_ratio, limits.error_ratio)]
        else:
            is_below = [self.ratio.low > one for one in (limits.low_warn_ratio, limits.low_ratio)]
        return Level(2 - sum(is_below))

    def of_before(self, time: int | None) -> "Diagnosis":
        """Return the diagnosis of a valve that is not monitored now, from its record at `time`, ns.

        It reports normal friction in the past tense: it may have changed since.
        """
        if self.state is not FrictionState.NORMAL or self.ratio is None:
            return self
        ratio = self.ratio
        was = said(Code.WAS_COMPARED, what=ratio.friction, ratio=ratio.interval, time=time)
        return replace(self, statement=_doubted(was, self.doubt))

    def to_dict(self) -> dict[str, Any]:
        """Return the diagnosis as a mapping of plain values, the source of all other formats.

        The keys are ``level`` (OK, WARN or ERROR), ``ne_107``, ``message``, ``ratio``,
        ``ratio_interval``, ``ratio_of``, ``ratio_speed`` and ``survey``.
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
            "survey": self.survey.value,
        }

    def __str__(self) -> str:
        """Return level and message on one line; OK reads unknown where nothing was compared."""
        is_unknown = self.level is Level.OK and self.ratio is None
        return f"{'unknown' if is_unknown else self.level.name}: {self.message}"


@equal_by_fields
@dataclass(frozen=True, kw_only=True)
class EarlierEstimate:
    """A stored estimate with its diagnosis.

    Attributes
    ----------
    time : int
        When the identification ended, ns since 1970 (UTC) by the node's clock.
    diagnosis : Diagnosis
        The diagnosis that the operator saw.
    limits : FrictionLimits
        The limits in force.
    baseline : Baseline or None
        The baseline in force.
    parameters : mapping of str to Parameter
        The identified parameters.
    sliding_speed : float
        Speed to which the sliding friction applies, m/s; nan if unknown.
    numbers : mapping of str to Measured
        Other measured numbers of the valve (`valve_numbers`).
    """

    time: int
    diagnosis: Diagnosis
    limits: FrictionLimits
    baseline: Baseline | None
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    sliding_speed: float = math.nan
    numbers: Mapping[str, Measured] = field(default_factory=dict)

    @property
    def values(self) -> dict[str, float]:
        """Values of the parameters by name."""
        return {name: parameter.value for name, parameter in self.parameters.items()}

    def to_dict(self) -> dict[str, Any]:
        """Return plain values with the keys of `Result.to_dict`."""
        raise NotImplementedError


Estimate: TypeAlias = Result | EarlierEstimate
"""The numbers that a diagnosis compares, identified now or stored."""


def dead_band(result: Estimate, valve: Valve) -> float:
    """Return the dead band of the stem as a share of the travel.

    After a move the sliding friction F_c still holds the spring off balance. To move back, the
    actuator must reverse this force and overcome F_s. The same change of pressure would move a
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


def dead_band_half_width(result: Estimate, valve: Valve) -> float:
    """Return half the width of the 95 % interval of the dead band, as a share of the travel.

    The errors of F_c and F_s are taken as fully correlated, the worst case. The error of k is
    independent. The result is nan where the dead band is.
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


def survey_of(result: Estimate, valve: Valve, limits: SurveyLimits | None = None) -> Survey:
    """Return the grade of a valve in a first survey, by its dead band.

    Without a spring constant, twice the friction over the force of the pressure sensor's range
    takes the place of the dead band.
    """
    band, width = dead_band(result, valve), dead_band_half_width(result, valve)
    if math.isnan(band) and valve.diaphragm_area is not None:
        span = valve.diaphragm_area * (valve.pressure_maximum - valve.pressure_minimum)
        known = [one for one in _frictions(result) if math.isfinite(one.value)]
        if known and math.isfinite(span) and not result.values.get("spring_constant", 0.0) > 0:
            band, width = 2 * known[-1].value / span, 2 * known[-1].half_width / span
    return surveyed(band, width, limits)


def leading_ratio(diagnosis: Diagnosis, findings: Iterable[Finding], level: Level) -> float:
    """Return the friction ratio behind a level of a valve; nan if there is none.

    A leading finding on friction comes before the latest identification, any other after it.
    """
    known = [f for f in findings if f.level == level and not math.isnan(f.friction_ratio)]
    leading = [f.friction_ratio for f in known if f.leads]
    if diagnosis.level == level and diagnosis.ratio is not None:
        leading.append(diagnosis.ratio.value)
    return [*leading, *(f.friction_ratio for f in known), math.nan][0]


def _consequence(result: Estimate, valve: Valve) -> Statement:
    share = dead_band(result, valve)
    if math.isnan(share):
        friction = next(one for one in _frictions(result) if not math.isnan(one.value))
        return said(Code.FRICTION_SIZE, **_sized(friction))
    return said(Code.DEAD_BAND, share=share)


def _frictions(result: Estimate) -> list[Parameter]:
    """Return F_c and, where the result has one, the sliding friction."""
    return [result.parameters[n] for n in ("coulomb_friction", SLIDING) if n in result.parameters]


def _sized(friction: Parameter) -> dict[str, Any]:
    return {"of": friction.name, "value": friction.value, "half_width": friction.half_width}


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
        Its state follows `friction_state`: an uncertain result raises no alarm.
        A friction that is not identifiable has collapsed where even its largest possible value
        lies below the low bound. A model that does not describe the valve is reported without an
        alarm: a single record is not a sign of a fault.
    """
    limits = limits or FrictionLimits()
    for friction in _frictions(result):
        if friction.value < 0:
            below = said(Code.FRICTION_BELOW_ZERO, **_sized(friction))
            return Diagnosis.of(FrictionState.IMPOSSIBLE, below)
    numbers, misfit = comparable_numbers(result.evidence), result.misfit
    found = _by_size(result, valve, baseline, limits, numbers)
    if misfit is None or misfit.describes:
        return found
    return _with_doubt(found, said(Code.MISFIT, misfit=(misfit.systematic, misfit.unit)))


def diagnose_again(
    earlier: EarlierEstimate,
    kept: Diagnosis,
    valve: Valve,
    baseline: Baseline | None,
    limits: FrictionLimits,
) -> Diagnosis:
    """Return the diagnosis of a stored estimate.

    It is `kept`, the stored diagnosis, unless the baseline or the limits have changed and the
    frictions are comparable with the new ones. Without a baseline it stays: an alarm does not clear
    because its baseline was not stored. A doubt about the model stays.
    """
    is_same = (baseline, limits) == (earlier.baseline, earlier.limits)
    if baseline is None or is_same or any(one.value < 0 for one in _frictions(earlier)):
        return kept
    found = compared(earlier.parameters, earlier.sliding_speed, baseline, earlier.numbers)
    if found is None:
        return kept
    again = _by_size(earlier, valve, baseline, limits, earlier.numbers)
    return again if kept.doubt is None else _with_doubt(again, kept.doubt)


def _by_size(
    result: Estimate,
    valve: Valve,
    baseline: Baseline | None,
    limits: FrictionLimits,
    numbers: Mapping[str, Measured],
) -> Diagnosis:
    found = None
    if baseline is not None:
        found = compared(result.parameters, result.sliding_speed, baseline, numbers)
        if vanished := _vanished(result, baseline, limits, numbers):
            return Diagnosis.of(FrictionState.COLLAPSED, vanished)
    if all(math.isnan(one.value) for one in _frictions(result)):
        return Diagnosis.of(FrictionState.UNKNOWN, _not_identifiable(_frictions(result)[0]))
    effect = _consequence(result, valve)
    if found is not None:
        return against(found.ratio, limits, effect)
    if baseline is None:
        survey = survey_of(result, valve, limits.survey)
        first = said(Code.NO_BASELINE, effect=effect, survey=survey.name)
        return Diagnosis.of(FrictionState.UNKNOWN, first)
    reasons = tuple(_why_not_compared(one, result, baseline) for one in _frictions(result))
    by_speed = tuple(one for one in reasons if one.code is Code.NOT_COMPARED_SPEED)
    reasons = by_speed or reasons
    why = said(Code.NOT_COMPARED, baseline=baseline.statement, reasons=reasons, effect=effect)
    return Diagnosis.of(FrictionState.UNKNOWN, why)


def _not_identifiable(friction: Parameter) -> Statement:
    return said(Code.NOT_IDENTIFIABLE, of=friction.name, reason=friction.reason)


def _why_not_compared(one: Parameter, result: Estimate, baseline: Baseline) -> Statement:
    if math.isnan(one.value):
        return _not_identifiable(one)
    if one.name == SLIDING and baseline.sliding is not None:
        speeds = {"speed": result.sliding_speed, "healthy": baseline.sliding.speed}
        return said(Code.NOT_COMPARED_SPEED, **speeds)
    return said(Code.NOT_COMPARED_LACKING, of=one.name)


def _vanished(
    result: Estimate,
    baseline: Baseline,
    limits: FrictionLimits,
    numbers: Mapping[str, Measured],
) -> Statement | None:
    """Return a statement if a friction too small to identify lies below the low limit, else None.

    F_c decides only where no sliding friction contradicts it: a shift from F_c to F_v is not a
    collapse. At a higher speed sliding friction is larger, at most by the ratio of the speeds.
    """
    healthy = {"coulomb_friction": (baseline.coulomb_friction or 0.0, baseline.half_width)}
    if (slid := baseline.sliding) is not None:
        healthy[SLIDING] = (slid.value, slid.half_width)
        now = carried(result.parameters, result.sliding_speed, slid, numbers)
        if now is not None and now.value + now.half_width >= slid.value - slid.half_width:
            return None
    for one in _frictions(result):
        value, width = healthy.get(one.name, (0.0, 0.0))
        largest = one.magnitude_bound
        if one.name == SLIDING and slid is not None:
            largest *= max(slid.speed / result.sliding_speed, 1.0)
        if math.isnan(one.value) and largest <= limits.low_ratio * (value - width):
            return said(Code.VANISHED, of=one.name, largest=largest, healthy=value)
    return None


def _with_doubt(diagnosis: Diagnosis, doubt: Statement) -> Diagnosis:
    return replace(diagnosis, statement=_doubted(diagnosis.statement, doubt), doubt=doubt)


def _doubted(statement: Statement, doubt: Statement | None) -> Statement:
    return statement if doubt is None else said(Code.DOUBTED, doubt=doubt, of=statement)


def against(
    ratio: Ratio,
    limits: FrictionLimits,
    effect: Statement,
    healthy: Statement | None = None,
) -> Diagnosis:
    """Return the diagnosis of a ratio to the `healthy` friction, by default the baseline.

    `effect` states the consequence of the friction for the valve.
    """
    state = friction_state(ratio, limits)
    statement = said(
        Code.COMPARED_AGAIN if state is FrictionState.UNCLEAR else Code.COMPARED,
        state=state.name,
        what=ratio.friction,
        ratio=ratio.interval,
        healthy=healthy or said(Code.ITS_BASELINE),
        effect=effect,
    )
    return Diagnosis.of(state, statement, ratio)


def friction_state(ratio: Ratio, limits: FrictionLimits) -> FrictionState:
    """Return the state of friction from a ratio and its 95 % interval.

    Friction is excessive, or has collapsed, where the whole interval lies beyond the bound. It has
    grown or fallen where the whole interval lies beyond the warning bound, or where the ratio does
    and friction has clearly changed (`_SURELY`). Where the change may be chance, the state is
    unclear.
    """
    surely = math.isnan(ratio.low) or (
        ratio.low > 0
        and abs(math.log(ratio.value)) > _SURELY * 0.5 * math.log(ratio.high / ratio.low)
    )
    is_high, is_low = ratio.value >= limits.warn_ratio, ratio.value <= limits.low_warn_ratio
    passed = (
        (ratio.low >= limits.error_ratio, FrictionState.EXCESS),
        (ratio.high <= limits.low_ratio, FrictionState.COLLAPSED),
        (ratio.low >= limits.warn_ratio or (is_high and surely), FrictionState.GROWN),
        (ratio.high <= limits.low_warn_ratio or (is_low and surely), FrictionState.FALLEN),
        (is_high or is_low, FrictionState.UNCLEAR),
    )
    return next((state for is_passed, state in passed if is_passed), FrictionState.NORMAL)
