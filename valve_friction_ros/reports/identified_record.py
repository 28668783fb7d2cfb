# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Content of the report of an identification, with its status and one-sentence diagnosis."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from functools import cached_property

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.diagnosis import (
    Diagnosis,
    FrictionLimits,
    FrictionState,
    dead_band,
    diagnose,
)
from valve_friction_ros.health.levels import Finding, Level, StatusSignal, Survey, by_severity
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.valve_diagnosis import (
    KnownNumbers,
    ValveLimits,
    drive_scale,
    explains,
    qualified,
)
from valve_friction_ros.health.valve_numbers import valve_numbers
from valve_friction_ros.history import ValveHistory
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.trust.verdict import Parameter, Verdict
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.reports.page import Colour, Conclusion
from valve_friction_ros.response import ResponseSummary
from valve_friction_ros.usage import LimitState, ValveUsage
from valve_friction_ros.wording import (
    capitalised,
    finding_advice,
    friction_advice,
    in_zone,
    percentage,
    ratio_interval,
    with_width,
)


@dataclass(frozen=True, eq=False)
class IdentifiedRecord:
    """A record and its result, with baseline and limits for the diagnosis.

    Attributes
    ----------
    name : str
        Name of the valve.
    source : str
        Source of the record.
    result : Result
        Result of the identification.
    baseline : Baseline or None
        Friction of the healthy valve.
    limits : FrictionLimits
        Bounds of the friction.
    notes : tuple of str
        Limitations of the record, one sentence each.
    dated : str
        A further date in words, such as that of the file or of the identification.
    healthy : Recording or None
        Record of the baseline, drawn in the same panel.
    history : ValveHistory or None
        Earlier identifications of this valve.
    usage : ValveUsage
        Travel, reversals and time of the valve in service.
    response : ResponseSummary or None
        Answers of the valve to command steps.
    usage_limits : tuple of LimitState or None
        State of the packing limits; None if unknown.
    valve_limits : ValveLimits
        Bounds of the other numbers of the valve.
    known : KnownNumbers or None
        Numbers of the valve from this and earlier records; None: from this result alone.
    zone : str
        Time zone for the date of the record, an IANA name; empty for UTC.
    """

    name: str
    source: str
    result: Result = field(repr=False)
    baseline: Baseline | None = None
    limits: FrictionLimits = field(default_factory=FrictionLimits)
    notes: tuple[str, ...] = ()
    dated: str = ""
    healthy: Recording | None = field(default=None, repr=False)
    history: ValveHistory | None = field(default=None, repr=False)
    usage: ValveUsage = field(default_factory=ValveUsage, repr=False)
    response: ResponseSummary | None = field(default=None, repr=False)
    usage_limits: tuple[LimitState, ...] | None = None
    valve_limits: ValveLimits = field(default_factory=ValveLimits)
    known: KnownNumbers | None = field(default=None, repr=False)
    zone: str = ""

    @property
    def recording(self) -> Recording:
        """Drive and stem position."""
        return self.result.recording

    @property
    def valve(self) -> Valve:
        """Geometry of the valve."""
        return self.result.valve

    @property
    def _friction(self) -> Diagnosis:
        return diagnose(self.result, self.valve, self.baseline, self.limits)

    @property
    def _factor(self) -> Measured | None:
        return self._known.common_factor(self.baseline, self.valve_limits)

    @property
    def diagnosis(self) -> Diagnosis:
        """The diagnosis of the valve."""
        return qualified(self._friction, self._factor, self.valve)

    @property
    def is_scaled(self) -> bool:
        """Whether one common factor explains the changes of both friction and spring."""
        return explains(self._factor, self._friction)

    @cached_property
    def _known(self) -> KnownNumbers:
        return self.known or KnownNumbers().followed_by(valve_numbers(self.result), 0)

    @property
    def numbers(self) -> dict[str, Measured]:
        """Known numbers of the valve other than its friction."""
        return self._known.numbers

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Changes of the valve other than its friction, the most severe first."""
        return tuple(
            by_severity(self._known.findings(self.baseline, self.valve, self.valve_limits))
        )


_DATED = (1e9, 1e11)
"""Range of start times that are seconds since 1970: years 2001 to 5138."""

_STATUS = {
    FrictionState.EXCESS: Conclusion(Colour.RED, "Excess friction", "failure (NE 107: F)"),
    FrictionState.COLLAPSED: Conclusion(
        Colour.RED, "Friction has collapsed", "out of specification (NE 107: S)"
    ),
    FrictionState.GROWN: Conclusion(
        Colour.AMBER, "Friction has grown", "maintenance required (NE 107: M)"
    ),
    FrictionState.FALLEN: Conclusion(
        Colour.AMBER, "Friction has fallen", "maintenance required (NE 107: M)"
    ),
    FrictionState.UNCLEAR: Conclusion(
        Colour.GREY, "Friction uncertain", "beyond a limit, but perhaps unchanged"
    ),
}


def valve_status(record: IdentifiedRecord) -> Conclusion:
    """Return the status; green only if a comparison with the baseline found nothing."""
    diagnosis = record.diagnosis
    worst = next(iter(record.findings), None)
    if worst is not None and worst.level > diagnosis.level:
        colour = Colour.RED if worst.level is Level.ERROR else Colour.AMBER
        if record.is_scaled and worst.status_signal is StatusSignal.CHECK_FUNCTION:
            return Conclusion(colour, "Check the sensors' scales", "check function (NE 107: C)")
        return Conclusion(colour, "The valve has changed", f"NE 107: {worst.status_signal.value}")
    if record.is_scaled:
        return Conclusion(Colour.AMBER, "Check the sensors' scales", "check function (NE 107: C)")
    return _of_friction(record)


def _of_friction(record: IdentifiedRecord) -> Conclusion:
    diagnosis = record.diagnosis
    if diagnosis.state in _STATUS:
        return _STATUS[diagnosis.state]
    if diagnosis.level >= Level.WARN:
        return Conclusion(Colour.AMBER, "Check sensors and model", "check function (NE 107: C)")
    if diagnosis.ratio is None:
        return Conclusion(Colour.GREY, "Unknown", _why_unknown(record))
    return Conclusion(Colour.GREEN, "Friction normal", "compared with the healthy valve")


def _why_unknown(record: IdentifiedRecord) -> str:
    values = record.result.values
    frictions = [values.get(name, math.nan) for name in ("coulomb_friction", SLIDING)]
    if all(map(math.isnan, frictions)):
        return "this record does not determine the friction"
    if record.baseline is None:
        return "no baseline to compare the friction with"
    return "not comparable with the baseline"


def began(record: IdentifiedRecord) -> datetime | None:
    """Return the start of a record, or None if its time is not in seconds since 1970."""
    start = record.recording.start_time
    if not _DATED[0] < start < _DATED[1]:
        return None
    return datetime.fromtimestamp(start, timezone.utc)


def date_line(record: IdentifiedRecord) -> str:
    """Return the date of the record in one sentence."""
    known, begin = "The record has no date", began(record)
    if begin is not None:
        known = f"Recorded {in_zone(begin, record.zone)}"
    return "; ".join(filter(None, (known, record.dated))) + "."


_CHECK = "check the sensors and their mounting, then identify it again"
_AS_BASELINE = "move the valve as for its baseline, and identify it again"
_BASELINE = "set a baseline, the friction of the healthy valve, to see whether it grows"

_STATE_WORDS = {
    FrictionState.EXCESS: "the friction is excessive, {ratio}",
    FrictionState.COLLAPSED: "the friction has collapsed, {ratio}",
    FrictionState.GROWN: "the friction has grown, {ratio}",
    FrictionState.FALLEN: "the friction has fallen, {ratio}",
    FrictionState.UNCLEAR: "the friction may have changed, {ratio}",
}


_SURVEY_ADVICE = {
    Survey.BAD: "plan work on the packing: its loop will oscillate; set a baseline afterwards",
    Survey.WATCH: "record it again within three months, and set a baseline",
    Survey.GOOD: "set a baseline: this record is suitable",
}


def what_to_do(diagnosis: Diagnosis, findings: Sequence[Finding] = ()) -> str:
    """Return the advice for a diagnosis, in a few words for a list of valves.

    Without a comparison the advice comes from the first survey, by absolute limits.
    """
    advice = friction_advice(diagnosis.state.name) or finding_advice(diagnosis.statement)
    if not advice and findings:
        advice = finding_advice(by_severity(findings)[0].statement)
    if advice:
        return advice
    if diagnosis.ratio is not None:
        return "no action is needed"
    if diagnosis.lacks_comparison:
        return _AS_BASELINE
    return _SURVEY_ADVICE.get(diagnosis.survey, _BASELINE)


def diagnosis_sentence(record: IdentifiedRecord) -> str:
    """Return the diagnosis in sentences: what to do, finding, certainty and consequence.

    It states the diagnosis of the monitor for readers outside control engineering. Other changes
    in the valve follow, one sentence each.
    """
    friction, sureness = _friction(record), ""
    state = record.diagnosis.state
    if record.diagnosis.ratio is None and state in _STATE_WORDS:
        vanished = next(one for one in _frictions(record) if math.isnan(one.value))
        size = f"at most {vanished.magnitude_bound:.2g} N, too small to be identified"
        finding, advice = _STATE_WORDS[state].format(ratio=size), friction_advice(state.name)
    elif math.isnan(friction.value):
        finding = f"this record does not determine the friction ({friction.reason})"
        advice = "stroke the valve quickly several times in both directions and identify it again"
    elif friction.value < 0:
        finding = (
            f"the identified friction is {friction.value:.4g} N, but friction cannot be negative"
        )
        advice = friction_advice(FrictionState.IMPOSSIBLE.name)
    else:
        (finding, advice), sureness = _found(record), _sureness(friction)
    told = (_doubt(record), advice, finding, sureness, _consequence(record))
    others = (one.message for one in record.findings)
    return " ".join(f"{capitalised(one)}." for one in filter(None, (*told, *others)))


def _frictions(record: IdentifiedRecord) -> list[Parameter]:
    parameters = record.result.parameters
    return [parameters[name] for name in ("coulomb_friction", SLIDING) if name in parameters]


def _friction(record: IdentifiedRecord) -> Parameter:
    """Return the friction that was compared; without a comparison a known one, preferably F_c.

    A negative friction comes first: it is a fault of the signals.
    """
    ratio, frictions = record.diagnosis.ratio, _frictions(record)
    if ratio is not None:
        return record.result.parameters[ratio.of]
    below = [one for one in frictions if one.value < 0]
    known = [one for one in frictions if not math.isnan(one.value)]
    return [*below, *known, *frictions][0]


def _found(record: IdentifiedRecord) -> tuple[str, str]:
    """Return a finding on a known friction, and the advice."""
    friction, diagnosis = _friction(record), record.diagnosis
    if diagnosis.ratio is None:
        size = with_width(friction.value, friction.half_width)
        advice = _BASELINE if record.baseline is None else _AS_BASELINE
        return f"the friction is {size} N", advice
    ratio = (
        f"{diagnosis.ratio.value:.2f} times that of the healthy valve "
        f"({ratio_interval(diagnosis.ratio.low, diagnosis.ratio.high)})"
    )
    if record.is_scaled:
        advice = (
            f"before any work on the packing, check {drive_scale(record.valve)}, because the "
            "spring constant has changed by the same factor"
        )
        return f"the friction seems to have changed, {ratio}", advice
    if (what := _STATE_WORDS.get(diagnosis.state)) is not None:
        return what.format(ratio=ratio), friction_advice(diagnosis.state.name)
    advice = _CHECK if _doubt(record) else "no action is needed"
    return f"the friction is normal, {ratio}", advice


def _sureness(friction: Parameter) -> str:
    """Return how far the number is limited, or an empty string if it is identified."""
    words = {
        Verdict.IDENTIFIED: "",
        Verdict.WEAK: f"this value is weak: {friction.reason}",
        Verdict.FIXED: "it was given, not identified",
    }
    return words[friction.verdict]


def _doubt(record: IdentifiedRecord) -> str:
    misfit = record.result.misfit
    if misfit is None or misfit.describes:
        return ""
    explained = "force" if math.isnan(misfit.of_stem) else "stem's motion"
    return (
        "use this with caution, because the model does not describe this valve "
        f"({misfit.words} of the {explained} remain unexplained)"
    )


def _consequence(record: IdentifiedRecord) -> str:
    share = dead_band(record.result, record.valve)
    if math.isnan(share) or share < 0:
        return ""
    return f"the stem ignores reversals smaller than {percentage(share)} of its travel"
