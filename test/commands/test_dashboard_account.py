# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `dashboard-account`: the line that it prints is an account, and says no password."""

import io
import sys

import pytest

from valve_friction_ros.commands.main import run
from valve_friction_ros.dashboard.accounts import Account, Role

PASSWORD = "correct horse battery"


def typed(monkeypatch, text):
    monkeypatch.setattr(sys, "stdin", io.StringIO(text))


def test_a_piped_password(monkeypatch, capsys):
    typed(monkeypatch, f"{PASSWORD}\n")
    assert run(["dashboard-account", "anna", "--role", "operate"]) == 0
    printed = capsys.readouterr()
    account = Account.read(printed.out)
    assert (account.name, account.role) == ("anna", Role.OPERATE)
    assert account.password.matches(PASSWORD)
    assert PASSWORD not in printed.out + printed.err


@pytest.mark.parametrize(
    ("name", "password", "words"),
    [("anna", "short", "10 to 200 characters"), ("an na", PASSWORD, "the name of an account")],
)
def test_what_is_refused(monkeypatch, capsys, name, password, words):
    typed(monkeypatch, f"{password}\n")
    assert run(["dashboard-account", name]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert words in printed.err


def test_a_terminal_is_asked_twice(monkeypatch, capsys):
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    for second, code in ((PASSWORD, 0), ("another password", 2)):
        answers = iter([PASSWORD, second])
        monkeypatch.setattr("getpass.getpass", lambda _, answers=answers: next(answers))
        assert run(["dashboard-account", "bo"]) == code
    printed = capsys.readouterr()
    assert Account.read(printed.out).role is Role.VIEW
    assert "the two passwords differ" in printed.err
