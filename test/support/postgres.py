"""A PostgreSQL server for tests."""

import pytest

from benchmark.postgres_server import PostgresServer, why_no_server


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
    from valve_friction_ros.history.server.address import HistoryServer

    postgres.start()
    name = postgres.database()
    yield HistoryServer(postgres.url(name))
    from valve_friction_ros.history.server import connection

    for one in connection._idle.pop(HistoryServer(postgres.url(name)), []):
        one.close()
