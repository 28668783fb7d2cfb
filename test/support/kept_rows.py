# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`identify-folder` without processes, and the rows that it has on the disk."""

import contextlib
import csv
import shutil
import sqlite3

import pytest

from valve_friction_ros.commands import identify_folder
from valve_friction_ros.commands.main import run


def _in_turn(work, tasks, _processes, _stopped):
    return ((task, work(task)) for task in tasks)


def run_here(arguments):
    """Run the command without a process that identifies, whose start takes a second."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(identify_folder, "in_processes", _in_turn)
        return run([str(argument) for argument in arguments])


def csv_rows(path):
    """Rows of a table, each a mapping by its headers."""
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def rows_of(path, key="recording"):
    """Rows of a table, by the names of the recordings of one valve each."""
    return {row[key]: row for row in csv_rows(path)}


def kept(output):
    """Number of rows that are on the disk, whatever a running or killed process does with it."""
    copy = output.parent / "copy"
    shutil.rmtree(copy, ignore_errors=True)
    copy.mkdir()
    for file in output.parent.glob(f"{output.stem}.sqlite*"):
        with contextlib.suppress(FileNotFoundError):  # a journal is there for a moment only
            shutil.copy(file, copy)
    try:
        with contextlib.closing(sqlite3.connect(copy / f"{output.stem}.sqlite")) as database:
            return database.execute("SELECT count(*) FROM result").fetchone()[0]
    except sqlite3.Error:
        return 0
