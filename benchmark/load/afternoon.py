# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""An afternoon of use, pressed into minutes: pages come and go, and the memory shall stay."""

import itertools
import random
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

import numpy as np
from playwright.sync_api import Browser, Page

from benchmark.harness.rows import Row, under
from benchmark.load.plant import identifier_of
from benchmark.load.stage import LIVE, Stage, Visit, pages_of, visit

_LOOK = 10.0
_SETTLED = 0.3
"""Share of the time after which all that is kept once has been kept."""
_GROWTH = 10.0
"""Growth of the memory from then on, MB, that counts as steady. Chosen: 5 % of the bound."""
_TABS = 4
_PATIENCE = 60_000.0
"""Longest time until a page is connected, ms."""


class _Look(NamedTuple):
    """What the dashboard holds at a time, s, and how many pages were opened until then."""

    time: float
    memory: float
    threads: int
    files: int
    pages: int
    heap: float


def _heap(page: Page) -> float:
    """Return the memory that a page's scripts hold in the browser, MB."""
    session = page.context.new_cdp_session(page)
    session.send("HeapProfiler.collectGarbage")
    session.send("Performance.enable")
    metrics = {
        one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]
    }
    session.detach()
    return float(metrics["JSHeapUsedSize"]) / 1e6


class _Visitor:
    """Opens, uses and closes tabs."""

    def __init__(self, browser: Browser, stage: Stage, seed: int) -> None:
        self._browser, self._stage = browser, stage
        self._chance = random.Random(seed)
        self._tabs: list[Page] = []
        self.pages = 0

    def _draw(self) -> Visit:
        valve = LIVE if self._chance.random() < 0.3 else identifier_of(
            self._chance.randrange(self._stage.valves)
        )  # fmt: skip
        return self._chance.choice(pages_of(self._stage.valves, valve)[1:] + _searches())

    def turn(self) -> None:
        """Open a page, in a new tab or in one that is there, or use one, or close one."""
        self.pages += 1
        chance = self._chance.random()
        if not self._tabs or (chance < 0.4 and len(self._tabs) < _TABS):
            context = self._browser.new_context()
            self._tabs.append(visit(context, self._stage.address, self._draw())[1])
        elif chance < 0.75:
            tab = self._chance.choice(self._tabs)
            tab.goto(self._stage.address + self._draw().path, wait_until="commit")
            # An evaluation of a page that is just being left may never come back.
            tab.wait_for_function("window.did_handshake", polling=50, timeout=_PATIENCE)
        elif chance < 0.85:
            self._chance.choice(self._tabs).reload(wait_until="commit")
        else:
            tab = self._tabs.pop(self._chance.randrange(len(self._tabs)))
            tab.context.close()

    def close(self) -> None:
        for tab in self._tabs:
            tab.context.close()
        self._tabs.clear()


def _searches() -> tuple[Visit, ...]:
    drawn = "document.querySelector('.vf-row, .vf-tile')"
    return tuple(
        Visit("search", f"/?{query}", drawn)
        for query in (f"q={quote('12-fv')}", "show=error,warn", "ne=F&sort=-ratio", "view=tiles")
    )


def _looks(
    browser: Browser, stage: Stage, seconds: float, seed: int, file: Path
) -> Iterator[_Look]:
    visitor = _Visitor(browser, stage, seed)
    with browser.new_context() as context, file.open("w", encoding="utf-8") as written:
        wall = visit(context, stage.address, pages_of(stage.valves, LIVE)[0])[1]
        begin = time.monotonic()
        for due in itertools.count(1):
            while time.monotonic() < begin + due * _LOOK:
                visitor.turn()
            now = stage.dashboard.usage()
            held = (now.memory, now.threads, now.files, visitor.pages, _heap(wall))
            look = _Look(now.time - begin, *held)
            print(*look, sep=",", file=written, flush=True)
            stage.say(f"{look.time:.0f} s: {look.pages} pages, {look.memory:.1f} MB")
            yield look
            if look.time > seconds:
                break
        visitor.close()


def _growth(times: np.ndarray, values: np.ndarray) -> float:
    """Return by how much a straight line through the values grows over the times."""
    return float(np.polyfit(times, values, 1)[0] * (times[-1] - times[0]))


def afternoon_rows(stage: Stage, browser: Browser, minutes: float, seed: int) -> Iterator[Row]:
    """Use the dashboard for some minutes, and compare what it holds early and late."""
    file = stage.folder / "afternoon.csv"
    looks = np.array(list(_looks(browser, stage, 60 * minutes, seed, file)))
    late = looks[looks[:, 0] > _SETTLED * looks[-1, 0]]
    times = late[:, 0]
    yield Row("pages opened, used and closed", looks[-1, 4], "")
    yield Row("memory at the end", late[-1, 1], "MB", late[0, 1], "once settled")
    grown = _growth(times, late[:, 1])
    yield under("growth of the memory since then", grown, "MB", _GROWTH)
    for name, column in (("threads", 2), ("open files and sockets", 3)):
        yield Row(name, late[:, column].max(), "", late[0, column], "once settled")
        yield under(f"growth of the {name}", _growth(times, late[:, column]), "", 5)
    yield Row("the wall screen's own memory", late[-1, 5], "MB", late[0, 5], "once settled")
    yield under("growth of that", _growth(times, late[:, 5]), "MB", 5)
