# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Measured items with their peers and goals, as rows, tables and JSON."""

import datetime
import json
import os
import platform
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

_WIDTH_OF_A_FILE = 120


@dataclass(frozen=True)
class Row:
    """One item of a part.

    Attributes
    ----------
    item : str
        Measured quantity.
    ours : float
        Value for the package.
    unit : str
        Unit of `ours` and `peer`.
    peer : float or None
        Value for the peer, if there is one.
    peer_name : str
        Name of the peer.
    goal : str
        Goal in words; empty if the item is for comparison only.
    met : bool or None
        Whether the goal was met; None without a goal.
    """

    item: str
    ours: float
    unit: str = ""
    peer: float | None = None
    peer_name: str = ""
    goal: str = ""
    met: bool | None = None

    @property
    def ratio(self) -> float | None:
        """Peer over ours: for a cost, the factor by which ours is cheaper."""
        return None if self.peer is None or self.ours == 0 else self.peer / self.ours


@dataclass(frozen=True)
class Bound:
    """A requirement, the figure reached, and whether it is met."""

    what: str  # the requirement
    reached: str  # the figure reached
    met: bool  # whether it is met


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


def logged(rows: Iterable[Row], found: list[Row], console: Console) -> None:
    """Append rows to `found`, and print each as it arrives."""
    for row in rows:
        found.append(row)
        console.log(f"{row.item}: {row.ours:.3g} {row.unit}")


def judged(rows: Iterable[Row], console: Console) -> int:
    """Print the missed goals; return 1 if there are any, else 0."""
    goals = [row for row in rows if row.met is not None]
    missed = [row for row in goals if not row.met]
    for row in missed:
        console.print(f"[red]missed[/] {row.item}: {row.goal}", soft_wrap=True)
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
    marks = {None: "", True: "[green]met[/]", False: "[red]missed[/]"}
    for row in rows:
        ours = f"{_number(row.ours)} {row.unit}"
        peer = "" if row.peer is None else f"{_number(row.peer)} {row.unit}\n{row.peer_name}"
        ratio = "" if row.ratio is None else f"{_number(row.ratio)}×"
        table.add_row(row.item, ours, peer, ratio, row.goal, marks[row.met])
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
