# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The page *Valve*: the full state of one valve, and the actions of its identifier."""

import asyncio
import contextlib
import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple
from urllib.parse import urlencode

from nicegui import run, ui

from valve_friction_ros.dashboard.context import Answer, DashboardContext, OfferedFile, ValveFiles
from valve_friction_ros.dashboard.history_cache import status_of
from valve_friction_ros.dashboard.live_state import Heard, Quantity, ValveView, view_of
from valve_friction_ros.dashboard.live_strip import LiveStrip
from valve_friction_ros.dashboard.pages.alarm_page import AlarmStates
from valve_friction_ros.dashboard.pages.theme import (
    AnswerLine,
    EntryList,
    Frame,
    agreed,
    card,
    chip,
    element,
    frame,
    link,
    redraw,
    text,
)
from valve_friction_ros.dashboard.pages.valve_cards import (
    ValveSignals,
    draw_alarms,
    draw_baselines,
    draw_files,
    draw_identifications,
    draw_parameters,
    draw_trend,
)
from valve_friction_ros.dashboard.plant_rows import (
    FRICTIONS,
    Selection,
    ago,
    drift_number,
    interval_text,
    moment,
    quantity_words,
    ratio_text,
    state_of,
    state_words,
)
from valve_friction_ros.health.alarms import Alarm, AlarmEvent
from valve_friction_ros.history import AlarmFilter, HistoryError, ValveHistory
from valve_friction_ros.outside_text import printable
from valve_friction_ros.wording import lack_remedies, name_in_words


class _ValveHead:
    """Name, state, diagnosis and main numbers of a valve."""

    def __init__(self, page: Frame, is_live: bool) -> None:
        self._page, self._is_live = page, is_live
        self._values: dict[str, ui.label] = {}

    def draw(self) -> None:
        """Draw the head, still without values."""
        with element("div", "vf-valve-name"):
            link("‹ Plant", self._page.link("/", **_selection_before()), "vf-back")
            self._title = text("h1", "")
            self._chip = element("span")
            self._place = ui.label("").classes("vf-place")
        self._advice = text("p", "", "vf-advice")
        self._sentence = text("p", "", "vf-sentence")
        self._facts = element("div", "vf-facts")

    def show(self, view: ValveView, heard: Heard | None, state: str) -> None:
        """Show state and diagnosis of the valve."""
        self._title.set_text(view.tag)
        ui.page_title(f"{view.tag} · valve friction")
        self._place.set_text(view.node)
        letter = "" if state in ("silent", "unheard") else view.signal.value
        words = "not heard" if heard is None else state_words(heard)
        redraw(self._chip, lambda: chip(state, words, letter))
        self._advice.set_text(view.advice)
        self._advice.set_visibility(bool(view.advice))
        self._sentence.set_text(view.sentence or "No message has been received from this valve.")

    def show_facts(self, view: ValveView, heard: Heard | None) -> None:
        """Show the numbers and their age."""
        facts = _facts(view, heard, self._page, self._is_live)
        if not self._values:
            with self._facts:
                self._values = {name: _fact(name) for name in facts}
        for name, words in facts.items():
            self._values[name].set_text(words)


def _facts(view: ValveView, heard: Heard | None, page: Frame, is_live: bool) -> dict[str, str]:
    silent = None if heard is None else heard.silent_for
    ratio = "–"
    if view.ratio is not None:
        between = interval_text(view.ratio, " to ")
        ratio = f"× {ratio_text(view.ratio.value)}" + (f"  ({between})" if between else "")
    made = view.identified
    age = "" if made is None else f"  ({ago(time.time() - made / 1e9)} ago)"
    facts = {
        "friction": quantity_words(view.friction, f"N {FRICTIONS[view.friction.name]}"),
        "baseline": quantity_words(view.healthy, "N"),
        "friction ÷ baseline": ratio,
        "dead band": quantity_words(view.dead_band, "% of travel"),
        "drift": _drift_words(view),
        "identified": moment(made, page.zone) + age,
    }
    if is_live:
        facts["heard"] = "never" if silent is None else f"{ago(silent)} ago"
    return facts


def _fact(name: str) -> ui.label:
    with element("div", "vf-fact"):
        ui.label(name).classes("vf-fact-name")
        return ui.label("").classes("vf-fact-value")


def _drift_words(view: ValveView) -> str:
    if view.drift is None:
        return "–"
    words = f"{drift_number(view.drift)} N per month"
    expected = view.drift.expected
    return f"{words}; limit {expected}" if expected else words


def _selection_before() -> dict[str, str]:
    """Return search and filters of the plant page if the visitor came from it."""
    referrer = ui.context.client.request.headers.get("referer", "")
    return Selection.from_address(referrer).to_query()


_ACTIONS = {
    "identify": ("Identify", "identifying"),
    "save": ("Save recording", "saving"),
    "report": ("Write report", "writing the report"),
    "set_baseline": ("Set baseline …", "setting the baseline"),
    "restore_baseline": ("Restore baseline …", "restoring the baseline"),
}


def _frictions(found: tuple[Quantity, ...]) -> str:
    words = (f"{name_in_words(one.name)} {quantity_words(one)}" for one in found)
    return "; ".join(words) or "none"


class Question(NamedTuple):
    """Question before a baseline changes: valve, estimate, old and new baseline.

    `identified` is the time of the estimate for a new baseline, ns since 1970. `alarm` is the level
    of the valve if it is WARN or ERROR.
    """

    tag: str
    identified: int | None
    old: str
    new: str
    alarm: str = ""


def question_of(view: ValveView, new: str | None) -> Question:
    """Return the question on a valve; without `new` the estimate becomes the baseline."""
    return Question(
        view.tag,
        view.identified if new is None else None,
        _frictions(view.baseline),
        _frictions(_estimate(view)) if new is None else new,
        view.level.name if new is None and view.level is not None and view.level > 0 else "",
    )


def _estimate(view: ValveView) -> tuple[Quantity, ...]:
    found = (
        view.parameter(name).if_determined for name in ("coulomb_friction", "sliding_friction")
    )
    return tuple(one for one in found if one.is_known)


class _ValveActions:
    """Buttons that call the services of one identifier, one call at a time.

    `now` returns the present state of the valve, `replaced` the words for the baseline that would
    be restored; `done` is called after each answer.
    """

    def __init__(
        self,
        context: DashboardContext,
        node: str,
        now: Callable[[], ValveView],
        replaced: Callable[[], str],
        done: Callable[[], None],
    ) -> None:
        self._context, self._node = context, node
        self._now, self._replaced, self._done = now, replaced, done
        self._busy: tuple[str, float] | None = None
        self._buttons: list[ui.button] = []

    def draw(self) -> None:
        """Draw the buttons and the answer line."""
        with element("div", "vf-actions", role="group", aria_label="Actions"):
            for service, (title, _) in _ACTIONS.items():
                self._buttons.append(self._button(service, title))
        self._answer = AnswerLine()
        self._report = link("Open the report", "", "vf-link", target="_blank", rel="noopener")
        self._report.set_visibility(False)

    def _button(self, service: str, title: str) -> ui.button:
        async def act() -> None:
            asked: str | None = service
            if service == "set_baseline" and self._now().lacks:
                asked = await self._told_what_is_missing()
            elif service in ("set_baseline", "restore_baseline"):
                asked = service if await self._agreed(service) else None
            if asked is not None:
                await self._call(asked)

        made = ui.button(title, on_click=act, color=None).props("no-caps unelevated dense")
        return made.classes("vf-act" + (" vf-act-first" if service == "identify" else ""))

    async def _told_what_is_missing(self) -> str | None:
        """Show what a baseline lacks, with remedies; return the chosen action."""
        view = self._now()
        asked = [(one.of, one.lack.name) for one in view.lacks]

        def draw() -> None:
            for title, some in (
                ("What is missing", [one.words for one in view.lacks]),
                ("What you can do", lack_remedies(asked)),
            ):
                text("h2", title)
                with element("ul", "vf-points"):
                    for words in some:
                        text("li", words)

        title = f"No baseline of {view.tag} can be set now"
        is_agreed = await agreed("Set baseline", title, draw, ("Close", "Identify"))
        return "identify" if is_agreed else None

    async def _agreed(self, service: str) -> bool:
        """Show old and new baseline and ask; ask again if they change meanwhile."""
        shown, is_agreed = None, True
        while is_agreed and shown != (question := self._question(service)):
            is_agreed = await self._asked(service, question, is_again=shown is not None)
            shown = question
        return is_agreed

    def _question(self, service: str) -> Question:
        new = None if service == "set_baseline" else self._replaced()
        return question_of(self._now(), new)

    async def _asked(self, service: str, question: Question, is_again: bool) -> bool:
        verb, note, yes = (
            ("Set", "All later diagnoses compare with it, so the valve must be healthy.",
             "Set anyway" if question.alarm else "Set baseline")
            if service == "set_baseline"
            else ("Restore", "This undoes the last change of the baseline.", "Restore baseline")
        )  # fmt: skip

        def draw() -> None:
            if is_again:
                ui.label("This changed while the dialog was open:").classes("vf-reason")
            for name, words in (("current", question.old), ("new", question.new)):
                with element("div", "vf-pair"):
                    ui.label(name)
                    ui.label(words)
            ui.label(note).classes("vf-none")
            if question.alarm:
                ui.label(
                    f"The valve is in {question.alarm}: make sure that it is healthy. A new "
                    "baseline could hide the fault."
                ).classes("vf-answer vf-answer-error")

        title = f"{verb} the baseline of {question.tag}?"
        return await agreed(_ACTIONS[service][0], title, draw, ("Cancel", yes))

    async def _call(self, service: str) -> None:
        if self._busy is not None:
            return
        self._busy = (service, time.monotonic())
        for button in self._buttons:
            button.disable()
        self._report.set_visibility(False)
        self._answer.say("busy", f"{_ACTIONS[service][1]} …")
        try:
            answer = await self._context.call(self._node, service)
        except Exception as error:  # noqa: BLE001 - a bug shall not leave the buttons dead
            answer = Answer(False, f"the call has failed: {error}")
        self._busy = None
        for button in self._buttons:
            button.enable()
        title = _ACTIONS[service][0].rstrip(" …")
        words = printable(answer.message, 2000) or "done"
        files = ValveFiles.of(self._context.options)
        if service == "report" and answer.success and (written := files.report(answer.message)):
            words = "written"
            self._report.props["href"] = written
            self._report.set_visibility(True)
            ui.navigate.to(written, new_tab=True)
        self._answer.say("ok" if answer.success else "error", f"{title}: {words}")
        self._done()

    def tick(self) -> None:
        """Show the duration of a call in progress."""
        if self._busy is not None:
            service, begin = self._busy
            self._answer.set_text(f"{_ACTIONS[service][1]} … {time.monotonic() - begin:.0f} s")


def _view_of_history(kept: ValveHistory | None) -> ValveView | None:
    """Return the last state of a valve in its history, and say that it is from there."""
    if kept is None or not kept.entries:
        return None
    try:
        view = view_of(kept.valve.name, status_of(kept))
    except (ValueError, TypeError, KeyError):  # written by something else
        return None
    told = f"No message has been received from this valve. Last in the history: {view.sentence}"
    return replace(view, sentence=told)


_MOST_EVENTS = 500
"""Maximum number of alarm events in the trend, the newest."""
_READING = 1.0
"""Longest time, s, for which a page waits for the history before it is sent without."""
_PERIOD = 0.2
_SLOWER = 5
"""Timer beats per update of everything but the signals."""
_LISTS = (
    ("changes", "Changes since the baseline", "Nothing has been compared with a baseline yet."),
    ("evidence", "Moves in service", "No moves have been evaluated yet."),
    ("usage", "Packing usage", "No usage recorded yet."),
    ("fit", "Model fit", "No estimate yet."),
    ("command", "Response to the command", "No stem_command has been received."),
    ("counters", "Node and samples", "Nothing has been received yet."),
)
"""Group of values, title of its card, and text of an empty card."""
_KEPT = ("fit",)
"""Groups available from a history."""
_OF_EXPERTS = ("fit", "counters")
"""Groups that are folded away."""


class _ValvePage:
    """The page of one valve in one browser."""

    def __init__(self, context: DashboardContext, node: str, page: Frame) -> None:
        self._context, self._node, self._page = context, node, page
        self._shown: ValveView | None = None
        self._state = ""
        self._revision = -1
        self._beat = 0
        self._history: ValveHistory | None = None
        self._kept: ValveView | None = None
        self._kept_alarms: tuple[Alarm, ...] | None = None
        self._head = _ValveHead(page, context.is_live)
        signals = context.signals
        self._signals = ValveSignals(LiveStrip(60.0) if signals is None else signals.watch(node))
        if signals is not None:
            ui.context.client.on_delete(lambda: signals.unwatch(node))

    def _heard(self) -> Heard | None:
        return self._context.plant.valve(self._node, time.monotonic())

    def _view(self) -> ValveView:
        """Return what the valve says; before its first message, what the history has of it."""
        heard = self._heard()
        if self._kept is not None and (heard is None or heard.silent_for is None):
            return self._kept
        return heard.view if heard is not None else ValveView(self._node, self._node)

    async def draw(self) -> None:
        with element("article", "vf-valve"):
            with element("div", "vf-valve-head"):
                self._head.draw()
                self._actions = _ValveActions(
                    self._context, self._node, self._view, self._replaced, self._answered
                )
                if self._context.is_live and self._context.visitors.may_operate():
                    self._actions.draw()
                elif self._context.is_live:
                    text("p", "Your account has view-only access.", "vf-none")
            with element("div", "vf-cards"):
                self._draw_cards()
        with contextlib.suppress(TimeoutError, asyncio.TimeoutError):  # the same from Python 3.11
            await asyncio.wait_for(self._read(), _READING)
        self._look()
        ui.timer(_PERIOD, self._tick)

    def _draw_cards(self) -> None:
        with card("Friction over time", "vf-wide") as self._trend_body:
            text("p", "Reading the history …", "vf-none")
        with card("Parameters") as self._parameters_body:
            pass
        if self._context.is_live:
            with card("Pressure and stem", "vf-wide", "last 60 s, while this page is open"):
                self._signals.draw()
        with card("Signature", "", "stem over pressure") as self._signature_body:
            pass
        with card("Identifications", "vf-wide vf-long") as self._entries_body:
            pass
        with element("div", "vf-stack"):
            with card("Baselines") as self._baselines_body:
                pass
            with card("Alarms"):
                self._states = AlarmStates(self._context, self._node, self._page.zone)
                self._states.draw()
            if self._context.is_live:
                with card("Alarm recordings") as self._alarms_body:
                    pass
            with card("Reports and recordings") as self._files_body:
                pass
        self._lists = {}
        for key, title, empty in _LISTS:
            if not (self._context.is_live or key in _KEPT):
                continue
            with card(title):
                if key not in _OF_EXPERTS:
                    self._lists[key] = EntryList(empty)
                    continue
                with element("details"):
                    text("summary", f"For experts: {title[0].lower()}{title[1:]}")
                    self._lists[key] = EntryList(empty)

    async def _tick(self) -> None:
        self._beat += 1
        if self._context.is_live:
            self._signals.show()
        if self._beat % _SLOWER == 1:
            self._look()
            await run.io_bound(self._context.history.refresh)
            if self._revision != self._context.history.revision:
                await self._read()

    # What is heard

    def _look(self) -> None:
        """Show changes of the valve's state."""
        heard, view = self._heard(), self._view()
        self._page.clock.set_text(moment(time.time_ns(), self._page.zone))
        self._actions.tick()
        state = "unknown" if heard is None else state_of(heard)
        if view is not self._shown or state != self._state:
            self._state = state
            self._head.show(view, heard, state)
            self._show_values(view)
        kept, is_silent = self._kept_alarms, heard is None or heard.is_silent
        self._states.show(view.alarms if kept is None or not is_silent else kept)
        self._head.show_facts(view, heard)

    def _show_values(self, view: ValveView) -> None:
        before, self._shown = self._shown, view
        shown = (view.parameters, view.baseline)
        if before is None or (before.parameters, before.baseline) != shown:
            redraw(self._parameters_body, lambda: draw_parameters(view))
        groups = view.groups()
        for key, entries in self._lists.items():
            entries.show(groups[key])

    # The history

    async def _read(self) -> None:
        revision = self._context.history.revision
        try:
            self._history = await run.io_bound(self._context.history.valve, self._node)
            self._kept = _view_of_history(self._history)
            self._kept_alarms = await run.io_bound(self._context.history.valve_alarms, self._node)
            problem = self._context.history.problem
        except HistoryError as error:
            problem = str(error)
        events = await self._events()
        files = await run.io_bound(
            ValveFiles.of(self._context.options).offered, self._view().namespace
        )
        kept, zone = self._history, self._page.zone
        draws: tuple[tuple[ui.element, Callable[[], None]], ...] = (
            (self._trend_body, lambda: draw_trend(kept, problem, zone, events)),
            (self._signature_body, lambda: self._signals.draw_signature(kept)),
            (self._entries_body, lambda: draw_identifications(kept, zone, self._compare)),
            (self._baselines_body, lambda: draw_baselines(kept, zone)),
            (self._files_body, lambda: self._draw_files(files or [])),
        )
        if self._context.is_live:
            draws = (*draws, (self._alarms_body, lambda: draw_alarms(kept, zone)))
        for body, draw in draws:
            redraw(body, draw)
        self._revision = revision

    async def _events(self) -> list[AlarmEvent]:
        chosen = AlarmFilter(valve=self._node)
        try:
            found = await run.io_bound(self._context.history.alarms, chosen, True, _MOST_EVENTS)
        except HistoryError:
            return []
        return [one.event for one in found or ()]

    def _draw_files(self, files: list[OfferedFile]) -> None:
        valves = self._context.plant.valves(time.monotonic())
        sharing = ValveFiles.sharing(self._view().namespace, (one.view.namespace for one in valves))
        if files and sharing:
            names = printable(", ".join(sharing), 300)
            text("p", f"Files of {names} have the same names and are listed too.", "vf-none")
        draw_files(files, self._page.zone)

    def _compare(self, stamp: int) -> str:
        return self._page.link("/compare", a=self._node, at=str(stamp), b=self._node)

    def _replaced(self) -> str:
        kept = None if self._history is None else self._history.set_baseline
        if kept is None:
            return "what was in force before the last setting"
        return str(kept.replaced or "none")

    def _answered(self) -> None:
        self._revision = -1  # files and history may be new


async def valve_page(context: DashboardContext, query: dict[str, str]) -> None:
    """Draw the page of the valve named by ``node`` in the address."""
    node = query.get("node", "")

    def here(common: dict[str, str]) -> str:
        return f"/valve?{urlencode({'node': node, **common})}"

    with frame(context, query, "Valve · valve friction", here) as page:
        await _ValvePage(context, node, page).draw()
