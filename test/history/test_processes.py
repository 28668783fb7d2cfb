# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Several processes write one history while some of them are killed."""

import signal
import sqlite3
import subprocess
import sys
from pathlib import Path

from histories import START

from valve_friction_ros.history import HistoryFile

WRITER = Path(__file__).with_name("history_writer.py")
KILLED, LIVING = 4, 2
ROWS = 25
"""What a living writer writes, and a killed one at least."""


def start(path, number, rows=()):
    return subprocess.Popen(
        [sys.executable, str(WRITER), str(path), str(number), *map(str, rows)],
        stdout=subprocess.PIPE,
        text=True,
    )


def finished_before_the_kill(process):
    """Kill a writer that is in the midst of it; the number of rows that it said to be finished."""
    for _ in range(ROWS // 2 + process.number):
        assert process.stdout.readline()
    process.send_signal(signal.SIGKILL)
    told = process.stdout.read()
    assert process.wait(60) == -signal.SIGKILL
    return ROWS // 2 + process.number + len(told.split())


def test_no_finished_row_is_lost_and_nothing_is_corrupted(tmp_path):
    """None of them finds the file when it starts."""
    history = HistoryFile(tmp_path / "history.sqlite")
    processes = []
    for number in range(KILLED + LIVING):
        processes.append(start(history.path, number, [ROWS] if number >= KILLED else []))
        processes[-1].number = number
    try:
        finished = [finished_before_the_kill(process) for process in processes[:KILLED]]
        for process in processes[KILLED:]:
            told, _ = process.communicate(timeout=90)
            assert process.returncode == 0
            finished.append(len(told.split()))
    finally:
        for process in processes:
            process.kill()
            process.wait()
            process.stdout.close()
    assert finished[KILLED:] == [ROWS] * LIVING
    connection = sqlite3.connect(history.path)
    assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
    assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
    connection.close()
    for number, count in enumerate(finished):
        name = f"/fv_{number}/identifier"
        entries = history.entries([name])
        # At most the one under way has come besides what was told.
        assert len(entries) in ((count, count + 1) if number < KILLED else (count,))
        assert [one.time - START for one in entries] == [*range(len(entries))]
        assert all(len(one.parameters) == (0 if one.refusal else 3) for one in entries)
        baseline = history.baseline(name).baseline.coulomb_friction
        assert baseline - 100 in (len(entries) - 1, len(entries) - 2)
        assert baseline - 100 >= count - 1
