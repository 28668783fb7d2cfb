# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Pictures of all pages, at three widths, light and dark, to be looked at; one is the manual's."""

import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import quote

from playwright.sync_api import Browser

from benchmark.load.browser import wait_on_page
from benchmark.load.plant import identifier_of
from benchmark.load.stage import LIVE, Stage
from benchmark.speed.rows import Row

__all__ = ["picture_rows", "take_manual_picture"]

_WIDTHS = {390: 844, 1280: 800, 2560: 1440}
_THEMES = ("light", "dark")
_SIGNALS = 20_000
"""Time for the signals of a valve to fill their charts, ms."""
_SETTLE = 2500
"""Time for a page to draw all that comes after it, ms."""


def _pages() -> dict[str, str]:
    live, other = quote(LIVE), quote(identifier_of(2))
    return {
        "plant": "/?",
        "tiles": "/?view=tiles",
        "nothing": "/?q=xyzzy",
        "valve": f"/valve?node={live}",
        "grown": f"/valve?node={other}",
        "unknown": f"/valve?node={quote('/area_9/no_such_valve/identifier')}",
        "compare": f"/compare?a={live}&b={other}",
    }


def picture_rows(
    stage: Stage, browser: Browser, folder: Path, say: Callable[[str], None]
) -> Iterator[Row]:
    """Take all pictures into a folder; count the pages that are wider than their window."""
    folder.mkdir(parents=True, exist_ok=True)
    wide = taken = 0
    seen: set[str] = set()
    for name, path in _pages().items():
        say(f"picture of {name}")
        for theme, (width, height) in itertools.product(_THEMES, _WIDTHS.items()):
            with browser.new_context(viewport={"width": width, "height": height}) as context:
                page = context.new_page()
                page.goto(f"{stage.address}{path}&theme={theme}")
                wait_on_page(page, "window.did_handshake")
                is_first = name == "valve" and name not in seen
                page.wait_for_timeout(_SIGNALS if is_first else _SETTLE)
                seen.add(name)
                wide += page.evaluate("document.documentElement.scrollWidth > innerWidth")
                page.screenshot(path=folder / f"{name}_{width}_{theme}.png", full_page=True)
                taken += 1
    yield Row("pictures taken", taken, "")
    yield Row("pages wider than their window", wide, "", goal="none", met=wide == 0)


def take_manual_picture(stage: Stage, browser: Browser, path: Path) -> None:
    """Take the picture of the plant that the manual shows."""
    with browser.new_context(viewport={"width": 1400, "height": 700}) as context:
        page = context.new_page()
        page.goto(f"{stage.address}/?theme=light")
        wait_on_page(page, "document.querySelector('.vf-row')")
        page.wait_for_timeout(_SETTLE)
        page.screenshot(path=path)
