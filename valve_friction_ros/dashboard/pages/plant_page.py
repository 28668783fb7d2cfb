"""The page *Plant*: all valves, the worst first."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from nicegui import run, ui

from valve_friction_ros.dashboard.board import Board
from valve_friction_ros.dashboard.heard.plant import Heard
from valve_friction_ros.dashboard.pages.plant_table import PlantTable
from valve_friction_ros.dashboard.pages.theme import Frame, element, frame
from valve_friction_ros.dashboard.plant_rows import SIGNAL_WORDS, STATE_WORDS, RowFeed, summary
from valve_friction_ros.dashboard.selection import (
    SIGNALS,
    STATES,
    Selection,
    levels_in,
    selected,
)
from valve_friction_ros.dashboard.times import moment

__all__ = ["plant_page"]

_PERIOD = 1.0
_FIRST_PERIOD, _FIRST_TIME = 0.25, 10.0
"""Period, s, in which a page looks at first, and for how long: after a restart of the dashboard the
valves are heard then."""
_COLUMNS = [
    {"key": key, "title": title, "unit": unit, "sort": sort, "css": f"vf-c-{key}"}
    for key, title, unit, sort in (
        ("state", "State", "", "worst"),
        ("tag", "Valve", "", "tag"),
        ("say", "Diagnosis", "", ""),
        ("ratio", "Ratio", "÷ baseline", "ratio"),
        ("dead", "Dead band", "%", "dead_band"),
        ("fc", "Friction", "N", "friction"),
        ("trend", "Trend", "", ""),
        ("drift", "Drift", "N/month", "drift"),
        ("age", "Identified", "ago", "age"),
        ("heard", "Heard", "", ""),
    )
]


class _PlantPage:
    """What one browser looks at: its selection, and what it has been sent."""

    def __init__(self, board: Board, selection: Selection) -> None:
        self._board = board
        self._selection = selection
        self._counts: dict[str, ui.label] = {}
        self._views: dict[ui.element, bool] = {}

    def address(self, common: dict[str, str]) -> str:
        return self._selection.address(common)

    def draw(self, page: Frame) -> None:
        self._page = page
        self._feed = RowFeed(lambda node: page.link("/valve", node=node))
        with element("section", "vf-head", aria_label="Filters"):
            self._title = ui.label("").classes("vf-title")
            self._title.props["role"] = "status"
            with element("div", "vf-search"):
                search = ui.input(
                    placeholder="Search tag, name, diagnosis   ( / )",
                    value=self._selection.search,
                    on_change=lambda event: self._select(search=str(event.value or "")),
                ).props("dense outlined clearable debounce=250 type=search")
                search.props["aria-label"] = "Search"
            with element("div", "vf-filters", role="group", aria_label="State"):
                for state in STATES:
                    self._chip("states", state, STATE_WORDS[state], f"vf-{state}")
            with element("div", "vf-filters", role="group", aria_label="NE 107"):
                for letter in SIGNALS:
                    self._chip("signals", letter, letter, "vf-letter", SIGNAL_WORDS[letter])
            with element("div", "vf-filters vf-views", role="group", aria_label="View"):
                for text, tiled in (("Table", False), ("Tiles", True)):
                    self._view(text, tiled)
        heard = self._heard()
        shown = selected(heard, self._selection)
        first = self._feed.news(shown, self._board.kept.spark, time.time())
        self._table = PlantTable({**first, **self._arrangement()}, _COLUMNS)
        self._table.on("sort", lambda event: self._sort(event.args))
        self._note = ui.label("").classes("vf-note")
        self._count(heard)
        self._timer = ui.timer(_FIRST_PERIOD, self._tick)
        self._drawn = time.monotonic()

    def _heard(self) -> list[Heard]:
        self._board.plant.expect(self._board.kept.valves)
        return self._board.plant.valves(time.monotonic())

    async def _tick(self) -> None:
        if time.monotonic() > self._drawn + _FIRST_TIME:
            self._timer.interval = _PERIOD
        await run.io_bound(self._board.kept.refresh)
        self._show({})

    def _show(self, more: dict[str, Any]) -> None:
        heard = self._heard()
        shown = selected(heard, self._selection)
        self._table.send({**self._feed.news(shown, self._board.kept.spark, time.time()), **more})
        self._count(heard)

    def _count(self, heard: list[Heard]) -> None:
        counts = levels_in(heard)
        for state, label in self._counts.items():
            label.set_text(str(counts[state]))
        self._title.set_text(summary(counts))
        self._page.clock.set_text(moment(time.time_ns(), self._page.zone))
        self._note.set_text(self._board.kept.problem or "")

    def _arrangement(self) -> dict[str, Any]:
        one = self._selection
        return {
            "sort": one.sort,
            "reversed": one.is_reversed,
            "tiled": one.is_tiled,
            "empty": "No valve meets the filters."
            if one.search or one.states or one.signals
            else "No valve has been heard yet: start an identifier in this ROS domain.",
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


def plant_page(board: Board, query: dict[str, str]) -> None:
    """Draw the page."""
    page = _PlantPage(board, Selection.from_query(query))
    with frame(board, query, "Plant · valve friction", page.address) as inside:
        page.draw(inside)
