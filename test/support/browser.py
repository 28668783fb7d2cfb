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

    def __init__(self, browser, address, width=1400, height=900):
        self.address = address
        self.page = browser.new_page(viewport={"width": width, "height": height})
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
