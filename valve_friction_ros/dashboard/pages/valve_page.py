"""The page *Valve*: all that is known of one."""

import time
from collections.abc import Callable
from urllib.parse import urlencode
from zoneinfo import ZoneInfo

from nicegui import run, ui

from valve_friction_ros.dashboard.board import Board
from valve_friction_ros.dashboard.charts import (
    live_chart,
    live_data,
    loop_chart,
    loop_data,
    trend_chart,
)
from valve_friction_ros.dashboard.pages.parts import EntryList, card, chip, text
from valve_friction_ros.dashboard.pages.theme import Frame, element, frame
from valve_friction_ros.dashboard.pages.valve_actions import ValveActions
from valve_friction_ros.dashboard.pages.valve_history import (
    baseline_words,
    draw_alarms,
    draw_baselines,
    draw_files,
    draw_identifications,
)
from valve_friction_ros.dashboard.pages.valve_parameters import draw_parameters
from valve_friction_ros.dashboard.plant import Heard
from valve_friction_ros.dashboard.plant_rows import (
    drift_number,
    interval_text,
    quantity_texts,
    ratio_text,
    state_words,
)
from valve_friction_ros.dashboard.selection import Selection, state_of
from valve_friction_ros.dashboard.status_keys import Quantity
from valve_friction_ros.dashboard.times import ago, moment
from valve_friction_ros.dashboard.valve_files import OfferedFile, ValveFiles
from valve_friction_ros.dashboard.valve_view import ValveView
from valve_friction_ros.history import HistoryError, KeptBaseline, ValveHistory, drift_text
from valve_friction_ros.outside_text import printable

__all__ = ["valve_page"]

_PERIOD = 0.2
_SLOWER = 5
"""Beats of the timer between two looks at all but the signals."""
_COLUMNS = 500
_LOOP = 1200
_UTC = ZoneInfo("UTC")


class _ValvePage:
    """What one browser looks at: one valve."""

    def __init__(self, board: Board, node: str, page: Frame) -> None:
        self._board, self._node, self._page = board, node, page
        self._shown: ValveView | None = None
        self._state = ""
        self._revision = -1
        self._beat = self._looped = 0
        self._drawn = (0, 0)
        self._history: ValveHistory | None = None
        self._loop: ui.echart | None = None
        self._fact_labels: dict[str, ui.label] = {}
        self._strip = board.signals.watch(node)
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
                with element("div", "vf-valve-name"):
                    with element("a", "vf-back", href=self._page.link("/", **_selection_before())):
                        ui.label("‹ Plant")
                    self._title = text("h1", "")
                    self._chip = element("span")
                    self._place = ui.label("").classes("vf-place")
                self._sentence = text("p", "", "vf-sentence")
                self._facts = element("div", "vf-facts")
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
            self._live = ui.echart(live_chart(self._strip.span)).classes("vf-chart-live")
            self._live.props["aria-label"] = "Pressure and stem of the last 60 seconds"
            self._live_note = text("p", "No sample has come yet.", "vf-none")
        with card("Signature", "", "stem over pressure"):
            self._loop_body = element("div")
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
        for key, title, empty in (
            ("evidence", "Moves in service", "No move has been counted."),
            ("usage", "Usage of the packing", "Nothing is counted."),
            ("fit", "Fit of the model", "There is no estimate."),
            ("command", "Answer to the command", "No stem_command is heard."),
            ("counters", "Node and samples", "Nothing has been heard."),
        ):
            with card(title):
                self._lists[key] = EntryList(empty)

    async def _tick(self) -> None:
        self._beat += 1
        self._show_signals()
        if self._beat % _SLOWER == 1:
            self._look()
            await run.io_bound(self._board.kept.refresh)
            if self._revision != self._board.kept.revision:
                await self._read()

    # What is heard

    def _look(self) -> None:
        """Show what is known now, where it has changed."""
        heard = self._heard()
        self._page.clock.set_text(moment(time.time_ns(), self._page.zone))
        self._actions.tick()
        state = "unknown" if heard is None else state_of(heard)
        view = self._view()
        if view is not self._shown or state != self._state:
            self._state = state
            self._show_view(view, heard)
        self._show_facts(view, heard)

    def _show_view(self, view: ValveView, heard: Heard | None) -> None:
        before, self._shown = self._shown, view
        _retitle(self._title, view.tag)
        self._place.set_text(view.node)
        self._chip.clear()
        with self._chip:
            words = "not heard" if heard is None else state_words(heard)
            chip(
                self._state,
                words,
                "" if self._state in ("silent", "unheard") else view.signal.value,
            )
        _retitle(self._sentence, view.sentence or "No message of this valve has been heard.")
        if (
            before is None
            or before.parameters != view.parameters
            or before.baseline != view.baseline
        ):
            self._parameters_body.clear()
            with self._parameters_body:
                draw_parameters(view)
        groups = view.groups()
        for key, entries in self._lists.items():
            entries.show(groups[key])

    def _show_facts(self, view: ValveView, heard: Heard | None) -> None:
        silent = None if heard is None else heard.silent_for
        ratio = "–"
        if view.ratio is not None:
            between = interval_text(view.ratio, " to ")
            ratio = f"× {ratio_text(view.ratio.value)}" + (f"  ({between})" if between else "")
        made = view.identified
        age = "" if made is None else f"  ({ago(time.time() - made / 1e9)} ago)"
        facts = {
            "friction ÷ baseline": ratio,
            "dead band": _with_unit(view.dead_band.if_determined, "% of travel"),
            "drift": _drift_words(view),
            "identified": moment(made, self._page.zone) + age,
            "heard": "never" if silent is None else f"{ago(silent)} ago",
        }
        if not self._fact_labels:
            with self._facts:
                self._fact_labels = {name: _fact(name) for name in facts}
        for name, words in facts.items():
            self._fact_labels[name].set_text(words)

    # The signals

    def _show_signals(self) -> None:
        note = self._strip.note()
        _retitle(self._live_note, note)
        self._live_note.set_visibility(bool(note))
        revision = self._strip.revision
        if revision == self._drawn:
            return
        self._drawn = revision
        pressure, stem = self._strip.strips(_COLUMNS)
        self._live.run_chart_method("setOption", {"series": live_data(pressure, stem)})
        if self._loop is not None and self._looped + _SLOWER <= self._beat:
            self._looped = self._beat
            loop = loop_data(self._strip.loop(_LOOP))
            self._loop.run_chart_method("setOption", {"series": [{}, {"data": loop}]})

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
        self._draw_trend(kept, problem)
        self._draw_loop(kept)
        draws: tuple[tuple[ui.element, Callable[[], None]], ...] = (
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

    def _draw_trend(self, kept: ValveHistory | None, problem: str | None) -> None:
        self._trend_body.clear()
        with self._trend_body:
            if problem:
                text("p", problem, "vf-none")
            if kept is None:
                if not problem:
                    text("p", "No identification is kept of this valve.", "vf-none")
                return
            chart = ui.echart(trend_chart(kept, self._page.zone, time.time_ns()))
            chart.classes("vf-chart-trend").props["aria-label"] = "Friction over time"
            text("p", _trend_words(kept), "vf-trend-words")

    def _draw_loop(self, kept: ValveHistory | None) -> None:
        self._loop_body.clear()
        healthy = None if kept is None else kept.set_baseline
        record = None if healthy is None else healthy.record
        with self._loop_body:
            self._loop = ui.echart(loop_chart(record)).classes("vf-chart-loop")
            self._drawn = (-1, 0)
            self._loop.props["aria-label"] = "Signature: stem over pressure"
            if record is None:
                text("p", "The record of the baseline is not kept.", "vf-none")

    def _last_set(self) -> KeptBaseline | None:
        return None if self._history is None else self._history.set_baseline

    def _replaced(self) -> str:
        kept = self._last_set()
        if kept is None:
            return "what was in force before the last setting"
        return baseline_words(kept.replaced)

    def _answered(self, _service: str) -> None:
        self._revision = -1  # files and history may be new


def _selection_before() -> dict[str, str]:
    """Return search and filters of the plant, where the visitor has come from its page."""
    referrer = ui.context.client.request.headers.get("referer", "")
    return Selection.from_address(referrer).to_query()


def _retitle(made: ui.element, words: str) -> None:
    label = made.default_slot.children[0]
    if isinstance(label, ui.label):
        label.set_text(words)


def _fact(name: str) -> ui.label:
    with element("div", "vf-fact"):
        ui.label(name).classes("vf-fact-name")
        return ui.label("").classes("vf-fact-value")


def _with_unit(one: Quantity, unit: str) -> str:
    return f"{' '.join(quantity_texts(one)).strip()} {unit}" if one.is_known else "–"


def _drift_words(view: ValveView) -> str:
    if view.drift is None:
        return "none that is significant" if view.friction.is_known else "–"
    words = f"{drift_number(view.drift)} N a month"
    expected = view.drift.expected
    return f"{words}; limit {expected.date}" if expected else words


def _trend_words(kept: ValveHistory) -> str:
    trend = kept.trend
    if trend is None:
        return "No trend: it needs estimates of four days since the baseline."
    if not trend.is_significant:
        return f"No significant drift of the {trend.what} in {trend.days} days with estimates."
    words = f"{trend.what[0].upper()}{trend.what[1:]}: {drift_text(trend)}"
    if trend.crossing is None:
        return f"{words}."
    early, late = (
        f"{moment(t, _UTC)[:10]}" for t in (trend.crossing.earliest, trend.crossing.latest)
    )
    return f"{words} (95 %: {early} to {late})."


def valve_page(board: Board, query: dict[str, str]) -> None:
    """Draw the page of the valve that the address names by ``node``."""
    node = query.get("node", "")

    def here(common: dict[str, str]) -> str:
        return f"/valve?{urlencode({'node': node, **common})}"

    with frame(board, query, "Valve · valve friction", here) as inside:
        _ValvePage(board, node, inside).draw()
