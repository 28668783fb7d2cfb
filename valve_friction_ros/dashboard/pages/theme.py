# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The frame of every page and its parts: style, navigation, chips, cards, tables, values."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from zoneinfo import ZoneInfo

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement

from valve_friction_ros.dashboard.context import DashboardContext
from valve_friction_ros.dashboard.live_state import Entry
from valve_friction_ros.dashboard.plant_rows import address_of, zone_asked
from valve_friction_ros.outside_text import printable


class RowTable(ui.element):
    """Rows kept by the browser, which receives only changes of the initial content."""

    def __init__(self, initial: Mapping[str, Any], **props: Any) -> None:
        super().__init__()
        self._props.update({"initial": dict(initial), **props})

    def send(self, news: Mapping[str, Any]) -> None:
        """Send changes under the keys of `initial`."""
        self.run_method("update", dict(news))


class AddressBar(ui.element, component="address.js"):
    """The address of the page, which holds the state of the page."""

    def show(self, address: str) -> None:
        """Show another address without loading it."""
        self.run_method("replace", address)


_THEMES: dict[str, bool | None] = {"auto": None, "light": False, "dark": True}
_COMMON = ("tz", "theme")
_PAGES = (("Plant", "/"), ("Alarms", "/alarms"), ("Compare", "/compare"))


def element(tag: str, css: str = "", **attributes: str) -> ui.element:
    """Make an HTML element; attribute values are never parsed as markup."""
    made = ui.element(tag).classes(css)
    for name, value in attributes.items():
        made.props[name.replace("_", "-")] = value
    return made


@dataclass(frozen=True)
class Frame:
    """The frame of a page, as its content uses it."""

    zone: ZoneInfo
    common: dict[str, str]
    """Parts of the address common to all pages: zone and theme."""
    address: AddressBar
    clock: ui.label
    """Label with the time of day."""

    def link(self, path: str, **parts: str) -> str:
        """Return the address of a page in the same zone and theme."""
        return address_of(path, {**parts, **self.common})


@contextmanager
def frame(
    context: DashboardContext,
    query: Mapping[str, str],
    title: str,
    here: Callable[[dict[str, str]], str],
) -> Iterator[Frame]:
    """Draw the frame of a page; `here` returns its address with given common parts."""
    zone = zone_asked(query, context.options.time_zone)
    theme = query.get("theme", "auto")
    common = {key: query[key] for key in _COMMON if query.get(key)}
    ui.page_title(title)
    ui.dark_mode(_THEMES.get(theme))
    around = ui.context.client.content.parent_slot
    if around is not None:
        around.parent.tag = "div"  # q-page would be a second `main`, around the bar
    address = AddressBar()
    link("Skip to the content", "#content").classes("vf-skip")
    with element("header", "vf-bar-top"):
        with element("nav", "vf-nav", aria_label="Pages"):
            element("span", "vf-mark", aria_hidden="true")
            for page, path in _PAGES:
                made = link(page, address_of(path, common))
                if here({}).partition("?")[0] == path:
                    made.props["aria-current"] = "page"
        with element("div", "vf-bar-right"):
            clock = ui.label("").classes("vf-clock")
            clock.props["aria-label"] = "time of day"
            zones = ("UTC", context.options.time_zone, zone.key, *_OFTEN)
            _choice("Time zone", dict.fromkeys(zones), zone.key, "tz", common, here)
            _choice("Theme", _THEMES, theme, "theme", common, here)
            if name := context.visitors.name():
                ui.label(name).classes("vf-account").props["aria-label"] = "logged in"
                out = ui.button("Log out", on_click=context.visitors.log_out, color=None)
                out.props("flat no-caps dense")
    with element("main", "vf-main", id="content", tabindex="-1"):
        yield Frame(zone, common, address, clock)


_OFTEN = ("Europe/London", "Europe/Berlin", "America/New_York", "America/Chicago",
          "Asia/Kolkata", "Asia/Shanghai", "Asia/Tokyo", "Australia/Sydney")  # fmt: skip


def _choice(
    title: str,
    choices: Iterable[str],
    chosen: str,
    key: str,
    common: dict[str, str],
    here: Callable[[dict[str, str]], str],
) -> None:
    """Draw a choice that reloads the page with the changed part of its address."""
    several = [*choices]
    made = ui.select(several, value=chosen if chosen in several else several[0])
    made.on_value_change(lambda event: ui.navigate.to(here({**common, key: str(event.value)})))
    made.classes("vf-choice").props("dense borderless options-dense")
    made.props["aria-label"] = title


_LONG = 40
"""Length above which a value is shown below its name."""


def text(tag: str, words: str, css: str = "", **attributes: str) -> TextElement:
    """Make an element with a text, which is never parsed as markup."""
    made = TextElement(tag=tag, text=words).classes(css)
    for name, value in attributes.items():
        made.props[name.replace("_", "-")] = value
    return made


def link(words: str, href: str, css: str = "", **attributes: str) -> TextElement:
    """Make a link."""
    return text("a", words, css, href=href, **attributes)


def search_field(words: str, searched: str, select: Callable[..., None]) -> None:
    """Draw a search field that passes its text to `select` as ``search``."""
    with element("div", "vf-search"):
        made = ui.input(
            placeholder=words,
            value=searched,
            on_change=lambda event: select(search=str(event.value or "")),
        ).props("dense outlined clearable debounce=250 type=search")
        made.props["aria-label"] = "Search"


def redraw(body: ui.element, draw: Callable[[], object]) -> None:
    """Redraw the content of an element."""
    body.clear()
    with body:
        draw()


def chip(state: str, word: str, letter: str = "") -> ui.element:
    """Show a state by a colour, a word and its NE 107 letter, if any."""
    with element("span", f"vf-chip vf-{state}") as made:
        if letter:
            text("b", letter, "vf-ne")
        ui.label(word)
    return made


class AnswerLine(ui.label):
    """The line with the outcome of a request; hidden until then."""

    def __init__(self) -> None:
        super().__init__("")
        self.classes("vf-answer").props["role"] = "status"
        self.set_visibility(False)

    def say(self, state: str, words: str) -> None:
        """Show words in the state ``busy``, ``ok`` or ``error``."""
        self.classes(replace=f"vf-answer vf-answer-{state}")
        self.set_visibility(True)
        self.set_text(words)

    def tell(self, success: bool, words: str) -> None:
        """Show the answer of a service."""
        self.say("ok" if success else "error", printable(words, 500))


async def agreed(
    name: str,
    title: str,
    draw: Callable[[], None],
    answers: tuple[str, str],
    cancel: str = "flat no-caps autofocus",
) -> bool:
    """Ask in a dialog, filled by `draw`; return whether the second answer was chosen."""
    with ui.dialog() as dialog, ui.card().classes("vf-dialog"):
        dialog.props["aria-label"] = name
        ui.label(title).classes("vf-dialog-title")
        draw()
        with element("div", "vf-actions"):
            no, yes = answers
            ui.button(no, on_click=lambda: dialog.submit(False), color=None).props(cancel)
            confirm = ui.button(yes, on_click=lambda: dialog.submit(True), color=None)
            confirm.props("unelevated no-caps").classes("vf-act-first")
    is_agreed = bool(await dialog)
    if not dialog.is_deleted:  # the visitor may have left meanwhile
        dialog.delete()
    return is_agreed


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


def table_head(*titles: tuple[str, str]) -> None:
    """Draw the head of a table: title and style of each column."""
    with element("thead"), element("tr"):
        for title, css in titles:
            text("th", title, css).props["scope"] = "col"


def table_row(*cells: tuple[str, str], css: str = "") -> ui.element:
    """Draw a row of a table: text and style of each cell."""
    with element("tr", css) as made:
        for words, style in cells:
            text("td", words, style)
    return made


def table(titles: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
    """Draw a table of texts."""
    with element("table", "vf-list"):
        table_head(*((title, "") for title in titles))
        with element("tbody"):
            for row in rows:
                table_row(*((words, "") for words in row))


class EntryList:
    """Values with their names and units, or a text without values; only changes are redrawn."""

    def __init__(self, empty: str) -> None:
        self._empty = empty
        self._body = element("div", "vf-entries")
        self._names: tuple[str, ...] | None = None
        self._values: list[TextElement] = []

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
                    self._values.append(text("dd", "", "vf-dd-long" if long else ""))
