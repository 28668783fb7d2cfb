# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a plant stands on, and faults may take away: a small disk, and a server of the history."""

import contextlib
import sqlite3
import subprocess
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from benchmark.harness.postgres import PostgresServer, running_server
from valve_friction_ros.history import copied
from valve_friction_ros.history.outbox import count_unsent
from valve_friction_ros.history.place import HistoryServer

_COUNT = "SELECT count(*) FROM identification"
_SIZE = "64m"
_CHUNK = 2**16


class Kept(NamedTuple):
    """What a history file and a server hold at the end.

    Attributes
    ----------
    in_file, on_server : int
        Identifications, counted by the engines' own clients.
    waiting : int
        Rows that wait in the file for the server, as it counts them: what a process writes as it
        ends is sent at its next start.
    lacking : int
        Rows of all tables that the server lacked, or had otherwise, as a comparison finds them.
    """

    in_file: int
    on_server: int
    waiting: int
    lacking: int


class Database:
    """A database on a server that may be ended and held."""

    def __init__(self, server: PostgresServer) -> None:
        self.server = server
        self._name = server.database()
        self.url = server.url(self._name)
        self.is_away = False
        """Whether a fault has it now."""

    def compared_with(self, file: Path) -> Kept:
        """Return what a file and the server hold; then the server holds everything."""
        ((on_server,),) = self.server.do(self._name, _COUNT)
        with contextlib.closing(sqlite3.connect(file)) as connection:
            (in_file,) = connection.execute(_COUNT).fetchone()
        waiting = count_unsent(file).waiting
        parts = copied(file, HistoryServer(self.url))
        lacking = sum(one.written + (not one.is_same) for one in parts)
        return Kept(in_file, on_server, waiting, lacking)


@contextlib.contextmanager
def own_database() -> Iterator[Database | None]:
    """Provide a new database on a new server; None where no server can be started."""
    with running_server() as server:
        yield None if server is None else Database(server)


@contextlib.contextmanager
def small_disk(folder: Path) -> Iterator[bool]:
    """Mount a file system of 64 MB in memory on a folder; tell whether that was allowed."""
    folder.mkdir(parents=True, exist_ok=True)
    command = ["mount", "-t", "tmpfs", "-o", f"size={_SIZE}", "tmpfs", str(folder)]
    is_mounted = False
    with contextlib.suppress(FileNotFoundError):
        is_mounted = subprocess.run(command, capture_output=True, check=False).returncode == 0
    try:
        yield is_mounted
    finally:
        if is_mounted:
            subprocess.run(["umount", "-l", str(folder)], check=False)


@contextlib.contextmanager
def filled(folder: Path) -> Iterator[None]:
    """Leave no room on the disk of a folder."""
    filler = folder / f"filler_{uuid.uuid4().hex}"  # two faults may fill it at once
    with contextlib.suppress(OSError), filler.open("wb", buffering=0) as stream:
        while True:
            stream.write(bytes(_CHUNK))
    try:
        yield
    finally:
        filler.unlink()
