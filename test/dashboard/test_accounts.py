# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Accounts and the hashes of their passwords: what is read, refused and kept secret."""

import hashlib
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from quick_accounts import PASSWORD, quick_account, quick_hash

from valve_friction_ros.dashboard.accounts import (
    SHORTEST,
    VARIABLE,
    Account,
    HashedPassword,
    Role,
    accounts_from,
)


def test_a_new_hash_is_the_documented_scrypt():
    made = HashedPassword.of("päßwörd of Anna")
    assert re.fullmatch(r"scrypt:14:8:5:[\w-]{22}:[\w-]{43}", str(made))
    assert made.digest == hashlib.scrypt(
        "päßwörd of Anna".encode(), salt=made.salt, n=2**14, r=8, p=5, maxmem=2**26, dklen=32
    )
    assert made.matches("päßwörd of Anna")
    assert made.matches(
        "pa\u0308ßwo\u0308rd of Anna"
    )  # the same letters, as another keyboard has it
    assert not made.matches("paßwörd of Anna")


def test_the_same_password_never_has_the_same_hash():
    assert str(quick_hash()) != str(quick_hash())


@given(st.text(min_size=1, max_size=40), st.text(min_size=1, max_size=40))
def test_only_the_password_matches(one, other):
    import unicodedata

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
    ],
)
def test_hashes_that_are_refused(change):
    text = str(quick_hash())
    with pytest.raises(ValueError, match="no usable hash") as raised:
        HashedPassword.read(text.replace(*change, 1))
    assert text[-20:] not in str(raised.value)


@pytest.mark.parametrize("cut", [1, 5, 43])
def test_a_hash_that_was_cut_off_is_refused(cut):
    with pytest.raises(ValueError, match="no usable hash"):
        HashedPassword.read(str(quick_hash())[:-cut])


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
        ("{anna}\n{anna}", "line 2: 'anna' is there twice"),
        ("anna operate", "line 1: not NAME, role"),
        ("anna admin {hash}", "line 1: not NAME, role"),
        ("an/na view {hash}", "line 1: the name of an account"),
        ("anna view plaintext-password", "line 1: no usable hash"),
        ("# nobody", "holds no account"),
        ("", "holds no account"),
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


def test_a_line_is_read_as_it_was_written():
    account = quick_account("bo", Role.VIEW)
    assert Account.read(str(account)) == account
    assert account.password.matches(PASSWORD)
