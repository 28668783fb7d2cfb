# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The page *Alarms*: lists, filters, answers and exports current alarms and all events."""

import asyncio
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from nicegui import run, ui

from valve_friction_ros.dashboard.alarm_list import (
    ACTIONS,
    ALL,
    LASTING,
    MOST_ROWS,
    RANGES,
    AlarmSelection,
    Asked,
    areas_of,
    possible,
    request_of,
    row_of,
)
from valve_friction_ros.dashboard.context import Answer, DashboardContext
from valve_friction_ros.dashboard.live_state import ValveAlarm, ValveView
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
from valve_friction_ros.dashboard.plant_rows import moment
from valve_friction_ros.health import AlarmAction, AlarmError, AlarmKind, AlarmRequest, AlarmState
from valve_friction_ros.history import HistoryError, KeptAlarmEvent
from valve_friction_ros.outside_text import printable

_PERIOD = 1.0


class AlarmTable(RowTable, component="alarm_table.js"):
    """Alarms or events as rows."""


async def asked_of_person(
    title: str, actions: Sequence[AlarmAction], name: str, chosen: AlarmAction | None = None
) -> Asked | None:
    """Ask for an action, a name, a comment and a duration; return None if cancelled.

    With an account, its name is fixed.
    """
    made: list[Any] = []

    def draw() -> None:
        names = {one.name: ACTIONS[one] for one in actions}
        action = ui.select(names, value=(chosen or actions[0]).name, label="Action")
        hours = ui.number("Duration, hours", value=8.0, min=0.1, max=8784, step=1)
        who = ui.input("Your name", value=name)
        who.set_enabled(not name)
        made.extend((action, who, ui.input("Comment"), hours))
        for one in made:
            one.classes("vf-select")

        def show() -> None:
            hours.set_visibility(AlarmAction[str(action.value)] in LASTING)

        action.on_value_change(show)
        show()

    if not await agreed(title, title, draw, ("Cancel", "Confirm"), "flat no-caps"):
        return None
    action, who, words, hours = (one.value for one in made)
    return Asked(AlarmAction[str(action)], str(who or ""), str(words or ""), float(hours or 0.0))


class _AlarmPage:
    """The page of one browser: its selection, and the events in its rows."""

    def __init__(self, context: DashboardContext, selection: AlarmSelection) -> None:
        self._context, self._selection = context, selection
        self._events: tuple[KeptAlarmEvent, ...] = ()
        self._shown: tuple[object, ...] = ()
        self._is_busy = False

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
            spans = {name: f"last {name}" for name in RANGES} | {ALL: "all time"}
            self._choice("Time", spans, "span")
            areas = areas_of(kept.name for kept in self._context.history.valves)
            names = {area: "all areas" if area == "/" else area for area in (*areas, one.area)}
            self._choice("Area", names, "area")
            self._several("State", {s: s.value for s in AlarmState}, "states")
            self._several("Alarm", {k: k.words for k in AlarmKind}, "kinds")
            self._export = link("CSV", self._csv(), "vf-link", download="alarms.csv")
            if may:
                self._all = ui.button("Acknowledge all", on_click=self._acknowledge_all, color=None)
                self._all.props("no-caps unelevated dense").classes("vf-act vf-act-first")
        self._answer = AnswerLine()
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
        state = (one, history.alarm_revision, history.problem, minute * (one.span != ALL))
        if state == self._shown:
            return
        problem, events = history.problem, tuple[KeptAlarmEvent, ...]()
        try:
            chosen = one.chosen(time.time_ns())
            found = await run.io_bound(history.alarms, chosen, one.is_journal, MOST_ROWS + 1)
            events = found or ()  # None during shutdown
        except HistoryError as error:
            problem = str(error)
        self._shown, self._events = state, events[:MOST_ROWS]
        address = self._page.link
        rows = [
            row_of(
                k, each, self._page.zone, address("/valve", node=each.valve.name), one.is_journal
            )
            for k, each in enumerate(self._events)
        ]
        empty = "No alarm matches the filters." if one.to_query() else "No current alarms."
        self._table.send({"rows": rows, "journal": one.is_journal, "empty": empty})
        waiting = sum(each.event.alarm.state.needs_answer for each in self._events)
        more = f"The newest {MOST_ROWS} are shown; the CSV has all." * (len(events) > MOST_ROWS)
        self._note.set_text(problem or more)
        if self._context.visitors.may_operate():
            self._all.set_visibility(not one.is_journal)
            self._all.set_enabled(bool(waiting) and not self._is_busy)
            self._all.set_text(f"Acknowledge all {waiting}" if waiting else "Acknowledge all")

    # Answers

    async def _ask(self, given: object) -> None:
        """Ask for an action on the alarm of a row."""
        if not (isinstance(given, list) and len(given) == 2 and isinstance(given[0], int)):
            return
        number, name = given
        if not 0 <= number < len(self._events):
            return
        one = self._events[number]
        alarm = one.event.alarm
        chosen = AlarmAction[name] if name in AlarmAction.__members__ else None
        title = f"{printable(one.valve.tag, 80)}, {alarm}"
        found = await asked_of_person(
            title, possible(alarm.state.value), self._context.visitors.name(), chosen
        )
        if found is not None:
            await self._call([(one.valve.name, alarm.kind.value)], found)

    async def _acknowledge_all(self) -> None:
        some = [one for one in self._events if one.event.alarm.state.needs_answer]
        title = f"Acknowledge {len(some)} alarms"
        only = (AlarmAction.ACKNOWLEDGE,)
        found = await asked_of_person(title, only, self._context.visitors.name())
        if found is None:
            return
        if self._context.is_live and not self._context.history.is_file:
            await self._call([(o.valve.name, o.event.alarm.kind.value) for o in some], found)
            return
        try:
            request = AlarmRequest(found.action, found.who, found.text)
        except AlarmError as error:
            self._answer.say("error", str(error))
            return
        alarms = [(one.valve, one.event.alarm.kind) for one in some]
        answer = await self._context.answer_alarms(alarms, request)
        self._answer.tell(*answer)

    async def _call(self, alarms: Sequence[tuple[str, str]], asked: Asked) -> None:
        """Make a request for each alarm: valves in parallel, alarms of one valve in turn."""
        self._is_busy = True
        self._answer.say("busy", f"{ACTIONS[asked.action]} …")
        by_valve: dict[str, list[str]] = {}
        for node, kind in alarms:
            by_valve.setdefault(node, []).append(kind)

        async def of_valve(node: str, kinds: Sequence[str]) -> list[Answer]:
            call = self._context.operator.call
            return [await call(node, request_of(asked, kind)) for kind in kinds]

        found = await asyncio.gather(*(of_valve(*each) for each in by_valve.items()))
        answers = [answer for some in found for answer in some]
        self._is_busy = False
        if wrong := [printable(one.message, 500) for one in answers if not one.success]:
            self._answer.say("error", f"{len(wrong)} of {len(answers)} refused: {wrong[0]}")
        elif len(answers) == 1:
            self._answer.tell(*answers[0])
        else:
            self._answer.say("ok", f"{len(answers)} done")
        self._shown = ()


class AlarmStates:
    """The alarms of one valve that are not normal, with buttons to answer them.

    Parameters
    ----------
    context : DashboardContext
        Context that calls the services.
    node : str
        The identifier.
    """

    def __init__(self, context: DashboardContext, node: str) -> None:
        self._context, self._node = context, node
        self._alarms: tuple[ValveAlarm, ...] | None = None

    def draw(self) -> None:
        """Draw the panel, still without alarms."""
        self._body = element("div")
        self._answer = AnswerLine()
        if self._context.visitors.may_operate():
            with element("div", "vf-actions", role="group", aria_label="Alarms of this valve"):
                for action in (AlarmAction.TAKE_OUT, AlarmAction.PUT_BACK):
                    ui.button(
                        f"{ACTIONS[action]} …",
                        on_click=lambda action=action: self._ask(None, action),
                        color=None,
                    ).props("no-caps unelevated dense").classes("vf-act")

    def show(self, view: ValveView) -> None:
        """Show the present alarms."""
        if view.alarms == self._alarms:
            return
        self._alarms = view.alarms
        redraw(self._body, lambda: self._draw_alarms(view.alarms))

    def _draw_alarms(self, alarms: Sequence[ValveAlarm]) -> None:
        if not alarms:
            text("p", "No current alarms.", "vf-none")
        for one in alarms:
            self._draw_alarm(one)

    def _draw_alarm(self, one: ValveAlarm) -> None:
        css = one.level.lower() if one.is_told else "unknown"
        name = one.kind.replace("_", " ")
        with element("div", "vf-alarm"):
            chip(css, name)
            ui.label(f"{one.state} until {one.until}" if one.until else one.state)
            if self._context.visitors.may_operate():
                may = possible(one.state)
                if AlarmAction.ACKNOWLEDGE in may:
                    self._button("Acknowledge", name, one, AlarmAction.ACKNOWLEDGE)
                self._button("More …", name, one, None)
            text("p", one.message, "vf-none")

    def _button(self, words: str, name: str, one: ValveAlarm, action: AlarmAction | None) -> None:
        made = ui.button(words, on_click=lambda: self._ask(one, action), color=None)
        made.props("no-caps unelevated dense").classes("vf-act")
        made.props["aria-label"] = f"{words.rstrip(' …')}: {name}"

    async def _ask(self, one: ValveAlarm | None, action: AlarmAction | None) -> None:
        may = [action] if one is None and action is not None else possible(one.state if one else "")
        title = "All alarms of this valve" if one is None else one.kind.replace("_", " ")
        found = await asked_of_person(title, may, self._context.visitors.name(), action)
        if found is None:
            return
        request = request_of(found, "all" if one is None else one.kind)
        answer = await self._context.operator.call(self._node, request)
        self._answer.tell(*answer)


def alarm_page(context: DashboardContext, query: dict[str, str]) -> None:
    """Draw the page."""
    page = _AlarmPage(context, AlarmSelection.from_query(query))
    with frame(context, query, "Alarms · valve friction", page.address) as inside:
        page.draw(inside)
