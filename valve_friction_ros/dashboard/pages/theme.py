# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The frame of every page, and its parts: style, navigation, chips, cards, tables, values."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlencode
from zoneinfo import ZoneInfo

from nicegui import ui

from valve_friction_ros.dashboard.context import DashboardContext
from valve_friction_ros.dashboard.live_state import Entry
from valve_friction_ros.dashboard.plant_rows import zone_asked


class PlantTable(ui.element, component="plant_table.js"):
    """Rows or tiles; the browser keeps them, and is sent what has changed.

    Parameters
    ----------
    initial : mapping
        All rows and the order.
    columns : list of dict
        Columns of the table: key, title, unit, sort and css of each.
    """

    def __init__(self, initial: Mapping[str, Any], columns: list[dict[str, str]]) -> None:
        super().__init__()
        self._props["initial"] = dict(initial)
        self._props["columns"] = columns

    def send(self, news: Mapping[str, Any]) -> None:
        """Send what has changed: ``now``, and at will ``rows``, ``order`` and the view."""
        self.run_method("update", dict(news))


class AddressBar(ui.element, component="address.js"):
    """The address of the page, which holds its state."""

    def show(self, address: str) -> None:
        """Show another address without loading it."""
        self.run_method("replace", address)


_STYLE = Path(__file__).with_name("dashboard.css")
_THEMES: dict[str, bool | None] = {"auto": None, "light": False, "dark": True}
_COMMON = ("tz", "theme")
_PAGES = (("Plant", "/"), ("Alarms", "/alarms"), ("Compare", "/compare"))


def load_style() -> None:
    """Add the style sheet to all pages."""
    ui.add_css(_STYLE, shared=True)


def element(tag: str, css: str = "", **attributes: str) -> ui.element:
    """Make an element of HTML; its attributes are never markup."""
    made = ui.element(tag).classes(css)
    for name, value in attributes.items():
        made.props[name.replace("_", "-")] = value
    return made


@dataclass(frozen=True)
class Frame:
    """What the frame of a page gives to its content.

    Attributes
    ----------
    zone : ZoneInfo
        Zone of the times.
    common : dict of str to str
        Parts of the address that all pages share: zone and theme.
    address : AddressBar
        The address of the page.
    clock : ui.label
        Shows the time of day.
    """

    zone: ZoneInfo
    common: dict[str, str]
    address: AddressBar
    clock: ui.label

    def link(self, path: str, **parts: str) -> str:
        """Return the address of a page, in the same zone and theme."""
        query = urlencode({key: text for key, text in {**parts, **self.common}.items() if text})
        return f"{path}?{query}" if query else path


@contextmanager
def frame(
    context: DashboardContext,
    query: Mapping[str, str],
    title: str,
    here: Callable[[dict[str, str]], str],
) -> Iterator[Frame]:
    """Draw the frame of a page; `here` returns its address with other common parts."""
    zone = zone_asked(query, context.options.time_zone)
    theme = query.get("theme", "auto")
    common = {key: query[key] for key in _COMMON if query.get(key)}
    ui.page_title(title)
    ui.dark_mode(_THEMES.get(theme))
    around = ui.context.client.content.parent_slot
    if around is not None:
        around.parent.tag = "div"  # q-page would be a second `main`, with the bar in it
    address = AddressBar()
    _link("Skip to the content", "#content").classes("vf-skip")
    with element("header", "vf-bar-top"):
        with element("nav", "vf-nav", aria_label="Pages"):
            element("span", "vf-mark", aria_hidden="true")
            for text, path in _PAGES:
                is_here = here({}).partition("?")[0] == path
                made = _link(text, f"{path}?{urlencode(common)}" if common else path)
                if is_here:
                    made.props["aria-current"] = "page"
        with element("div", "vf-bar-right"):
            clock = ui.label("").classes("vf-clock")
            clock.props["aria-label"] = "time of day"
            _choice("Time zone", _zones(context, zone), zone.key, "tz", common, here)
            _choice("Theme", tuple(_THEMES), theme, "theme", common, here)
            _account(context)
    with element("main", "vf-main", id="content", tabindex="-1"):
        yield Frame(zone, common, address, clock)


def _zones(context: DashboardContext, zone: ZoneInfo) -> tuple[str, ...]:
    return tuple(dict.fromkeys(("UTC", context.options.time_zone, zone.key, *_OFTEN)))


_OFTEN = ("Europe/London", "Europe/Berlin", "America/New_York", "America/Chicago",
          "Asia/Kolkata", "Asia/Shanghai", "Asia/Tokyo", "Australia/Sydney")  # fmt: skip


def _account(context: DashboardContext) -> None:
    """Show who has logged in, and a button to log out."""
    name = context.visitors.name()
    if name:
        ui.label(name).classes("vf-account").props["aria-label"] = "logged in"
        out = ui.button("Log out", on_click=context.visitors.log_out, color=None)
        out.props("flat no-caps dense")


def _link(text: str, href: str) -> ui.element:
    with element("a", "", href=href) as made:
        ui.label(text)
    return made


def _choice(
    title: str,
    choices: tuple[str, ...],
    chosen: str,
    key: str,
    common: dict[str, str],
    here: Callable[[dict[str, str]], str],
) -> None:
    """Draw a choice that loads the page anew, with its part of the address changed."""

    def choose(event: Any) -> None:
        text = str(event.value)
        ui.navigate.to(here({**common, key: text}))

    made = ui.select(list(choices), value=chosen if chosen in choices else choices[0])
    made.on_value_change(choose)
    made.classes("vf-choice").props("dense borderless options-dense")
    made.props["aria-label"] = title


_LONG = 40
"""Characters from which a value stands below its name."""


def text(tag: str, words: str, css: str = "") -> ui.element:
    """Make an element with a text, which is never markup."""
    with element(tag, css) as made:
        ui.label(words)
    return made


def retitle(made: ui.element, words: str) -> None:
    """Change the text of an element that `text` has made."""
    label = made.default_slot.children[0]
    if isinstance(label, ui.label):
        label.set_text(words)


def chip(state: str, word: str, letter: str = "") -> ui.element:
    """Show a state by a colour, a word and, where it has one, its letter of NE 107."""
    with element("span", f"vf-chip vf-{state}") as made:
        if letter:
            text("b", letter, "vf-ne")
        ui.label(word)
    return made


@contextmanager
def card(title: str, css: str = "", note: str = "") -> Iterator[ui.element]:
    """Draw a card with a heading, and provide its body."""
    with element("section", f"vf-card {css}", aria_label=title):
        with element("header", "vf-card-head"):
            text("h2", title)
            if note:
                text("small", note)
        with element("div", "vf-card-body") as body:
            yield body


def table(
    titles: Sequence[str], rows: Iterable[Sequence[str]], numeric: Sequence[int] = (), css: str = ""
) -> ui.element:
    """Draw a table of texts; columns of numbers are set to the right."""
    with element("table", f"vf-list {css}") as made:
        with element("thead"), element("tr"):
            for column, title in enumerate(titles):
                text("th", title, "vf-n" if column in numeric else "").props["scope"] = "col"
        with element("tbody"):
            for row in rows:
                with element("tr"):
                    for column, words in enumerate(row):
                        text("td", words, "vf-n" if column in numeric else "")
    return made


class EntryList:
    """Values with their names and units; only what has changed is drawn anew.

    Parameters
    ----------
    empty : str
        What is said where there are none.
    """

    def __init__(self, empty: str) -> None:
        self._empty = empty
        self._body = element("div", "vf-entries")
        self._names: tuple[str, ...] | None = None
        self._values: list[ui.label] = []

    def show(self, entries: Sequence[Entry]) -> None:
        """Show these values."""
        names = tuple(one.name for one in entries)
        if names != self._names:
            self._names = names
            self._draw(entries)
        for label, entry in zip(self._values, entries, strict=True):
            label.set_text(f"{entry.text} {entry.unit}".strip())

    def _draw(self, entries: Sequence[Entry]) -> None:
        self._body.clear()
        self._values = []
        with self._body:
            if not entries:
                text("p", self._empty, "vf-none")
                return
            with element("dl", "vf-dl"):
                for entry in entries:
                    text("dt", entry.name)
                    long = len(entry.text) > _LONG
                    with element("dd", "vf-dd-long" if long else ""):
                        self._values.append(ui.label(""))
