# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Exports of other programs, read with few options or none; units by their definitions."""

from collections import Counter
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from benchmark.exports.programs import PROGRAMS, pi_pairs, twin_cat, twin_cat_semicolons
from benchmark.exports.trial import read
from benchmark.exports.truth import draw
from valve_friction_ros.model import Valve
from valve_friction_ros.records.recordings import read_table
from valve_friction_ros.records.table import OpenTable
from valve_friction_ros.records.units import (
    FORCE_UNITS,
    NANOSECONDS,
    POSITION_UNITS,
    PRESSURE_UNITS,
)

ASKED = {
    "aspen_long", "ignition_dataset", "grafana_raw", "labview", "without_units", "bad_beyond",
    "day_or_month", "rockwell", "second_sheet", "finnish",
}  # fmt: skip
"""Exports that do not say their units, what a column is, or whether day or month is first."""


@pytest.fixture(scope="module", params=[1, 2])
def outcomes(request, tmp_path_factory):
    pytest.importorskip("openpyxl")
    pytest.importorskip("pyarrow")
    random = np.random.default_rng(request.param)
    folder = tmp_path_factory.mktemp("exports")
    found = {}
    for program, truth in zip(PROGRAMS, draw(len(PROGRAMS), request.param), strict=True):
        place = folder / program.__name__
        place.mkdir()
        found[program.__name__] = read(program(truth, random), truth, place)
    return found


def test_none_is_read_wrongly(outcomes):
    assert not {name: one.message for name, one in outcomes.items() if one.kind == "wrong"}


def test_nearly_all_are_read(outcomes):
    assert not {name for name, one in outcomes.items() if one.kind == "refused"}
    counts = Counter(one.options for one in outcomes.values())
    assert counts[0] >= 43
    assert counts[0] + counts[1] >= 0.9 * len(outcomes)
    assert set(counts) <= {0, 1, 2}


def test_what_is_ambiguous_is_asked_for(outcomes):
    assert {name for name, one in outcomes.items() if one.kind == "options"} <= ASKED
    message = outcomes["without_units"].message
    assert "--pressure-unit" in message
    assert "--position-unit" in message


@pytest.mark.parametrize("program", [twin_cat, twin_cat_semicolons, pi_pairs])
def test_what_is_saved_of_a_table_with_several_times_reads_it_alike(program, tmp_path):
    """Each signal keeps its own time, although the saved section names columns."""
    (truth,) = draw(1, 3)
    export = program(truth, np.random.default_rng(3))
    path, valve = tmp_path / export.name, Valve(truth.area, 0.0, truth.travel)
    path.write_bytes(export.content)
    (first,) = read_table(path, valve)
    (again,) = read_table(path, valve, OpenTable(path).layout.form)
    assert again.recording().start_time == first.recording().start_time
    np.testing.assert_array_equal(again.recording().drive, first.recording().drive)
    np.testing.assert_array_equal(again.recording().position, first.recording().position)


INCH = Fraction("0.0254")
POUND_FORCE = Fraction("0.45359237") * Fraction("9.80665")
DEFINITIONS = {
    "Pa": Fraction(1),
    "hPa": Fraction(100),
    "kPa": Fraction(1000),
    "MPa": Fraction(10**6),
    "mbar": Fraction(100),
    "bar": Fraction(10**5),
    "psi": POUND_FORCE / INCH**2,
    "kgf/cm2": Fraction("9.80665") * 10**4,
    "inH2O": Fraction("249.08891"),  # at 4 °C
    "inHg": Fraction("3386.389"),  # at 0 °C
    "mmHg": Fraction("133.322387415"),
    "m": Fraction(1),
    "cm": Fraction(1, 100),
    "mm": Fraction(1, 1000),
    "um": Fraction(1, 10**6),
    "in": INCH,
    "N": Fraction(1),
    "kN": Fraction(1000),
    "lbf": POUND_FORCE,
    "kgf": Fraction("9.80665"),
}
UNITS = {**PRESSURE_UNITS, **POSITION_UNITS, **FORCE_UNITS}


def test_each_has_a_definition():
    assert set(UNITS) == set(DEFINITIONS)
    assert len(UNITS) == len(PRESSURE_UNITS) + len(POSITION_UNITS) + len(FORCE_UNITS)


@pytest.mark.parametrize("name", DEFINITIONS)
def test_size(name):
    """Within a rounding of each of its two numbers and of their ratio."""
    size = UNITS[name].to_si(np.array([1.0]))[0]
    assert size == pytest.approx(float(DEFINITIONS[name]), rel=2**-51)


@given(some.integers(-(10**9), 10**9), some.sampled_from(["cm", "mm", "um", "in", "kPa", "bar"]))
def test_whole_numbers_are_converted_to_the_last_bit(number, name):
    assert UNITS[name].to_si(np.array([float(number)]))[0] == float(number * DEFINITIONS[name])


@given(some.floats(allow_nan=False))
def test_si_units_change_nothing(value):
    for name in ("Pa", "m", "N"):
        assert UNITS[name].to_si(np.array([value]))[0] == value


def test_times():
    short = {"ns": 1, "us": 10**3, "ms": 10**6, "s": 10**9}
    assert short | {"min": 60 * 10**9, "h": 3600 * 10**9, "d": 86400 * 10**9} == {
        name: size for name, size in NANOSECONDS.items() if name != "microdays"
    }
    assert NANOSECONDS["microdays"] * 10**6 == NANOSECONDS["d"]
