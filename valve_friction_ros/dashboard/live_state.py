# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The live state of a plant's valves, read from their statuses for the pages."""

import contextlib
import itertools
import math
import re
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import NamedTuple

from valve_friction_ros.health.alarms import Alarm, AlarmKind, AlarmState, Condition
from valve_friction_ros.health.baseline import BaselineLack, Lack
from valve_friction_ros.health.comparison import Ratio
from valve_friction_ros.health.levels import Level, StatusSignal
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.outside_text import printable
from valve_friction_ros.records.bags.topics import StreamNames
from valve_friction_ros.wording import lasting, name_in_words, number_and_width, without_exponent

_KEY = re.compile(r"(?P<name>.*?)(?: \[(?P<unit>[^\]]*)\])?")
_LONGEST_TEXT = 400
_LONG = 600.0
"""Time from which a larger unit than the second is used, s."""


class Entry(NamedTuple):
    """A value as text: name in words, value, and unit if it has one."""

    name: str
    text: str
    unit: str


class Quantity(NamedTuple):
    """A number with its interval."""

    name: str
    """Name of the number, as in the keys."""
    value: float
    half_width: float = math.nan
    """The number, and half the width of its 95 % interval, in `unit`; nan if unknown."""
    unit: str = ""
    """Unit; empty for a pure number."""
    verdict: str = ""
    reason: str = ""
    """Whether the record determines the number, and if not, why; empty if not stated."""

    @property
    def is_known(self) -> bool:
        """Whether there is a value."""
        return math.isfinite(self.value)

    @property
    def if_determined(self) -> "Quantity":
        """The same quantity, without value and width if the record does not determine it."""
        if self.verdict != "not identifiable":
            return self
        return self._replace(value=math.nan, half_width=math.nan)


def number(text: str | None) -> float:
    """Read a number; return nan for any other text."""
    try:
        return math.nan if text is None else float(text)
    except ValueError:
        return math.nan


def _text(values: Mapping[str, str], key: str, longest: int = _LONGEST_TEXT) -> str:
    return printable(values.get(key, ""), longest)


def _quantity(values: Mapping[str, str], name: str, unit: str) -> Quantity:
    """Return the quantity of this name and unit, with half width, verdict and reason."""
    bracket = f" [{unit}]" if unit else ""
    return Quantity(
        name,
        number(values.get(name + bracket)),
        number(values.get(f"{name} half width{bracket}")),
        unit,
        _text(values, f"{name} verdict"),
        _text(values, f"{name} reason"),
    )


def _entry(key: str, text: str) -> Entry:
    match = _KEY.fullmatch(key)
    name, unit = (match["name"], match["unit"] or "") if match else (key, "")
    value = number(text)
    if math.isnan(value):
        shown = "–" if text == "nan" else printable(text, _LONGEST_TEXT)
    elif unit == "s" and value >= _LONG:
        shown, unit = lasting(value).split(" ")
    else:
        is_whole = abs(value) < 1e9 and value == round(value)
        shown = f"{value:.0f}" if is_whole else without_exponent(f"{value:.4g}")
    if unit == "time":
        shown = shown.replace("T", " ").replace("Z", " UTC")
    unit = "" if unit in ("date", "time", "1") else unit
    title = name_in_words(name).replace(" in all", ", total")
    return Entry(printable(title, _LONGEST_TEXT), shown, printable(unit, 40))


_CHANGE = " change"
_NORMAL = AlarmState.NORMAL.value
_ALARMS = tuple(f"alarm {kind.value}" for kind in AlarmKind)
_SHOWN = (*_ALARMS, "NE 107", "survey", "estimate_", "reason", "friction_ratio", "friction_drift",
          "limit_expected", "baseline", "dead_band", "travel_histogram", "preparing")  # fmt: skip
_STARTS = {
    "evidence": ("evidence ",),
    "usage": ("packing_renewed", "travelled_distance", "reversals", "breakaways", "time_watched",
              "time_near_seat", "counting_dead_band", "usage"),
    "command": ("command ", "moves", "changes left", "largest ", "smallest ", "moved by ",
                "stem_command"),
    "counters": ("samples_",),
    "fit": ("fit", "rms", "systematic", "method", "derivative", "threshold", "samples", "sigma",
            "r_squared", "fixed", "warnings", "sliding_speed"),
}  # fmt: skip
"""Key prefixes of each group; the first match decides."""


def _with_intervals(changes: tuple[Entry, ...]) -> tuple[Entry, ...]:
    """Write each change since the baseline in one entry, rounded to its interval."""
    numbers = {one.name: number(one.text) for one in changes}
    found = []
    for name, text, unit in changes:
        if name.endswith((" low", " high")):
            continue
        ends = [numbers.get(f"{name} {end}", math.nan) for end in ("low", "high")]
        half_width, words = 0.5 * (ends[1] - ends[0]), text
        if math.isfinite(half_width):
            some = (number_and_width(one, half_width)[0] for one in (numbers[name], *ends))
            words = "{} ({} to {})".format(*some)
        found.append(Entry(name.removesuffix(_CHANGE), words, unit))
    return tuple(found)


def _group(key: str, shown: tuple[str, ...]) -> str:
    """Return the group of a key; empty if the page shows the key elsewhere."""
    if f"{_CHANGE} " in key and not key.startswith("evidence "):
        return "changes"
    if key.startswith(shown):
        return ""
    found = (group for group, starts in _STARTS.items() if key.startswith(starts))
    return next(found, "counters")


class Status(NamedTuple):
    """A diagnostic status as received: the fields of diagnostic_msgs/DiagnosticStatus."""

    name: str
    level: int
    hardware_id: str
    message: str
    values: Mapping[str, str]


class Unread(NamedTuple):
    """A received status that is decoded only when a page needs it.

    Attributes
    ----------
    name : str
        Name of the status.
    read : callable
        Returns the status; raises ValueError if the bytes are invalid.
    mark : callable or None
        Returns a mark that changes only if more than ages and counters change; raises ValueError if
        the bytes are invalid. None: the status must be read.
    """

    name: str
    read: Callable[[], Status]
    mark: Callable[[], object] | None = None


class Drift(NamedTuple):
    """Drift of the friction, N per month, with half width; the date of a limit ahead, or empty."""

    value: float
    half_width: float
    expected: str


@dataclass(frozen=True)
class ValveView:
    """The state of one valve as a dashboard shows it."""

    node: str
    """Fully qualified name of the identifier, unique per valve."""
    tag: str
    level: Level | None = None
    """Severity; None if unknown."""
    signal: StatusSignal = StatusSignal.GOOD
    sentence: str = ""
    """The diagnosis in words."""
    reason: str = ""
    """Why there is no estimate; empty with an estimate."""
    identified: int | None = None
    """Time of the estimate, ns since 1970 (UTC)."""
    ratio: Ratio | None = None
    """Friction over baseline."""
    dead_band: Quantity = Quantity("dead_band", math.nan, unit="%")  # noqa: RUF009 - a tuple
    """Dead band of the stem, % of the travel."""
    parameters: tuple[Quantity, ...] = ()
    baseline: tuple[Quantity, ...] = ()
    """Frictions of the baseline; empty without a baseline."""
    drift: Drift | None = None
    """A significant drift."""
    sources: StreamNames = StreamNames()  # noqa: RUF009 - a tuple
    """Topics of its samples."""
    alarms: tuple[Alarm, ...] = ()
    """Its alarms that are not normal."""
    lacks: tuple[BaselineLack, ...] = ()
    """Conditions of a baseline that the valve does not meet now."""
    survey: str = ""
    """Result of the first survey: good, watch or bad; empty without a result."""
    values: Mapping[str, str] = field(default_factory=dict, repr=False, compare=False)
    """All values as received."""

    @property
    def namespace(self) -> str:
        """The namespace of the valve."""
        return self.node.rpartition("/")[0] or "/"

    def groups(self) -> dict[str, tuple[Entry, ...]]:
        """Return the remaining values by subject.

        The groups are ``changes``, ``fit``, ``evidence``, ``usage``, ``command`` and
        ``counters``.
        """
        shown = (*_SHOWN, *(one.name for one in self.parameters))
        found: dict[str, list[Entry]] = {name: [] for name in ("changes", *_STARTS)}
        for key, text in self.values.items():
            if text and (place := _group(key, shown)):
                found[place].append(_entry(key, text))
        bare = (one._replace(name=one.name.removeprefix("evidence ")) for one in found["evidence"])
        groups = {name: tuple(some) for name, some in found.items()}
        return groups | {"evidence": tuple(bare), "changes": _with_intervals(groups["changes"])}

    def parameter(self, name: str) -> Quantity:
        """Return a parameter, without a value if it is missing."""
        found = (one for one in self.parameters if one.name == name)
        return next(found, Quantity(name, math.nan))

    @property
    def advice(self) -> str:
        """Advice on the most severe active alarm; empty without an alarm."""
        told = [one for one in self.alarms if one.is_told]
        return max(told, key=lambda one: one.condition.level).advice if told else ""

    @property
    def friction(self) -> Quantity:
        """The friction that was compared with the baseline.

        Without a ratio, the Coulomb friction, or the sliding friction if only that is determined.
        """
        compared = "" if self.ratio is None else self.ratio.of
        names = sorted(("coulomb_friction", "sliding_friction"), key=lambda one: one != compared)
        first, second = (self.parameter(name).if_determined for name in names)
        return second if second.is_known and not first.is_known else first

    @property
    def healthy(self) -> Quantity:
        """The same friction of the baseline, without a value if the baseline lacks it."""
        name = self.friction.name
        found = (one for one in self.baseline if one.name == name)
        return next(found, Quantity(name, math.nan))


_LACKING = ("coulomb_friction", "sliding_friction", "moves", "result", "valve")
_SOURCES = ("pressure_topic", "stem_topic", "stem_joint")
_SUFFIX = ": friction"
_LONGEST_SENTENCE = 2000


def identifier_in(name: str) -> str | None:
    """Return the identifier from the name of its status; None for the status of another node."""
    node = name.removesuffix(_SUFFIX)
    return node if node != name and node.startswith("/") and len(node) < 256 else None


ESSENTIAL_KEYS = (
    "NE 107",
    "estimate_valid",
    "estimate_time",
    "reason",
    "friction_ratio",
    "friction_ratio low",
    "friction_ratio high",
    "survey",
    "dead_band [%]",
    "dead_band half width [%]",
    "friction_drift [N/month]",
    "friction_drift half width [N/month]",
    "limit_expected [date]",
    "baseline_coulomb_friction [N]",
    "baseline half width [N]",
    "baseline_sliding_friction [N]",
    "baseline_possible",
    *(f"baseline_lacks {one}" for one in _LACKING),
    *_SOURCES,
    *(f"{name}{end}" for name in _ALARMS for end in ("", " level", " until [time]")),
)
"""Keys whose values distinguish two views of a valve, without counters and ages."""

_SIGNALS = {one.value: one for one in StatusSignal}
_LEVELS = {one.value: one for one in Level}


def view_of(node: str, status: Status) -> ValveView:
    """Read the status of an identifier, ignoring invalid values."""
    values = status.values
    return ValveView(
        node=node,
        tag=printable(status.hardware_id or node.rpartition("/")[0].strip("/") or node, 80),
        level=_LEVELS.get(status.level),
        signal=_SIGNALS.get(values.get("NE 107", ""), StatusSignal.CHECK_FUNCTION),
        sentence=printable(status.message, _LONGEST_SENTENCE),
        reason=_text(values, "reason", _LONGEST_SENTENCE),
        identified=_stamp(values.get("estimate_time", "")),
        ratio=_ratio(values),
        dead_band=_quantity(values, "dead_band", "%"),
        parameters=_parameters(values),
        baseline=_baseline(values),
        drift=_drift(values),
        sources=StreamNames(*(values.get(key, "") for key in _SOURCES)),
        alarms=alarms_in(values),
        lacks=_lacks(values),
        survey=_text(values, "survey", 20),
        values=values,
    )


def alarms_in(values: Mapping[str, str]) -> tuple[Alarm, ...]:
    """Return the alarms that are not normal, from the values of a status, ignoring invalid ones."""
    found = []
    for kind, name in zip(AlarmKind, _ALARMS, strict=True):
        if values.get(name, _NORMAL) == _NORMAL:
            continue
        with contextlib.suppress(KeyError, ValueError):
            level = Level[values[f"{name} level"]]
            until = _stamp(values.get(f"{name} until [time]", ""))
            message = values.get(f"{name} message", "")
            shown = Condition(level, message=message)
            found.append(Alarm(kind, AlarmState(values[name]), shown, None, until, message))
    return tuple(found)


def _lacks(values: Mapping[str, str]) -> tuple[BaselineLack, ...]:
    """Read what a baseline lacks; older identifiers report at most a missing result."""
    if "baseline_possible" not in values:
        names = ("coulomb_friction [N]", "sliding_friction [N]")
        is_known = any(math.isfinite(number(values.get(name))) for name in names)
        return () if is_known else (BaselineLack("result", Lack.RESULT),)
    return tuple(
        BaselineLack(
            of,
            Lack[name],
            number(values.get(f"baseline_lacks {of} share [%]")) / 100,
            number(values.get(f"baseline_lacks {of} largest [%]")) / 100,
        )
        for of in _LACKING
        if (name := values.get(f"baseline_lacks {of}", "")) in Lack.__members__
    )


def _stamp(text: str) -> int | None:
    fraction = ".%f" if "." in text else ""
    try:
        moment = datetime.strptime(text, f"%Y-%m-%dT%H:%M:%S{fraction}%z")
    except ValueError:
        return None
    return round(moment.timestamp() * 1e3) * 1_000_000


def _ratio(values: Mapping[str, str]) -> Ratio | None:
    value, low, high = (number(values.get(f"friction_ratio{end}")) for end in ("", " low", " high"))
    if not math.isfinite(value):
        return None
    return Ratio.between(value, low, high, of=_text(values, "friction_ratio of", 80))


def _parameters(values: Mapping[str, str]) -> tuple[Quantity, ...]:
    units = {}
    for key in values:
        name, bracket, unit = key.partition(" half width [")
        if bracket and f"{name} verdict" in values and not name.startswith("evidence "):
            units[name] = unit.rstrip("]")
    return tuple(_quantity(values, name, unit) for name, unit in units.items())


def _baseline(values: Mapping[str, str]) -> tuple[Quantity, ...]:
    coulomb = Quantity(
        "coulomb_friction",
        number(values.get("baseline_coulomb_friction [N]")),
        number(values.get("baseline half width [N]")),
        "N",
    )
    sliding = _quantity(values, "baseline_sliding_friction", "N")._replace(name="sliding_friction")
    return tuple(one for one in (coulomb, sliding) if one.is_known)


def _drift(values: Mapping[str, str]) -> Drift | None:
    value = number(values.get("friction_drift [N/month]"))
    if not math.isfinite(value):
        return None
    width = number(values.get("friction_drift half width [N/month]"))
    return Drift(value, width, _text(values, "limit_expected [date]", 40))


MOST_VALVES = 5000
"""Maximum number of valves: names come from outside, and their number has no bound."""

_FORGETTING = 3600.0
"""Silence, s, after which a valve is dropped if the history does not hold it."""
_TIDYING = 60.0
"""Time between two searches for valves to drop, s."""


@equal_by_fields
@dataclass(frozen=True)
class Heard:
    """A valve and the age of its last message."""

    number: int
    """Number of the valve in this run of the dashboard."""
    view: ValveView
    silent_for: float | None
    """Time since its last message, s; None before the first message."""
    is_silent: bool
    """Whether that time is too long."""
    revision: int = 0
    """Count that grows with each change of the valve's row in a table."""


class _Valve:
    """The newest status of a valve; its view is made on demand."""

    def __init__(self, number: int, view: ValveView) -> None:
        self.number = number
        self.at: float | None = None
        self.latest: Unread | None = None
        self.revision = 0
        self.is_kept = False
        self.view = view
        self._mark: object = None
        self._essence: tuple[object, ...] = ()
        self._looked: Unread | None = None
        self._whole = view
        self._read: Unread | None = None

    def last_was(self, view: ValveView) -> None:
        """Show a state that was known before the first status."""
        self.view = self._whole = view
        self.revision += 1

    def look(self, node: str) -> None:
        """Read what a table shows from the latest status; an invalid status changes nothing.

        Each status is looked at once, however many pages are open.
        """
        latest = self.latest
        if latest is None or latest is self._looked:
            return
        try:
            mark = None if latest.mark is None else latest.mark()
            if mark is None or mark != self._mark:
                status = latest.read()
                # Parameters change only with the time of the estimate.
                essence = (*status[1:4], *map(status.values.get, ESSENTIAL_KEYS))
                if essence != self._essence:
                    self.view, self._essence = replace(view_of(node, status), values={}), essence
                    self.revision += 1
        except ValueError:
            self.latest = self._looked
            return
        self._mark, self._looked = mark, latest

    def whole(self) -> ValveView:
        """Return the view with all values, after a look; the same object until the next status."""
        if self.latest is not None and self.latest is not self._read:
            with contextlib.suppress(ValueError):
                self._whole = replace(self.view, values=self.latest.read().values)
            self._read = self.latest
        return self._whole


class Plant:
    """The state of each valve, behind a lock: any thread may write and read.

    A page never draws in a ROS callback: it reads `valves` in its own timer. A valve is silent
    after the time `silence`, s, without a message.
    """

    def __init__(self, silence: float) -> None:
        self._silence = silence
        self._lock = threading.Lock()
        self._valves: dict[str, _Valve] = {}
        self._numbers = itertools.count()
        self._tidied = -math.inf

    def hear(self, status: Unread, at: float) -> None:
        """Take a status received at a time, s of the monotonic clock.

        It is decoded on demand. A status of any node but an identifier is ignored.
        """
        node = identifier_in(status.name)
        if node is None:
            return
        with self._lock:
            self._tidy(at)
            if (valve := self._entry(node)) is not None:
                valve.at, valve.latest = at, status

    def expect(self, valves: Iterable[ValveView]) -> None:
        """Show the last known states of valves until they are heard; never drop these valves."""
        with self._lock:
            for view in valves:
                if (valve := self._entry(view.node)) is not None:
                    valve.is_kept = True
                    if valve.latest is None and valve.view != view:
                        valve.last_was(view)

    def _tidy(self, now: float) -> None:
        """Drop valves that the history does not hold and that have long been silent."""
        if now < self._tidied + _TIDYING:
            return
        self._tidied = now
        gone = [
            node
            for node, valve in self._valves.items()
            if not valve.is_kept and valve.at is not None and now > valve.at + _FORGETTING
        ]
        for node in gone:
            del self._valves[node]

    def _entry(self, node: str) -> _Valve | None:
        """Return a valve, adding it if there is room."""
        valve = self._valves.get(node)
        if valve is None and len(self._valves) < MOST_VALVES:
            view = view_of(node, Status("", 3, "", "", {}))
            valve = self._valves[node] = _Valve(next(self._numbers), view)
        return valve

    def valves(self, now: float) -> list[Heard]:
        """Return all valves at a time, s of the monotonic clock, in a fixed order.

        Their views have no `values`.
        """
        with self._lock:
            self._tidy(now)
            return [self._heard(node, valve, now) for node, valve in self._valves.items()]

    def valve(self, node: str, now: float) -> Heard | None:
        """Return the valve of an identifier, if it is known."""
        with self._lock:
            if (valve := self._valves.get(node)) is None:
                return None
            heard = self._heard(node, valve, now)
            return replace(heard, view=valve.whole())

    def _heard(self, node: str, valve: _Valve, now: float) -> Heard:
        valve.look(node)
        age = None if valve.at is None else max(0.0, now - valve.at)
        silent = age is None or age > self._silence
        return Heard(valve.number, valve.view, age, silent, valve.revision)
