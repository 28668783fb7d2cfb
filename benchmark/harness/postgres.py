# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A private PostgreSQL server, which a run may kill, stop and restart."""

import contextlib
import itertools
import os
import pwd
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from ipaddress import ip_network
from pathlib import Path
from typing import Any

from benchmark.harness.processes import free_port

_FOLDERS = sorted(Path("/usr/lib/postgresql").glob("*/bin"), key=lambda one: one.parent.name)
_PATIENCE = 60.0


def _program(name: str) -> str | None:
    return str(_FOLDERS[-1] / name) if _FOLDERS else shutil.which(name)


def _somebody() -> dict[str, Any] | None:
    """Return the user for the server, which root may not run; None if there is none."""
    if os.geteuid():
        return {}
    for name in ("postgres", "nobody"):
        with contextlib.suppress(KeyError):
            entry = pwd.getpwnam(name)
            return {"user": entry.pw_uid, "group": entry.pw_gid, "extra_groups": []}
    return None


def why_no_server() -> str | None:
    """Return why no server can be started here, and what to do; None if one can."""
    try:
        import psycopg  # noqa: F401, PLC0415
    except ImportError:
        return "no library to speak to PostgreSQL: run `make venv-test`"
    if _program("postgres") is None:
        return "no PostgreSQL server: run `make postgres`, or `apt install postgresql`"
    if _somebody() is None:
        return "root may not run PostgreSQL, and there is no user `postgres` or `nobody`"
    return None


class PostgresServer:
    """A server with the superuser `owner`; other roles need a password.

    It listens on one address and accepts connections from that /24 network. Its folder contains its
    log. Raises RuntimeError if no server can be started; see `why_no_server`.
    """

    def __init__(self, address: str = "127.0.0.1") -> None:
        if (reason := why_no_server()) is not None:
            raise RuntimeError(reason)
        self.folder = Path(tempfile.mkdtemp(prefix="vf-postgres-"))
        self._who = _somebody() or {}
        if self._who:
            os.chown(self.folder, self._who["user"], self._who["group"])
        self.data = self.folder / "data"
        self._make()
        near = ip_network(f"{address}/24", strict=False)
        (self.data / "pg_hba.conf").write_text(
            f"host all owner {near} trust\nhost all all {near} scram-sha-256\n"
        )
        self.address, self.port = address, free_port(address)
        self.settings: dict[str, object] = {
            "port": self.port,
            "unix_socket_directories": self.folder,
            "listen_addresses": address,
            "fsync": "off",
        }
        self._process: subprocess.Popen[bytes] | None = None
        self._databases = itertools.count()
        self.start()

    def _make(self) -> None:
        command = [_program("initdb"), "-D", self.data, "-U", "owner", "-A", "trust"]
        done = subprocess.run(
            [*map(str, command), "-N", "-E", "UTF8"],
            cwd=self.folder,
            env={"PATH": os.environ["PATH"], "LC_ALL": "C"},
            capture_output=True,
            text=True,
            timeout=_PATIENCE,
            check=False,
            **self._who,
        )
        if done.returncode:
            raise RuntimeError(f"initdb: {done.stderr}")

    def launch(self) -> bool:
        """Start the server if it does not run; return whether it answers."""
        import psycopg  # noqa: PLC0415

        options = [f"--{name}={value}" for name, value in self.settings.items()]
        if self._process is None or self._process.poll() is not None:
            # A killed server leaves processes that end a little later.
            with (self.folder / "log").open("ab") as log:
                self._process = subprocess.Popen(
                    [str(_program("postgres")), "-D", str(self.data), *options],
                    cwd=self.folder,
                    env={"PATH": os.environ["PATH"], "LC_ALL": "C"},
                    stdout=log,
                    stderr=log,
                    **self._who,
                )
        try:
            psycopg.connect(self.url("postgres"), connect_timeout=2).close()
        except psycopg.OperationalError:
            return False
        return True

    def start(self) -> None:
        """Start the server, and wait until it answers."""
        deadline = time.monotonic() + _PATIENCE
        while not self.launch():
            if time.monotonic() > deadline:
                raise RuntimeError((self.folder / "log").read_text())
            time.sleep(0.05)

    def url(
        self, database: str, user: str = "owner", password: str | None = None, **parameters: object
    ) -> str:
        """Return the address of a database for a role."""
        secret = "" if password is None else f":{password}"
        query = "&".join(f"{name}={value}" for name, value in parameters.items())
        place = f"{user}{secret}@{self.address}:{self.port}/{database}"
        return f"postgresql://{place}{'?' * bool(query)}{query}"

    def database(self) -> str:
        """Make a new database; return its name."""
        name = f"plant_{next(self._databases)}"
        self.do("postgres", f"CREATE DATABASE {name}")
        return name

    def do(self, database: str, statement: str, values: Sequence[object] = ()) -> list[Any]:
        """Execute a statement as owner; return its rows."""
        import psycopg  # noqa: PLC0415

        with psycopg.connect(self.url(database), autocommit=True) as connection:
            cursor = connection.execute(statement.encode(), values or None)
            return cursor.fetchall() if cursor.description else []

    def _signal(self, number: signal.Signals) -> None:
        """Send a signal to the server and all its child processes."""
        if self._process is None:
            return
        found = [self._process.pid]
        for path in Path("/proc").glob("[0-9]*/stat"):
            with contextlib.suppress(OSError):
                fields = path.read_text().rpartition(")")[2].split()
                if int(fields[1]) == self._process.pid:
                    found.append(int(path.parent.name))
        for one in found:
            with contextlib.suppress(ProcessLookupError):
                os.kill(one, number)

    def _end(self, number: signal.Signals) -> None:
        if self._process is not None:
            self._process.send_signal(number)
            self._process.wait()

    def kill(self) -> None:
        """Kill the server and its child processes, like a power cut."""
        self._signal(signal.SIGKILL)
        if self._process is not None:
            self._process.wait()

    def stop(self) -> None:
        """Shut the server down cleanly; connections end."""
        self._end(signal.SIGINT)

    @contextlib.contextmanager
    def paused(self) -> Iterator[None]:
        """Suspend the server."""
        self._signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self._signal(signal.SIGCONT)

    def remove(self) -> None:
        """End the server, and delete its data."""
        self._signal(signal.SIGCONT)
        self._end(signal.SIGQUIT)
        shutil.rmtree(self.folder, ignore_errors=True)


@contextlib.contextmanager
def running_server(address: str = "127.0.0.1") -> Iterator[PostgresServer | None]:
    """Provide a new server at an address, or None if no server can be started."""
    if why_no_server() is not None:
        yield None
        return
    server = PostgresServer(address)
    try:
        yield server
    finally:
        server.remove()
