# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Who may come in: accounts and their hashes, where a dashboard listens, tries and sessions."""

import asyncio
import hashlib
import json
import re
import shutil
import subprocess
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st
from local_server import certificate_pair
from quick_accounts import PASSWORD, quick_account, quick_hash

from valve_friction_ros.dashboard.accounts import (
    SHORTEST,
    VARIABLE,
    Access,
    Account,
    HashedPassword,
    Role,
    accounts_from,
)
from valve_friction_ros.dashboard.gate import host_of, is_own_origin, own_path
from valve_friction_ros.dashboard.log_in import AttemptLimit, LogIn, Sessions


def test_a_new_hash_is_the_documented_scrypt():
    made = HashedPassword.of("päßwörd of Anna")
    assert re.fullmatch(r"scrypt:14:8:5:[\w-]{22}:[\w-]{43}", str(made))
    assert made.digest == hashlib.scrypt(
        "päßwörd of Anna".encode(), salt=made.salt, n=2**14, r=8, p=5, maxmem=2**26, dklen=32
    )
    assert made.matches("pa\u0308ßwo\u0308rd of Anna")  # as another keyboard has it
    assert str(HashedPassword.of("päßwörd of Anna")) != str(made)


@given(st.text(min_size=1, max_size=40), st.text(min_size=1, max_size=40))
def test_only_the_password_matches(one, other):
    equal = unicodedata.normalize("NFKC", one) == unicodedata.normalize("NFKC", other)
    assert HashedPassword.read(str(quick_hash(one))).matches(other) == equal


@pytest.mark.parametrize("length", [SHORTEST - 1, 201])
def test_lengths_that_are_refused(length):
    with pytest.raises(ValueError, match="10 to 200 characters"):
        HashedPassword.of("x" * length)


@pytest.mark.parametrize(
    "change",
    [
        ("scrypt", "bcrypt"),
        (":10:", ":9:"),
        (":10:", ":21:"),  # 8 GiB a try
        (":10:", ":x:"),
        (":1:1:", ":1:"),
        (":1:1:", ":1:17:"),
        -1,  # cut off
        -5,
        -43,
    ],
)
def test_hashes_that_are_refused(change):
    text = str(quick_hash())
    wrong = text.replace(*change, 1) if isinstance(change, tuple) else text[:change]
    with pytest.raises(ValueError, match="usable password hash") as raised:
        HashedPassword.read(wrong)
    assert text[-20:] not in str(raised.value)


def test_no_secret_in_what_is_shown():
    account = quick_account()
    for part in str(account.password).split(":")[-2:]:
        assert part not in repr(account)
    assert repr(account.password.digest) not in repr(account)


def write(path, text, mode=0o600):
    path.write_text(text)
    path.chmod(mode)
    return path


def test_accounts_of_a_file(tmp_path):
    anna, bo = quick_account(), quick_account("bo@plant", Role.VIEW)
    file = write(tmp_path / "accounts", f"# who may\n\n{anna}\n{bo}\n")
    assert accounts_from(file, {}) == (anna, bo)
    assert accounts_from(None, {VARIABLE: f"{anna};{bo}"}) == (anna, bo)
    assert accounts_from(None, {}) == ()
    assert accounts_from(None, {VARIABLE: " "}) == ()


@pytest.mark.parametrize("mode", [0o644, 0o604, 0o660, 0o602, 0o640, 0o610])
def test_a_file_that_others_can_read_is_refused(tmp_path, mode):
    file = write(tmp_path / "accounts", f"{quick_account()}\n", mode)
    with pytest.raises(ValueError, match=f"open to others: run `chmod 600 {file}`"):
        accounts_from(file, {})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{anna}\n{anna}", "line 2: 'anna' is given twice"),
        ("anna operate", "line 1: not NAME, role"),
        ("anna admin {hash}", "line 1: not NAME, role"),
        ("an/na view {hash}", "line 1: an account name must"),
        ("anna view plaintext-password", "line 1: not a usable password hash"),
        ("# nobody", "contains no account"),
        ("", "contains no account"),
    ],
)
def test_wrong_files(tmp_path, text, words):
    anna = quick_account()
    file = write(tmp_path / "accounts", text.format(anna=anna, hash=anna.password))
    with pytest.raises(ValueError, match=words) as raised:
        accounts_from(file, {})
    assert "plaintext" not in str(raised.value)
    assert str(anna.password) not in str(raised.value)


def test_two_sources_are_refused(tmp_path):
    file = write(tmp_path / "accounts", f"{quick_account()}\n")
    with pytest.raises(ValueError, match="give one of them"):
        accounts_from(file, {VARIABLE: str(quick_account())})


ANNA = quick_account()


class Clock:
    def __init__(self):
        self.now = 1000.0

    def __call__(self):
        return self.now


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.1.1", "::1", "localhost"])
def test_this_machine_needs_no_account(host):
    assert Access(host).warning == ""


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "10.1.2.3", "fd00::1", "plant.example", ""])
def test_any_other_address_needs_accounts(host):
    with pytest.raises(
        ValueError, match="there are no accounts: create one with `valve_friction dash"
    ):
        Access(host)
    assert "passwords and sessions can be read in transit" in Access(host, accounts=(ANNA,)).warning


def test_a_name_for_others_needs_accounts():
    """Behind a proxy on this machine the address is its own, and others come in all the same."""
    with pytest.raises(ValueError, match="no accounts"):
        Access(host_names=("valves.example",))


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    return certificate_pair(tmp_path_factory.mktemp("tls"))


def test_tls_needs_a_pair(pair, tmp_path):
    certificate, key = pair
    assert Access("0.0.0.0", accounts=(ANNA,), certificate=certificate, key=key).warning == ""
    with pytest.raises(ValueError, match="give both or none"):
        Access(certificate=certificate)
    with pytest.raises(ValueError, match="cannot be used"):
        Access(certificate=key, key=key)
    with pytest.raises(OSError, match=r"missing\.pem"):
        Access(certificate=tmp_path / "missing.pem", key=key)
    locked = tmp_path / "locked.pem"
    subprocess.run(
        ["openssl", "pkcs8", "-topk8", "-in", key, "-out", locked, "-passout", "pass:secret"],
        check=True,
    )
    locked.chmod(0o600)
    with pytest.raises(ValueError, match="without a password"):
        Access(certificate=certificate, key=locked)
    locked.chmod(0o644)
    with pytest.raises(ValueError, match="open to others"):
        Access(certificate=certificate, key=locked)


LOCAL = Access()
OPEN = Access("0.0.0.0", host_names=("Valves.example",), accounts=(ANNA,))


@pytest.mark.parametrize(
    ("access", "called", "address", "answers"),
    [
        (LOCAL, "127.0.0.1:8080", "127.0.0.1", True),
        (LOCAL, "localhost:8080", "127.0.0.1", True),
        (LOCAL, "LOCALHOST.", "127.0.0.1", True),
        (LOCAL, "evil.example:8080", "127.0.0.1", False),
        (LOCAL, "127.0.0.1.evil.example", "127.0.0.1", False),
        (LOCAL, "10.0.0.9", "127.0.0.1", False),
        (LOCAL, "", "127.0.0.1", False),
        (LOCAL, "[", "127.0.0.1", False),
        (OPEN, "valves.example", "10.0.0.5", True),
        (OPEN, "10.0.0.5:8080", "10.0.0.5", True),
        (OPEN, "[fd00::1]:8080", "fd00::1", True),
        (OPEN, "10.0.0.6", "10.0.0.5", False),
        (OPEN, "rebound.example", "10.0.0.5", False),
    ],
)
def test_names_that_a_dashboard_answers_to(access, called, address, answers):
    assert access.answers_to(host_of(called), address) == answers


HERE, THERE = "127.0.0.1:8080", "valves.example"


@pytest.mark.parametrize(
    ("origin", "called", "is_encrypted", "is_own"),
    [
        (None, HERE, False, True),
        (f"http://{HERE}", HERE, False, True),
        (f"https://{HERE}", HERE, False, True),
        ("http://127.0.0.1:8081", HERE, False, False),
        ("http://127.0.0.1", HERE, False, False),
        ("http://evil.example", HERE, False, False),
        (f"http://{HERE}@evil.example", HERE, False, False),
        (f"ftp://{HERE}", HERE, False, False),
        ("null", HERE, False, False),
        ("", HERE, False, False),
        ("http://[", HERE, False, False),
        (None, THERE, True, True),
        (f"https://{THERE}", THERE, True, True),
        (f"http://{THERE}", THERE, True, False),
    ],
)
def test_origins(origin, called, is_encrypted, is_own):
    assert is_own_origin(origin, called, is_encrypted=is_encrypted) == is_own


def test_sessions_go_on_in_memory_where_they_cannot_be_kept(tmp_path):
    folder, lines = tmp_path / "full", []
    folder.mkdir()
    sessions = Sessions([ANNA], 60.0, Clock(), folder / "sessions.json", lines.append)
    shutil.rmtree(folder)
    token = sessions.begin(ANNA)
    assert sessions.account_of(token) is ANNA
    sessions.end(token)
    assert sessions.account_of(token) is None
    assert len(lines) == 2
    assert "No such file or directory" in lines[0]


def test_no_way_out_by_the_log_in():
    page = "/valve?node=/fv_101/identifier&zone=UTC"
    assert own_path(page) == page
    for text in ("//evil.example", "https://evil.example", "/\\evil.example", "\\\\evil",
                 "/\t/evil.example", "/a\nb", "javascript:x", ""):  # fmt: skip
        assert own_path(text) == "/"


def test_a_limit_slides():
    clock = Clock()
    limit = AttemptLimit(3, 60.0, clock)
    for seconds in (0, 10, 20):
        clock.now = 1000.0 + seconds
        assert limit.wait("a") == 0
        limit.count("a")
    assert limit.wait("a") == 40
    assert limit.wait("b") == 0
    clock.now = 1060.0
    assert limit.wait("a") == 0
    limit.count("a")
    assert limit.wait("a") == 10
    limit.forgive("a")
    assert limit.wait("a") == 0


def test_a_limit_forgets_the_oldest_of_too_many_keys():
    limit = AttemptLimit(1, 60.0, Clock())
    for number in range(10_001):
        limit.count(str(number))
    assert limit.wait("0") == 0
    assert limit.wait("1") == limit.wait("10000") == 60


@pytest.fixture
def door():
    """Function of attempts, (name, password, address) each, made one after the other."""
    clock, accounts = Clock(), (ANNA, quick_account("bo", Role.VIEW, "another password"))
    sessions = Sessions(accounts, 60.0, clock)
    log_in = LogIn(Access(accounts=accounts), sessions, clock)

    def attempts(*several):
        return [asyncio.run(log_in.attempt(*one)) for one in several]

    attempts.clock, attempts.sessions, attempts.log_in = clock, sessions, log_in
    return attempts


RIGHT, WRONG = ("anna", PASSWORD, "10.0.0.1"), ("anna", "wrong", "10.0.0.1")


def test_the_log_in_takes_the_right_password_only(door):
    (token,) = door(RIGHT)
    assert door.sessions.account_of(token) is ANNA
    wrong = (("anna", "another password"), ("bo", PASSWORD), ("cy", PASSWORD), ("", ""),
             ("anna", ""), ("anna", "x" * 5000))  # fmt: skip
    assert door(*((*one, "10.0.0.1") for one in wrong)) == [0] * len(wrong)


@pytest.mark.parametrize("name", ["anna", "nobody"])
def test_an_address_has_ten_wrong_tries(door, name):
    """A known and an unknown name have the same answers."""
    assert door(*[(name, "wrong", "10.0.0.1")] * 12) == [0] * 10 + [900] * 2
    refused, elsewhere = door(RIGHT, ("anna", PASSWORD, "10.0.0.2"))
    assert refused == 900
    assert isinstance(elsewhere, str)
    door.clock.now += 900.0
    assert isinstance(*door(RIGHT), str)


@pytest.mark.parametrize("name", ["anna", "nobody"])
def test_a_name_has_twenty_wrong_tries_from_everywhere(door, name):
    tries = [(name, "wrong", f"10.0.0.{i}") for i in range(22)]
    assert door(*tries) == [0] * 20 + [900] * 2


def test_a_right_password_between_the_wrong_ones_does_not_help(door):
    answers = door(*[WRONG, ("bo", "another password", "10.0.0.1")] * 10)
    assert answers[::2] == [0] * 10
    assert door(RIGHT) == [900]


def test_a_network_of_ipv6_is_one_address(door):
    tries = [(str(i), "wrong", f"fd00:1:2:3::{i:x}") for i in range(11)]
    assert door(*tries, ("x", "wrong", "fd00:1:2:4::1"))[-2:] == [900, 0]


def test_many_at_once_get_no_further_than_one_by_one(door):
    async def visit():
        return await asyncio.gather(*(door.log_in.attempt(*WRONG) for _ in range(50)))

    answers = asyncio.run(visit())
    assert answers.count(0) <= 10
    assert all(isinstance(each, int) for each in answers)


def test_a_session_ends():
    clock = Clock()
    sessions = Sessions([ANNA], 60.0, clock)
    token, other = sessions.begin(ANNA), sessions.begin(ANNA)
    assert token != other
    assert len(token) >= 43  # 256 bits
    assert sessions.account_of(token) is ANNA
    for strange in (None, "", "x", token[:-1], token.lower() + "x"):
        assert sessions.account_of(strange) is None
    sessions.end(token)
    assert sessions.account_of(token) is None
    assert sessions.account_of(other) is ANNA
    clock.now += 60.0
    assert sessions.account_of(other) is None


def test_sessions_are_bounded():
    sessions = Sessions([ANNA], 60.0, Clock())
    first, second, *_, last = (sessions.begin(ANNA) for _ in range(1001))
    assert sessions.account_of(first) is None
    assert sessions.account_of(second) is sessions.account_of(last) is ANNA


def test_sessions_survive_a_restart_unless_the_account_has_changed(tmp_path):
    file, clock = tmp_path / "sessions.json", Clock()
    bo = quick_account("bo", Role.OPERATE)
    first = Sessions([ANNA, bo], 60.0, clock, file)
    of_anna, of_bo, ended = first.begin(ANNA), first.begin(bo), first.begin(ANNA)
    first.end(ended)
    assert file.stat().st_mode & 0o777 == 0o600
    assert of_anna not in file.read_text()
    degraded = Account("bo", Role.VIEW, bo.password)
    second = Sessions([ANNA, degraded], 60.0, clock, file)
    assert second.account_of(of_anna) is ANNA
    assert second.account_of(of_bo) is None
    assert second.account_of(ended) is None
    renewed = Account("anna", Role.OPERATE, quick_hash())
    assert Sessions([renewed], 60.0, clock, file).account_of(of_anna) is None


@pytest.mark.parametrize("text", ["", "{", "[]", "3", '{"a": 1}', '{"a": ["b"]}'])
def test_a_damaged_file_of_sessions_is_begun_anew(tmp_path, text):
    file = write(tmp_path / "sessions.json", text)
    token = Sessions([ANNA], 60.0, Clock(), file).begin(ANNA)
    assert Sessions([ANNA], 60.0, Clock(), file).account_of(token) is ANNA
    assert len(json.loads(file.read_text())) == 1


def test_a_file_of_sessions_that_others_can_read_is_refused(tmp_path):
    file = write(tmp_path / "sessions.json", "{}", 0o644)
    with pytest.raises(ValueError, match="open to others"):
        Sessions([ANNA], 60.0, Clock(), file)


def test_an_unknown_name_takes_as_long_as_a_known_one(door, monkeypatch):
    """Both have one hash of the same cost made."""
    costs = []
    made = HashedPassword._hashed

    def noted(hashed, password):
        costs.append((hashed.cost, hashed.block, hashed.parallel))
        return made(hashed, password)

    monkeypatch.setattr(HashedPassword, "_hashed", noted)
    door(WRONG, ("nobody", "wrong", "10.0.0.1"))
    assert costs[0] == costs[1]
    assert len(costs) == 2
