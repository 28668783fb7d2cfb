# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The page *Alarms*: lists, filters, answers and exports current alarms and all events."""

import time
from collections import defaultdict
from collections.abc import Awaitable, Callable, Hashable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from typing import Any
from zoneinfo import ZoneInfo

from nicegui import run, ui

from valve_friction_ros.dashboard.context import Answer, DashboardContext
from valve_friction_ros.dashboard.pages.theme import (
    AnswerLine,
    Frame,
    RowTable,
    agreed,
    chip,
    element,
    frame,
    link,
    redraw,
    search_field,
    text,
)
from valve_friction_ros.dashboard.plant_rows import address_of, minute, moment
from valve_friction_ros.health.alarms import (
    TRANSITIONS,
    Alarm,
    AlarmAction,
    AlarmError,
    AlarmKind,
    AlarmRequest,
    AlarmState,
    alarm_summary,
)
from valve_friction_ros.history import AlarmFilter, HistoryError, KeptAlarmEvent
from valve_friction_ros.outside_text import printable
from valve_friction_ros.streams import DAY
from valve_friction_ros.wording import capitalised, numbered

_PERIOD = 1.0

RANGES = {
    "1 h": DAY // 24,
    "1 day": DAY,
    "1 week": 7 * DAY,
    "1 month": 30 * DAY,
    "1 year": 366 * DAY,
}
"""Selectable time spans before now, ns."""
_ALL = "all"
_MOST_ROWS = 500
"""Maximum number of rows on a page; the CSV has all."""
_LONGEST_SEARCH = 200

_ACTIONS = {
    AlarmAction.ACKNOWLEDGE: "Acknowledge",
    AlarmAction.UNSHELVE: "Unshelve",
    AlarmAction.PUT_BACK: "Put back into service",
    AlarmAction.SHELVE: "Shelve",
    AlarmAction.TAKE_OUT: "Take out of service",
    AlarmAction.COMMENT: "Comment",
}
"""Actions of a person, with the labels of their buttons; a form begins with the first possible."""

_LASTING = frozenset({AlarmAction.SHELVE, AlarmAction.TAKE_OUT})
"""Actions that last for a set time."""


def _possible(alarm: Alarm) -> tuple[AlarmAction, ...]:
    """Return the actions that an alarm allows now."""
    return tuple(one for one in _ACTIONS if (alarm.state, one) in TRANSITIONS)


def _is_quiet(alarm: Alarm) -> bool:
    """Return whether an alarm only follows its valve: out of service and inactive."""
    return alarm.state is AlarmState.OUT_OF_SERVICE and not alarm.is_active


def _state(alarm: Alarm, zone: ZoneInfo) -> str:
    """Return the state of an alarm, with the end of a suppression."""
    end = "" if alarm.until is None else f" until {minute(alarm.until, zone)}"
    return f"{alarm.state.value}{end}"


@dataclass(frozen=True)
class AlarmSelection:
    """Filters of an alarm page."""

    is_journal: bool = False
    """Whether to list all events; else only alarms that are not normal."""
    span: str = _ALL
    """Name of the time span before now (`RANGES`), or ``all``."""
    search: str = ""
    """Words; each must occur in tag, name, sentence, person or text."""
    area: str = "/"
    """Area of the valves, including its sub-areas."""
    states: frozenset[AlarmState] = frozenset()
    """States to list; empty for all."""
    kinds: frozenset[AlarmKind] = frozenset()
    """Kinds of alarm to list; empty for all."""

    @classmethod
    def from_query(cls, query: Mapping[str, str]) -> "AlarmSelection":
        """Read the filters from an address; ignore unknown parts."""
        states, kinds = query.get("state", "").split(","), query.get("kind", "").split(",")
        span = query.get("span", _ALL)
        return cls(
            is_journal=query.get("view") == "events",
            span=span if span in RANGES else _ALL,
            search=query.get("q", "")[:_LONGEST_SEARCH],
            area=query.get("area", "/")[:_LONGEST_SEARCH] or "/",
            states=frozenset(one for one in AlarmState if one.name.lower() in states),
            kinds=frozenset(one for one in AlarmKind if one.value in kinds),
        )

    def to_query(self) -> dict[str, str]:
        """Return the parts of the address, without defaults."""
        parts = {
            "view": "events" if self.is_journal else "",
            "span": "" if self.span == _ALL else self.span,
            "q": self.search,
            "area": "" if self.area == "/" else self.area,
            "state": ",".join(one.name.lower() for one in AlarmState if one in self.states),
            "kind": ",".join(one.value for one in AlarmKind if one in self.kinds),
        }
        return {key: text for key, text in parts.items() if text}

    def address(self, more: Mapping[str, str], path: str = "/alarms") -> str:
        """Return the address of this list, with further parts."""
        return address_of(path, {**self.to_query(), **more})

    def chosen(self, now: int) -> AlarmFilter:
        """Return the filter of the history at a time, ns since 1970."""
        since = now - RANGES[self.span] if self.span in RANGES else AlarmFilter().since
        return AlarmFilter(
            since=since, area=self.area, states=self.states, kinds=self.kinds, words=self.search
        )


def _urgency(one: KeptAlarmEvent) -> tuple[bool, bool]:
    """Return a sort key: first what waits for acknowledgement, last what is suppressed."""
    state = one.event.alarm.state
    return state.is_suppressed, not state.needs_answer


def _merged(events: Sequence[KeptAlarmEvent]) -> list[tuple[KeptAlarmEvent, int]]:
    """Return the events, with a single one for the quiet alarms of a valve, and their number."""
    groups: defaultdict[Hashable, list[KeptAlarmEvent]] = defaultdict(list)
    for k, one in enumerate(events):
        alarm = one.event.alarm
        groups[(one.valve, alarm.until) if _is_quiet(alarm) else k].append(one)
    return [(some[0], len(some)) for some in groups.values()]


def _row(
    number: int, one: KeptAlarmEvent, alarms: int, zone: ZoneInfo, href: str, is_journal: bool
) -> Any:
    """Return a row for some alarms of a valve under fixed keys, with `number` as its identity."""
    event, alarm = one.event, one.event.alarm
    level = alarm.condition.level
    by = f"{event.action.value} by {event.who}" if event.who else event.action.value
    return {
        "i": number,
        "alarm": [one.valve.name, alarm.kind.value if alarms == 1 else ""],
        "href": href,
        "tag": printable(one.valve.tag, 80),
        "area": printable(one.area, 120),
        "kind": alarm.kind.words if alarms == 1 else numbered(alarms, "alarm"),
        "state": alarm.state.value,
        "until": "" if alarm.until is None else minute(alarm.until, zone),
        "css": level.name.lower() if alarm.is_told else "unknown",
        "level": level.name if alarm.is_active else "",
        "advice": alarm.advice if alarm.is_told else "",
        "say": printable(alarm.message, 300),
        "when": moment(event.time, zone),
        "raised": minute(alarm.raised, zone),
        "by": printable(by, 120),
        "text": printable(event.text, 500),
        "can": [] if is_journal else [a.name for a in _possible(alarm)],
    }


def _areas(valves: Iterable[str]) -> tuple[str, ...]:
    """Return the areas of identifiers, with all enclosing areas, sorted."""
    found = {"/"}
    for name in valves:
        parts = name.strip("/").split("/")[:-2]
        found |= {"/" + "/".join(parts[: k + 1]) for k in range(len(parts))}
    return tuple(sorted(found))


class AlarmTable(RowTable, component="alarm_table.js"):
    """Alarms or events as rows."""


class _RequestLine(AnswerLine):
    """Asks for a request on alarms in a dialog, makes it, and shows its outcome."""

    is_busy = False

    async def ask(
        self,
        title: str,
        actions: Sequence[AlarmAction],
        name: str,
        answer: Callable[[AlarmRequest], Awaitable[Answer]],
        chosen: AlarmAction | None = None,
    ) -> None:
        """Ask for action, person, comment and duration; `name` is that of an account, if any."""
        made: list[Any] = []

        def draw() -> None:
            names = {one.name: _ACTIONS[one] for one in actions}
            action = ui.select(names, value=(chosen or actions[0]).name, label="Action")
            hours = ui.number("Duration, hours", value=8.0, min=0.1, max=8784, step=1)
            who = ui.input("Your name", value=name)
            who.set_enabled(not name)
            made.extend((action, who, ui.input("Comment"), hours))
            for one in made:
                one.classes("vf-select")

            def show() -> None:
                hours.set_visibility(AlarmAction[str(action.value)] in _LASTING)

            action.on_value_change(show)
            show()

        # Beside this line: what was clicked may be redrawn, and would take the dialog with it.
        with self.parent_slot or nullcontext():
            is_agreed = await agreed(title, title, draw, ("Cancel", "Confirm"), "flat no-caps")
        if not is_agreed:
            return
        action, who, words, hours = (one.value for one in made)
        done, duration = AlarmAction[str(action)], 3600 * float(hours or 0.0)
        try:
            request = AlarmRequest(done, str(who or ""), str(words or ""), duration)
        except AlarmError as error:
            self.tell(False, str(error))
            return
        self.is_busy = True
        self.say("busy", f"{_ACTIONS[done]} …")
        self.tell(*await answer(request))
        self.is_busy = False


class _AlarmPage:
    """The page of one browser: its selection, and the events in its rows."""

    def __init__(self, context: DashboardContext, selection: AlarmSelection) -> None:
        self._context, self._selection = context, selection
        self._events: tuple[KeptAlarmEvent, ...] = ()
        self._shown: tuple[object, ...] = ()

    def address(self, common: dict[str, str]) -> str:
        return self._selection.address(common)

    def draw(self, page: Frame) -> None:
        self._page = page
        may, one = self._context.visitors.may_operate(), self._selection
        with element("section", "vf-head", aria_label="Filters"):
            self._title = text("h1", "Alarms", "vf-title")
            search_field("Search tag, message, person", one.search, self._select)
            lists = {False: "current alarms", True: "alarm history"}
            self._choice("List", lists, "is_journal")
            spans = {name: f"last {name}" for name in RANGES} | {_ALL: "all time"}
            self._choice("Time", spans, "span")
            areas = _areas(kept.name for kept in self._context.history.valves)
            names = {area: "all areas" if area == "/" else area for area in (*areas, one.area)}
            self._choice("Area", names, "area")
            self._several("State", {s: s.value for s in AlarmState}, "states")
            self._several("Alarm", {k: k.words for k in AlarmKind}, "kinds")
            self._export = link("CSV", self._csv(), "vf-link", download="alarms.csv")
            if may:
                self._all = ui.button("Acknowledge all", on_click=self._acknowledge_all, color=None)
                self._all.props("no-caps unelevated dense").classes("vf-act vf-act-first")
        self._answer = _RequestLine()
        self._table = AlarmTable({"rows": [], "journal": False, "empty": ""}, may=may)
        self._table.on("ask", lambda event: self._ask(event.args))
        self._note = ui.label("").classes("vf-note")
        ui.timer(_PERIOD, self._tick)

    def _choice(self, title: str, names: Mapping[Any, str], what: str) -> None:
        made = ui.select(dict(names), value=getattr(self._selection, what))
        made.on_value_change(lambda event: self._select(**{what: event.value}))
        self._dress(made, title)

    def _several(self, title: str, names: Mapping[Any, str], what: str) -> None:
        """Draw a multiple choice; an empty choice selects all."""
        texts = {one.name: words for one, words in names.items()}
        by_name = {one.name: one for one in names}
        value = [one.name for one in getattr(self._selection, what)]
        made = ui.select(texts, value=value, label=title, multiple=True)
        made.on_value_change(
            lambda event: self._select(**{what: frozenset(map(by_name.__getitem__, event.value))})
        )
        self._dress(made, title)

    @staticmethod
    def _dress(made: ui.select, title: str) -> None:
        made.classes("vf-pick").props("dense outlined options-dense")
        made.props["aria-label"] = title

    def _csv(self) -> str:
        return self._selection.address({}, "/alarms.csv")

    def _select(self, **changes: Any) -> None:
        self._selection = replace(self._selection, **changes)
        self._export.props["href"] = self._csv()
        self._page.address.show(self.address(self._page.common))

    async def _tick(self) -> None:
        self._page.clock.set_text(moment(time.time_ns(), self._page.zone))
        await run.io_bound(self._context.history.refresh)
        await self._read()

    async def _read(self) -> None:
        history, one = self._context.history, self._selection
        minute = time.time_ns() // 60_000_000_000
        state = (one, history.alarm_revision, history.problem, minute * (one.span != _ALL))
        if state == self._shown:
            return
        problem, events = history.problem, tuple[KeptAlarmEvent, ...]()
        try:
            chosen = one.chosen(time.time_ns())
            found = await run.io_bound(history.alarms, chosen, one.is_journal, _MOST_ROWS + 1)
            events = found or ()  # None during shutdown
            if not one.is_journal:
                events = tuple(sorted(events, key=_urgency))
        except HistoryError as error:
            problem = str(error)
        self._shown, self._events = state, events[:_MOST_ROWS]
        address = self._page.link
        shown = [(e, 1) for e in self._events] if one.is_journal else _merged(self._events)
        rows = [
            _row(
                k,
                each,
                alarms,
                self._page.zone,
                address("/valve", node=each.valve.name),
                one.is_journal,
            )
            for k, (each, alarms) in enumerate(shown)
        ]
        empty = "No alarm matches the filters." if one.to_query() else "No current alarms."
        self._table.send({"rows": rows, "journal": one.is_journal, "empty": empty})
        waiting = sum(each.event.alarm.state.needs_answer for each in self._events)
        more = f"The newest {_MOST_ROWS} are shown; the CSV has all." * (len(events) > _MOST_ROWS)
        self._note.set_text(problem or more)
        if self._context.visitors.may_operate():
            self._all.set_visibility(not one.is_journal)
            self._all.set_enabled(bool(waiting) and not self._answer.is_busy)
            self._all.set_text(f"Acknowledge all {waiting}" if waiting else "Acknowledge all")

    # Answers

    async def _ask(self, given: object) -> None:
        """Ask for an action on the alarm of a row."""
        if not (isinstance(given, list) and len(given) == 2):
            return
        # By its name: the rows in the browser may be older than ours.
        asked, name = given
        node, kind = asked
        of_valve = [e for e in self._events if e.valve.name == node]
        some = (
            e
            for e in of_valve
            if (e.event.alarm.kind.value == kind if kind else _is_quiet(e.event.alarm))
        )
        if (one := next(some, None)) is None:
            return
        alarm = one.event.alarm
        state, words = _state(alarm, self._page.zone), alarm.kind.words if kind else "all alarms"
        title = f"{printable(one.valve.tag, 80)}, {words}: {state}"
        may, who = _possible(alarm), self._context.visitors.name()
        chosen = next((action for action in may if action.name == name), None)
        if name and chosen is None:
            self._answer.tell(False, f"The alarm has changed: {title}")
            return
        answer = partial(self._context.answer_alarm, node, alarm.kind if kind else None)
        await self._answer.ask(title, may, who, answer, chosen)
        self._shown = ()

    async def _acknowledge_all(self) -> None:
        some = [one for one in self._events if one.event.alarm.state.needs_answer]
        alarms = [(one.valve, one.event.alarm.kind) for one in some]
        only, who = (AlarmAction.ACKNOWLEDGE,), self._context.visitors.name()
        answer = partial(self._context.answer_alarms, alarms)
        title = f"Acknowledge {numbered(len(some), 'alarm')}"
        await self._answer.ask(title, only, who, answer)
        self._shown = ()


class AlarmStates:
    """The alarms of one valve that are not normal, with buttons to answer them."""

    def __init__(self, context: DashboardContext, node: str, zone: ZoneInfo) -> None:
        self._context, self._node, self._zone = context, node, zone
        self._alarms: tuple[Alarm, ...] | None = None

    def draw(self) -> None:
        """Draw the panel, still without alarms."""
        self._body = element("div")
        self._answer = _RequestLine()
        if self._context.visitors.may_operate():
            with element("div", "vf-actions", role="group", aria_label="Alarms for this valve"):
                for action in (AlarmAction.TAKE_OUT, AlarmAction.PUT_BACK):
                    ui.button(
                        f"{_ACTIONS[action]} …",
                        on_click=partial(self._ask, "All alarms for this valve", None, [action]),
                        color=None,
                    ).props("no-caps unelevated dense").classes("vf-act")

    def show(self, alarms: tuple[Alarm, ...]) -> None:
        """Show the present alarms."""
        if alarms == self._alarms:
            return
        self._alarms = alarms
        redraw(self._body, lambda: self._draw_alarms(alarms))

    def _draw_alarms(self, alarms: Sequence[Alarm]) -> None:
        if not alarms:
            text("p", "No current alarms.", "vf-none")
        if quiet := [one for one in alarms if _is_quiet(one)]:
            text("p", capitalised(alarm_summary(quiet, partial(_state, zone=self._zone))) + ".")
        for one in alarms:
            if one not in quiet:
                self._draw_alarm(one)

    def _draw_alarm(self, one: Alarm) -> None:
        css = one.condition.level.name.lower() if one.is_told else "unknown"
        kind = one.kind
        with element("div", "vf-alarm"):
            chip(css, kind.words)
            ui.label(_state(one, self._zone))
            if self._context.visitors.may_operate():
                may, acknowledge = _possible(one), AlarmAction.ACKNOWLEDGE
                ask = partial(self._ask, kind.words, kind, may)
                if acknowledge in may:
                    self._button("Acknowledge", kind.words, partial(ask, acknowledge))
                self._button("More …", kind.words, ask)
            text("p", printable(one.message, 2000), "vf-none")

    @staticmethod
    def _button(words: str, name: str, click: Callable[[], Awaitable[None]]) -> None:
        made = ui.button(words, on_click=click, color=None)
        made.props("no-caps unelevated dense").classes("vf-act")
        made.props["aria-label"] = f"{words.rstrip(' …')}: {name}"

    async def _ask(
        self,
        title: str,
        kind: AlarmKind | None,
        may: Sequence[AlarmAction],
        chosen: AlarmAction | None = None,
    ) -> None:
        answer = partial(self._context.answer_alarm, self._node, kind)
        await self._answer.ask(title, may, self._context.visitors.name(), answer, chosen)


def alarm_page(context: DashboardContext, query: dict[str, str]) -> None:
    """Draw the page."""
    page = _AlarmPage(context, AlarmSelection.from_query(query))
    with frame(context, query, "Alarms · valve friction", page.address) as inside:
        page.draw(inside)
