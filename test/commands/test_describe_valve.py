# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`describe-valve`, and `inspect`: what is written once needs no option again."""

import json

import numpy as np
import pytest
import yaml
from processes import ran

from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.valve_file import read_valve_file

SINGLE = {
    "tag": "FV-101",
    "area": "690 cm2",
    "travel": "1.125 in",
    "acting": "single",
    "spring_range": "3..15 psi",
    "air_to": "close",
    "position": "plug",
    "sensor": "absolute",
    "sensor_range": "0..7 bar",
    "mass": "3.5 lb",
}


def options(answers):
    return [f"--{name.replace('_', '-')}={value}" for name, value in answers.items()]


@pytest.fixture
def described(told, tmp_path):
    def described(*arguments):
        path = tmp_path / "fv_101.yaml"
        assert told("describe-valve", *arguments, "--output", path) == f"{path}\n"
        return read_valve_file(path)

    return described


def test_units_of_people(described):
    found = described(*options(SINGLE))
    assert found.valve.diaphragm_area == pytest.approx(0.069, rel=1e-8)
    assert found.valve.travel == pytest.approx(0.028575, rel=1e-8)
    assert found.valve.pressure_reference == 101325.0
    assert (found.valve.pressure_minimum, found.valve.pressure_maximum) == (0.0, 7e5)
    psi = 6894.757293
    assert found.known["spring_constant"] == pytest.approx(0.069 * 12 * psi / 0.028575, rel=1e-7)
    assert found.known["spring_preload"] == pytest.approx(0.069 * 3 * psi, rel=1e-7)
    assert found.known["mass"] == pytest.approx(3.5 * 0.45359237, rel=1e-7)
    assert not any(name.startswith("fixed.") for name in found.settings)
    assert found.columns == Columns(inverted_position=True)


@pytest.mark.parametrize(
    ("air_to", "position", "inverted"),
    [("open", "plug", False), ("open", "stem", False), ("close", "stem", False)],
)
def test_only_the_opening_of_an_air_to_close_valve_is_inverted(
    described, air_to, position, inverted, tmp_path
):
    found = described(*options(SINGLE | {"air_to": air_to, "position": position}))
    assert found.columns.inverted_position == inverted
    written = yaml.safe_load((tmp_path / "fv_101.yaml").read_text())["/**"]["ros__parameters"]
    assert written.get("air_to", "open") == air_to  # where a node looks for the seat


def test_double_acting_without_a_spring(described):
    answers = {"area": "500cm²", "travel": "50 mm", "acting": "double", "opposing_area": "450cm^2"}
    found = described("--yes", *options(answers))
    assert found.columns.opposing_area_ratio == pytest.approx(0.9)
    assert found.columns.opposing_pressure_column == "opposing_pressure_pa"
    assert found.settings["fixed.spring_constant"] == 0.0


def test_columns_are_kept(described):
    answers = {"area": "690cm2", "travel": "28mm", "position_unit": "%", "time_zone": "Asia/Tokyo"}
    found = described("--yes", *options(answers), "--time-column", 'Zeit: [s] # "x"')
    assert found.columns == Columns(
        time_column='Zeit: [s] # "x"', position_unit="percent", time_zone="Asia/Tokyo"
    )


def test_a_node_reads_it(told):
    """ROS wants doubles with a point, below two lines of its own."""
    out = told("describe-valve", *options(SINGLE))
    parameters = yaml.safe_load(out)["/**"]["ros__parameters"]
    numbers = [value for value in parameters.values() if not isinstance(value, (str, dict))]
    assert len(numbers) == 8
    assert all(type(number) is float for number in numbers)
    assert out.count("  # ") >= 8


def test_what_is_open_is_asked_for(tmp_path):
    path = tmp_path / "fv_101.yaml"
    answers = "".join(f"{SINGLE[name]}\n" for name in SINGLE if name != "area")
    options = ("--output", path, "--area", "690cm2")
    code, out, err = ran("describe-valve", *options, input=answers)
    assert (code, out) == (0, f"{path}\n")
    assert "spring range (bench set) (0.2..1.0 bar, 3..15 psi) [none]: " in err
    assert read_valve_file(path).valve.travel == pytest.approx(0.028575)


def test_a_wrong_answer_is_asked_for_again():
    wrong = SINGLE | {"area": "690 ha\n690 cm2", "acting": "triple\nsingle"}
    answers = "".join(f"{answer}\n" for answer in wrong.values())
    code, out, err = ran("describe-valve", input=answers)
    assert code == 0
    assert err.count("unknown unit 'ha'") == err.count("choose single or") == 1
    assert "diaphragm_area: 0.069 " in out


def test_after_the_last_wrong_answer_it_ends():
    code, out, err = ran("describe-valve", input="FV-1\n690 cm2\n28 mm\ntriple\n")
    assert (code, out) == (2, "")
    assert err.count("'triple': choose single or double") == 2


def test_what_nobody_said_is_called_assumed(told):
    given = {"area": "690cm2", "travel": "28mm", "acting": "double"}
    lines = told("describe-valve", "--yes", *options(given)).splitlines()
    found = {line.split(":")[0].strip() for line in lines if "assumed" in line.partition("#")[2]}
    guesses = {"opposing_pressure_column", "opposing_area_ratio", "fixed.spring_constant"}
    assert found == guesses
    given |= {"opposing_area": "600cm2", "opposing_pressure_column": "p2"}
    given |= {"spring_range": "0.2..1 bar"}
    assert "assumed:" not in told("describe-valve", "--yes", *options(given))


@pytest.mark.parametrize(
    ("answers", "cause"),
    [
        ({"area": "690"}, "--area: '690': there is no unit; known are m2, cm2, mm2, in2"),
        ({"area": "690 ha"}, "--area: '690 ha': unknown unit 'ha'"),
        ({"area": "nan cm2"}, "--area: 'nan cm2' is not a number with a unit, such as 690 cm2\n"),
        ({"travel": "long"}, "--travel: 'long' is not a number with a unit, such as 28.6 mm\n"),
        ({"area": "690 m2"}, "cm² or in² read as m²?"),
        ({"travel": "28 m"}, "mm read as m?"),
        ({"spring_range": "1..0.2 bar"}, "give the range from low to high"),
        ({"spring_range": "1 bar"}, "is not a range with a unit"),
        ({"acting": "triple"}, "choose single or double"),
        ({"opposing_area": "1 cm2"}, "belongs to a double-acting actuator"),
        ({"time_zone": "Mars"}, "unknown time_zone 'Mars'"),
    ],
)
def test_one_line(refused, answers, cause, tmp_path):
    path = tmp_path / "fv_101.yaml"
    given = {"area": "690cm2", "travel": "28mm", **answers}
    told = refused("describe-valve", "--yes", "--output", path, *options(given))
    assert cause in f"{told}\n"
    assert not path.exists()


def test_nothing_is_replaced_unasked(refused, described, tmp_path):
    given = options({"area": "690cm2", "travel": "28mm"})
    described("--yes", *given)
    told = refused("describe-valve", "--yes", *given, "--output", tmp_path / "fv_101.yaml")
    assert told.endswith("it already exists: give another name, or --replace")
    described("--yes", "--replace", *given)


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


def test_what_would_be_read(command, told, export):
    code, out, err = command("inspect", export)
    assert code == 2
    assert out.startswith("read as: semicolon; decimal comma; time in s; pressure 'Druck', ")
    (line,) = err.splitlines()
    assert "--pressure-unit" in line
    assert "--position-unit" in line
    found = json.loads(told("inspect", export, *ANSWERS, "--json"))
    pressure, stem = found["signals"]
    assert (pressure["samples"], pressure["bad"], stem["samples"], stem["bad"]) == (39, 1, 40, 0)
    assert pressure["period"] == pytest.approx(0.1)
    assert (pressure["unit"], stem["unit"]) == ("bar", "mm")
    assert stem["low"] == pytest.approx(5.0, abs=0.1)
    assert found["questions"] == []
    out = told("inspect", export, *ANSWERS)
    assert sum(mark in "▁▂▃▄▅▆▇█" for mark in out) == 40 + 38  # a bad one leaves a hole


@pytest.mark.parametrize(
    ("bad", "told_of_it"),
    [
        (40, "'?' is not a valid value, and neither is any other of the 40 values of 'Druck'"),
        (9, "(--maximum-bad-share 0.23)"),
    ],
)
def test_what_identify_would_refuse(command, export, bad, told_of_it):
    """It ended with 0, and showed a signal without values."""
    rows = export.read_text().splitlines()
    for row in range(1, 1 + bad):
        time, _, stem = rows[row].split(";")
        rows[row] = f"{time};?;{stem}"
    rows[20] = rows[20].replace("Bad Input", "1,5")
    export.write_text("\n".join(rows))
    code, out, err = command("inspect", export, *ANSWERS)
    assert code == 2
    assert " bar " in out
    assert told_of_it in err


@pytest.mark.parametrize("text", [PLAIN, OF_NODE], ids=["plain", "of a node"])
def test_saved_columns_need_no_option(told, export, tmp_path, text):
    valve, saved = tmp_path / "valve.yaml", tmp_path / "saved.yaml"
    valve.write_text(text)
    told("inspect", export, "--valve", valve, *ANSWERS, "--save-columns", saved)
    out = told("inspect", export, "--valve", saved, "--json")
    assert [one["unit"] for one in json.loads(out)["signals"]] == ["bar", "mm"]
    found = read_valve_file(saved)
    assert found.valve == read_valve_file(valve).valve
    assert found.columns.delimiter == ";"
    for comment in (line.partition("#")[2] for line in text.splitlines() if "#" in line):
        assert comment in saved.read_text()


def test_a_picture(told, export, tmp_path):
    valve, picture = tmp_path / "valve.yaml", tmp_path / "record.png"
    valve.write_text(PLAIN)
    told("inspect", export, "--valve", valve, *ANSWERS, "--plot", picture)
    assert picture.read_bytes().startswith(b"\x89PNG")
