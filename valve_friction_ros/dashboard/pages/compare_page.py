"""The page *Compare*: two identifications, of one valve or of two, side by side."""

import time
from urllib.parse import urlencode

from nicegui import run, ui

from valve_friction_ros.dashboard.board import Board
from valve_friction_ros.dashboard.compared import Side, compared, side_of_entry, side_of_view
from valve_friction_ros.dashboard.pages.parts import chip, text
from valve_friction_ros.dashboard.pages.theme import Frame, element, frame
from valve_friction_ros.dashboard.plant_rows import quantity_texts
from valve_friction_ros.dashboard.times import moment
from valve_friction_ros.history import HistoryError, ValveHistory

__all__ = ["compare_page"]

_SIDES = ("a", "b")
_NOW = "now"
_MOST = 400


class _ComparePage:
    """What one browser compares."""

    def __init__(self, board: Board, query: dict[str, str], page: Frame) -> None:
        self._board, self._page = board, page
        self._nodes = {side: query.get(side, "") for side in _SIDES}
        self._stamps = {"a": query.get("at", _NOW), "b": query.get("bt", _NOW)}

    def address(self, common: dict[str, str]) -> str:
        """Return the address of what is compared."""
        parts = {**self._nodes, "at": self._stamps["a"], "bt": self._stamps["b"]}
        kept = {key: value for key, value in parts.items() if value and value != _NOW}
        query = urlencode({**kept, **common})
        return f"/compare?{query}" if query else "/compare"

    async def draw(self) -> None:
        """Draw both choices and the table."""
        self._board.plant.expect(self._board.kept.valves)
        valves = sorted(
            (one.view.tag, one.view.node) for one in self._board.plant.valves(time.monotonic())
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
        """Return what tells the views of now apart; None for a side that the history holds."""
        found = []
        for side in _SIDES:
            heard = None
            if self._stamps[side] == _NOW:
                heard = self._board.plant.valve(self._nodes[side], time.monotonic())
            found.append(None if heard is None else (heard.revision, heard.is_silent))
        return tuple(found)

    async def _draw_choice(self, side: str, valves: list[tuple[str, str]]) -> None:
        names = {node: f"{tag}   {node.rpartition('/')[0]}" for tag, node in valves}
        chosen = self._nodes[side] if self._nodes[side] in names else None
        kept = await self._history(side)
        times = {_NOW: "as it is now"}
        if kept is not None:
            for entry in reversed(kept.entries[-_MOST:]):
                if not entry.refusal:
                    times[str(entry.time)] = moment(entry.time, self._page.zone)
        with element("div", "vf-card vf-choice-card"), element("div", "vf-card-body"):
            text("h2", f"Side {side.upper()}")
            valve = ui.select(names, value=chosen, label="Valve", with_input=True)
            valve.on_value_change(lambda event: self._choose(side, str(event.value or ""), _NOW))
            valve.classes("vf-select").props["aria-label"] = f"Valve of side {side.upper()}"
            stamp = self._stamps[side] if self._stamps[side] in times else _NOW
            when = ui.select(times, value=stamp, label="Identification")
            when.on_value_change(
                lambda event: self._choose(side, self._nodes[side], str(event.value))
            )
            when.classes("vf-select").props["aria-label"] = f"Identification of side {side.upper()}"

    def _choose(self, side: str, node: str, stamp: str) -> None:
        self._nodes[side], self._stamps[side] = node, stamp
        ui.navigate.to(self.address(self._page.common))

    async def _history(self, side: str) -> ValveHistory | None:
        try:
            return await run.io_bound(self._board.kept.valve, self._nodes[side])
        except HistoryError:
            return None

    async def _side(self, side: str) -> Side | None:
        node, stamp = self._nodes[side], self._stamps[side]
        heard = self._board.plant.valve(node, time.monotonic())
        if stamp == _NOW:
            return None if heard is None else side_of_view(heard.view)
        kept = await self._history(side)
        found = (one for one in (kept.entries if kept else ()) if str(one.time) == stamp)
        entry = next(found, None)
        return None if entry is None else side_of_entry(entry)

    async def _show(self) -> None:
        self._drawn = self._heard_now()
        sides = [await self._side(side) for side in _SIDES]
        self._body.clear()
        with self._body:
            if sides[0] is None or sides[1] is None:
                text("p", "Choose a valve on both sides.", "vf-none")
                return
            self._draw_table(sides[0], sides[1])

    def _draw_table(self, one: Side, other: Side) -> None:
        with element("table", "vf-list vf-compared"):
            with element("thead"), element("tr"):
                for title, css in (("", ""), ("A", "vf-n"), ("B", "vf-n"), ("B ÷ A", "vf-n"),
                                   ("", "")):  # fmt: skip
                    text("th", title, css)
            with element("tbody"):
                heard = tuple(
                    "–" if now is None else ("silent" if now[1] else "now") for now in self._drawn
                )
                for name, words in (
                    ("heard", heard),
                    ("valve", (one.tag, other.tag)),
                    ("identified", tuple(moment(s.time, self._page.zone) for s in (one, other))),
                    ("method", (one.method, other.method)),
                ):
                    with element("tr"):
                        for each in (name, *words, "", ""):
                            text("td", each, "" if each == name else "vf-n")
                for row in compared(one, other):
                    with element("tr"):
                        text("td", row.name.replace("_", " "))
                        for quantity in (row.one, row.other):
                            value, width = quantity_texts(quantity)
                            unit = quantity.unit if quantity.if_determined.is_known else ""
                            text("td", f"{value} {width} {unit}".strip(), "vf-n")
                        text("td", row.ratio_words, "vf-n")
                        with element("td"):
                            if row.verdict:
                                state = "warn" if row.verdict == "differs" else "unknown"
                                chip(state, row.verdict)
                with element("tr"):
                    text("td", "diagnosis")
                    for side in (one, other):
                        text("td", side.sentence, "vf-words vf-said")
                    text("td", "")
                    text("td", "")


async def compare_page(board: Board, query: dict[str, str]) -> None:
    """Draw the page; the address names two valves and the times of their identifications."""
    made: list[_ComparePage] = []
    with frame(
        board,
        query,
        "Compare · valve friction",
        lambda common: made[0].address(common) if made else "/compare",
    ) as inside:
        made.append(_ComparePage(board, query, inside))
        await made[0].draw()
