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

from benchmark.harness.rows import Row, at_most
from benchmark.load.plant import identifier_of
from benchmark.load.stage import ALL_HEARD, LIVE, Stage, Visit, pages_of, visit, wait_on_page

_READY = 1.0
_ACKNOWLEDGED = 2.0
_HEALED = 5.0
_CORES = 0.25
_MEMORY = 200.0
_SETTLE = 5.0


def _row(item: str, times: Sequence[float], limit: float) -> Row:
    """Return the longest of some times, beside their median."""
    return at_most(item, max(times), "s", limit, statistics.median(times), "median")


def _ready(browser: Browser, address: str, one: Visit, repeats: int) -> Iterator[Row]:
    """Measure first visits, with nothing kept, and later ones."""
    first, later = [], []
    for _ in range(repeats):
        with browser.new_context(viewport={"width": 1400, "height": 900}) as context:
            first.append(visit(context, address, one)[0])
            later.append(visit(context, address, one)[0])
    yield _row(f"{one.name}: ready, first visit", first, _READY)
    yield _row(f"{one.name}: ready, later visit", later, _READY)


def _acknowledged(browser: Browser, stage: Stage, alarms: Visit) -> Row:
    """Measure how long all alarms of the plant take to be acknowledged."""
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
            time.sleep(_SETTLE)
            before = stage.dashboard.usage()
            time.sleep(seconds)
            after = stage.dashboard.usage()
        yield at_most(f"{name}: processor", after.cores_since(before), "cores", _CORES)
        yield at_most(f"{name}: memory", after.memory, "MB", _MEMORY)


def _healed(stage: Stage, launch: Callable[[], Browser], repeats: int) -> Iterator[Row]:
    """Measure restarts by kill -9, from the kill to the page that shows the new state."""
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
        yield _row(f"healed after a restart: {name}", some, _HEALED)
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
