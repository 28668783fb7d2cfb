# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The bounds of the dashboard: how soon it is ready, what it takes, how soon it heals."""

import statistics
import time
from collections.abc import Callable, Iterator, Sequence

from playwright.sync_api import Browser

from benchmark.load.browser import Visit, pages_of, visit, wait_on_page
from benchmark.load.plant import identifier_of
from benchmark.load.processes import Process
from benchmark.load.stage import LIVE, Stage
from benchmark.speed.rows import Row

__all__ = ["bound_rows"]

_READY = 1.0
_HEALED = 5.0
_CORES = 0.25
_MEMORY = 200.0
_SETTLE = 5.0
_Say = Callable[[str], None]


def _row(item: str, times: Sequence[float], limit: float) -> Row:
    """Return the longest of some times, beside their median."""
    longest = max(times)
    goal = f"at most {limit:g} s"
    return Row(item, longest, "s", statistics.median(times), "median", goal, longest <= limit)


def _ready(browser: Browser, address: str, one: Visit, repeats: int) -> Iterator[Row]:
    """Measure first visits, with nothing kept, and later ones."""
    first, later = [], []
    for _ in range(repeats):
        with browser.new_context(viewport={"width": 1400, "height": 900}) as context:
            first.append(visit(context, address, one)[0])
            later.append(visit(context, address, one)[0])
    yield _row(f"{one.name}: ready, first visit", first, _READY)
    yield _row(f"{one.name}: ready, later visit", later, _READY)


def _usage(process: Process, seconds: float) -> tuple[float, float]:
    """Return the cores that a process uses for some seconds, and its memory after them, MB."""
    time.sleep(_SETTLE)
    begin, used = time.monotonic(), process.processor()
    time.sleep(seconds)
    cores = (process.processor() - used) / (time.monotonic() - begin)
    return cores, process.memory()


def _usage_rows(
    browser: Browser, stage: Stage, process: Process, visits: Sequence[Visit], seconds: float
) -> Iterator[Row]:
    for opened, name in (
        ([], "no page open"),
        (visits[:1], "the plant open"),
        (visits, f"{len(visits)} pages open"),
    ):
        with browser.new_context() as context:
            for one in opened:
                visit(context, stage.address, one)
            cores, memory = _usage(process, seconds)
        goal = f"at most {_CORES:g} cores"
        yield Row(f"{name}: processor", cores, "cores", goal=goal, met=cores <= _CORES)
        goal = f"at most {_MEMORY:g} MB"
        yield Row(f"{name}: memory", memory, "MB", goal=goal, met=memory <= _MEMORY)


def _healed(stage: Stage, launch: Callable[[], Browser], repeats: int) -> Iterator[Row]:
    """Measure restarts by kill -9, from the kill to the page that shows the new state."""
    plant = pages_of(stage.valves, LIVE)[0]
    is_live = (
        f"{plant.is_ready} && window.did_handshake "
        "&& !document.querySelector('.vf-is-silent, .vf-is-unheard')"
    )
    times: dict[str, list[float]] = {"identifier": [], "dashboard": [], "browser": []}
    started: dict[str, list[float]] = {"dashboard": []}
    for turn in range(repeats):
        begin = time.monotonic()
        browser = launch()
        with browser.new_context() as context:
            page = visit(context, stage.address, plant)[1]
            times["browser"].append(time.monotonic() - begin)
            wait_on_page(page, is_live)
            origin = page.evaluate("performance.timeOrigin")

            stage.dashboards[-1].kill()
            begin = time.monotonic()
            made = stage.dashboard()
            started["dashboard"].append(time.monotonic() - begin)
            wait_on_page(page, f"performance.timeOrigin !== {origin} && {is_live}")
            times["dashboard"].append(time.monotonic() - begin)
            del made

            tag = f"LIVE-{turn + 2}"
            stage.live.kill()
            begin = time.monotonic()
            stage.identifier(tag)
            wait_on_page(page, f"[...document.querySelectorAll('.vf-c-tag a')]"
                               f".some((one) => one.innerText === '{tag}')")  # fmt: skip
            times["identifier"].append(time.monotonic() - begin)
        browser.close()
    for name, some in times.items():
        yield _row(f"healed after a restart: {name}", some, _HEALED)
    yield Row("of it, until the dashboard listens", max(started["dashboard"]), "s")


def bound_rows(
    stage: Stage, launch: Callable[[], Browser], seconds: float, repeats: int, say: _Say
) -> Iterator[Row]:
    """Measure all bounds at 1 Hz."""
    visits = pages_of(stage.valves, identifier_of(3))
    browser = launch()
    say("waiting for all valves")
    with browser.new_context() as context:
        page = visit(context, stage.address, visits[0])[1]
        wait_on_page(page, "!document.querySelector('.vf-is-unheard')")
    for one in visits:
        say(f"opening {one.name}")
        yield from _ready(browser, stage.address, one, repeats)
    say("what the dashboard takes")
    yield from _usage_rows(browser, stage, stage.dashboards[-1], visits, seconds)
    browser.close()
    say("restarts")
    yield from _healed(stage, launch, repeats)
