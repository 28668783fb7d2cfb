# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""The dashboard before 500 valves, in a real browser: `make load`."""

import argparse
import contextlib
import math
import os
import random
import shutil
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from playwright.sync_api import Browser, BrowserContext, Error, Page, sync_playwright
from rclpy.serialization import serialize_message

from benchmark.harness.processes import Process, free_port, module, parameters, running
from benchmark.harness.rows import Row, at_most, judged, opened_console, rows_table
from benchmark.harness.run import Participant, own_folder, quiet_domain
from benchmark.load_plant import identifier_of, ratio_of, tag_of
from valve_friction_ros.health import (
    AlarmKind,
    Baseline,
    Condition,
    Diagnosis,
    FrictionLimits,
    Level,
    MonitorSettings,
    StatusSignal,
    compared,
)
from valve_friction_ros.history import HistoryEntry, HistoryFile, KeptValve, follow_alarms
from valve_friction_ros.history.database import writing
from valve_friction_ros.history.entry import Fit, Span, settings_text
from valve_friction_ros.history.rows import insert_entry, valve_id
from valve_friction_ros.identification import Parameter, Verdict
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.nodes.service_call import caller
from valve_friction_ros.streams import DAY
from valve_friction_ros.wording import quoted

_EVERY = 7 * DAY
_GROWN = Condition(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown")
_SETTINGS = settings_text(MonitorSettings(BENCH_VALVE))


def _parameter(name: str, value: float, share: float = 0.02) -> Parameter:
    half_width = share * value
    return Parameter(name, value, half_width / 2, half_width, Verdict.IDENTIFIED, "")


def _entry(
    valve: KeptValve, baseline: Baseline | None, friction: float, stamp: int
) -> HistoryEntry:
    parameters = {
        "mass": Parameter("mass", 1.6, 0.0, 0.0, Verdict.FIXED, "assumed"),
        "viscous_friction": _parameter("viscous_friction", 5300.0),
        "coulomb_friction": _parameter("coulomb_friction", friction),
        "spring_constant": _parameter("spring_constant", 2.05e5),
        "spring_preload": _parameter("spring_preload", 231.0),
    }
    found = None if baseline is None else compared(parameters, math.nan, baseline)
    words = "friction normal: the stem ignores reversals smaller than 9 % of its travel"
    return HistoryEntry(
        time=stamp,
        valve=valve,
        span=Span(stamp - 60_000_000_000, stamp),
        method="plant",
        diagnosis=Diagnosis(Level.OK, StatusSignal.GOOD, quoted(words), found and found.ratio),
        limits=FrictionLimits(),
        baseline=baseline,
        settings=_SETTINGS,
        parameters=parameters,
        fit=Fit(0.99, 1e-5, 1e-6),
    )


def write_history(path: Path, valves: int, weeks: int = 52) -> None:
    """Write a history file with weekly identifications and an alarm for each valve."""
    now = time.time_ns()
    with writing(path) as connection:
        for index in range(valves):
            chance = random.Random(index)
            valve = KeptValve(identifier_of(index), tag_of(index))
            number, healthy = valve_id(connection, valve), chance.uniform(150, 900)
            ratio = ratio_of(index)
            baseline = None if ratio is None else Baseline(healthy, 0.02 * healthy)
            change = (ratio or 1.0) - 1
            for week in range(weeks):
                share = max(0.0, 2 * week / weeks - 1)
                friction = healthy * (1 + change * share) * chance.gauss(1.0, 0.01)
                stamp = now - (weeks - week) * _EVERY
                insert_entry(connection, number, _entry(valve, baseline, friction, stamp))
    for index in range(valves):
        valve = KeptValve(identifier_of(index), tag_of(index))
        follow_alarms(HistoryFile(path), valve, {AlarmKind.FRICTION_HIGH: _GROWN}, now)


LIVE = "/live_1/identifier"
"""The identifier of the real valve."""
_RECORD = 14.0
"""Length of its record, s: more than one period of the pressure."""
_ANSWER = 600.0
_PATIENCE = 60.0
_FIRST_SCREEN = 40
"""Number of rows on a tall screen."""
ALL_HEARD = " && ".join(
    f"document.querySelector('.vf-filter.vf-{one} .vf-count')?.innerText === '0'"
    for one in ("silent", "unheard")
)
"""Whether a plant page shows all valves as heard."""
_LOOK = """
(() => {
  const look = () => {
    let ready = false;
    try { ready = Boolean(window.did_handshake && (%s)); } catch (error) { ready = false; }
    if (ready) window.__ready = performance.now(); else requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
})()"""
"""Checks at each animation frame whether the page is ready: drawn and connected."""


class Stage:
    """Starts and keeps the processes; the folder contains history and logs."""

    def __init__(self, folder: Path, valves: int, say: Callable[[str], None]) -> None:
        self.folder, self.valves, self.say, self._port = folder, valves, say, free_port()
        self.address = f"http://127.0.0.1:{self._port}"
        self.processes: list[Process] = []
        self._history = folder / "history.sqlite"
        self._template = folder / "status.cdr"

    def _start(self, name: str, *arguments: str) -> Process:
        log = self.folder / f"{name.rpartition('.')[2]}_{len(self.processes) + 1}.log"
        made = Process(module(name, *arguments), log)
        self.processes.append(made)
        return made

    def _node(self, name: str, place: str, **given: object) -> Process:
        words = ["--ros-args", "--log-level", "info", *(["-r", f"__ns:={place}"] if place else [])]
        return self._start(f"valve_friction_ros.nodes.{name}", *words, *parameters(**given))

    def identifier(self, tag: str) -> None:
        """Start the identifier of the real valve with a tag."""
        known = {"valve_tag": tag, "history_file": self._history, "window": 60.0}
        self.live = self._node("identifier", "/live_1", **known)

    def show(self) -> None:
        """Start the dashboard, and wait until it can be opened."""
        known = {"port": self._port, "history_file": self._history}
        self.dashboard = self._node("dashboard", "", **known)
        self.dashboard.wait_for("ready: open")

    @contextlib.contextmanager
    def shown(self, *more: str) -> Iterator[None]:
        """Provide a plant shown by the dashboard."""
        given = ("--valves", str(self.valves), *more)
        with self._start("benchmark.load_plant", str(self._template), *given) as plant:
            plant.wait_for("publishing")
            self.show()
            yield
        self.dashboard.end()

    def prepare(self) -> None:
        """Write the history, and record a real status as template for the simulated valves."""
        self.say(f"writing the history of {self.valves} valves")
        write_history(self._history, self.valves)
        self.say("identifying a simulated valve by real nodes")
        self.identifier("LIVE-1")
        self._node("simulator", "/live_1", position_noise=1e-5, noise_seed=1)
        drive = {"excitation": "sine", "sample_rate": 100.0, "pressure_noise": 20.0}
        self._node("pressure_source", "/live_1", **drive, noise_seed=2)
        with caller(lambda: True) as client:
            identifier = client.find(LIVE, _ANSWER)
            time.sleep(_RECORD)
            for service in ("identify", "set_baseline"):
                answer = client.call(identifier, service, _ANSWER)
                if answer is None or not answer.success:
                    raise RuntimeError(f"{service}: {answer}")
        self._template.write_bytes(_heard())


def _heard() -> bytes:
    """Return the next status of the real valve with a ratio, serialised."""
    found: list[DiagnosticStatus] = []

    def note(message: DiagnosticArray) -> None:
        found.extend(
            status
            for status in message.status
            if any(value.key == "friction_ratio" for value in status.values)
        )

    with Participant("listener") as listener:
        listener.node.create_subscription(DiagnosticArray, "/diagnostics", note, 100)
        if not listener.wait(lambda: bool(found), _ANSWER):
            raise RuntimeError(f"{LIVE} says no ratio of its friction")
    return serialize_message(found[-1])


class Visit(NamedTuple):
    """A page to measure: its path, and an expression that is true once it is complete."""

    name: str
    path: str
    is_ready: str


def pages_of(valves: int, identifier: str) -> tuple[Visit, ...]:
    """Return the pages to visit for a plant of `valves` valves and for one identifier."""
    node = quote(identifier)
    valve = (
        "document.querySelector('.vf-parameters') "
        "&& document.querySelector('.vf-chart-trend canvas')"
    )
    compared = "document.querySelector('.vf-compared tbody')"
    screen = min(valves, _FIRST_SCREEN)
    plant = f"document.querySelectorAll('.vf-row, .vf-tile').length >= {screen}"
    alarms = f"document.querySelectorAll('.vf-alarm-list tbody tr').length >= {screen}"
    return (
        Visit("plant, table", "/", plant),
        Visit("plant, tiles", "/?view=tiles", plant),
        Visit("valve", f"/valve?node={node}", valve),
        Visit("compare", f"/compare?a={node}&b={node}", compared),
        Visit("alarms", "/alarms", alarms),
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
    """Open a page in a new tab; return the time until it is ready, s, and the tab."""
    page = context.new_page()
    page.add_init_script(_LOOK % one.is_ready)
    page.goto(address + one.path, wait_until="commit")
    ready = page.wait_for_function("window.__ready", timeout=1e3 * _PATIENCE)
    return float(ready.json_value()) / 1e3, page


def wait_on_page(page: Page, expression: str) -> None:
    """Wait until an expression is true, even across reloads."""
    end = time.monotonic() + _PATIENCE
    while time.monotonic() < end:
        with contextlib.suppress(Error):  # the page is loading
            if page.evaluate(f"Boolean({expression})"):
                return
        page.wait_for_timeout(20)
    raise RuntimeError(f"not within {_PATIENCE:g} s: {expression}")


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


_PARTS = ("bounds", "picture")
_SETTLE = 2500
"""Time for a page to finish drawing, ms."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="load", description=__doc__)
    parser.add_argument("--parts", nargs="+", choices=_PARTS, default=_PARTS[:1])
    parser.add_argument("--valves", type=int, default=500)
    parser.add_argument("--seconds", type=float, default=60.0, help="of each usage (%(default)g)")
    parser.add_argument("--repeats", type=int, default=5, help="of each time (%(default)s)")
    parser.add_argument("--folder", type=Path, help="of history and logs; default: a new one")
    return parser


def _take_manual_picture(stage: Stage, browser: Browser, path: Path) -> None:
    with browser.new_context(viewport={"width": 1400, "height": 700}) as context:
        page = context.new_page()
        page.goto(f"{stage.address}/?theme=light")
        wait_on_page(page, "document.querySelector('.vf-row')")
        page.wait_for_timeout(_SETTLE)
        page.screenshot(path=path)


def _measured(options: argparse.Namespace, stage: Stage) -> Iterator[tuple[str, list[Row]]]:
    """Run the parts, each with its own plant."""
    with running(stage.processes), launched() as launch:
        stage.prepare()
        if "bounds" in options.parts:
            with stage.shown():
                yield "bounds", list(bound_rows(stage, launch, options.seconds, options.repeats))
        if "picture" in options.parts:
            with stage.shown("--still"):
                _take_manual_picture(stage, launch(), stage.folder / "dashboard.png")


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
