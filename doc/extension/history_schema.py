# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The tables of the history, as SQLite knows them."""

import sqlite3
import tempfile
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from extension.meanings import meanings, require_all

__all__ = ["Column", "schema", "schema_as_markdown"]


class Column(NamedTuple):
    """A column of a table or a view."""

    name: str
    kind: str
    is_needed: bool
    is_key: bool


def schema() -> dict[str, list[Column]]:
    """Return the columns of each table and view of a new history."""
    from valve_friction_ros.history.database import writing

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "history.sqlite"
        with writing(path):
            pass
        with closing(sqlite3.connect(path)) as connection:
            names = connection.execute(
                "SELECT name FROM sqlite_master WHERE type IN ('table', 'view') ORDER BY name"
            )
            return {
                name: [
                    Column(row[1], row[2], bool(row[3]), bool(row[5]))
                    for row in connection.execute(f"PRAGMA table_info({name})")
                ]
                for (name,) in names.fetchall()
            }


def schema_as_markdown() -> str:
    """Return a heading and a list of columns for each table."""
    tables, said = schema(), meanings()["history"]
    require_all("tables of the history", tables, said["tables"])
    lines = []
    used = set()
    for table, row in said["tables"].items():
        lines += [
            f"## `{table}`",
            "",
            row["is"].strip(),
            "",
            "| column | type | meaning |",
            "| --- | --- | --- |",
        ]
        own = row.get("columns", {})
        require = [one.name for one in tables[table]]
        require_all(f"columns of {table}", require, {*own, *(set(said["columns"]) & set(require))})
        for one in tables[table]:
            used.add(one.name)
            kind = one.kind or "text"
            facts = f"{kind.lower()}{', key' if one.is_key else ''}"
            is_sure = one.is_needed or one.is_key or table == "friction"
            null = "" if is_sure else ", or NULL"
            meaning = own.get(one.name, said["columns"].get(one.name, "")).strip()
            lines.append(f"| `{one.name}` | {facts}{null} | {meaning} |")
        lines.append("")
    return "\n".join(lines)
