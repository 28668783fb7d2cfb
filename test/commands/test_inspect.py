# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`inspect`, and `--save-columns`: what is recognized once needs no option again."""

import json

import numpy as np
import pytest

from valve_friction_ros.records.valve_file import read_valve_file

PLAIN = "diaphragm_area: 0.0445  # m²\ntravel: 0.028575\n"
OF_NODE = (
    "# a comment that stays\n/**:\n  ros__parameters:\n    diaphragm_area: 0.0445\n"
    "    columns:\n      decimal: ','\n    travel: 0.028575\n"
)


@pytest.fixture
def export(tmp_path):
    """A German export whose headers name no units: forty samples at 10 Hz, one of them bad."""
    rows = ["Zeit;Druck;Hub"]
    for index in range(40):
        pressure = f"{1 + 0.5 * np.sin(index / 6):.4f}".replace(".", ",")
        stem = f"{10 + 5 * np.sin(index / 6):.3f}".replace(".", ",")
        rows.append(f"{0.1 * index:.1f}".replace(".", ",") + f";{pressure};{stem}")
    rows[20] = "1,9;Bad Input;12,0"
    path = tmp_path / "export.csv"
    path.write_text("\n".join(rows))
    return path


ANSWERS = ("--pressure-unit", "bar", "--position-unit", "mm")


def test_what_is_open_is_one_line(command, export):
    code, out, err = command("inspect", export)
    assert code == 2
    assert out.startswith("read as: semicolon; decimal comma; time in s; pressure 'Druck', ")
    (line,) = err.splitlines()
    assert "--pressure-unit" in line
    assert "--position-unit" in line


def test_what_would_be_read(command, export):
    code, out, err = command("inspect", export, *ANSWERS, "--json")
    assert (code, err) == (0, "")
    told = json.loads(out)
    pressure, stem = told["signals"]
    assert (pressure["samples"], pressure["bad"], stem["samples"], stem["bad"]) == (39, 1, 40, 0)
    assert pressure["period"] == pytest.approx(0.1)
    assert (pressure["unit"], stem["unit"]) == ("bar", "mm")
    assert stem["low"] == pytest.approx(5.0, abs=0.1)
    assert told["questions"] == []
    code, out, _ = command("inspect", export, *ANSWERS)
    assert code == 0
    assert sum(mark in "▁▂▃▄▅▆▇█" for mark in out) == 40 + 39


@pytest.mark.parametrize("text", [PLAIN, OF_NODE], ids=["plain", "of a node"])
def test_saved_columns_need_no_option(command, export, tmp_path, text):
    valve, saved = tmp_path / "valve.yaml", tmp_path / "saved.yaml"
    valve.write_text(text)
    code, _, err = command("inspect", export, "--valve", valve, *ANSWERS, "--save-columns", saved)
    assert (code, err) == (0, "")
    code, out, err = command("inspect", export, "--valve", saved, "--json")
    assert (code, err) == (0, "")
    assert [one["unit"] for one in json.loads(out)["signals"]] == ["bar", "mm"]
    found = read_valve_file(saved)
    assert found.valve == read_valve_file(valve).valve
    assert found.columns.delimiter == ";"
    for comment in (line.partition("#")[2] for line in text.splitlines() if "#" in line):
        assert comment in saved.read_text()


def test_a_picture(command, export, tmp_path):
    valve, picture = tmp_path / "valve.yaml", tmp_path / "record.png"
    valve.write_text(PLAIN)
    code, _, err = command("inspect", export, "--valve", valve, *ANSWERS, "--plot", picture)
    assert (code, err) == (0, "")
    assert picture.read_bytes().startswith(b"\x89PNG")
