# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The list of valves: its filters, order and rows; and the comparison of two valves."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any
from urllib.parse import parse_qsl, urlencode, urlsplit
from zoneinfo import ZoneInfo

from valve_friction_ros.dashboard.context import zone_of
from valve_friction_ros.dashboard.history_cache import Sparkline
from valve_friction_ros.dashboard.live_state import Drift, Heard, Quantity, ValveView
from valve_friction_ros.health.comparison import Ratio
from valve_friction_ros.health.levels import Level, StatusSignal
from valve_friction_ros.history import HistoryEntry
from valve_friction_ros.identification.settings import SLIDING, UNITS
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.outside_text import printable
from valve_friction_ros.streams import utc
from valve_friction_ros.wording import number_and_width, numbered, with_width


def address_of(path: str, parts: Mapping[str, str]) -> str:
    """Return the address of a page, without empty parts."""
    query = urlencode({key: text for key, text in parts.items() if text})
    return f"{path}?{query}" if query else path


def zone_asked(query: Mapping[str, str], usual: str) -> ZoneInfo:
    """Return the time zone from ``tz`` in an address; `usual` if missing or unknown."""
    try:
        return zone_of(query.get("tz", usual))
    except ValueError:
        return zone_of(usual)


def moment(stamp: int | None, zone: ZoneInfo, form: str = "%Y-%m-%d %H:%M:%S") -> str:
    """Write a time, ns since 1970, in a zone, with the abbreviation of the zone."""
    if stamp is None:
        return "–"
    local: datetime = utc(stamp).astimezone(zone)
    return f"{local:{form}} {local.tzname()}"


def minute(stamp: int | None, zone: ZoneInfo) -> str:
    """Write a time as `moment` does, to the minute."""
    return moment(stamp, zone, "%Y-%m-%d %H:%M")


def ago(seconds: float) -> str:
    """Write an age in its largest unit."""
    for size, unit in ((86_400 * 365.25, "y"), (86_400, "d"), (3600, "h"), (60, "min")):
        if seconds >= size:
            return f"{seconds // size:.0f} {unit}"
    return f"{max(0.0, seconds):.0f} s"


STATES = ("error", "silent", "warn", "unknown", "ok", "unheard")
"""States of a valve, the worst first; ``unheard``: known only from the history.

A silent valve may be in any condition, so it comes next to an error."""

SIGNALS = tuple(one.value for one in StatusSignal if one.value)
_LONGEST_SEARCH = 200


def state_of(valve: Heard) -> str:
    """Return the state of a valve: its level in lower case, or that it is silent.

    A valve is ``ok`` only if a comparison with a baseline found nothing.
    """
    if valve.is_silent:
        return "unheard" if valve.silent_for is None else "silent"
    level = valve.view.level
    if level is None or (level is Level.OK and valve.view.ratio is None):
        return "unknown"
    return level.name.lower()


def _falling(value: float | None) -> float:
    """Return a sort key with the largest number first and a missing number last."""
    return math.inf if value is None or math.isnan(value) else -value


def _worst_first(valve: Heard) -> tuple[Any, ...]:
    state, view = state_of(valve), valve.view
    return (
        STATES.index(state),
        -(view.level or 0) if state == "silent" else 0,  # its last known level
        # Halved friction has changed as much as doubled friction.
        -abs(math.log(view.ratio.value)) if view.ratio and view.ratio.value > 0 else 1.0,
        _falling(view.dead_band.if_determined.value),
        view.tag,
    )


SORTS: dict[str, Callable[[Heard], tuple[Any, ...]]] = {
    "worst": _worst_first,
    "tag": lambda one: (one.view.tag, one.view.node),
    "ratio": lambda one: (_falling(one.view.ratio.value if one.view.ratio else None), one.view.tag),
    "dead_band": lambda one: (_falling(one.view.dead_band.if_determined.value), one.view.tag),
    "friction": lambda one: (_falling(one.view.friction.value), one.view.tag),
    "drift": lambda one: (_falling(one.view.drift and abs(one.view.drift.value)), one.view.tag),
    "age": lambda one: (one.view.identified or 0, one.view.tag),
}
"""Sort keys by name; each puts the most urgent or the largest first."""


@dataclass(frozen=True)
class Selection:
    """Filters and order of a plant page.

    Attributes
    ----------
    search : str
        Words; each must occur in tag, name or diagnosis.
    states, signals : frozenset of str
        States and letters of NE 107 to show; empty for all.
    sort : str
        Name of the order (`SORTS`).
    is_reversed : bool
        Whether the order is reversed.
    is_tiled : bool
        Whether to show tiles instead of rows.
    """

    search: str = ""
    states: frozenset[str] = frozenset()
    signals: frozenset[str] = frozenset()
    sort: str = "worst"
    is_reversed: bool = False
    is_tiled: bool = False

    @classmethod
    def from_query(cls, query: Mapping[str, str]) -> "Selection":
        """Read the selection from an address; ignore unknown parts."""
        order = query.get("sort", "worst")
        name = order.removeprefix("-")
        return cls(
            search=query.get("q", "")[:_LONGEST_SEARCH],
            states=frozenset(query.get("show", "").split(",")) & frozenset(STATES),
            signals=frozenset(query.get("ne", "").split(",")) & frozenset(SIGNALS),
            sort=name if name in SORTS else "worst",
            is_reversed=order.startswith("-"),
            is_tiled=query.get("view") == "tiles",
        )

    @classmethod
    def from_address(cls, address: str) -> "Selection":
        """Read the selection from a plant page's address; for another page, select all."""
        try:
            parts = urlsplit(address)
            return cls.from_query(dict(parse_qsl(parts.query)) if parts.path == "/" else {})
        except ValueError:
            return cls()

    def to_query(self) -> dict[str, str]:
        """Return the parts of the address, without defaults."""
        sign = "-" if self.is_reversed else ""
        parts = {
            "q": self.search,
            "show": ",".join(one for one in STATES if one in self.states),
            "ne": ",".join(one for one in SIGNALS if one in self.signals),
            "sort": "" if (self.sort, sign) == ("worst", "") else sign + self.sort,
            "view": "tiles" if self.is_tiled else "",
        }
        return {key: text for key, text in parts.items() if text}

    def address(self, more: Mapping[str, str]) -> str:
        """Return the address of this page, with further parts."""
        return address_of("/", {**self.to_query(), **more})

    def sorted_by(self, name: str) -> "Selection":
        """Sort by a column; a second time reverses the order."""
        return replace(self, sort=name, is_reversed=self.sort == name and not self.is_reversed)

    def shows(self, valve: Heard) -> bool:
        """Return whether a valve is shown."""
        if self.states and state_of(valve) not in self.states:
            return False
        if self.signals and valve.view.signal.value not in self.signals:
            return False
        view = valve.view
        text = f"{view.tag} {view.node} {view.sentence}".casefold()
        return all(word in text for word in self.search.casefold().split())


def selected(valves: Iterable[Heard], selection: Selection) -> list[Heard]:
    """Return the selected valves in order."""
    shown = filter(selection.shows, valves)
    return sorted(shown, key=SORTS[selection.sort], reverse=selection.is_reversed)


def levels_in(valves: Iterable[Heard]) -> dict[str, int]:
    """Count the valves of each state."""
    counts = dict.fromkeys(STATES, 0)
    for valve in valves:
        counts[state_of(valve)] += 1
    return counts


_SAY = 240
_LOWEST, _HIGHEST = 0.25, 4.0
"""Ends of the logarithmic bar of a ratio."""

STATE_WORDS = {**{state: state for state in STATES}, "ok": "good", "unheard": "not heard"}

SIGNAL_WORDS = {
    "F": "failure",
    "C": "check function",
    "S": "out of specification",
    "M": "maintenance required",
    "": "good",
}
_SHORT = {"F": "failure", "C": "check", "S": "out of spec", "M": "maintenance"}
FRICTIONS = {"coulomb_friction": "F_c", "sliding_friction": "sliding"}
"""Short names of the frictions, shown beside their numbers."""

Row = dict[str, Any]
"""A row under fixed keys: no key comes from outside."""


def state_words(valve: Heard) -> str:
    """Return the state of a valve in a word or two."""
    state = state_of(valve)
    if state == "unknown":
        view = valve.view
        is_new = view.level is not None and view.friction.is_known and not view.baseline
        words = f"no baseline, {view.survey}" if view.survey else "no baseline"
        return words if is_new else "unknown"
    if valve.is_silent or not valve.view.signal.value:
        return STATE_WORDS[state]
    return _SHORT[valve.view.signal.value]


def summary(counts: Mapping[str, int]) -> str:
    """Return the number of valves, and the number in each state other than good."""
    total = sum(counts.values())
    if not total:
        return "No valves yet"
    others = [f"{n} {STATE_WORDS[state]}" for state, n in counts.items() if n and state != "ok"]
    valves = numbered(total, "valve")
    return f"{valves}: {', '.join(others)}" if others else f"{valves}, all good"


def ratio_text(ratio: float) -> str:
    """Write a ratio with two decimals, or two digits if it is very small or large."""
    return f"{ratio:.2f}" if ratio == 0 or 0.01 <= abs(ratio) < 1e4 else f"{ratio:.2g}"


def interval_text(ratio: Ratio, between: str) -> str:
    """Write the interval of a ratio; empty without an interval."""
    ends = (ratio.low, ratio.high)
    return between.join(map(ratio_text, ends)) if all(map(math.isfinite, ends)) else ""


def quantity_texts(one: Quantity) -> tuple[str, str]:
    """Write a quantity and half its interval; a dash if the record does not determine it."""
    known = one.if_determined
    return number_and_width(known.value, known.half_width)


def quantity_words(one: Quantity, unit: str = "") -> str:
    """Write a quantity with its interval and unit; a dash if the record does not determine it."""
    texts = quantity_texts(one)
    is_known = one.if_determined.is_known
    return " ".join(filter(None, (*texts, (unit or one.unit) * is_known)))


def _place(ratio: float) -> float:
    span = math.log(_HIGHEST / _LOWEST)
    bounded = min(max(ratio, _LOWEST), _HIGHEST) if ratio > 0 else _LOWEST
    return round(100 * math.log(bounded / _LOWEST) / span, 1)


def _ratio(ratio: Ratio | None) -> Row:
    if ratio is None:
        return {"ratio": "–", "between": "", "bar": None}
    bar = [_place(one) if math.isfinite(one) else _place(ratio.value) for one in ratio.interval]
    return {"ratio": ratio_text(ratio.value), "between": interval_text(ratio, "–"), "bar": bar}


def drift_number(drift: Drift) -> str:
    """Write a drift with its sign and half its interval."""
    value, width = number_and_width(drift.value, drift.half_width)
    return f"{'+' if drift.value > 0 else ''}{value} {width}".strip()


def row_of(valve: Heard, spark: Sparkline | None, wall: float, href: str) -> Row:
    """Return the row of a valve; `wall` is the time of day, s since 1970."""
    view = valve.view
    dead, dead_width = quantity_texts(view.dead_band)
    friction = view.friction
    value, width = quantity_texts(friction)
    silent = valve.is_silent and valve.silent_for is not None
    drift = view.drift
    return {
        "i": valve.number,
        "tag": view.tag,
        "place": view.namespace,
        "href": href,
        "state": state_of(valve),
        "ne": "" if valve.is_silent else view.signal.value,
        "word": state_words(valve),
        "advice": "" if valve.is_silent else view.advice,
        "say": view.sentence[:_SAY] or ("no message has been heard" if valve.is_silent else ""),
        **_ratio(view.ratio),
        "dead": dead,
        "deadw": dead_width,
        "fc": value,
        "fcw": width,
        "fcof": FRICTIONS[friction.name] if friction.is_known else "",
        "drift": drift_number(drift) if drift else "–",
        "expected": f"limit {drift.expected}" if drift and drift.expected else "",
        "spark": spark.path if spark else "",
        "base": spark.base if spark else "",
        "days": spark.days if spark else 0,
        "made": None if view.identified is None else view.identified // 1_000_000_000,
        "last": round(wall - (valve.silent_for or 0.0)) if silent else None,
    }


class RowFeed:
    """Rows for one browser; sends only changes.

    `href` returns the address of a valve's page from the name of its identifier.
    """

    def __init__(self, href: Callable[[str], str]) -> None:
        self._href = href
        self._sent: dict[int, tuple[object, ...]] = {}
        self._order: list[int] = []

    def news(
        self,
        shown: Iterable[Heard],
        sparks: Callable[[str], Sparkline | None],
        wall: float,
        most: int | None = None,
    ) -> Row:
        """Return the clock, the changed rows, and the order if it has changed.

        `most` limits the number of rows; the rest follow next time.
        """
        rows: list[Row] = []
        order: list[int] = []
        for valve in shown:
            order.append(valve.number)
            spark = sparks(valve.view.node)
            cause = (valve.revision, valve.is_silent, spark)
            if self._sent.get(valve.number) == cause or len(rows) == most:
                continue
            self._sent[valve.number] = cause
            rows.append(row_of(valve, spark, wall, self._href(valve.view.node)))
        news: Row = {"now": round(wall, 1)}
        if rows:
            news["rows"] = rows
        if order != self._order:
            news["order"] = self._order = order
        return news


@dataclass(frozen=True)
class ComparedIdentification:
    """An identification: valve, time, ns since 1970, method, diagnosis and parameters."""

    tag: str
    time: int | None
    method: str
    sentence: str
    parameters: tuple[Quantity, ...]


@equal_by_fields
@dataclass(frozen=True)
class Difference:
    """A parameter on both sides."""

    name: str
    one: Quantity
    other: Quantity
    """The parameter on either side, without a value if missing."""
    ratio: float
    half_width: float
    """`other` over `one`, and half the width of its 95 % interval; nan if unknown."""

    @property
    def verdict(self) -> str:
        """Whether the two differ by more than their intervals; empty if unknown."""
        if not math.isfinite(self.half_width):
            return ""
        change = self.other.value - self.one.value
        width = math.hypot(self.one.half_width, self.other.half_width)
        return "differs" if abs(change) > width else "no difference seen"

    @property
    def ratio_words(self) -> str:
        """The ratio with its interval."""
        if not math.isfinite(self.ratio):
            return "–"
        if not math.isfinite(self.half_width) or not 0.01 <= abs(self.ratio) < 1e4:
            return ratio_text(self.ratio)
        return with_width(self.ratio, self.half_width)


def side_of_view(view: ValveView) -> ComparedIdentification:
    """Return the present identification of a valve."""
    method = printable(view.values.get("method", "–"), 80)
    return ComparedIdentification(view.tag, view.identified, method, view.sentence, view.parameters)


def side_of_entry(entry: HistoryEntry) -> ComparedIdentification:
    """Return an identification from the history."""
    units = {**UNITS, SLIDING: "N"}
    parameters = tuple(
        Quantity(name, p.value, p.half_width, units.get(name, ""), p.verdict.value, p.reason)
        for name, p in entry.parameters.items()
    )
    tag = printable(entry.valve.tag or entry.valve.name, 80)
    words = printable(entry.diagnosis.message, 2000)
    return ComparedIdentification(tag, entry.time, entry.method, words, parameters)


def compared(one: ComparedIdentification, other: ComparedIdentification) -> tuple[Difference, ...]:
    """Compare all parameters of both sides, in the order of the first side.

    The interval of a ratio treats both sides as independent: it adds the squares of their relative
    half widths.
    """
    left = {each.name: each for each in one.parameters}
    right = {each.name: each for each in other.parameters}
    found = []
    for name in dict.fromkeys((*left, *right)):
        both = [side.get(name, Quantity(name, math.nan)) for side in (left, right)]
        is_open = any(each.verdict in ("fixed", "not identifiable") for each in both)
        known, value = (each.if_determined.value for each in both)
        ratio = value / known if known else math.nan
        shares = [each.half_width / each.value if each.value else math.nan for each in both]
        width = math.nan if is_open else abs(ratio) * math.hypot(*shares)
        found.append(Difference(name, both[0], both[1], ratio, width))
    return tuple(found)
