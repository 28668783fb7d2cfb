# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Cost of identification, with peers for comparison: `make bench`."""

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from benchmark.harness.rows import (
    Row,
    judged,
    logged,
    new_file,
    opened_console,
    rows_table,
    write_json,
)
from benchmark.harness.run import quiet_domain
from benchmark.speed.live import PROFILE, many_valves, streams
from benchmark.speed.many_recordings import fleet
from benchmark.speed.offline import Settings, identification, simulation, sweep

_DEMO = Path(__file__).resolve().parents[2] / "valve_friction_ros" / "commands" / "demo"
_PARTS: dict[str, Callable[[Settings], Iterator[Row]]] = {
    one.__name__: one for one in (fleet, identification, many_valves, simulation, streams, sweep)
}
"""Parts by name, which yield each row as soon as it is measured; the first line of the docstring is
the title."""


def _parser() -> argparse.ArgumentParser:
    parser, usual = argparse.ArgumentParser(prog="bench", description=__doc__), Settings()
    add = parser.add_argument
    add("--parts", nargs="+", choices=_PARTS, default=[*_PARTS], help="what to run")
    add("--repeats", type=int, default=usual.repeats, help="of each; their median counts")
    add("--seconds", type=float, default=usual.seconds, help="how long each stream runs")
    add("--output", type=new_file, default=Path("speed.json"), help="where to write the rows")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the requested parts; return 1 if a goal is missed."""
    options = _parser().parse_args(arguments)
    console = opened_console()
    os.environ[PROFILE] = str(_DEMO / "fast_discovery.xml")
    measured: dict[str, list[Row]] = {}
    with quiet_domain():
        for name in options.parts:
            part = _PARTS[name]
            title = (part.__doc__ or "").splitlines()[0].rstrip(".")
            rows = measured[name] = []
            with console.status(title) as status:
                settings = Settings(options.repeats, options.seconds, status.update)
                logged(part(settings), rows, console)
            console.print(rows_table(title, rows))
            write_json(measured, options.output)
    return judged([row for rows in measured.values() for row in rows], console)


if __name__ == "__main__":
    sys.exit(main())
