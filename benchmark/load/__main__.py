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
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.parse import quote

from playwright.sync_api import Browser

from benchmark.harness.processes import running
from benchmark.harness.rows import Row, judged, none, opened_console, rows_table
from benchmark.harness.run import own_folder, quiet_domain
from benchmark.load.afternoon import afternoon_rows
from benchmark.load.bounds import bound_rows
from benchmark.load.plant import identifier_of
from benchmark.load.stage import LIVE, Stage, launched, wait_on_page

_PARTS = ("bounds", "afternoon", "pictures")
_WIDTHS = {390: 844, 1280: 800, 2560: 1440}
_THEMES = ("light", "dark")
_SIGNALS = 20_000
"""Time for the signals of a valve to fill their charts, ms."""
_SETTLE = 2500
"""Time for a page to draw all that comes after it, ms."""


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
    """Take pictures of all pages, to be looked at; count those that are wider than their window."""
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
    """Run the parts, each before a plant of its own."""
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
