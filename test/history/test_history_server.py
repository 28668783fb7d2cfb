# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A history on a PostgreSQL server: read as a file is, its tables, its address, its rights."""

import os
import re
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
import sqlalchemy as sa
from full_history import all_of, fill, filled
from histories import START, VALVE, make_version, select, success
from local_server import certificate_pair, database_of, sending
from processes import printed, wait_until

from valve_friction_ros.history import (
    History,
    HistoryError,
    HistoryFile,
    HistoryServer,
    copied,
    history_mark,
    keep_renewal,
    ratios_after,
    server_from,
    tables,
)
from valve_friction_ros.history import database as connections
from valve_friction_ros.history.database import server_engine, writing

PROJECT = Path(__file__).resolve().parents[2]
VERSION_7 = Path(__file__).with_name("server_of_version_7.sql")
SECRET = "s3cret%2Fword"


@pytest.fixture
def history(tmp_path):
    return filled(tmp_path)


@pytest.fixture
def server(history, database):
    """The same on a server."""
    assert all(one.is_same for one in copied(history.path, database))
    return History(database)


def test_it_is_read_as_the_file_is(history, server):
    assert all_of(server) == all_of(history)
    mark = history_mark(server)
    assert mark[:4] == history_mark(history)[:4]
    assert mark.settled
    found, expected = (
        sorted(one[1:] for one in ratios_after(each, 0, 0)) for each in (server, history)
    )
    assert len(found) == 2
    assert found == expected


def test_the_view_for_plain_sql_is_the_same(history, server, postgres):
    query = (
        "SELECT time, valve, tag, coulomb_friction, half_width, sliding_friction, ratio, message, "
        "refusal FROM friction"
    )
    expected = sorted(select(history, query), key=repr)
    assert len(expected) == 6
    assert sorted(postgres.do(database_of(server.place), query), key=repr) == expected


def test_there_is_nothing_before_the_first_row(database):
    with pytest.raises(HistoryError, match="contains no history: `valve_friction history copy`"):
        History(database).valves()
    with writing(database):
        pass
    assert History(database).valves() == ()


def test_columns_of_both_engines_are_the_same(history, database, postgres):
    with writing(database):
        pass
    found = postgres.do(
        database_of(database),
        "SELECT table_name, column_name FROM information_schema.columns "
        "WHERE table_schema = 'public' ORDER BY table_name, ordinal_position",
    )
    names = select(history, "SELECT name FROM sqlite_master WHERE type IN ('table', 'view')")
    expected = [
        (table, row[1])
        for (table,) in sorted(names)
        for row in select(history, f"PRAGMA table_info({table})")
    ]
    assert found == expected


def with_step(monkeypatch, *statements):
    """Have a next version whose step from this one are some statements."""

    def step(connection, version):
        assert version == tables.SCHEMA_VERSION
        for statement in statements:
            connection.exec_driver_sql(statement)

    monkeypatch.setattr(connections, "SCHEMA_VERSION", tables.SCHEMA_VERSION + 1)
    monkeypatch.setattr(connections, "bring_up_to_date", step)


class TestVersions:
    """Tables of an older version are changed, those of a newer one are left alone."""

    def test_a_server_of_version_7_is_read_and_extended(self, tmp_path, database, postgres):
        """It holds what the file of that version holds."""
        postgres.do(database_of(database), VERSION_7.read_text())
        file = make_version(7, HistoryFile(tmp_path / "history.sqlite"))
        name = database_of(database)
        rights = "GRANT SELECT ON ALL TABLES IN SCHEMA public TO reader"
        postgres.do(name, f"CREATE ROLE reader LOGIN PASSWORD 'one'; {rights}")
        reader = History(HistoryServer(postgres.url(name, "reader", "one")))
        assert all_of(reader) == all_of(History(database)) == all_of(file)
        with writing(database):
            pass
        postgres.do(name, "GRANT SELECT ON ALL TABLES IN SCHEMA public TO reader")
        assert [one.written for one in copied(file.path, database)] == [0] * 11
        assert all_of(reader) == all_of(file)
        server_engine(reader.place).dispose()
        postgres.do(name, "DROP OWNED BY reader; DROP ROLE reader")
        file.add(success(START + 9))
        assert sum(one.written for one in copied(file.path, database)) == 1
        assert all_of(History(database)) == all_of(file)

    def test_a_step_is_done_once_by_many(self, server, monkeypatch):
        before = all_of(server)
        with_step(monkeypatch, "ALTER TABLE valve ADD COLUMN remark REAL")
        for _ in range(2):
            with writing(server.place) as connection:
                found = connection.exec_driver_sql("SELECT remark FROM valve").all()
        assert len(found) == 2
        assert all_of(server) == before

    def test_a_step_that_fails_changes_nothing(self, server, monkeypatch):
        before = all_of(server)
        with monkeypatch.context() as patch:
            with_step(patch, "DROP VIEW friction", "ALTER TABLE nowhere ADD COLUMN remark REAL")
            with pytest.raises(HistoryError, match="nowhere"), writing(server.place):
                pass
        assert all_of(server) == before
        with writing(server.place) as connection:
            assert connection.exec_driver_sql("SELECT count(*) FROM friction").scalar() == 6

    def test_a_newer_one_is_refused(self, history, server, postgres):
        newer = "UPDATE mark SET value = '99' WHERE name = 'schema'"
        postgres.do(database_of(server.place), newer)
        for act in (server.valves, lambda: copied(history.path, server.place)):
            with pytest.raises(HistoryError, match="newer version of this package"):
                act()


class TestTrouble:
    """One line: what, where, what to do; and never a password."""

    @pytest.mark.parametrize(
        ("change", "words"),
        [
            (lambda url: url.replace("owner@", f"nobody:{SECRET}@"), "password"),
            (lambda url: re.sub(":[0-9]+/", ":1/", url), "check that the server runs"),
            (lambda url: url + "x", "create it, or use another database"),
            (lambda url: url + "?sslmode=require", "check sslmode"),
            (lambda url: url + f"?nonsense=1&password={SECRET}", "cannot read"),
        ],
    )
    def test_what_hinders(self, database, change, words):
        server = HistoryServer(change(database.url))
        with pytest.raises(HistoryError, match=words) as error:
            History(server).valves()
        message = str(error.value)
        assert message.startswith(f"{server}: ")
        assert "\n" not in message
        for secret in ("s3cret", "word@"):
            assert secret not in message + repr(server) + str(server)

    def test_addresses(self):
        server = HistoryServer("postgresql://me:s3cret@host:1/db?sslmode=require&password=o%20ther")
        assert str(server) == "postgresql://me@host:1/db"
        assert "s3cret" not in repr(server)
        told = server.without_secrets("no s3cret,\nno o%20ther, no o ther")
        assert told == "no ***, no ***, no ***"
        assert str(HistoryServer("postgres://a,b/db")) == "postgresql://a,b/db"
        for wrong in ("host/db", "mysql://host/db", "postgresql://a b", "postgresql://[::1/db"):
            with pytest.raises(ValueError, match="address of") as error:
                HistoryServer(wrong)
            assert wrong not in str(error.value)

    def test_parameter_and_environment(self):
        name = "VALVE_FRICTION_HISTORY_URL"
        outer = {name: "postgresql://me:s3cret@host/outer"}
        assert server_from("", environment={}) is None
        assert str(server_from("", environment=outer)) == "postgresql://me@host/outer"
        inner = "postgresql://me@host/inner"
        assert server_from(inner, environment=outer) == HistoryServer(inner)
        with pytest.raises(ValueError, match=r"history_url holds a password.*pgpass") as error:
            server_from(outer[name], environment={})
        assert "s3cret" not in str(error.value)
        with pytest.raises(ValueError, match=f"{name}: not the address"):
            server_from("", environment={name: "s3cret"})

    def test_a_server_that_stands_still_is_left(self, history, server, postgres, monkeypatch):
        monkeypatch.setattr(connections, "_PATIENCE_WITH_SERVER", 1.0)
        late = pytest.raises(
            HistoryError, match="timeout: no answer for 1 s: check that the server"
        )
        with late, writing(server.place) as connection, postgres.paused():
            connection.scalar(sa.select(1))
        with postgres.paused(), pytest.raises(HistoryError):
            server.valves()
        assert server.valves() == history.valves()

    def test_a_connection_that_has_ended_is_made_anew(self, history, server, postgres):
        assert server.valves() == history.valves()
        postgres.stop()
        with pytest.raises(HistoryError):
            server.valves()
        postgres.start()
        assert server.valves() == history.valves()

    def test_texts_of_any_kind_arrive(self, history, server):
        entry = success(START + 9, warnings=("a\0b '; DROP TABLE valve; -- %s ? 😀",))
        history.add(entry)
        assert all(one.is_same for one in copied(history.path, server.place))
        last = server.entries([VALVE.name])[-1]
        assert last.warnings == ("a␀b '; DROP TABLE valve; -- %s ? 😀",)


def test_without_a_server_its_library_is_not_loaded(tmp_path):
    code = (
        "import sys, valve_friction_ros.history as h; from pathlib import Path; "
        f"h.HistoryFile(Path({str(tmp_path / 'h.sqlite')!r})).prepare(); "
        "print('psycopg' in sys.modules)"
    )
    assert printed("-c", code, cwd=PROJECT) == "False\n"


def test_without_its_library_one_line_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "psycopg", None)
    with pytest.raises(HistoryError, match=r"^postgresql://h/d: psycopg is missing: pip install"):
        History(HistoryServer("postgresql://h/d")).valves()


PAGE = PROJECT / "doc" / "how_to" / "history_server.md"
(ROLES,) = re.findall(r"```sql\n(.*?)```", PAGE.read_text(), re.DOTALL)


@pytest.fixture
def one_valve(tmp_path):
    one_valve = HistoryFile(tmp_path / "history.sqlite")
    fill(one_valve)
    return one_valve


@pytest.fixture
def roles(one_valve, database, postgres):
    """Addresses of the server for a node and a reader, with the rights of the page."""
    copied(one_valve.path, database)
    name = database_of(database)
    postgres.do(name, "DROP ROLE IF EXISTS valve_nodes; DROP ROLE IF EXISTS valve_readers;" + ROLES)
    yield {
        role: HistoryServer(postgres.url(name, role, password))
        for role, password in (("valve_nodes", "one"), ("valve_readers", "another"))
    }
    postgres.do(name, "DROP OWNED BY valve_nodes, valve_readers")
    postgres.do(name, "DROP ROLE valve_nodes, valve_readers")


def test_a_node_may_send_and_take(one_valve, roles, database, tmp_path):
    with sending(one_valve, roles["valve_nodes"]) as sender:
        assert sender.take(VALVE) is None
        fill(one_valve)  # adds, changes and replaces
        keep_renewal(one_valve, VALVE, START + 10**9)  # deletes
        one_valve.add(success(START + 9, valve=VALVE._replace(tag="renamed")))
        wait_until(
            lambda: all_of(History(database)) == all_of(one_valve), lambda: sender.state, turn=0.1
        )
        assert sender.state.problem is None
    second = HistoryFile(tmp_path / "second.sqlite")
    with sending(second, roles["valve_nodes"]) as sender:
        assert sender.take(VALVE) is None
        assert len(second.entries()) == len(one_valve.entries())


def test_a_reader_reads_and_writes_nothing(one_valve, roles):
    assert all_of(History(roles["valve_readers"])) == all_of(one_valve)
    one_valve.add(success(START + 9))
    with pytest.raises(HistoryError, match=r"permission denied.*history_server\.md") as error:
        copied(one_valve.path, roles["valve_readers"])
    assert "another" not in str(error.value)


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE identification SET level = 0",
        "DELETE FROM identification",
        "DELETE FROM parameter",
        "UPDATE baseline SET coulomb_friction = 1",
        "DELETE FROM baseline",
        "DELETE FROM packing_renewal",
        "UPDATE valve SET name = 'x'",
        "UPDATE mark SET value = 'x'",
        "INSERT INTO mark VALUES ('x', 'x')",
        "DROP TABLE told_level",
        "CREATE TABLE x (a INTEGER)",
    ],
)
def test_what_a_node_may_not(roles, statement):
    import psycopg

    with (
        psycopg.connect(roles["valve_nodes"].url) as connection,
        pytest.raises(psycopg.errors.InsufficientPrivilege),
    ):
        connection.execute(statement)


def test_who_may_make_no_tables_is_told_who_does(one_valve, database, postgres):
    name = database_of(database)
    postgres.do(name, "CREATE ROLE stranger LOGIN PASSWORD 'three'")
    try:
        with pytest.raises(HistoryError, match="have the owner of the database run"):
            copied(one_valve.path, HistoryServer(postgres.url(name, "stranger", "three")))
    finally:
        postgres.do(name, "DROP ROLE stranger")


@contextmanager
def encrypted(postgres, folder):
    """Have the server offer TLS, and nothing else."""
    certificate, key = certificate_pair(folder)
    owner = postgres.folder.stat()
    for path in (certificate, key):
        copy = postgres.folder / path.name
        copy.write_bytes(path.read_bytes())
        os.chown(copy, owner.st_uid, owner.st_gid)
        copy.chmod(0o600)
    rules = (postgres.data / "pg_hba.conf").read_text()
    (postgres.data / "pg_hba.conf").write_text(rules.replace("host all", "hostssl all"))
    before = dict(postgres.settings)
    postgres.settings |= {
        "ssl": "on",
        "ssl_cert_file": postgres.folder / certificate.name,
        "ssl_key_file": postgres.folder / key.name,
    }
    postgres.stop()
    postgres.start()
    try:
        yield certificate
    finally:
        postgres.settings = before
        (postgres.data / "pg_hba.conf").write_text(rules)
        postgres.stop()
        postgres.start()


def test_encryption_by_the_address(one_valve, database, postgres, tmp_path):
    with encrypted(postgres, tmp_path) as certificate:
        (tmp_path / "other").mkdir()
        stranger, _ = certificate_pair(tmp_path / "other")
        # The certificate is of that name, and the server listens on this address.
        named = database.url.replace("@127.0.0.1:", "@localhost:") + "?hostaddr=127.0.0.1"
        checked = f"{named}&sslmode=verify-full&sslrootcert="
        parts = copied(one_valve.path, HistoryServer(f"{checked}{certificate}"))
        assert all(one.is_same for one in parts)
        for url in (f"{checked}{stranger}", f"{database.url}?sslmode=disable"):
            with pytest.raises(HistoryError) as error:
                History(HistoryServer(url)).valves()
            assert "check sslmode and sslrootcert" in str(error.value)
