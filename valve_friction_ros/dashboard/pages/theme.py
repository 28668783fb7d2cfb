"""The frame of every page: style, bar with navigation, zone and theme."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlencode
from zoneinfo import ZoneInfo

from nicegui import ui

from valve_friction_ros.dashboard.board import Board
from valve_friction_ros.dashboard.pages.plant_table import AddressBar
from valve_friction_ros.dashboard.times import zone_asked

__all__ = ["Frame", "element", "frame", "load_style"]

_STYLE = Path(__file__).with_name("dashboard.css")
_THEMES: dict[str, bool | None] = {"auto": None, "light": False, "dark": True}
_COMMON = ("tz", "theme")


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
    board: Board, query: Mapping[str, str], title: str, here: Callable[[dict[str, str]], str]
) -> Iterator[Frame]:
    """Draw the frame of a page; `here` returns its address with other common parts."""
    zone = zone_asked(query, board.options.time_zone)
    theme = query.get("theme", "auto")
    common = {key: query[key] for key in _COMMON if query.get(key)}
    ui.page_title(title)
    ui.dark_mode(_THEMES.get(theme))
    address = AddressBar()
    _link("Skip to the content", "#content").classes("vf-skip")
    with element("header", "vf-bar-top"):
        with element("nav", "vf-nav", aria_label="Pages"):
            element("span", "vf-mark", aria_hidden="true")
            for text, path in (("Plant", "/"), ("Compare", "/compare")):
                is_here = here({}).partition("?")[0] == path
                made = _link(text, f"{path}?{urlencode(common)}" if common else path)
                if is_here:
                    made.props["aria-current"] = "page"
        with element("div", "vf-bar-right"):
            clock = ui.label("").classes("vf-clock")
            clock.props["aria-label"] = "time of day"
            _choice("Time zone", _zones(board, zone), zone.key, "tz", common, here)
            _choice("Theme", tuple(_THEMES), theme, "theme", common, here)
            _account(board)
    with element("main", "vf-main", id="content", tabindex="-1"):
        yield Frame(zone, common, address, clock)


def _zones(board: Board, zone: ZoneInfo) -> tuple[str, ...]:
    return tuple(dict.fromkeys(("UTC", board.options.time_zone, zone.key, *_OFTEN)))


_OFTEN = ("Europe/London", "Europe/Berlin", "America/New_York", "America/Chicago",
          "Asia/Kolkata", "Asia/Shanghai", "Asia/Tokyo", "Australia/Sydney")  # fmt: skip


def _account(board: Board) -> None:
    """Show who has logged in, and a button to log out."""
    name = board.visitors.name()
    if name:
        ui.label(name).classes("vf-account").props["aria-label"] = "logged in"
        out = ui.button("Log out", on_click=board.visitors.log_out, color=None)
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
