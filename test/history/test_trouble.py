# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A history in trouble: disks, other programs, and several processes of which some are killed."""

import contextlib
import signal
import sqlite3
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from histories import START, change, select, success
from processes import printed
from writers import writer

from valve_friction_ros.history import HistoryError, HistoryFile, database, tables
from valve_friction_ros.history.place import Claim

PROJECT = Path(__file__).resolve().parents[2]
FOLDERS = (PROJECT / "test" / "support", PROJECT)


@pytest.fixture
def history(tmp_path):
    history = HistoryFile(tmp_path / "history.sqlite")
    history.add(success())
    return history


def told(history, action=lambda history: history.add(success(START + 1))):
    """Return the message of the error; it is one line that begins with the path."""
    with pytest.raises(HistoryError) as error:
        action(history)
    message = str(error.value)
    assert message.startswith(f"{history.path}: ")
    assert "\n" not in message
    return message.removeprefix(f"{history.path}: ")


def is_whole(history, count=1):
    state = select(history, "PRAGMA integrity_check")
    return state == [("ok",)] and len(history.entries()) == count


def fill(monkeypatch, pages):
    """Let the file hold no more than some pages, as on a disk that is full."""

    class Full(sqlite3.Connection):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            self.execute(f"PRAGMA max_page_count = {pages}")

    connect = sqlite3.connect
    monkeypatch.setattr(
        database.sqlite3, "connect", lambda *some, **more: connect(*some, factory=Full, **more)
    )


def test_full_disk_and_room_again(history, monkeypatch):
    fill(monkeypatch, pages=1)
    long = success(START + 1, warnings=("a" * 100_000,))
    message = told(history, lambda one: one.add(long))
    assert message == "database or disk is full: make room on its disk"
    assert is_whole(history)
    monkeypatch.undo()
    history.add(long)
    assert is_whole(history, 2)


LIMITED = """
import resource, sys
from pathlib import Path
sys.path[:0] = sys.argv[2:]
from histories import START, success
from valve_friction_ros.history import HistoryError, HistoryFile
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, resource.RLIM_INFINITY))
history = HistoryFile(Path(sys.argv[1]))
written = 0
try:
    while True:
        history.add(success(START + 1 + written, warnings=("a" * 5_000,)))
        written += 1
except HistoryError as error:
    print(error)
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
assert len(history.entries()) == 1 + written
history.add(success(START))
"""


def printed_by(program, path):
    """Run a program, given a path and the folders of its modules; what it prints."""
    return printed("-c", program, path, *FOLDERS)


def test_a_file_that_may_not_grow(history):
    """The operating system itself refuses to write."""
    told = printed_by(LIMITED, history.path)
    assert told.startswith(f"{history.path}: ")
    assert told.endswith("check the disk, its free space and the process's limits\n")
    assert is_whole(history, len(history.entries()))
    assert len(history.entries()) > 10


def test_no_folder_can_be_made(tmp_path):
    (tmp_path / "file").touch()
    history = HistoryFile(tmp_path / "file" / "history.sqlite")
    message = told(history)
    assert message == "its folder is a file: check the folder, or use another history_file"
    assert "there is no such file: check its name" in told(history, HistoryFile.entries)


READ_ONLY = """
import os, sys
from pathlib import Path
sys.path[:0] = sys.argv[2:]
from histories import START, success
from valve_friction_ros.history import HistoryError, HistoryFile
if os.geteuid() == 0:  # who may write anywhere
    os.seteuid(65534)
folder = Path(sys.argv[1])
print(len(HistoryFile(folder / "history.sqlite").entries()))
for name in ("history.sqlite", "new.sqlite"):
    try:
        HistoryFile(folder / name).add(success(START + 1))
    except HistoryError as error:
        print(error)
"""


def test_read_only_folder():
    """The history can still be read; the folder lies where every user may look."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        HistoryFile(folder / "history.sqlite").add(success())
        (folder / "history.sqlite").chmod(0o444)
        folder.chmod(0o555)
        told = printed_by(READ_ONLY, folder)
        folder.chmod(0o755)
    count, old, new = told.splitlines()
    assert count == "1"
    assert "readonly database: make the file and its folder writable, or use another" in old
    assert "unable to open database file: check that the folder exists and is writable" in new


def test_newer_schema(history):
    change(history, f"PRAGMA user_version = {tables.SCHEMA_VERSION + 1}")
    expected = (
        f"written by a newer version of this package (schema {tables.SCHEMA_VERSION + 1}, this "
        f"version knows {tables.SCHEMA_VERSION}): update the package, or use another history_file"
    )
    for action in (HistoryFile.prepare, HistoryFile.entries):
        assert told(history, action) == expected
    change(history, f"PRAGMA user_version = {tables.SCHEMA_VERSION}")
    assert is_whole(history)


@pytest.mark.parametrize(
    "statement", ["CREATE TABLE theirs (a)", "PRAGMA user_version = 1", "PRAGMA application_id = 7"]
)
def test_another_programs_database(tmp_path, statement):
    history = HistoryFile(tmp_path / "theirs.sqlite")
    change(history, statement)
    before = history.path.read_bytes()
    assert told(history) == "the database of another program: use another history_file"
    assert history.path.read_bytes() == before


def test_another_process_creates_it_while_it_is_looked_at(tmp_path, monkeypatch):
    """Its mark and its tables are of one moment, or it would seem another program's."""
    history, refused = HistoryFile(tmp_path / "history.sqlite"), []

    def creates(connection, name, pragma=database._pragma):
        value = pragma(connection, name)
        with contextlib.closing(sqlite3.connect(history.path, timeout=0)) as other:
            try:
                other.execute("CREATE TABLE theirs (a)")
            except sqlite3.OperationalError as error:
                refused.append(str(error))
        return value

    monkeypatch.setattr(database, "_pragma", creates)
    history.add(success())
    assert set(refused) == {"database is locked"}
    assert is_whole(history)


def test_no_database(tmp_path):
    history = HistoryFile(tmp_path / "history.sqlite")
    history.path.write_bytes(b"nothing of the kind" * 100)
    for action in (HistoryFile.prepare, HistoryFile.entries):
        assert told(history, action) == (
            "file is not a database: give the right file, or move this file away: the node then "
            "begins a new file"
        )
    assert "unable to open" in told(HistoryFile(tmp_path))  # a folder


def test_damaged_pages(history):
    for k in range(200):
        history.add(success(START + 1 + k))
    content = bytearray(history.path.read_bytes())
    content[4096 : len(content) // 2] = b"\xa5" * (len(content) // 2 - 4096)
    history.path.write_bytes(content)
    assert "malformed: move it away" in told(history, HistoryFile.entries)
    assert "malformed: move it away" in told(history)


def test_an_empty_file_is_a_new_history(tmp_path):
    history = HistoryFile(tmp_path / "history.sqlite")
    history.path.touch()
    assert (
        told(history, HistoryFile.entries) == "the file is empty: no identification has been stored"
    )
    history.add(success())
    assert is_whole(history)


def test_held_by_another(history, monkeypatch):
    monkeypatch.setattr(database, "_PATIENCE", 0.05)
    holder = sqlite3.connect(history.path, isolation_level=None)
    holder.execute("BEGIN IMMEDIATE")
    assert told(history) == "database is locked: find the process that locks it, and stop it"
    assert len(history.entries()) == 1  # reading is not held up
    history.prepare()  # nor is the start of a node
    holder.execute("ROLLBACK")
    holder.close()
    history.add(success(START + 1))
    assert is_whole(history, 2)


@pytest.mark.parametrize("half_width", ["NULL", "-1.0", "9e999"])
def test_a_row_that_somebody_has_spoilt_makes_no_trend(history, half_width):
    history.add(success(START + 1))
    change(history, f"UPDATE parameter SET half_width = {half_width} WHERE identification_id = 1")
    assert [point.time for point in history.points("/fv_101/identifier", "bench")] == [START + 1]


def test_nothing_of_a_failed_change_stays(history, monkeypatch):
    """The identification is written, its forgetting fails: neither has happened."""
    from valve_friction_ros.history import history as history_file

    def fail(connection, *_):
        connection.exec_driver_sql("SELECT * FROM no_such_table")

    monkeypatch.setattr(history_file, "_forget", fail)
    with pytest.raises(HistoryError, match="no such table"):
        history.add(success(START + 1), days=1)
    assert is_whole(history)


KILLED, LIVING = 4, 2
ROWS = 25
"""What a living writer writes, and a killed one at least."""


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
        rows = [ROWS] if number >= KILLED else []
        processes.append(writer("history", history.path, number, *rows))
        processes[-1].number = number
    try:
        finished = [finished_before_the_kill(process) for process in processes[:KILLED]]
        for process in processes[KILLED:]:
            told, _ = process.communicate(timeout=300)
            assert process.returncode == 0
            finished.append(len(told.split()))
    finally:
        for process in processes:
            process.kill()
            process.wait()
            process.stdout.close()
    assert finished[KILLED:] == [ROWS] * LIVING
    assert select(history, "PRAGMA integrity_check") == [("ok",)]
    assert select(history, "PRAGMA foreign_key_check") == []
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


HOLD = """
import sys
from pathlib import Path
from valve_friction_ros.history.place import Claim
claim = Claim(Path(sys.argv[1]), "/fv_101")
print(claim.ask(), flush=True)
sys.stdin.read()
"""


def test_one_claim_a_valve(tmp_path):
    path = tmp_path / "history.sqlite"
    one, other, same = (Claim(path, name) for name in ("/fv_101", "/fv_102", "/fv_101"))
    assert one.ask()
    assert one.ask()
    assert other.ask()
    assert not same.ask()
    assert Claim(tmp_path / "other.sqlite", "/fv_101").ask()
    one.release()
    assert same.ask()
    for claim in (other, same):
        claim.release()


def test_a_killed_process_has_none(tmp_path):
    path = tmp_path / "history.sqlite"
    claim, command = Claim(path, "/fv_101"), [sys.executable, "-c", HOLD, str(path)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as holder:
        assert holder.stdout.readline() == "True\n"
        assert not claim.ask()
        holder.kill()
    assert claim.ask()
    claim.release()


def test_a_folder_that_is_not_there_grants_it(tmp_path):
    assert Claim(tmp_path / "nowhere" / "history.sqlite", "/fv_101").ask()
