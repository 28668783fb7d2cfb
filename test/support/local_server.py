# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Servers on this machine: a free port, a certificate, and PostgreSQL."""

import contextlib
import shutil
import subprocess

import pytest

from benchmark.harness.postgres import PostgresServer, why_no_server
from benchmark.harness.processes import free_port  # noqa: F401 - of tests


def certificate_pair(folder):
    """Make a certificate of `localhost` and its key, which its owner alone can read; the paths."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl, which makes the certificate, is not installed")
    certificate, key = folder / "certificate.pem", folder / "key.pem"
    words = (
        "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 "
        "-subj /CN=localhost -addext subjectAltName=DNS:localhost"
    )
    subprocess.run(
        [*words.split(), "-keyout", key, "-out", certificate], check=True, capture_output=True
    )
    key.chmod(0o600)
    return certificate, key


def require_postgres():
    """Skip where there is no server to start, or no library to speak to it."""
    if (reason := why_no_server()) is not None:
        pytest.skip(reason)


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
    from valve_friction_ros.history.place import HistoryServer

    postgres.start()
    name = postgres.database()
    yield HistoryServer(postgres.url(name))
    from valve_friction_ros.history.database import server_engine

    server_engine(HistoryServer(postgres.url(name))).dispose()


def database_of(server):
    """Name of the database of an address."""
    return server.url.rpartition("/")[2].partition("?")[0]


@contextlib.contextmanager
def sending(file, server):
    """Send the rows of a history to a server, as a node does."""
    from valve_friction_ros.history import sender_of

    sender = sender_of(file.path, server)
    try:
        yield sender
    finally:
        sender.end()
