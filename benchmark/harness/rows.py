# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What all benchmarks share: rows and bounds with their goals, tables, JSON, parallel work."""

import argparse
import datetime
import json
import multiprocessing
import os
import platform
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

_WIDTH_OF_A_FILE = 150
_MARKS = {None: "", True: "[green]met[/]", False: "[red]missed[/]"}


@dataclass(frozen=True)
class Row:
    """A measured item of a part, beside its peer and its goal; `ours` and `peer` have one unit."""

    item: str
    ours: float
    unit: str = ""
    peer: float | None = None
    peer_name: str = ""
    goal: str = ""  # empty if the item is for comparison only
    met: bool | None = None  # None without a goal

    @property
    def ratio(self) -> float | None:
        """Peer over ours: for a cost, the factor by which ours is cheaper."""
        return None if self.peer is None or self.ours == 0 else self.peer / self.ours

    def __str__(self) -> str:
        return f"{self.item}: {self.goal}"


@dataclass(frozen=True)
class Bound:
    """A requirement, the figure reached, and whether it is met."""

    what: str
    reached: str
    met: bool

    def __str__(self) -> str:
        return f"{self.what}: {self.reached}"


def none(item: str, count: int) -> Row:
    """Return a count that must be zero."""
    return Row(item, count, goal="none", met=count == 0)


def some(item: str, count: int) -> Row:
    """Return a count that must not be zero."""
    return Row(item, count, goal="some", met=count > 0)


def at_most(item: str, value: float, unit: str, limit: float, *peer: float | str) -> Row:
    """Return a value, with its peer, that must not exceed a limit."""
    told = peer or (None, "")
    return Row(item, value, unit, *told, f"at most {limit:g} {unit}", value <= limit)


def under(item: str, value: float, unit: str, limit: float, *peer: float | str) -> Row:
    """Return a value, with its peer, that must be below a limit."""
    told = peer or (None, "")
    return Row(item, value, unit, *told, f"under {limit:g} {unit}".rstrip(), value < limit)


def new_file(text: str) -> Path:
    """Return the path of a file to write, for an option; its folder must exist."""
    path = Path(text)
    if not path.parent.is_dir():
        raise argparse.ArgumentTypeError(f"{path}: there is no folder {path.parent}")
    return path


def machine_shape() -> dict[str, str | float]:
    """Return the properties of machine, load and software that affect the numbers."""
    return {
        "cores": os.cpu_count() or 1,
        "load": round(os.getloadavg()[0], 1),
        "architecture": platform.machine(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "numpy": np.__version__,
    }


def opened_console() -> Console:
    """Return a console after printing the properties of the machine."""
    console = Console(width=None if sys.stdout.isatty() else _WIDTH_OF_A_FILE)
    console.print(", ".join(f"{name} {value}" for name, value in machine_shape().items()))
    return console


def in_parallel(
    title: str,
    work: Callable[..., Any],
    tasks: Iterable[tuple[Any, ...]],
    jobs: int,
    arrived: Callable[[Any], object] = lambda _: None,
) -> list[Any]:
    """Return the results of all tasks in order, from `jobs` processes, with a progress bar.

    `arrived` sees each result as soon as it is there.
    """
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        pending = [pool.submit(work, *task) for task in tasks]
        bar = Console(stderr=True)
        try:
            for one in track(as_completed(pending), title, len(pending), console=bar):
                arrived(one.result())
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [one.result() for one in pending]


def logged(rows: Iterable[Row], found: list[Row], console: Console) -> None:
    """Append rows to `found`, and print each as it arrives."""
    for row in rows:
        found.append(row)
        console.log(f"{row.item}: {row.ours:.3g} {row.unit}")


def judged(found: Iterable[Row | Bound], console: Console) -> int:
    """Print the missed goals; return 1 if there are any, else 0."""
    goals = [one for one in found if one.met is not None]
    missed = [one for one in goals if not one.met]
    for one in missed:
        console.print(f"[red]missed[/] {one}", soft_wrap=True)
    console.print(f"{len(goals) - len(missed)} of {len(goals)} goals are met")
    return 1 if missed else 0


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}" if abs(value) < 1000 else f"{value:,.0f}"


def rows_table(title: str, rows: Sequence[Row]) -> Table:
    """Tabulate the rows of a part."""
    table = Table(title=title)
    for column in ("item", "ours", "peer", "ratio", "goal", ""):
        right = column in ("ours", "peer", "ratio")
        table.add_column(column, justify="right" if right else "left")
    for row in rows:
        ours = f"{_number(row.ours)} {row.unit}"
        peer = "" if row.peer is None else f"{_number(row.peer)} {row.unit}\n{row.peer_name}"
        ratio = "" if row.ratio is None else f"{_number(row.ratio)}×"
        table.add_row(row.item, ours, peer, ratio, row.goal, _MARKS[row.met])
    return table


def bounds_table(bounds: Iterable[Bound]) -> Table:
    """Tabulate requirements."""
    table = Table("requirement", "reached", "", title="requirements")
    for bound in bounds:
        table.add_row(bound.what, bound.reached, _MARKS[bound.met])
    return table


def write_json(parts: Mapping[str, Sequence[Row]], path: Path) -> None:
    """Write date, properties of the machine and all rows."""
    content = {
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "machine": machine_shape(),
        "parts": {
            name: [vars(row) | {"ratio": row.ratio} for row in rows] for name, rows in parts.items()
        },
    }
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
