# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The full check of the accuracy requirements of an identification: `make accuracy`."""

import argparse
import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from itertools import product
from pathlib import Path

from rich.console import Console

from benchmark.bounds import (
    by_case,
    case_bounds,
    cases_table,
    information_table,
)
from benchmark.cases import (
    CONDITIONS,
    EXCITATIONS,
    NOISES,
    PLANTS,
    Case,
    Information,
    Outcome,
    information,
    run,
)
from benchmark.harness.rows import (
    Bound,
    bounds_table,
    in_parallel,
    judged,
    new_file,
    opened_console,
)

_KARNOPP = [name for name, plant in PLANTS.items() if plant.is_karnopp]

_Found = tuple[Sequence[Outcome | Information], list[Bound]]
"""What a part has measured, and its requirements with the figures reached."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="accuracy", description=__doc__)
    parts = sorted(_RUNS)
    parser.add_argument("--parts", nargs="+", choices=parts, default=parts, help="what to run")
    parser.add_argument("--seeds", type=int, default=20, help="records of the square wave")
    parser.add_argument("--other-seeds", type=int, default=3, help="records of all other cases")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--output", type=new_file, default=Path("accuracy"), help="of the JSON")
    return parser


def _seeds_of(case: Case, options: argparse.Namespace) -> int:
    if case.noise == "clean":
        return 1
    is_main = (case.excitation, case.condition) == ("square", "1 kHz")
    if is_main and case.plant.is_karnopp and case.noise in ("28.6 µm", "60 µm"):
        return int(options.seeds)
    return int(options.other_seeds)


def _cases(options: argparse.Namespace, console: Console) -> _Found:
    """Identify all combinations of plant, excitation, noise and sampling by `bench`."""
    cases = [Case(*names) for names in product(PLANTS, EXCITATIONS, NOISES, CONDITIONS)]
    tasks = [(case, seed) for case in cases for seed in range(_seeds_of(case, options))]
    outcomes = in_parallel("cases", run, tasks, options.jobs)
    console.print(cases_table(outcomes))
    return outcomes, [one for group in by_case(outcomes).values() for one in case_bounds(group)]


def _information(_: argparse.Namespace, console: Console) -> _Found:
    """Compute the best accuracy that any method could reach on the square wave."""
    noises = [noise for noise in NOISES if noise != "clean"]
    found = [information(name, noise) for name, noise in product(_KARNOPP, noises)]
    console.print(information_table(found))
    return found, []


_RUNS: Mapping[str, Callable[[argparse.Namespace, Console], _Found]] = {
    "cases": _cases,
    "information": _information,
}


def _is_worth_a_line(bound: Bound) -> bool:
    """Return whether to show a bound; those of many cases only where they are missed."""
    return not bound.met or bound.reached not in ("always", "shown 0×")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the requested parts; return 1 if a bound is missed."""
    options, console = _parser().parse_args(arguments), opened_console()
    bounds: list[Bound] = []
    content: dict[str, list[dict[str, object]]] = {}
    for name, part in _RUNS.items():
        if name in options.parts:
            found, of_part = part(options, console)
            content[name] = list(map(asdict, found))
            bounds += of_part
    content["bounds"] = list(map(asdict, bounds))
    console.print(bounds_table(filter(_is_worth_a_line, bounds)))
    options.output.with_suffix(".json").write_text(
        json.dumps(content, indent=1, ensure_ascii=False), encoding="utf-8"
    )
    return judged(bounds, console)


if __name__ == "__main__":
    sys.exit(main())
