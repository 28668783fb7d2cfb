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
import os
import socket
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from benchmark.load.afternoon import afternoon_rows
from benchmark.load.bounds import bound_rows
from benchmark.load.browser import launched
from benchmark.load.pictures import picture_rows, take_manual_picture
from benchmark.load.processes import running
from benchmark.load.stage import Stage
from benchmark.speed.rows import Row
from benchmark.speed.table import machine_shape, rows_table
from valve_friction_ros.commands.demo.bench import free_domain

__all__ = ["main"]

_PARTS = ("bounds", "afternoon", "pictures")

_WIDTH_OF_A_FILE = 120


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


def _free_port() -> int:
    with socket.socket() as tried:
        tried.bind(("127.0.0.1", 0))
        port: int = tried.getsockname()[1]
        return port


def _load() -> str:
    return f"load {', '.join(f'{one:.2f}' for one in os.getloadavg())}"


def _measured(options: argparse.Namespace, console: Console) -> dict[str, list[Row]]:
    """Run the parts, each before a plant of its own."""
    found: dict[str, list[Row]] = {}

    def say(line: str) -> None:
        console.print(f"{line} ({_load()})", highlight=False)

    folder = options.folder or Path(tempfile.mkdtemp(prefix="load_"))
    folder.mkdir(parents=True, exist_ok=True)
    stage = Stage(folder, options.valves, _free_port())
    with running(stage.processes), launched() as launch:
        stage.prepare(say)
        if "bounds" in options.parts:
            plant = stage.plant(1.0)
            stage.dashboard()
            found["bounds"] = list(bound_rows(stage, launch, options.seconds, options.repeats, say))
            plant.end()
            stage.dashboards[-1].end()
        if "afternoon" in options.parts:
            plant = stage.plant(options.rate)
            stage.dashboard()
            found["afternoon"] = list(
                afternoon_rows(stage, launch(), options.minutes, options.seed, say)
            )
            plant.end()
            stage.dashboards[-1].end()
        if "pictures" in options.parts:
            plain = stage.plant(1.0, "--still")
            stage.dashboard()
            browser = launch()
            say("the picture of the manual")
            take_manual_picture(stage, browser, folder / "dashboard.png")
            plain.end()
            stage.plant(1.0, "--still", "--awkward")
            found["pictures"] = list(picture_rows(stage, browser, folder / "pictures", say))
    console.print(f"logs in {folder}", soft_wrap=True)
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure; return 1 if a goal is missed."""
    options = _parser().parse_args(arguments)
    console = Console(width=None if sys.stdout.isatty() else _WIDTH_OF_A_FILE)
    console.print(", ".join(f"{name} {value}" for name, value in machine_shape().items()))
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    with free_domain() as domain:
        os.environ["ROS_DOMAIN_ID"] = str(domain)
        found = _measured(options, console)
    for part, rows in found.items():
        console.print(rows_table(f"{part}: {options.valves} valves", rows))
    return 1 if any(row.met is False for rows in found.values() for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
