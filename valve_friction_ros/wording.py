# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sentences of the product: a finding is a `Code` with its numbers, worded here.

No code decides by a sentence, stores it as state or parses it. A `Statement` is compared, stored
and restored by its code and facts. `sentence` words it for topics, pages, reports and logs.
"""

import math
import string
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone, tzinfo
from enum import Enum, unique
from typing import Any

from valve_friction_ros.model.drive import Drive

LAG_SETTING = "timing_uncertainty (--timing-uncertainty)"
"""The setting of the lag between the signals, as a valve file, a node and a command name it."""

MORE_STROKES = (
    f"record more strokes, some fast and some slow, and state {LAG_SETTING} if the clocks and lags "
    "of both signals are known"
)
"""Advice for a narrower interval of friction."""


@unique
class Code(Enum):
    """Meaning of a statement; its value is the sentence, with a format for each fact."""

    QUOTED = "{text}"
    """Text from outside or from a former version, verbatim."""
    # The diagnosis of the friction
    COMPARED = "{state:of state}: {what} is {ratio:figures} times {healthy}; {effect}"
    COMPARED_AGAIN = (
        "{state:of state}: {what} is {ratio:figures} times {healthy}; {effect}; identify it again "
        "from a longer record with more strokes to be sure"
    )
    FRICTION_BELOW_ZERO = (
        "{of:words} is {value,half_width:±} N, but friction cannot be negative: check the "
        "direction of both signals"
    )
    MOVES_BELOW_ZERO = (
        "{moves}, sliding friction is {value:.4g} N, but friction cannot be negative: check the "
        "direction of both signals"
    )
    VANISHED = (
        "friction collapsed, the packing may leak: {of:words} is too small to be identified (at "
        "most {largest:.2g} N); its baseline is {healthy:.4g} N"
    )
    NOT_IDENTIFIABLE = "{of:words} is not identifiable: {reason}"
    NO_BASELINE = "no baseline yet; {effect}{survey:of survey}"
    NOT_COMPARED = "no comparison with the baseline ({baseline}): {reasons:list |; |}; {effect}"
    NOT_COMPARED_SPEED = (
        "the stem slid at {speed:in .2g mm/s} mm/s, but at {healthy:in .2g mm/s} mm/s in the "
        "baseline, and friction between these speeds is not known well enough: move the stem as "
        "for the baseline"
    )
    NOT_COMPARED_LACKING = "the baseline has no {of:words}: set it again"
    WAS_COMPARED = "{what} was {ratio:figures} times its baseline{time:dated}"
    # Qualifications of a diagnosis
    MISFIT = "the Karnopp model does not describe this valve (misfit {misfit:misfit})"
    DOUBTED = "{doubt}; {of}"
    SCALED = (
        "friction and spring constant have changed by the same factor, which points to {scale}: "
        "check both before working on the packing; {of}"
    )
    DATED = "{of}{time:dated}"
    DATED_EARLIER = "{of} (identified earlier, {time:minute})"
    AGED = "{of} (identified {age:ago}, before the restart)"
    STANDS_UNCOMPARED = "{alarm}; the latest record cannot be compared: {latest}"
    STANDS_UNCERTAIN = "{alarm}; the latest record does not clear it: {latest}"
    FAILED = "{error}; previous result: {of}"
    NO_ESTIMATE = "no estimate: {reason}"
    NOTHING_IDENTIFIED = "nothing has been identified yet"
    REFUSED = "the latest identification was refused: {reason}; previous result: {of}"
    REFUSED_REPEATEDLY = "the latest {count} identifications were refused{reason:after : }"
    MEASURED_EARLIER = "{of} (measured {time:minute}; not seen in any record since)"
    # Parts
    FRICTION = "{of:words}"
    FRICTION_AT = "{of:words} at {speed:in .2g mm/s} mm/s"
    FRICTION_SIZE = "{of:words} {value,half_width:±} N"
    DEAD_BAND = "the stem ignores reversals smaller than {share:percent} of its travel"
    DEAD_BAND_INTERVAL = (
        "; the stem ignores reversals smaller than {share,half_width:shares} % of its travel"
    )
    BASELINE = "{frictions:list |, |}"
    BASELINE_COULOMB = "Coulomb friction {value,half_width:±} N"
    SLIDING_SIZE = "{value,half_width:±} N at {speed:in .3g mm/s} mm/s"
    BASELINE_SLIDING = f"sliding friction {SLIDING_SIZE}"
    BASELINE_REMARK = (
        "it is known to ±{share:percent}: only growth to {least:.2g} times or more is certain to "
        "be reported; " + MORE_STROKES
    )
    ITS_BASELINE = "its baseline"
    FIRST_MOVES = (
        "its value up to {time:minute}, when the moves of this valve were first combined "
        "({has_baseline:?the baseline cannot be compared|no baseline}: call ~/set_baseline while "
        "it is healthy)"
    )
    BEFORE_CHANGE = (
        "its value before the change between {earliest:minute} and {latest:minute} (no baseline "
        "and no earlier moves to compare with: call ~/set_baseline while it is healthy)"
    )
    BY_MOVES = "from {moves} moves in service since {since:minute}{dead_band}"
    CHANGED = "{of}; the change occurred between {earliest:minute} and {latest:minute}"
    AREA_AND_SCALE = "the scale of the {drive:drive} sensor and the diaphragm area"
    SCALE = "the scale of the {drive:drive} sensor"
    POSITION_SCALE = "the scale of the position sensor"
    # Evidence from the moves in service
    UNTIL_BEFORE = "{of} (until {time:second}, before that identification)"
    BASELINE_WITHOUT_SLIDING = (
        "not compared with the baseline: it has no sliding friction, the only friction that moves "
        "in service determine; call ~/set_baseline while the valve is healthy"
    )
    BASELINE_AT_OTHER_SPEED = (
        "not compared with the baseline: it was taken at {healthy:in .2g mm/s} mm/s and the moves "
        "at {speed:in .2g mm/s} mm/s, more than a factor of {factor:g} apart; call ~/set_baseline "
        "while the valve is healthy"
    )
    # Findings on the valve
    COMMON_SCALE = (
        "spring constant and friction have both changed to {change:times} the baseline: a common "
        "factor points to {scale} rather than to spring and packing at once; {advice}"
    )
    SPRING_CHANGED = (
        "the spring constant has changed{with_preload:? together with its preload}: {change:times} "
        "the baseline, now {value:.4g} N/m: {advice}"
    )
    BALANCE_SHIFTED = (
        "the force balance has shifted: spring preload {change:by N}, {share:percent} of the "
        "spring's force over the travel; {advice}"
    )
    BENCH_SET = "the bench set"
    AIR_PRESSURE = "the reference of the pressure sensor, gauge or absolute (one atmosphere)"
    DRIVE_ZERO = "the zero of the {drive:drive} sensor ({reading:+.3g} {unit})"
    POSITION_ZERO = "the zero of the position sensor ({reading:in +.2g mm} mm){stops:of stops}"
    UNEVEN_PACKING = "packing with more friction {upward:?up|down}ward"
    SLIP_GROWN = (
        "the slip jump has grown: static friction exceeds sliding friction by {change:by N} more "
        "than in the baseline, and the stem jumps by {share:percent} of its travel; {advice}"
    )
    VISCOUS_CHANGED = (
        "viscous friction has {grown:?grown|fallen} to {change:times} the baseline: {advice}; a "
        "change in lag between the signals would look similar"
    )
    ASYMMETRY_CHANGED = (
        "viscous friction has grown {upward:?up|down}ward (share {change:by}): {advice}"
    )
    NOISE_GROWN = (
        "the noise of the {signal:of signal} has grown to {change:times} the baseline: {advice}"
    )
    LAG_CHANGED = (
        "the lag of the stem behind the {drive:drive} has {later:?grown|shrunk}, {change:by ms}: "
        "{advice}; a change in viscous friction would look similar"
    )
    STOPS_MOVED_ALIKE = (
        "both travel stops have shifted by {change:by mm}: the zero of the position sensor or its "
        "coupling to the stem has shifted; {advice}"
    )
    TRAVEL_LOST = (
        "travel is lost at the {stop:of end}: the stem stops {change:by mm} from its former stop; "
        "{advice}"
    )
    STOP_MOVED_OUTWARD = (
        "the travel stop at the {stop:of end} has moved outward by {change:by mm}: {advice}"
    )
    STOOD_STILL = (
        "the stem has not moved from {position:in .1f mm} mm since {since:minute} although its "
        "{drive:drive} changed by {change:.3g} {unit}: it is held by more than {ratio:.2g} times "
        "the friction of the baseline, by a part in the trim or by a lock, or the position sensor "
        "has failed; {advice}"
    )
    HELD_IN_TEST = (
        "the stem stayed at {position:in .1f mm} mm in a test although the force should have moved "
        "it: static friction is at least {friction:.0f} N, {ratio:.2f} times the friction of the "
        "baseline, or the stem is blocked; {advice}"
    )
    # The samples of a valve
    BUFFER_CLEARED = "the buffer was cleared: {because}"
    CLEARED_ON_REQUEST = "on request"
    CLEARED_AS_SETTINGS = "valve or window parameters were changed"
    CLEARED_AS_RECORD_BEGINS = "a new record begins"
    CLEARED_AS_STAMPS_GO_BACK = "time stamps go backwards: the buffer is cleared"
    STAMPS_WENT_BACK = "the time stamps of {signal} jumped back by {seconds:lasting}"
    TIME_JUMPED = (
        "the time on /clock jumped back by {seconds:lasting}; if a bag is played in a loop, "
        "identify shortly before it begins again"
    )
    CLOCK_CHANGED = "use_sim_time was changed"
    TIME_JUMPS = "the time on /clock jumps back"
    SAMPLE_DAMAGED = "{signal} is damaged"
    SAMPLE_NO_JOINT = "{signal} has no position for the joint"
    SAMPLE_NOT_FINITE = "{signal} is not finite"
    SAMPLE_OUT_OF_RANGE = "{signal} outside {span}"
    SAMPLE_REPEATED = "{signal} repeats a time stamp"
    SAMPLE_OVERTAKEN = (
        "{signal} arrived out of order: its time stamp is slightly before the last one"
    )
    SAMPLE_BACK = "{signal} went back in time"
    SENSOR_RANGE = "the sensor's range {lowest:g} to {highest:g} Pa"
    ANY_VALVE_RANGE = "the range of any valve, {lowest:g} to {highest:g} m"
    DATA_FAULT = "{signal:or the stamps}: {cause:of}{cause:?, |}{kind:of}"
    OUTSIDE_TRAVEL = (
        "stem_state: {share:rounded} of its samples lie outside the travel of 0 to {travel:.4g} m, "
        "for example {reading:.4g} m: check unit (m), zero and travel{question:after : }"
    )
    STAMPS_APART = (
        "stem_state is stamped {seconds:lasting} {is_ahead:?later|earlier} than actuator_pressure: "
        "synchronise the clocks of both sensors, and check for transmission delays"
    )
    STAMPS_OFF_CLOCK = (
        "the time stamps of {signal:or both inputs} are {seconds:lasting} {is_ahead:?ahead "
        "of|behind} the clock of this node: synchronise the clocks; for a recording, set "
        "use_sim_time and play it with --clock, or set clock_tolerance to 0"
    )
    REJECTED = "{signal}: {share:rounded} of its samples are rejected{usable:after , }: {why}"
    REJECTED_FOR = "{cause:of rejected}"
    REJECTED_WITHOUT_JOINT = (
        "no position for the joint{joint:quoted}: name it in the messages, or set joint"
    )
    PRESSURE_OUT_OF_RANGE = (
        "{reading:.4g} Pa is outside the sensor's range {lowest:g} to {highest:g} Pa: check sensor "
        "and unit (Pa), or correct pressure_minimum and pressure_maximum"
    )
    POSITION_OUT_OF_RANGE = (
        "{reading:.4g} m is outside the range of any valve, up to {highest:g} m: check sensor and "
        "unit (m)"
    )
    NONE_USABLE = "no usable sample yet"
    LAST_USABLE = "last usable sample {seconds:.0f} s ago"
    # Response to the command
    STEPS_IGNORED = (
        "the stem ignored {number} of the latest {steps} command steps of {least:percent} of the "
        "travel or more: {cause:of cause}"
    )
    ANSWER_LATE = (
        "the stem starts to move {median:.2g} s after its command (median of {moves} moves, limit "
        "{limit:g} s): {cause:of cause}"
    )
    ANSWER_SLOW = (
        "the stem reaches 86 % of its move {median:.2g} s after its command (median of {moves} "
        "moves, limit {limit:g} s): {cause:of cause}"
    )
    RESTS_AWAY = (
        "the stem settles {median:percent} of its travel away from its command (median of {moves} "
        "moves, limit {limit:percent}): {cause:of cause}"
    )
    HUNTS = (
        "the stem hunts by {amplitude:percent} of its travel every {period:.2g} s at a constant "
        "command: {cause:of cause}"
    )
    COMMANDS_UNUSABLE = "no command on stem_command can be used: {problem}"
    # The life of the packing
    PACKING_TRAVEL = (
        "packing life: {used:.4g} m of {limit:.6g} m travelled (travel_limit){state}: replace the "
        "packing, then call ~/reset_usage"
    )
    PACKING_REVERSALS = (
        "packing life: {used:.0f} of {limit:.6g} reversals (reversal_limit){state}: replace the "
        "packing, then call ~/reset_usage"
    )
    LIMIT_REACHED = ", limit reached"
    LIMIT_EXPECTED = ", expected on {expected:day}"
    LIMIT_NEAR = ", close to its limit (previously warned)"
    # Why a stroke test that is played returns to its start
    POSITION_BEYOND_LIMIT = "the stem reached {found:.4g} m, beyond its limit of {limit:.4g} m"
    PRESSURE_BEYOND_LIMIT = (
        "the measured pressure was {found:.6g} Pa, beyond its limit of {limit:.6g} Pa"
    )
    STEM_SILENT = "no stem position has been received {found:silent} (limit {limit:g} s)"
    PRESSURE_SILENT = "no pressure has been received {found:silent} (limit {limit:g} s)"
    PLAYER_STALLED = "the player stalled for {found:.2g} s (limit {limit:g} s)"
    PLAYER_STOPPED = "an operator stopped it"
    PLAYER_SHUT_DOWN = "the player was shut down"


@dataclass(frozen=True)
class Statement:
    """A code with the facts that its sentence needs.

    Attributes
    ----------
    code : Code
        Meaning of the statement.
    facts : mapping of str to object
        Numbers in SI units, times in ns since 1970 (UTC), names of parameters and of enum members,
        other statements, and tuples of these. An unknown fact is None.
    """

    code: Code
    facts: Mapping[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """Return the statement as a mapping of plain values, the inverse of `from_dict`."""
        return {"code": self.code.name, **{name: _plain(one) for name, one in self.facts.items()}}

    @classmethod
    def from_dict(cls, kept: Mapping[str, Any]) -> "Statement":
        """Restore a stored statement; raises ValueError for an unknown code."""
        try:
            code = Code[kept["code"]]
        except KeyError as unknown:
            raise ValueError(f"{unknown} is not a statement code") from None
        facts = {name: _restored(one) for name, one in kept.items() if name != "code"}
        return cls(code, facts)

    @property
    def innermost(self) -> "Statement":
        """The statement inside those that only date or doubt it."""
        told = self
        while isinstance(inner := told.facts.get("of"), Statement):
            told = inner
        return told

    def __hash__(self) -> int:
        """Return a hash of code and facts, so that statements can be counted."""
        return hash((self.code, frozenset(self.facts.items())))

    def __str__(self) -> str:
        return sentence(self)


def said(code: Code, **facts: Any) -> Statement:
    """Return a statement with these facts."""
    return Statement(code, facts)


def quoted(text: str) -> Statement:
    """Return text from outside, or from a former version, as a statement."""
    return said(Code.QUOTED, text=text)


def _plain(fact: Any) -> Any:
    if isinstance(fact, Statement):
        return fact.to_dict()
    return [_plain(one) for one in fact] if isinstance(fact, tuple | list) else fact


def _restored(fact: Any) -> Any:
    if isinstance(fact, dict):
        return Statement.from_dict(fact)
    return tuple(_restored(one) for one in fact) if isinstance(fact, list) else fact


def sentence(statement: Statement) -> str:
    """Write a statement, without a full stop."""
    facts = {**statement.facts, "advice": _advice(statement)}
    return _WRITER.vformat(statement.code.value, (), facts)


def _advice(statement: Statement) -> str:
    template = _CHECKS.get(statement.code, "")
    return _WRITER.vformat(template, (), statement.facts)


def finding_advice(statement: Statement) -> str:
    """Write what to do about a finding besides the friction; empty where nothing is known."""
    return _advice(statement.innermost)


def headline(statement: Statement) -> str:
    """Write a statement without its figures, for a cell of a table."""
    template = _HEADLINES.get(statement.code) or statement.code.value
    return _WRITER.vformat(template, (), statement.facts)


# Numbers and times for people


def capitalised(text: str) -> str:
    """Write a text with a capital first letter."""
    return f"{text[:1].upper()}{text[1:]}"


def numbered(count: int, noun: str) -> str:
    """Write a number of things: 1 valve, 3 valves."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def two_digits(value: float) -> str:
    """Write a number with two significant digits, or as an integer from 100 on; no exponent."""
    return f"{value:.2g}" if abs(value) < 99.5 else f"{value:.0f}"


def three_digits(value: float) -> str:
    """Write a number with three significant digits, or as an integer from 1000 on; no exponent."""
    return f"{value:.3g}" if abs(value) < 999.5 else f"{value:.0f}"


def without_exponent(number: str) -> str:
    """Write a formatted number below 1e9 without an exponent: 3.1e+04 becomes 31000."""
    if "e+" not in number or abs(float(number)) >= 1e9:
        return number
    return f"{float(number):{'+' if number.startswith('+') else ''}.0f}"


_UNITS_OF_TIME = (("days", 86400), ("h", 3600), ("min", 60))
"""Units above the second, and their length, s."""


def _unit_of_time(seconds: float, least: int) -> tuple[str, int]:
    """Return the largest unit of which a time has so many, or the second, and its length, s."""
    return next((one for one in _UNITS_OF_TIME if seconds >= least * one[1]), ("s", 1))


def lasting(seconds: float) -> str:
    """Write a duration with up to three digits in its largest unit: 0.02 s, 390 s, 23.5 min."""
    unit, length = _unit_of_time(seconds, 10)
    return f"{three_digits(seconds / length)} {unit}"


def number_and_width(value: float, half_width: float) -> tuple[str, str]:
    """Write a number and half the width of its interval to two digits of the latter."""
    if not math.isfinite(value):
        return "–", ""
    is_plain = value == 0 or 1e-4 <= abs(value) < 1e6
    if not math.isfinite(half_width) or half_width <= 0:
        digits = f"{value:.3g}" if abs(value) < 1000 or not is_plain else f"{value:.0f}"
        return _minus(digits), ""
    if not is_plain or not 1e-6 <= half_width < 1e6:
        return _minus(f"{value:.4g}"), f"± {half_width:.2g}"
    of_width = min(1 - int(f"{half_width:.1e}".partition("e")[2]), 7)
    of_value = max(3 - math.floor(math.log10(abs(value))), 0) if value else 3
    places = min(of_width, of_value)
    return _minus(_to_places(value, places)), f"± {_to_places(half_width, of_width)}"


def _to_places(value: float, places: int) -> str:
    """Round to decimal places, or, where they are negative, to tens, hundreds and so on."""
    return f"{round(value, places):.{max(places, 0)}f}"


def with_width(value: float, half_width: float) -> str:
    """Write a number with half the width of its interval, if any: 152.7 ± 1.2."""
    number, width = number_and_width(value, half_width)
    return f"{number} {width}" if width else _minus(f"{value:.6g}")


def _minus(number: str) -> str:
    return f"−{number[1:]}" if number.startswith("-") else number


def percentage(share: float) -> str:
    """Write a share in percent with two significant digits, or as an integer from 100 % on."""
    return f"{two_digits(100 * share)} %"


def utc(stamp: float) -> datetime:
    """Return the date of a stamp, ns since 1970 (UTC)."""
    return datetime.fromtimestamp(stamp / 1e9, timezone.utc)


def in_zone(moment: datetime, zone: str, form: str = "%Y-%m-%d %H:%M") -> str:
    """Write a moment in an IANA zone, or in UTC without one: 2026-07-17 12:00 Europe/Berlin."""
    there: tzinfo = timezone.utc
    if zone:
        from zoneinfo import ZoneInfo  # noqa: PLC0415 - the start of a node needs none

        there = ZoneInfo(zone)
    return f"{moment.astimezone(there):{form}} {zone or 'UTC'}"


def utc_day(stamp: float) -> str:
    """Write the day of a stamp, ns since 1970, in ISO 8601 and UTC."""
    return f"{utc(stamp):%Y-%m-%d}"


def utc_minute(stamp: float) -> str:
    """Write a stamp, ns since 1970, for people, to the minute: 2026-11-22 18:56 UTC."""
    return f"{utc(stamp):%Y-%m-%d %H:%M} UTC"


def utc_second(stamp: float) -> str:
    """Write a stamp, ns since 1970, in ISO 8601 and UTC, to the second."""
    return f"{utc(stamp):%Y-%m-%dT%H:%M:%SZ}"


_PEOPLE = ("coulomb", "stribeck")


def name_in_words(name: str) -> str:
    """Write the name of a number in words."""
    parts = name.split("_")
    return " ".join(part.capitalize() if part in _PEOPLE else part for part in parts)


def misfit_words(misfit: float, unit: str) -> str:
    """Write a misfit of the stem, m, or of the force, N."""
    return f"{1e6 * misfit:.3g} µm" if unit == "m" else f"{misfit:.3g} {unit}"


_SUPPORTS = {"POSITIVE": "somewhat", "STRONG": "strongly", "VERY_STRONG": "very strongly"}


def evidence_ratio_words(
    support: str,
    log_ratio: float,
    samples: float,
    independent: float,
    describes: tuple[bool, bool],
) -> str:
    """Write how strongly a record favours one of two models, with the limits of this evidence."""
    digits = abs(log_ratio) / math.log(10.0)
    ratio = f"1e{digits:.0f}" if digits >= 9 else without_exponent(f"{10.0**digits:.1g}")
    which = "first" if log_ratio > 0 else "second"
    told = "the record cannot distinguish between the two models"
    if support != "HARDLY":
        told = (
            f"the record {_SUPPORTS[support]} favours the {which} model, which is {ratio} times "
            "as probable"
        )
    count = f"{samples:.0f} samples"
    if independent < 0.5 * samples:
        count += f" (equivalent to {independent:.0f} independent samples)"
    wrong = {
        (False, False): "; neither model describes the valve to within noise: this ranks them, it "
        "does not confirm either",
        (True, False): "; the second model does not describe the valve to within noise",
        (False, True): "; the first model does not describe the valve to within noise",
    }.get(describes, "")
    return f"{told}; {count}{wrong}"


_LACKS = {
    "RESULT": "nothing has been identified since the identifier started",
    "VALUE": "{of} is not identifiable",
    "SIZE": "{of} is not positive",
    "INTERVAL": "{of} has no interval",
    "PRECISION": "{of} is known to ±{share}, but a baseline requires ±{largest}",
    "HEALTH": "the valve is in alarm, and a new baseline could hide the cause",
}


def lack_words(of: str, lack: str, share: float, largest: float) -> str:
    """Write what a baseline lacks; `lack` is the name of a `Lack`."""
    name = "friction from moves in service" if of == "moves" else name_in_words(of)
    known = {"share": share, "largest": largest}
    shares = {key: "–" if math.isnan(one) else percentage(one) for key, one in known.items()}
    return _LACKS[lack].format(of=name, **shares)


_BETTER_RECORD = (
    "Record more strokes, some fast and some slow, and identify again.",
    "Plan a stroke test that determines friction well enough: valve_friction plan-test.",
)
_LACK_REMEDIES = {
    "RESULT": ("Identify the valve.",),
    "VALUE": _BETTER_RECORD,
    "SIZE": ("Check the direction of both signals, then identify again.",),
    "INTERVAL": ("Use a method that gives confidence intervals.",),
    "PRECISION": _BETTER_RECORD,
    "HEALTH": (
        "Repair the valve, then identify it again.",
        "If it is healthy, set baseline_in_alarm of its identifier to true.",
    ),
}
_LET_IT_WORK = "Or leave the valve in service: its moves will provide a baseline in time."


def lack_remedies(lacks: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """Write the remedies for the lacks of a baseline, given as pairs of subject and `Lack` name."""
    found = [one for of, lack in lacks if of != "moves" for one in _LACK_REMEDIES[lack]]
    waits = [_LET_IT_WORK] if any(of == "moves" and lack != "SIZE" for of, lack in lacks) else []
    return tuple(dict.fromkeys([*found, *waits]))


def member_words(name: str | None, table: str) -> str:
    """Write an enum member in the words of a table; one that it does not have, by its name."""
    return "" if name is None else _TABLES.get(table, {}).get(name, name_in_words(name.lower()))


def _ago(age: int) -> str:
    """Write an age, ns, in whole units; a negative age means that a clock has been set back."""
    seconds = age / 1e9
    if seconds < 0:
        return "in the future: a clock has since been set back"
    unit, length = _unit_of_time(seconds, 2)
    return f"{seconds // length:.0f} {unit} ago"


_SMALL_SHARE = 0.05
"""Shares below this are written in tenths of a percent."""

_SIZES = {"%": 1e2, "mm": 1e3, "ms": 1e3, "mm/s": 1e3}
"""Display units that differ from the SI units of the facts: number of each in one SI unit."""


def _difference(change: tuple[float, float, float], unit: str) -> str:
    size, digits = _SIZES.get(unit, 1.0), ".2f" if unit == "mm" else ".3g"
    value, low, high = (without_exponent(f"{size * one:+{digits}}") for one in change)
    return f"{' '.join(filter(None, (value, unit)))} ({low} to {high})"


def _ratio(change: tuple[float, float, float], digits: str, times: str = "") -> str:
    value, low, high = (format(one, digits) for one in change)
    interval = "no interval" if math.isnan(change[1]) else f"{low} to {high}"
    return f"{value}{times} ({interval})"


def ratio_interval(low: float, high: float) -> str:
    """Write the 95 % interval of a ratio, or that there is none."""
    return "no interval" if math.isnan(low) else f"95 % interval: {low:.2f} to {high:.2f}"


def _in_unit(value: float, details: str) -> str:
    digits, unit = details.split(" ")
    return format(_SIZES[unit] * value, digits)


def _listed(several: tuple[object, ...], pattern: str) -> str:
    """Join items by the pattern ``before|between|after``; empty without items."""
    before, between, after = pattern.split("|")
    return f"{before}{between.join(map(str, several))}{after}" if several else ""


_FORMATS: dict[str, Callable[[Any, str], str]] = {
    "ago": lambda age, _: _ago(age),
    "by": _difference,
    "day": lambda time, _: utc_day(time),
    "drive": lambda name, _: Drive[name].words,
    "figures": lambda ratio, _: _ratio(ratio, ".2f"),
    "headline": lambda one, _: headline(one),
    "lasting": lambda seconds, _: lasting(seconds),
    "dated": lambda time, _: "" if time is None else f" (identified {utc_minute(time)})",
    "in": _in_unit,
    "misfit": lambda one, _: misfit_words(*one),
    "±": lambda one, _: with_width(one[0], one[1] or 0.0),
    "shares": lambda one, _: with_width(100.0 * one[0], 100.0 * one[1]),
    "list": _listed,
    "minute": lambda time, _: utc_minute(time),
    "of": member_words,
    "or": lambda known, other: other if known is None else str(known),
    "after": lambda known, mark: "" if known is None else f"{mark}{known}",
    "quoted": lambda name, _: "" if name is None else f" '{name}'",
    "rounded": lambda share, _: f"{100 * share:.{0 if share >= _SMALL_SHARE else 1}f} %",
    "percent": lambda share, _: percentage(share),
    "second": lambda time, _: utc_second(time),
    "silent": lambda time, _: f"for {time:.2g} s" if math.isfinite(time) else "so far",
    "times": lambda change, _: _ratio(change, ".3g", " times"),
    "words": lambda name, _: name_in_words(name),
}
"""Formats of facts: ``{fact:name details}``. ``{fact:?this|that}`` chooses by a fact. Everything
else is Python's own format, of a fact that is known."""


class _Writer(string.Formatter):
    """Fills the facts into a sentence; ``{value,half_width:±}`` formats two facts together."""

    def get_value(self, key: int | str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> Any:
        names = str(key).split(",")
        if len(names) == 1:
            return super().get_value(key, args, kwargs)
        return tuple(kwargs[name] for name in names)

    def format_field(self, value: Any, format_spec: str) -> str:
        name, _, details = format_spec.partition(" ")
        if format_spec.startswith("?"):
            yes, _, no = format_spec[1:].partition("|")
            return yes if value else no
        if (form := _FORMATS.get(name)) is not None:
            return form(value, details)
        told = "" if value is None else format(value, format_spec)
        return without_exponent(told) if format_spec.endswith("g") else told


_WRITER = _Writer()

_TABLES: dict[str, Mapping[str, str]] = {
    "state": {
        "UNKNOWN": "",
        "IMPOSSIBLE": "friction below zero",
        "NORMAL": "friction normal",
        "UNCLEAR": "friction may have changed",
        "GROWN": "friction has grown",
        "EXCESS": "excess friction",
        "FALLEN": "friction has fallen",
        "COLLAPSED": "friction collapsed, the packing may leak",
    },
    "rejected": {
        "DAMAGED": "the messages are damaged: check the publisher",
        "NOT_FINITE": "the values are not finite: check sensor, cable and driver",
        "REPEATED": "time stamps are repeated: stamp each sample with the time of its measurement",
        "OVERTAKEN": "samples arrive out of order: check the network",
        "BACK": "time stamps go backwards: check for a second publisher, and check the sensor "
        "clock",
    },
    "survey": {
        "UNKNOWN": "",
        "GOOD": ": good by the limits for a first survey",
        "WATCH": ": watch, by the limits for a first survey",
        "BAD": ": bad by the limits for a first survey",
    },
    "end": {"lower_stop": "lower end", "upper_stop": "upper end"},
    "sensor": {"BOTH": "zero and span", "EITHER": "zero or span", "SPAN": "span"},
    "signal": {**{one.name: one.words for one in Drive}, "STEM": "stem position"},
    "stops": {
        "NONE": "",
        "ONE": ", consistent with the shift of the one travel stop reached",
        "BOTH": ", consistent with the shift of both travel stops",
    },
    "cause": {
        "FRICTION": "the pressure responds but friction holds the stem: check packing and guide",
        "LATE": "the actuator pressure itself responds late: check the positioner",
        "SLOW": "the actuator pressure itself changes slowly: check positioner, air supply and "
        "volume",
        "SETTING": "the stem follows the pressure, but the pressure stops short: check "
        "calibration and gain of the positioner, and the air supply",
        "UNKNOWN": "pressure and stem do not show whether the positioner or the valve is the cause",
        "PRESSURE_ANSWERS": "the pressure responds: the stem is stuck or its position sensor has "
        "failed; inspect the stem",
        "PRESSURE_SILENT": "the actuator pressure does not respond either: check the positioner, "
        "its command and the air supply",
        "PRESSURE_ANSWERS_SOME": "the pressure responds to some of them: the stem is stuck, its "
        "position sensor has failed, or the pressure does not always "
        "reach the actuator",
        "STICTION": "the stem sticks and jumps while the pressure swings (stiction with integral "
        "action): check the packing first",
        "NOT_FRICTION": "no sign that friction is the cause: check gain and air supply of the "
        "positioner",
    },
}
"""Words for enum members and names, by table."""

_HEADLINES = {
    Code.COMPARED: "{state:of state}",
    Code.COMPARED_AGAIN: "{state:of state}",
    Code.VANISHED: "friction collapsed, the packing may leak",
    Code.FRICTION_BELOW_ZERO: "friction below zero",
    Code.MOVES_BELOW_ZERO: "friction below zero",
    Code.NOT_IDENTIFIABLE: "{of:words} is not identifiable",
    Code.NO_BASELINE: "no baseline yet",
    Code.NOT_COMPARED: "no comparison with the baseline",
    Code.WAS_COMPARED: "{what} was {ratio:figures} times its baseline",
    Code.DOUBTED: "{doubt}",
    Code.SCALED: "friction and spring constant have changed by the same factor",
    Code.DATED: "{of:headline}",
    Code.AGED: "{of:headline}",
    Code.STANDS_UNCOMPARED: "{alarm:headline}",
    Code.STANDS_UNCERTAIN: "{alarm:headline}",
    Code.FAILED: "{error}",
    Code.NO_ESTIMATE: "no estimate",
    Code.HELD_IN_TEST: "a test did not move the stem",
    Code.REFUSED: "the latest identification was refused",
}


_CHECKS = {
    Code.COMMON_SCALE: "check them",
    Code.SPRING_CHANGED: "check the spring{causes:list , and | and |, which would have the same "
    "effect}",
    Code.BALANCE_SHIFTED: "check {causes:list | or |}",
    Code.SLIP_GROWN: "check packing, stem and guides for sticking",
    Code.VISCOUS_CHANGED: "check packing and lubricant, and the air path of the actuator",
    Code.ASYMMETRY_CHANGED: "check stem and packing for one-sided wear, and the air path for a "
    "restriction that acts in one direction only",
    Code.NOISE_GROWN: "check the sensor, its cable, its supply and its mounting",
    Code.LAG_CHANGED: "check filters and clocks of both sensors, and tubing and volume between "
    "sensor and actuator",
    Code.STOPS_MOVED_ALIKE: "check its mounting",
    Code.TRAVEL_LOST: "check for dirt or a foreign part in the trim, an adjusted stop, and the "
    "{sensor:of sensor} of the position sensor",
    Code.STOP_MOVED_OUTWARD: "check seat and plug for wear, check stop and coupling, and the "
    "{sensor:of sensor} of the position sensor",
    Code.STOOD_STILL: "inspect the stem",
    Code.HELD_IN_TEST: "inspect the stem and repeat the test with more force",
}
"""What to do about a finding, the part {advice} of its sentence."""

_OF_FRICTION = {
    "EXCESS": "replace the packing as soon as possible; keep the loop in manual if it oscillates",
    "GROWN": "plan to replace the packing at the next shutdown",
    "FALLEN": "check the packing for leakage on the next round",
    "COLLAPSED": "check the packing for leakage now",
    "UNCLEAR": "before any work, identify it again from a longer record with more strokes",
    "IMPOSSIBLE": "check the direction of both signals, and identify it again",
}


def friction_advice(state: str) -> str:
    """Return what to do in a state of the friction, by its name; empty if nothing."""
    return _OF_FRICTION.get(state, "")


_ADVICE = {
    "stuck": "put the loop in manual, stroke the valve locally, and check packing, trim and "
    "actuator",
    "whole_valve": "check the part named in the message at the next opportunity",
    "data_quality": "check the sensor and its connection; the valve is not monitored until this "
    "is fixed",
    "positioner": "check the positioner and its air supply, and the tuning of the loop",
}

_STATE_OF_ALARM = {
    ("friction_high", "WARN"): "GROWN",
    ("friction_high", "ERROR"): "EXCESS",
    ("friction_low", "WARN"): "FALLEN",
    ("friction_low", "ERROR"): "COLLAPSED",
}


def alarm_advice(kind: str, level: str) -> str:
    """Return what to do about an alarm as a sentence, by its name and the name of its level."""
    state = _STATE_OF_ALARM.get((kind, level), "")
    advice = friction_advice(state) or _ADVICE.get(kind, "")
    return advice and f"{capitalised(advice)}."
