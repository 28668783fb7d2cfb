"""The head of the page *Valve*: its sentence, and the facts below it."""

import time

from nicegui import ui

from valve_friction_ros.dashboard.heard.plant import Heard
from valve_friction_ros.dashboard.heard.status_keys import Quantity
from valve_friction_ros.dashboard.heard.valve_view import ValveView
from valve_friction_ros.dashboard.pages.parts import chip, retitle, text
from valve_friction_ros.dashboard.pages.theme import Frame, element
from valve_friction_ros.dashboard.plant_rows import (
    drift_number,
    interval_text,
    quantity_texts,
    ratio_text,
    state_words,
)
from valve_friction_ros.dashboard.selection import Selection
from valve_friction_ros.dashboard.times import ago, moment

__all__ = ["ValveHead"]


class ValveHead:
    """Name, state and sentence of a valve, and its most important numbers.

    Parameters
    ----------
    page : Frame
        The frame of the page.
    """

    def __init__(self, page: Frame) -> None:
        self._page = page
        self._values: dict[str, ui.label] = {}

    def draw(self) -> None:
        """Draw it, still without its values."""
        with element("div", "vf-valve-name"):
            with element("a", "vf-back", href=self._page.link("/", **_selection_before())):
                ui.label("‹ Plant")
            self._title = text("h1", "")
            self._chip = element("span")
            self._place = ui.label("").classes("vf-place")
        self._sentence = text("p", "", "vf-sentence")
        self._facts = element("div", "vf-facts")

    def show(self, view: ValveView, heard: Heard | None, state: str) -> None:
        """Show the state of a valve and its sentence."""
        retitle(self._title, view.tag)
        self._place.set_text(view.node)
        letter = "" if state in ("silent", "unheard") else view.signal.value
        self._chip.clear()
        with self._chip:
            chip(state, "not heard" if heard is None else state_words(heard), letter)
        retitle(self._sentence, view.sentence or "No message of this valve has been heard.")

    def show_facts(self, view: ValveView, heard: Heard | None) -> None:
        """Show the numbers, and how old they are now."""
        facts = _facts(view, heard, self._page)
        if not self._values:
            with self._facts:
                self._values = {name: _fact(name) for name in facts}
        for name, words in facts.items():
            self._values[name].set_text(words)


def _facts(view: ValveView, heard: Heard | None, page: Frame) -> dict[str, str]:
    silent = None if heard is None else heard.silent_for
    ratio = "–"
    if view.ratio is not None:
        between = interval_text(view.ratio, " to ")
        ratio = f"× {ratio_text(view.ratio.value)}" + (f"  ({between})" if between else "")
    made = view.identified
    age = "" if made is None else f"  ({ago(time.time() - made / 1e9)} ago)"
    return {
        "friction ÷ baseline": ratio,
        "dead band": _with_unit(view.dead_band, "% of travel"),
        "drift": _drift_words(view),
        "identified": moment(made, page.zone) + age,
        "heard": "never" if silent is None else f"{ago(silent)} ago",
    }


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


def _selection_before() -> dict[str, str]:
    """Return search and filters of the plant, where the visitor has come from its page."""
    referrer = ui.context.client.request.headers.get("referer", "")
    return Selection.from_address(referrer).to_query()
