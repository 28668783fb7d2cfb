# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Who may do what to a history on a server, and by which way."""

import datetime
import ipaddress
import os
import re
from contextlib import contextmanager
from pathlib import Path

import pytest
from full_history import all_of, fill
from histories import START, VALVE, success
from waiting import wait_until

from valve_friction_ros.history import (
    History,
    HistoryError,
    HistoryFile,
    HistoryServer,
    copied,
    keep_renewal,
    sender_of,
)

PAGE = Path(__file__).resolve().parents[2] / "doc" / "how_to" / "history_server.md"
(ROLES,) = re.findall(r"```sql\n(.*?)```", PAGE.read_text(), re.DOTALL)


@pytest.fixture
def history(tmp_path):
    history = HistoryFile(tmp_path / "history.sqlite")
    fill(history)
    return history


@pytest.fixture
def roles(history, database, postgres):
    """Addresses of the server for a node and a reader, with the rights of the page."""
    copied(history.path, database)
    name = database.url.rpartition("/")[2]
    postgres.do(name, "DROP ROLE IF EXISTS valve_nodes; DROP ROLE IF EXISTS valve_readers;" + ROLES)
    yield {
        role: HistoryServer(postgres.url(name, role, password))
        for role, password in (("valve_nodes", "one"), ("valve_readers", "another"))
    }
    postgres.do(name, "DROP OWNED BY valve_nodes, valve_readers")
    postgres.do(name, "DROP ROLE valve_nodes, valve_readers")


def test_a_node_may_send_and_take(history, roles, database, tmp_path):
    sender = sender_of(history.path, roles["valve_nodes"])
    try:
        assert sender.take(VALVE) is None
        fill(history)  # adds, changes and replaces
        keep_renewal(history, VALVE, START + 10**9)  # deletes
        history.add(success(START + 9, valve=VALVE._replace(tag="renamed")))
        wait_until(
            lambda: all_of(History(database)) == all_of(history), lambda: sender.state, turn=0.1
        )
        assert sender.state.problem is None
    finally:
        sender.end()
    second = HistoryFile(tmp_path / "second.sqlite")
    sender = sender_of(second.path, roles["valve_nodes"])
    try:
        assert sender.take(VALVE) is None
        assert len(second.entries()) == len(history.entries())
    finally:
        sender.end()


def test_a_reader_reads_and_writes_nothing(history, roles):
    assert all_of(History(roles["valve_readers"])) == all_of(history)
    history.add(success(START + 9))
    with pytest.raises(HistoryError, match=r"permission denied.*history_server\.md") as error:
        copied(history.path, roles["valve_readers"])
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


def test_who_may_make_no_tables_is_told_who_does(history, database, postgres):
    name = database.url.rpartition("/")[2]
    postgres.do(name, "CREATE ROLE stranger LOGIN PASSWORD 'three'")
    try:
        with pytest.raises(HistoryError, match="have the owner of the database run"):
            copied(history.path, HistoryServer(postgres.url(name, "stranger", "three")))
    finally:
        postgres.do(name, "DROP ROLE stranger")


def _certificate(folder, name):
    """Write a key and a certificate for 127.0.0.1, signed by itself."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)])
    now = datetime.datetime.now(datetime.timezone.utc)
    address = x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))])
    certificate = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + datetime.timedelta(days=1))
        .add_extension(address, critical=False)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .sign(key, hashes.SHA256())
    )
    paths = folder / f"{name}.pem", folder / f"{name}.key"
    paths[0].write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    paths[1].write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
    )
    return paths


@contextmanager
def encrypted(postgres, folder):
    """Have the server offer TLS, and nothing else."""
    pytest.importorskip("cryptography", reason="run `make venv-test`")
    certificate, key = _certificate(folder, "server")
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


def test_encryption_by_the_address(history, database, postgres, tmp_path):
    with encrypted(postgres, tmp_path) as certificate:
        stranger, _ = _certificate(tmp_path, "stranger")
        checked = f"{database.url}?sslmode=verify-full&sslrootcert="
        parts = copied(history.path, HistoryServer(f"{checked}{certificate}"))
        assert all(one.is_same for one in parts)
        for url in (f"{checked}{stranger}", f"{database.url}?sslmode=disable"):
            with pytest.raises(HistoryError) as error:
                History(HistoryServer(url)).valves()
            assert "check sslmode and sslrootcert" in str(error.value)
