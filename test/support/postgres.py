"""A PostgreSQL server of a test's own, which the test may kill, stop and start again."""

import contextlib
import itertools
import os
import pwd
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path

import pytest

FOLDERS = sorted(Path("/usr/lib/postgresql").glob("*/bin"), key=lambda one: one.parent.name)
_PATIENCE = 60.0
_databases = itertools.count()


def require_postgres():
    """Skip where there is no server to start, or no library to speak to it."""
    pytest.importorskip("psycopg", reason="run `make venv-test`")
    if not FOLDERS and shutil.which("postgres") is None:
        pytest.skip("no PostgreSQL server: run `make postgres`, or `apt install postgresql`")


def _program(name):
    return str(FOLDERS[-1] / name) if FOLDERS else shutil.which(name)


def _somebody():
    """The user that the server runs as: root may not."""
    if os.geteuid():
        return {}
    for name in ("postgres", "nobody"):
        with contextlib.suppress(KeyError):
            entry = pwd.getpwnam(name)
            return {"user": entry.pw_uid, "group": entry.pw_gid, "extra_groups": []}
    pytest.skip("root runs the tests, and there is no user `postgres` or `nobody`")


def _free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class PostgresServer:
    """A server at 127.0.0.1, with the superuser `owner`; other roles need a password."""

    def __init__(self):
        self.folder = Path(tempfile.mkdtemp(prefix="vf-postgres-"))
        self._who = _somebody()
        if self._who:
            os.chown(self.folder, self._who["user"], self._who["group"])
        self.data = self.folder / "data"
        self._run("initdb", "-D", self.data, "-U", "owner", "-A", "trust", "-N", "-E", "UTF8")
        (self.data / "pg_hba.conf").write_text(
            "host all owner 127.0.0.1/32 trust\nhost all all 127.0.0.1/32 scram-sha-256\n"
        )
        self.port = _free_port()
        self.settings = {
            "port": self.port,
            "unix_socket_directories": self.folder,
            "listen_addresses": "127.0.0.1",
            "fsync": "off",
        }
        self._process = None
        self.start()

    def _run(self, program, *arguments):
        done = subprocess.run(
            [_program(program), *map(str, arguments)],
            cwd=self.folder,
            env={"PATH": os.environ["PATH"], "LC_ALL": "C"},
            capture_output=True,
            text=True,
            timeout=_PATIENCE,
            check=False,
            **self._who,
        )
        assert done.returncode == 0, done.stderr

    def start(self):
        """Start it, and wait until it answers."""
        import psycopg

        options = [f"--{name}={value}" for name, value in self.settings.items()]
        deadline = time.monotonic() + _PATIENCE
        while True:
            if self._process is None or self._process.poll() is not None:
                # One that was killed leaves processes that end a little later.
                with (self.folder / "log").open("ab") as log:
                    self._process = subprocess.Popen(
                        [_program("postgres"), "-D", self.data, *options],
                        cwd=self.folder,
                        env={"PATH": os.environ["PATH"], "LC_ALL": "C"},
                        stdout=log,
                        stderr=log,
                        **self._who,
                    )
            try:
                psycopg.connect(self.url("postgres"), connect_timeout=2).close()
            except psycopg.OperationalError:
                assert time.monotonic() < deadline, (self.folder / "log").read_text()
                time.sleep(0.05)
            else:
                return

    def url(self, database, user="owner", password=None, **parameters):
        secret = "" if password is None else f":{password}"
        query = "&".join(f"{name}={value}" for name, value in parameters.items())
        place = f"{user}{secret}@127.0.0.1:{self.port}/{database}"
        return f"postgresql://{place}{'?' * bool(query)}{query}"

    def database(self):
        """Make a new database; return its name."""
        name = f"plant_{next(_databases)}"
        self.do("postgres", f"CREATE DATABASE {name}")
        return name

    def do(self, database, statement, values=()):
        """Do a statement as its owner; return the rows that it finds."""
        import psycopg

        with psycopg.connect(self.url(database), autocommit=True) as connection:
            cursor = connection.execute(statement, values or None)
            return cursor.fetchall() if cursor.description else []

    def _processes(self):
        """The server and all that it has started."""
        found = [self._process.pid]
        for path in Path("/proc").glob("[0-9]*/stat"):
            with contextlib.suppress(OSError):
                fields = path.read_text().rpartition(")")[2].split()
                if int(fields[1]) == self._process.pid:
                    found.append(int(path.parent.name))
        return found

    def _signal(self, number):
        for one in self._processes():
            with contextlib.suppress(ProcessLookupError):
                os.kill(one, number)

    def kill(self):
        """Kill it and all that it has started, as a power cut does."""
        self._signal(signal.SIGKILL)
        self._process.wait()

    def stop(self):
        """Stop it orderly; connections end."""
        self._process.send_signal(signal.SIGINT)
        self._process.wait()

    @contextlib.contextmanager
    def paused(self):
        """Have it stand still."""
        self._signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self._signal(signal.SIGCONT)

    def remove(self):
        self._signal(signal.SIGCONT)
        self._process.send_signal(signal.SIGQUIT)
        self._process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


@pytest.fixture(scope="session")
def postgres():
    """A server for all tests of a process; a test that has stopped it starts it again."""
    require_postgres()
    server = PostgresServer()
    yield server
    server.remove()


@pytest.fixture
def database(postgres):
    """The address of a new, empty database."""
    from valve_friction_ros.history.server.address import HistoryServer

    postgres.start()
    name = postgres.database()
    yield HistoryServer(postgres.url(name))
    from valve_friction_ros.history.server import connection

    for one in connection._idle.pop(HistoryServer(postgres.url(name)), []):
        one.close()
