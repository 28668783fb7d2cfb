# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A real browser for the pages of the dashboard."""

import contextlib
import shutil
from urllib.parse import urlsplit

import pytest

TIMEOUT = 40_000
"""Time for one thing to happen on a loaded machine, ms."""


@contextlib.contextmanager
def chromium():
    """The system's Chromium, started once; skips the tests where it is not there."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        pytest.skip("there is no Chromium")
    with playwright.sync_playwright() as engine:
        browser = engine.chromium.launch(executable_path=path, args=["--no-sandbox"])
        try:
            yield browser
        finally:
            browser.close()


class Tab:
    """A tab of the browser, and what went wrong in it: errors, and requests to other machines."""

    def __init__(self, browser, address):
        self.address = address
        self.page = browser.new_page()
        self.page.set_viewport_size({"width": 1400, "height": 900})
        self.page.set_default_timeout(TIMEOUT)
        self.errors, self.strangers, self.dialogs = [], [], []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", self._note_request)
        self.page.on("dialog", self._note_dialog)

    def _note_request(self, request):
        parts = urlsplit(request.url)
        if parts.scheme not in ("data", "blob") and parts.hostname != "127.0.0.1":
            self.strangers.append(request.url)

    def _note_dialog(self, dialog):
        self.dialogs.append(dialog.message)
        dialog.dismiss()

    def open(self, path):
        """Open a page of the dashboard."""
        self.page.goto(self.address + path)
        return self.page

    def close(self):
        """Close it; it must have seen no error, no other machine and no dialog of a script."""
        self.page.close()
        assert not self.errors
        assert not self.strangers
        assert not self.dialogs


def axe_violations(page):
    """Return what axe-core finds wrong with a page at rest, a text for each rule; skips without it.

    A page that is still being drawn has colours and places of its own. Of a page with a dialog the
    dialog counts: what is behind it cannot be used.
    """
    axe = pytest.importorskip(
        "axe_playwright_python.sync_playwright", reason="axe is not installed"
    )
    found, part = [], ".q-dialog" if page.locator(".q-dialog").count() else None
    for _ in range(5):
        page.wait_for_function("document.getAnimations().every(one => one.playState != 'running')")
        found = axe.Axe().run(page, part).response["violations"]
        if not found:
            break
    return [
        f"{one['id']} ({one['impact']}) ×{len(one['nodes'])}: {one['nodes'][0]['html'][:160]}: "
        f"{one['nodes'][0]['failureSummary']}"
        for one in found
    ]
