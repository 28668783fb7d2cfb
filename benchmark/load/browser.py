# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A real browser before the dashboard, and the times at which its pages are ready."""

import contextlib
import shutil
import time
from collections.abc import Callable, Iterator
from urllib.parse import quote

from playwright.sync_api import Browser, BrowserContext, Error, Page, sync_playwright

__all__ = ["Visit", "launched", "pages_of", "visit", "wait_on_page"]

_PATIENCE = 60.0
_FIRST_SCREEN = 40
"""Rows that a tall screen shows at once."""
_LOOK = """
(() => {
  const look = () => {
    let ready = false;
    try { ready = Boolean(window.did_handshake && (%s)); } catch (error) { ready = false; }
    if (ready) window.__ready = performance.now(); else requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
})()"""
"""Notes, each time that a picture is drawn, whether the page is ready: drawn, and connected."""


class Visit:
    """A page to measure: its path, and the expression that is true once it shows all it should."""

    def __init__(self, name: str, path: str, is_ready: str) -> None:
        self.name, self.path, self.is_ready = name, path, is_ready


def pages_of(valves: int, identifier: str) -> tuple[Visit, ...]:
    """Return the pages with what each shows of so many valves, and of one of them."""
    all_drawn = f"document.querySelectorAll('.vf-row, .vf-tile').length >= {valves}"
    node = quote(identifier)
    valve = (
        "document.querySelector('.vf-parameters') "
        "&& document.querySelector('.vf-chart-trend canvas')"
    )
    first_screen = f"document.querySelectorAll('.vf-row').length >= {min(valves, _FIRST_SCREEN)}"
    return (
        Visit("plant, table", "/", all_drawn),
        Visit("plant, tiles", "/?view=tiles", all_drawn),
        Visit("plant, first screen", "/", first_screen),
        Visit("valve", f"/valve?node={node}", valve),
        Visit(
            "compare", f"/compare?a={node}&b={node}", "document.querySelector('.vf-compared tbody')"
        ),
    )


@contextlib.contextmanager
def launched() -> Iterator[Callable[[], Browser]]:
    """Provide a function that starts the system's Chromium."""
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        raise RuntimeError("there is no Chromium: run `make browser`")
    with sync_playwright() as engine:
        yield lambda: engine.chromium.launch(executable_path=path, args=["--no-sandbox"])


def visit(context: BrowserContext, address: str, one: Visit) -> tuple[float, Page]:
    """Open a page in a new tab; return the time until it was ready, s, and the tab."""
    page = context.new_page()
    page.add_init_script(_LOOK % one.is_ready)
    page.goto(address + one.path, wait_until="commit")
    ready = page.wait_for_function("window.__ready", timeout=1e3 * _PATIENCE)
    return float(ready.json_value()) / 1e3, page


def wait_on_page(page: Page, expression: str, patience: float = _PATIENCE) -> float:
    """Wait until an expression is true, also over reloads; return the time that it took, s."""
    begin = time.monotonic()
    while time.monotonic() < begin + patience:
        with contextlib.suppress(Error):  # a page that is being loaded
            if page.evaluate(f"Boolean({expression})"):
                return time.monotonic() - begin
        page.wait_for_timeout(20)
    raise RuntimeError(f"not within {patience:g} s: {expression}")
