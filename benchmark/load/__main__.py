# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The dashboard before 500 valves, in a real browser: python -m benchmark.load, or `make load`."""

import argparse
import itertools
import os
import random
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

import numpy as np
from playwright.sync_api import Browser, Page

from benchmark.harness.processes import running
from benchmark.harness.rows import Row, at_most, judged, none, opened_console, rows_table, under
from benchmark.harness.run import own_folder, quiet_domain
from benchmark.load.plant import identifier_of
from benchmark.load.stage import (
    ALL_HEARD,
    LIVE,
    Stage,
    Visit,
    launched,
    pages_of,
    visit,
    wait_on_page,
)

_LOOK = 10.0
_SETTLED = 0.3
"""Share of the run after which all caches are filled."""
_GROWTH = 10.0
"""Largest growth of steady memory after that, MB. Chosen: 5 % of the bound."""
_TABS = 4
_PATIENCE = 60_000.0
"""Longest time for a page to connect, ms."""


class _Look(NamedTuple):
    """Resources of the dashboard at a time, s, and the number of pages opened so far."""

    time: float
    memory: float
    threads: int
    files: int
    pages: int
    heap: float


def _heap(page: Page) -> float:
    """Return the memory of a page's scripts in the browser, MB."""
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
        """Open a page in a new or an existing tab, reload a tab, or close one."""
        self.pages += 1
        chance = self._chance.random()
        if not self._tabs or (chance < 0.4 and len(self._tabs) < _TABS):
            context = self._browser.new_context()
            self._tabs.append(visit(context, self._stage.address, self._draw())[1])
        elif chance < 0.75:
            tab = self._chance.choice(self._tabs)
            tab.goto(self._stage.address + self._draw().path, wait_until="commit")
            # An evaluation on a page that is being left may never return.
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
    """Return the growth of a straight line fitted to the values."""
    return float(np.polyfit(times, values, 1)[0] * (times[-1] - times[0]))


def afternoon_rows(stage: Stage, browser: Browser, minutes: float, seed: int) -> Iterator[Row]:
    """Use the dashboard for some minutes, and compare its early and late resources."""
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


_READY = 1.0
_ACKNOWLEDGED = 2.0
_HEALED = 5.0
_CORES = 0.25
_MEMORY = 200.0
_QUIET_FOR = 5.0


def _times_row(item: str, times: Sequence[float], limit: float) -> Row:
    """Return the longest of several times, with their median as peer."""
    return at_most(item, max(times), "s", limit, statistics.median(times), "median")


def _ready(browser: Browser, address: str, one: Visit, repeats: int) -> Iterator[Row]:
    """Measure first visits, without a cache, and later visits."""
    first, later = [], []
    for _ in range(repeats):
        with browser.new_context(viewport={"width": 1400, "height": 900}) as context:
            first.append(visit(context, address, one)[0])
            later.append(visit(context, address, one)[0])
    yield _times_row(f"{one.name}: ready, first visit", first, _READY)
    yield _times_row(f"{one.name}: ready, later visit", later, _READY)


def _acknowledged(browser: Browser, stage: Stage, alarms: Visit) -> Row:
    """Measure the time to acknowledge all alarms of the plant."""
    with browser.new_context() as context:
        page = visit(context, stage.address, alarms)[1]
        page.get_by_role("button", name="Acknowledge all").click()
        page.get_by_label("Your name").fill("A. Operator")
        begin = time.monotonic()
        page.get_by_role("button", name="Confirm").click()
        wait_on_page(page, "!document.body.innerText.includes('unacknowledged')")
        taken = time.monotonic() - begin
    return at_most(f"{stage.valves} alarms acknowledged", taken, "s", _ACKNOWLEDGED)


def _usage_rows(
    browser: Browser, stage: Stage, visits: Sequence[Visit], seconds: float
) -> Iterator[Row]:
    for opened, name in (
        ([], "no page open"),
        (visits[:1], "the plant open"),
        (visits, f"{len(visits)} pages open"),
    ):
        with browser.new_context() as context:
            for one in opened:
                visit(context, stage.address, one)
            time.sleep(_QUIET_FOR)
            before = stage.dashboard.usage()
            time.sleep(seconds)
            after = stage.dashboard.usage()
        yield at_most(f"{name}: processor", after.cores_since(before), "cores", _CORES)
        yield at_most(f"{name}: memory", after.memory, "MB", _MEMORY)


def _healed(stage: Stage, launch: Callable[[], Browser], repeats: int) -> Iterator[Row]:
    """Measure restarts after kill -9, from the kill until the page shows the new state."""
    plant = Visit("plant", "/?sort=-tag", pages_of(stage.valves, LIVE)[0].is_ready)
    is_live = f"{plant.is_ready} && window.did_handshake && {ALL_HEARD}"
    times: dict[str, list[float]] = {"identifier": [], "dashboard": [], "browser": []}
    started: list[float] = []
    for turn in range(repeats):
        begin = time.monotonic()
        browser = launch()
        with browser.new_context() as context:
            page = visit(context, stage.address, plant)[1]
            times["browser"].append(time.monotonic() - begin)
            wait_on_page(page, is_live)
            origin = page.evaluate("performance.timeOrigin")

            stage.dashboard.kill()
            begin = time.monotonic()
            stage.show()
            started.append(time.monotonic() - begin)
            wait_on_page(page, f"performance.timeOrigin !== {origin} && {is_live}")
            times["dashboard"].append(time.monotonic() - begin)

            tag = f"LIVE-{turn + 2}"
            stage.live.kill()
            begin = time.monotonic()
            stage.identifier(tag)
            wait_on_page(page, f"[...document.querySelectorAll('.vf-c-tag a')]"
                               f".some((one) => one.innerText === '{tag}')")  # fmt: skip
            times["identifier"].append(time.monotonic() - begin)
        browser.close()
    for name, some in times.items():
        yield _times_row(f"healed after a restart: {name}", some, _HEALED)
    yield Row("of it, until the dashboard listens", max(started), "s")


def bound_rows(
    stage: Stage, launch: Callable[[], Browser], seconds: float, repeats: int
) -> Iterator[Row]:
    """Measure all bounds at 1 Hz."""
    visits = pages_of(stage.valves, identifier_of(3))
    browser = launch()
    stage.say("waiting for all valves")
    with browser.new_context() as context:
        page = visit(context, stage.address, visits[0])[1]
        wait_on_page(page, ALL_HEARD)
    for one in visits:
        stage.say(f"opening {one.name}")
        yield from _ready(browser, stage.address, one, repeats)
    stage.say("acknowledging all alarms")
    yield _acknowledged(browser, stage, visits[-1])
    stage.say("what the dashboard takes")
    yield from _usage_rows(browser, stage, visits, seconds)
    browser.close()
    stage.say("restarts")
    yield from _healed(stage, launch, repeats)


_PARTS = ("bounds", "afternoon", "pictures")
_WIDTHS = {390: 844, 1280: 800, 2560: 1440}
_THEMES = ("light", "dark")
_SIGNALS = 20_000
"""Time for the signals of a valve to fill their charts, ms."""
_SETTLE = 2500
"""Time for a page to finish drawing, ms."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="load", description=__doc__)
    parser.add_argument("--parts", nargs="+", choices=_PARTS, default=_PARTS[:2])
    parser.add_argument("--valves", type=int, default=500)
    parser.add_argument("--seconds", type=float, default=60.0, help="of each usage (%(default)g)")
    parser.add_argument("--repeats", type=int, default=5, help="of each time (%(default)s)")
    parser.add_argument("--minutes", type=float, default=25.0, help="of use (%(default)g)")
    parser.add_argument("--rate", type=float, default=5.0, help="Hz of that use (%(default)g)")
    parser.add_argument("--seed", type=int, default=1, help="of that use (%(default)s)")
    parser.add_argument("--folder", type=Path, help="of history and logs; default: a new one")
    return parser


def _take_manual_picture(stage: Stage, browser: Browser, path: Path) -> None:
    stage.say("the picture of the manual")
    with browser.new_context(viewport={"width": 1400, "height": 700}) as context:
        page = context.new_page()
        page.goto(f"{stage.address}/?theme=light")
        wait_on_page(page, "document.querySelector('.vf-row')")
        page.wait_for_timeout(_SETTLE)
        page.screenshot(path=path)


def _picture_rows(stage: Stage, browser: Browser, folder: Path) -> Iterator[Row]:
    """Take pictures of all pages for inspection; count pages wider than their window."""
    folder.mkdir(parents=True, exist_ok=True)
    live, other = quote(LIVE), quote(identifier_of(2))
    pages = {
        "plant": "/?",
        "tiles": "/?view=tiles",
        "nothing": "/?q=xyzzy",
        "valve": f"/valve?node={live}",
        "grown": f"/valve?node={other}",
        "unknown": f"/valve?node={quote('/area_9/no_such_valve/identifier')}",
        "compare": f"/compare?a={live}&b={other}",
    }
    wide, taken = 0, 0
    for name, path in pages.items():
        stage.say(f"picture of {name}")
        settle = _SIGNALS if name == "valve" else _SETTLE
        for theme, (width, height) in itertools.product(_THEMES, _WIDTHS.items()):
            with browser.new_context(viewport={"width": width, "height": height}) as context:
                page = context.new_page()
                page.goto(f"{stage.address}{path}&theme={theme}")
                wait_on_page(page, "window.did_handshake")
                page.wait_for_timeout(settle)
                wide += page.evaluate("document.documentElement.scrollWidth > innerWidth")
                page.screenshot(path=folder / f"{name}_{width}_{theme}.png", full_page=True)
            settle, taken = _SETTLE, taken + 1
    yield Row("pictures taken", taken)
    yield none("pages wider than their window", wide)


def _measured(options: argparse.Namespace, stage: Stage) -> Iterator[tuple[str, list[Row]]]:
    """Run the parts, each with its own plant."""
    with running(stage.processes), launched() as launch:
        stage.prepare()
        if "bounds" in options.parts:
            with stage.shown(1.0):
                yield "bounds", list(bound_rows(stage, launch, options.seconds, options.repeats))
        if "afternoon" in options.parts:
            with stage.shown(options.rate):
                use = afternoon_rows(stage, launch(), options.minutes, options.seed)
                yield "afternoon", list(use)
        if "pictures" in options.parts:
            browser = launch()
            with stage.shown(1.0, "--still") as plain:
                _take_manual_picture(stage, browser, stage.folder / "dashboard.png")
                plain.end()
                stage.plant(1.0, "--still", "--awkward")
                pictures = _picture_rows(stage, browser, stage.folder / "pictures")
                yield "pictures", list(pictures)


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure; return 1 if a goal is missed."""
    options, console = _parser().parse_args(arguments), opened_console()

    def say(line: str) -> None:
        load = ", ".join(f"{one:.2f}" for one in os.getloadavg())
        console.print(f"{line} (load {load})", highlight=False)

    with quiet_domain():
        stage = Stage(own_folder("load", options.folder), options.valves, say)
        found = dict(_measured(options, stage))
    console.print(f"logs in {stage.folder}", soft_wrap=True)
    for part, rows in found.items():
        console.print(rows_table(f"{part}: {options.valves} valves", rows))
    return judged([row for rows in found.values() for row in rows], console)


if __name__ == "__main__":
    sys.exit(main())
