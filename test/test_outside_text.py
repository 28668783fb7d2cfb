# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Names and tags from outside: shown, never obeyed."""

import csv

import pytest
from histories import START, VALVE, success

from valve_friction_ros.commands.main import run
from valve_friction_ros.history import HistoryFile, KeptValve
from valve_friction_ros.outside_text import harmless, printable

TAG = "=1+1 cost $\\foo{$ \x1b[2J\x07"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("FV-101 µm ²", "FV-101 µm ²"),
        ("\x1b[31mred\x07\n", "\\x1b[31mred\\x07\\n"),
        ("\x9b2J\u202etxt\udcff", "\\x9b2J\\u202etxt\\udcff"),
        ("x" * 20_000, "x" * 10_000 + "…"),
    ],
)
def test_printable(text, shown):
    assert printable(text) == shown


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@x", "\t=1", "\r=1"])
def test_a_formula_is_a_text(text):
    assert harmless(text) == f"'{text}"
    assert (harmless("FV-101"), harmless(-1.0), harmless(None)) == ("FV-101", -1.0, None)


def test_a_hostile_tag_in_table_csv_and_picture(tmp_path, capsys):
    file = tmp_path / "plant.sqlite"
    HistoryFile(file).add(success(START, valve=KeptValve(VALVE.name, TAG)))
    table, picture = tmp_path / "a.csv", tmp_path / "a.png"
    assert run(["history", str(file), "--csv", str(table), "--plot", str(picture)]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "=1+1 cost $\\foo{$ \\x1b[2J\\x07" in out
    with table.open(newline="") as stream:
        (row,) = csv.DictReader(stream)
    assert row["tag"] == f"'{TAG}"
    assert picture.stat().st_size > 5000
