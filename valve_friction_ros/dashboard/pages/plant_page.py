# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The page *Plant*, the worst valve first, and *Compare*, with two identifications."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from nicegui import run, ui

from valve_friction_ros.dashboard.context import DashboardContext
from valve_friction_ros.dashboard.live_state import Heard
from valve_friction_ros.dashboard.pages.theme import (
    Frame,
    RowTable,
    chip,
    element,
    frame,
    redraw,
    search_field,
    table_head,
    table_row,
    text,
)
from valve_friction_ros.dashboard.plant_rows import (
    SIGNAL_WORDS,
    SIGNALS,
    STATE_WORDS,
    STATES,
    ComparedIdentification,
    RowFeed,
    Selection,
    address_of,
    compared,
    levels_in,
    moment,
    quantity_words,
    selected,
    side_of_entry,
    side_of_view,
    summary,
)
from valve_friction_ros.history import HistoryError, ValveHistory
from valve_friction_ros.wording import name_in_words

_PERIOD = 1.0
_FIRST_PERIOD, _FIRST_TIME = 0.25, 10.0
"""Initial refresh period of a page, s, and its duration, s: after a restart of the dashboard this
is when messages from valves arrive."""
_FIRST_ROWS = 100
"""Rows sent with the page, more than a screen shows; the rest follow once it is connected."""
_KEPT_STATES = tuple(one for one in STATES if one not in ("silent", "unheard"))
_COLUMNS = [
    {"key": key, "title": title, "unit": unit, "sort": sort, "css": f"vf-c-{key}"}
    for key, title, unit, sort in (
        ("state", "State", "", "worst"),
        ("tag", "Valve", "", "tag"),
        ("say", "What to do, diagnosis", "", ""),
        ("ratio", "Ratio", "÷ baseline", "ratio"),
        ("dead", "Dead band", "%", "dead_band"),
        ("fc", "Friction", "N", "friction"),
        ("trend", "Trend", "", ""),
        ("drift", "Drift", "N/month", "drift"),
        ("age", "Identified", "ago", "age"),
        ("heard", "Heard", "", ""),
    )
]


_NONE_YET = {
    True: "No message from a valve yet: start an identifier in this ROS domain.",
    False: "The history contains no valves yet: `identify-folder --history` adds results to it.",
}


class PlantTable(RowTable, component="plant_table.js"):
    """The valves as rows or tiles."""


class _PlantPage:
    """The page of one browser: its selection, and the rows sent so far."""

    def __init__(self, context: DashboardContext, selection: Selection) -> None:
        self._context = context
        self._selection = selection
        self._counts: dict[str, ui.label] = {}
        self._views: dict[ui.element, bool] = {}

    def address(self, common: dict[str, str]) -> str:
        return self._selection.address(common)

    def draw(self, page: Frame) -> None:
        self._page = page
        self._feed = RowFeed(lambda node: page.link("/valve", node=node))
        with element("section", "vf-head", aria_label="Filters"):
            text("h1", "Plant", "vf-unseen")
            self._title = ui.label("").classes("vf-title")
            self._title.props["role"] = "status"
            words = "Search tag, name, diagnosis   ( / )"
            search_field(words, self._selection.search, self._select)
            with element("div", "vf-filters", role="group", aria_label="State"):
                for state in STATES if self._context.is_live else _KEPT_STATES:
                    self._chip("states", state, STATE_WORDS[state], f"vf-{state}")
            with element("div", "vf-filters", role="group", aria_label="NE 107"):
                for letter in SIGNALS:
                    self._chip("signals", letter, letter, "vf-letter", SIGNAL_WORDS[letter])
            with element("div", "vf-filters vf-views", role="group", aria_label="View"):
                for words, tiled in (("Table", False), ("Tiles", True)):
                    self._view(words, tiled)
        heard = self._heard()
        shown = selected(heard, self._selection)
        spark = self._context.history.spark
        first = self._feed.news(shown, spark, time.time(), _FIRST_ROWS)
        live = self._context.is_live
        columns = [one for one in _COLUMNS if live or one["key"] != "heard"]
        self._table = PlantTable({**first, **self._arrangement(), "live": live}, columns=columns)
        self._table.on("sort", lambda event: self._sort(event.args))
        self._note = ui.label("").classes("vf-note")
        self._count(heard)
        self._timer = ui.timer(_FIRST_PERIOD, self._tick)
        self._drawn = time.monotonic()

    def _heard(self) -> list[Heard]:
        self._context.plant.expect(self._context.history.last.values())
        return self._context.plant.valves(time.monotonic())

    async def _tick(self) -> None:
        if time.monotonic() > self._drawn + _FIRST_TIME:
            self._timer.interval = _PERIOD
        await run.io_bound(self._context.history.refresh)
        self._show({})

    def _show(self, more: dict[str, Any]) -> None:
        heard = self._heard()
        shown = selected(heard, self._selection)
        self._table.send(
            {**self._feed.news(shown, self._context.history.spark, time.time()), **more}
        )
        self._count(heard)

    def _count(self, heard: list[Heard]) -> None:
        counts = levels_in(heard)
        for state, label in self._counts.items():
            label.set_text(str(counts[state]))
        self._title.set_text(summary(counts))
        self._page.clock.set_text(moment(time.time_ns(), self._page.zone))
        self._note.set_text(self._context.history.problem or "")

    def _arrangement(self) -> dict[str, Any]:
        one = self._selection
        return {
            "sort": one.sort,
            "reversed": one.is_reversed,
            "tiled": one.is_tiled,
            "empty": "No valve matches the filters."
            if one.search or one.states or one.signals
            else _NONE_YET[self._context.is_live],
        }

    def _change(self, selection: Selection) -> None:
        self._selection = selection
        self._page.address.show(self.address(self._page.common))
        self._show(self._arrangement())

    def _select(self, **changes: Any) -> None:
        self._change(replace(self._selection, **changes))

    def _sort(self, name: object) -> None:
        if isinstance(name, str):
            self._change(self._selection.sorted_by(name))

    def _chip(self, kind: str, one: str, text: str, css: str, title: str = "") -> None:
        def toggle() -> None:
            chosen = getattr(self._selection, kind) ^ {one}
            button.props["aria-pressed"] = str(one in chosen).lower()
            self._select(**{kind: chosen})

        is_on = one in getattr(self._selection, kind)
        button = self._button(text, f"vf-filter {css}", is_on, toggle)
        if title:
            button.props["title"] = f"NE 107: {title}"
            button.props["aria-label"] = f"NE 107 {one}: {title}"
        if kind == "states":
            with button:
                self._counts[one] = ui.label("0").classes("vf-count")

    def _view(self, text: str, tiled: bool) -> None:
        def choose() -> None:
            for other, is_on in self._views.items():
                other.props["aria-pressed"] = str(is_on == tiled).lower()
            self._select(is_tiled=tiled)

        made = self._button(text, "vf-filter", self._selection.is_tiled == tiled, choose)
        self._views[made] = tiled

    @staticmethod
    def _button(text: str, css: str, is_on: bool, click: Callable[[], None]) -> ui.element:
        with element("button", css, type="button", aria_pressed=str(is_on).lower()) as made:
            ui.label(text)
        made.on("click", click)
        return made


def plant_page(context: DashboardContext, query: dict[str, str]) -> None:
    """Draw the page."""
    page = _PlantPage(context, Selection.from_query(query))
    with frame(context, query, "Plant · valve friction", page.address) as inside:
        page.draw(inside)


_SIDES = ("a", "b")
_NOW = "now"
_MOST_CHOICES = 400


class _ComparePage:
    """The comparison in one browser."""

    def __init__(self, context: DashboardContext, query: dict[str, str]) -> None:
        self._context = context
        self._nodes = {side: query.get(side, "") for side in _SIDES}
        self._stamps = {"a": query.get("at", _NOW), "b": query.get("bt", _NOW)}

    def address(self, common: dict[str, str]) -> str:
        stamps = {f"{side}t": one for side, one in self._stamps.items() if one != _NOW}
        return address_of("/compare", {**self._nodes, **stamps, **common})

    async def draw(self, page: Frame) -> None:
        self._page = page
        self._context.plant.expect(self._context.history.last.values())
        valves = sorted(
            (one.view.tag, one.view.node) for one in self._context.plant.valves(time.monotonic())
        )
        with element("article", "vf-compare"):
            text("h1", "Compare")
            with element("div", "vf-compare-heads"):
                for side in _SIDES:
                    await self._draw_choice(side, valves)
            with element("div", "vf-card"), element("div", "vf-card-body") as self._body:
                pass
        await self._show()
        ui.timer(1.0, self._tick)

    async def _tick(self) -> None:
        self._page.clock.set_text(moment(time.time_ns(), self._page.zone))
        if self._heard_now() != self._drawn:
            await self._show()

    def _heard_now(self) -> tuple[tuple[int, bool] | None, ...]:
        """Return a key of each side's live view; None for a side from the history."""
        found = []
        for side in _SIDES:
            heard = None
            if self._stamps[side] == _NOW:
                heard = self._context.plant.valve(self._nodes[side], time.monotonic())
            found.append(None if heard is None else (heard.revision, heard.is_silent))
        return tuple(found)

    async def _draw_choice(self, side: str, valves: list[tuple[str, str]]) -> None:
        names = {node: f"{tag}   {node.rpartition('/')[0]}" for tag, node in valves}
        chosen = self._nodes[side] if self._nodes[side] in names else None
        kept = await self._history(side)
        times = {_NOW: "current state" if self._context.is_live else "the latest"}
        if kept is not None:
            for entry in reversed(kept.entries[-_MOST_CHOICES:]):
                if not entry.refusal:
                    times[str(entry.time)] = moment(entry.time, self._page.zone)
        with element("div", "vf-card vf-choice-card"), element("div", "vf-card-body"):
            text("h2", f"Side {side.upper()}")
            valve = ui.select(names, value=chosen, label="Valve", with_input=True)
            valve.on_value_change(lambda event: self._choose(side, str(event.value or ""), _NOW))
            stamp = self._stamps[side] if self._stamps[side] in times else _NOW
            when = ui.select(times, value=stamp, label="Identification")
            when.on_value_change(
                lambda event: self._choose(side, self._nodes[side], str(event.value))
            )
            for made, name in ((valve, "Valve"), (when, "Identification")):
                made.classes("vf-select").props["aria-label"] = f"{name} of side {side.upper()}"

    def _choose(self, side: str, node: str, stamp: str) -> None:
        self._nodes[side], self._stamps[side] = node, stamp
        ui.navigate.to(self.address(self._page.common))

    async def _history(self, side: str) -> ValveHistory | None:
        try:
            return await run.io_bound(self._context.history.valve, self._nodes[side])
        except HistoryError:
            return None

    async def _side(self, side: str) -> ComparedIdentification | None:
        node, stamp = self._nodes[side], self._stamps[side]
        heard = self._context.plant.valve(node, time.monotonic())
        if stamp == _NOW and heard is not None and heard.silent_for is not None:
            return side_of_view(heard.view)
        kept = await self._history(side)
        successes = [one for one in (kept.entries if kept else ()) if not one.refusal]
        found = (one for one in reversed(successes) if stamp in (_NOW, str(one.time)))
        entry = next(found, None)
        return None if entry is None else side_of_entry(entry)

    async def _show(self) -> None:
        self._drawn = self._heard_now()
        sides = [await self._side(side) for side in _SIDES]
        redraw(self._body, lambda: self._draw_table(*sides))

    def _draw_table(
        self, one: ComparedIdentification | None, other: ComparedIdentification | None
    ) -> None:
        if one is None or other is None:
            text("p", "Choose a valve for each side.", "vf-none")
            return
        with element("table", "vf-list vf-compared"):
            sides = ("A", "B", "B ÷ A")
            table_head(("number", ""), *((side, "vf-n") for side in sides), ("verdict", ""))
            with element("tbody"):
                heard = tuple(
                    "–" if now is None else ("silent" if now[1] else "now") for now in self._drawn
                )
                for name, words in (
                    *((("heard", heard),) if self._context.is_live else ()),
                    ("valve", (one.tag, other.tag)),
                    ("identified", tuple(moment(s.time, self._page.zone) for s in (one, other))),
                    ("method", (one.method, other.method)),
                ):
                    table_row(*((w, "" if w == name else "vf-n") for w in (name, *words, "", "")))
                for row in compared(one, other):
                    numbers = (*map(quantity_words, (row.one, row.other)), row.ratio_words)
                    name = name_in_words(row.name)
                    cells = ((name, ""), *((each, "vf-n") for each in numbers))
                    with table_row(*cells), element("td"):
                        if row.verdict:
                            state = "warn" if row.verdict == "differs" else "unknown"
                            chip(state, row.verdict)
                said = ((side.sentence, "vf-words vf-said") for side in (one, other))
                table_row(("diagnosis", ""), *said, ("", ""), ("", ""))


async def compare_page(context: DashboardContext, query: dict[str, str]) -> None:
    """Draw the page for the two valves and identification times in the address."""
    page = _ComparePage(context, query)
    with frame(context, query, "Compare · valve friction", page.address) as inside:
        await page.draw(inside)
