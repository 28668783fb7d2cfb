# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The measured rows as a table and as JSON."""

import datetime
import json
import os
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from rich.table import Table

from benchmark.speed.rows import Row

__all__ = ["machine_shape", "rows_table", "write_json"]


def machine_shape() -> dict[str, str | float]:
    """Tell what of the machine, its load and its software the numbers depend on."""
    return {
        "cores": os.cpu_count() or 1,
        "load": round(os.getloadavg()[0], 1),
        "architecture": platform.machine(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "numpy": np.__version__,
    }


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
    """Write date, shape of the machine and all rows."""
    content = {
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "machine": machine_shape(),
        "parts": {
            name: [vars(row) | {"ratio": row.ratio} for row in rows] for name, rows in parts.items()
        },
    }
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
