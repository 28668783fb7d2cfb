"""The page *Valve*: all that is known of one."""

import time
from collections.abc import Callable
from urllib.parse import urlencode

from nicegui import run, ui

from valve_friction_ros.dashboard.board import Board
from valve_friction_ros.dashboard.heard.plant import Heard
from valve_friction_ros.dashboard.heard.valve_view import ValveView
from valve_friction_ros.dashboard.pages.parts import EntryList, card, text
from valve_friction_ros.dashboard.pages.theme import Frame, element, frame
from valve_friction_ros.dashboard.pages.valve_actions import ValveActions
from valve_friction_ros.dashboard.pages.valve_head import ValveHead
from valve_friction_ros.dashboard.pages.valve_history import (
    baseline_words,
    draw_alarms,
    draw_baselines,
    draw_files,
    draw_identifications,
)
from valve_friction_ros.dashboard.pages.valve_parameters import draw_parameters
from valve_friction_ros.dashboard.pages.valve_signals import ValveSignals
from valve_friction_ros.dashboard.pages.valve_trend import draw_trend
from valve_friction_ros.dashboard.selection import state_of
from valve_friction_ros.dashboard.times import moment
from valve_friction_ros.dashboard.valve_files import OfferedFile, ValveFiles
from valve_friction_ros.history import HistoryError, ValveHistory
from valve_friction_ros.outside_text import printable

__all__ = ["valve_page"]

_PERIOD = 0.2
_SLOWER = 5
"""Beats of the timer between two looks at all but the signals."""
_LISTS = (
    ("changes", "Changes since the baseline", "Nothing is compared with a baseline."),
    ("evidence", "Moves in service", "No move has been counted."),
    ("usage", "Usage of the packing", "Nothing is counted."),
    ("fit", "Fit of the model", "There is no estimate."),
    ("command", "Answer to the command", "No stem_command is heard."),
    ("counters", "Node and samples", "Nothing has been heard."),
)
"""Group of values, title of its card, and what stands there without any."""


class _ValvePage:
    """What one browser looks at: one valve."""

    def __init__(self, board: Board, node: str, page: Frame) -> None:
        self._board, self._node, self._page = board, node, page
        self._shown: ValveView | None = None
        self._state = ""
        self._revision = -1
        self._beat = 0
        self._history: ValveHistory | None = None
        self._head = ValveHead(page)
        self._signals = ValveSignals(board.signals.watch(node))
        ui.context.client.on_delete(lambda: board.signals.unwatch(node))

    def _heard(self) -> Heard | None:
        return self._board.plant.valve(self._node, time.monotonic())

    def _view(self) -> ValveView:
        heard = self._heard()
        return heard.view if heard is not None else ValveView(self._node, self._node)

    def draw(self) -> None:
        """Draw the page, still without its values."""
        with element("article", "vf-valve"):
            with element("div", "vf-valve-head"):
                self._head.draw()
                self._actions = ValveActions(
                    self._board.operator, self._node, self._view, self._replaced, self._answered
                )
                if self._board.visitors.may_operate():
                    self._actions.draw()
                else:
                    text("p", "Your account may view, not operate.", "vf-none")
            with element("div", "vf-cards"):
                self._draw_cards()
        self._look()
        ui.timer(_PERIOD, self._tick)

    def _draw_cards(self) -> None:
        with card("Friction over time", "vf-wide") as self._trend_body:
            text("p", "The history is being read …", "vf-none")
        with card("Parameters") as self._parameters_body:
            pass
        with card("Pressure and stem", "vf-wide", "last 60 s, while this page is open"):
            self._signals.draw()
        with card("Signature", "", "stem over pressure") as self._signature_body:
            pass
        with card("Identifications", "vf-wide vf-long") as self._entries_body:
            pass
        with element("div", "vf-stack"):
            with card("Baselines") as self._baselines_body:
                pass
            with card("Alarms") as self._alarms_body:
                pass
            with card("Reports and recordings") as self._files_body:
                pass
        self._lists = {}
        for key, title, empty in _LISTS:
            with card(title):
                self._lists[key] = EntryList(empty)

    async def _tick(self) -> None:
        self._beat += 1
        self._signals.show()
        if self._beat % _SLOWER == 1:
            self._look()
            await run.io_bound(self._board.kept.refresh)
            if self._revision != self._board.kept.revision:
                await self._read()

    # What is heard

    def _look(self) -> None:
        """Show what is known now, where it has changed."""
        heard, view = self._heard(), self._view()
        self._page.clock.set_text(moment(time.time_ns(), self._page.zone))
        self._actions.tick()
        state = "unknown" if heard is None else state_of(heard)
        if view is not self._shown or state != self._state:
            self._state = state
            self._head.show(view, heard, state)
            self._show_values(view)
        self._head.show_facts(view, heard)

    def _show_values(self, view: ValveView) -> None:
        before, self._shown = self._shown, view
        if before is None or (before.parameters, before.baseline) != (
            view.parameters,
            view.baseline,
        ):
            self._parameters_body.clear()
            with self._parameters_body:
                draw_parameters(view)
        groups = view.groups()
        for key, entries in self._lists.items():
            entries.show(groups[key])

    # The history

    async def _read(self) -> None:
        self._revision = self._board.kept.revision
        try:
            self._history = await run.io_bound(self._board.kept.valve, self._node)
            problem = self._board.kept.problem
        except HistoryError as error:
            problem = str(error)
        files = await run.io_bound(
            ValveFiles.of(self._board.options).offered, self._view().namespace
        )
        kept, zone = self._history, self._page.zone
        draws: tuple[tuple[ui.element, Callable[[], None]], ...] = (
            (self._trend_body, lambda: draw_trend(kept, problem, zone)),
            (self._signature_body, lambda: self._signals.draw_signature(kept)),
            (self._entries_body, lambda: draw_identifications(kept, zone, self._compare)),
            (self._baselines_body, lambda: draw_baselines(kept, zone)),
            (self._alarms_body, lambda: draw_alarms(kept, zone)),
            (self._files_body, lambda: self._draw_files(files or [])),
        )
        for body, draw in draws:
            body.clear()
            with body:
                draw()

    def _draw_files(self, files: list[OfferedFile]) -> None:
        valves = self._board.plant.valves(time.monotonic())
        sharing = ValveFiles.sharing(self._view().namespace, (one.view.namespace for one in valves))
        if files and sharing:
            names = printable(", ".join(sharing), 300)
            text("p", f"Files of {names} have the same names: they stand here too.", "vf-none")
        draw_files(files, self._page.zone)

    def _compare(self, stamp: int) -> str:
        return self._page.link("/compare", a=self._node, at=str(stamp), b=self._node)

    def _replaced(self) -> str:
        kept = None if self._history is None else self._history.set_baseline
        if kept is None:
            return "what was in force before the last setting"
        return baseline_words(kept.replaced)

    def _answered(self, _service: str) -> None:
        self._revision = -1  # files and history may be new


def valve_page(board: Board, query: dict[str, str]) -> None:
    """Draw the page of the valve that the address names by ``node``."""
    node = query.get("node", "")

    def here(common: dict[str, str]) -> str:
        return f"/valve?{urlencode({'node': node, **common})}"

    with frame(board, query, "Valve · valve friction", here) as inside:
        _ValvePage(board, node, inside).draw()
