# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Run the speed benchmark: python -m benchmark.speed, or `make bench`."""

import argparse
import importlib
import os
import pkgutil
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmark.harness.rows import Row, judged, logged, opened_console, rows_table, write_json
from benchmark.harness.run import quiet_domain
from benchmark.speed import parts
from benchmark.speed.measuring import Settings
from benchmark.speed.observer import PROFILE

_DEMO = Path(__file__).resolve().parents[2] / "valve_friction_ros" / "commands" / "demo"


def _parser() -> argparse.ArgumentParser:
    names = [module.name for module in pkgutil.iter_modules(parts.__path__)]
    usual = Settings()
    parser = argparse.ArgumentParser(prog="bench", description=__doc__)
    parser.add_argument("--parts", nargs="+", choices=names, default=names, help="what to run")
    parser.add_argument(
        "--repeats", type=int, default=usual.repeats, help="repetitions, of which the median counts"
    )
    parser.add_argument(
        "--seconds", type=float, default=usual.seconds, help="how long each stream runs"
    )
    parser.add_argument(
        "--output", type=Path, default=Path("speed.json"), help="where to write the rows"
    )
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the requested parts; return 1 if a goal is missed."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if not options.output.parent.is_dir():
        parser.error(f"{options.output}: there is no folder {options.output.parent}")
    console = opened_console()
    os.environ[PROFILE] = str(_DEMO / "fast_discovery.xml")
    measured: dict[str, list[Row]] = {}
    with quiet_domain():
        for name in options.parts:
            part = importlib.import_module(f"{parts.__name__}.{name}")
            title = part.__doc__.strip().splitlines()[0].rstrip(".")
            rows = measured[name] = []
            with console.status(title) as status:
                settings = Settings(options.repeats, options.seconds, status.update)
                logged(part.measure(settings), rows, console)
            console.print(rows_table(title, rows))
            write_json(measured, options.output)
    return judged([row for rows in measured.values() for row in rows], console)


if __name__ == "__main__":
    sys.exit(main())
