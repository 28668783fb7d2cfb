# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The names that `import valve_friction_ros` offers: loaded on first use, with examples."""

import doctest
import json
import math
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from processes import printed

import valve_friction_ros as vf

NAN = float("nan")


@pytest.fixture(scope="module")
def columns(loose_record):
    return {
        "time_s": 100.0 + loose_record.time,
        "pressure_pa": loose_record.pressure,
        "position_m": loose_record.position,
    }


@pytest.fixture(scope="module")
def result(loose_record, benches):
    return vf.identify(loose_record, benches["low"].valve)


def test_some_fifteen_names():
    assert len(vf.__all__) == 15
    assert set(vf.__all__) <= set(dir(vf))
    with pytest.raises(AttributeError, match="no attribute 'assess'"):
        _ = vf.assess


def test_nothing_is_loaded_before_it_is_used():
    code = "import sys, valve_friction_ros; print(*sys.modules)"
    loaded = printed("-c", code).split()
    assert [name for name in loaded if name.startswith("valve_friction_ros")] == [
        "valve_friction_ros.on_demand",
        "valve_friction_ros",
    ]
    assert "numpy" not in loaded


@pytest.mark.parametrize("name", [*vf.__all__, "valve_friction_ros"])
def test_the_examples_hold(name):
    thing = vf if name == "valve_friction_ros" else getattr(vf, name)
    assert "Examples\n" in thing.__doc__
    home = vf if thing is vf else import_module(thing.__module__)
    (test,) = doctest.DocTestFinder(recurse=False).find(thing, name, home)
    assert test.examples
    words: list[str] = []
    failed, _ = doctest.DocTestRunner().run(test, out=words.append)
    assert not failed, "".join(words)


class TestReadRecording:
    def test_from_arrays(self, columns, loose_record):
        found = vf.read_recording(columns)
        assert (found.sample_period, found.start_time) == (loose_record.sample_period, 100.0)
        np.testing.assert_array_equal(found.pressure, loose_record.pressure)
        np.testing.assert_array_equal(found.position, loose_record.position)

    @pytest.mark.parametrize("zone", [None, "UTC", "Europe/Berlin"])
    def test_from_a_frame_with_an_index_of_dates(self, columns, loose_record, zone):
        pandas = pytest.importorskip("pandas")
        frame = pandas.DataFrame(columns)
        times = pandas.to_datetime((1e9 * frame.pop("time_s")).round().astype("int64"), utc=True)
        index = pandas.DatetimeIndex(times)
        frame.index = index.tz_localize(None) if zone is None else index.tz_convert(zone)
        dated = [frame, {"time_s": frame.index, **{name: frame[name] for name in frame}}]
        dated.append(frame.reset_index(names="time_s"))
        if zone is not None:
            pytest.importorskip("pyarrow")
            arrow = frame.index.to_series().astype(f"timestamp[us, tz={zone}][pyarrow]")
            dated += [frame.set_index(arrow), frame.assign(time_s=arrow)]
        for found in map(vf.read_recording, dated):
            assert found.start_time == 100.0
            np.testing.assert_array_equal(found.position, loose_record.position)

    def test_from_a_file(self, columns, loose_record, tmp_path):
        path = tmp_path / "record.csv"
        rows = np.column_stack([*columns.values()])
        np.savetxt(path, rows, "%.17g", ",", header=",".join(columns), comments="")
        found = vf.read_recording(path)
        np.testing.assert_array_equal(found.pressure, loose_record.pressure)

    @pytest.mark.parametrize(
        ("columns", "message"),
        [
            ({"time_s": [0.0, 1.0, 0.5]}, "^time_s does not increase at sample 2: sort the rows$"),
            ({"pressure_pa": [1.0, NAN, 1.0]}, "^pressure_pa is not finite at sample 1$"),
            ({"pressure_pa": None}, "^there is no column 'pressure_pa' among time_s, position_m:"),
            (
                {"time_s": None, "pressure_pa": None},
                "^there is no column 'time_s' and no column 'pressure_pa' among position_m: rename",
            ),
        ],
    )
    def test_bad_columns_are_named(self, columns, message):
        good = {"time_s": [0.0, 1.0, 2.0], "pressure_pa": [1.0] * 3, "position_m": [0.0] * 3}
        given = {name: values for name, values in {**good, **columns}.items() if values}
        with pytest.raises(ValueError, match=message):
            vf.read_recording(given)

    def test_a_masked_value_is_no_number(self, columns):
        masked = np.ma.masked_array(columns["position_m"], mask=False)
        found = vf.read_recording({**columns, "position_m": masked})
        np.testing.assert_array_equal(found.position, columns["position_m"])
        masked[7] = np.ma.masked
        with pytest.raises(ValueError, match=r"^position_m is not finite at sample 7$"):
            vf.read_recording({**columns, "position_m": masked})
        with pytest.raises(ValueError, match=r"^position is not finite at sample 7$"):
            vf.Recording(0.01, columns["pressure_pa"], masked)

    @pytest.mark.parametrize(
        ("changed", "message"),
        [
            ({"position_m": [0.0] * 2}, "^time_s has 3 samples, pressure_pa 3, position_m 2$"),
            ({"position_m": [[0.0]] * 3}, "^position_m must be a row of samples, got shape"),
            ({"position_m": [0.0, "Bad", 0.0]}, "^position_m must be a row of numbers: .*'Bad'$"),
            ({"time_s": [0, 10**9, 2 * 10**10]}, "^time_s reaches 2e.10 s, which is after the"),
            ({"time_s": np.array(["2026-01-01", "NaT", "NaT"], "M8[s]")}, "^time_s has no date at"),
        ],
    )
    def test_impossible_columns_are_named(self, changed, message):
        good = {"time_s": [0.0, 1.0, 2.0], "pressure_pa": [1.0] * 3, "position_m": [0.0] * 3}
        with pytest.raises(ValueError, match=message):
            vf.read_recording({**good, **changed})

    @pytest.mark.parametrize("source", [None, ["a.csv", "b.csv"], np.zeros((3, 3))])
    def test_a_source_of_another_type_is_named(self, source):
        told = f"^source must be a path, a frame or .* got {type(source).__name__}; for a file per"
        with pytest.raises(TypeError, match=told):
            vf.read_recording(source)


class TestResult:
    def test_the_table_has_a_line_a_parameter(self, result):
        lines = str(result).splitlines()
        assert len(lines) <= 10
        assert lines[0].split()[:2] == ["parameter", "value"]
        names = [line.split()[0] for line in lines[1 : 1 + len(result.parameters)]]
        assert names == list(result.parameters)
        assert lines[-1] == f"method plant, fit {100 * result.fit:.2f} %"

    def test_the_summary_adds_reasons_and_warnings(self, result):
        summary = result.summary()
        assert summary.startswith(str(result))
        for name, each in result.parameters.items():
            assert (f"{name} {each.verdict.value}: {each.reason}" in summary) == bool(each.reason)
        for warning in result.warnings:
            assert f"note: {warning}" in summary

    def test_the_mapping_is_plain(self, result):
        shown = result.to_dict()
        assert json.loads(json.dumps(shown, allow_nan=False)) == shown
        for name, each in result.parameters.items():
            row = shown["parameters"][name]
            assert row["value"] == (None if math.isnan(each.value) else each.value)
            assert row["unit"] == each.unit
        assert shown["settings"]["derivative_window"] is None

    def test_html_is_escaped(self, result):
        page = replace(result, warnings=("<script>",))._repr_html_()
        assert "&lt;script&gt;" in page
        assert "<script>" not in page
        assert page.count("<tr>") == 1 + len(result.parameters)

    def test_to_frame(self, result):
        pytest.importorskip("pandas")
        frame = result.to_frame()
        assert list(frame.index) == list(result.parameters)
        coulomb = result.parameters["coulomb_friction"]
        assert frame.loc["coulomb_friction", "value"] == coulomb.value
        assert frame.loc["coulomb_friction", "high"] == coulomb.interval[1]

    def test_plot(self, result):
        labels = {axes.get_ylabel() for axes in result.plot().axes}
        assert {"pressure [kPa]", "stem [mm]"} <= labels


def test_methods_return_the_same_type(loose_record, benches):
    published = vf.identify(loose_record, benches["low"].valve, method="published")
    assert type(published) is vf.Result
    assert published.method == "published"
    friction = published.parameters["coulomb_friction"]
    assert friction.value == friction.published
    assert friction.reason == "the published method gives no interval"
    assert math.isnan(published.rms)


def test_arguments_of_other_types_are_named(columns, loose_record, benches):
    valve = benches["low"].valve
    for given, told in [
        ((columns, valve), "^recording must be of type Recording, got dict: give what vf.read_rec"),
        ((loose_record, "fv_101.yaml"), "^valve must be of type Valve, got str: give vf.Valve"),
        ((loose_record, valve, {"order": 3}), "^settings must be of type Identification.* dict"),
    ]:
        with pytest.raises(TypeError, match=told):
            vf.identify(*given)
    result = vf.identify(loose_record, valve, "published")
    with pytest.raises(TypeError, match=r"^baseline must be of type Baseline or Result, got float"):
        vf.compare(result, 150.0)
    with pytest.raises(TypeError, match=r"^parameters must be of type KarnoppParameters or Result"):
        vf.simulate(valve, valve, loose_record.pressure, 0.01)
    with pytest.raises(TypeError, match=r"^parameters must be of type KarnoppParameters or Result"):
        vf.validate(loose_record, valve, columns)
    with pytest.raises(
        TypeError, match=r"^recording must be of type Recording, got dict: give wha"
    ):
        vf.validate(columns, valve, result)
    with pytest.raises(
        TypeError, match=r"^fixed must be of type Mapping, got list: give names and"
    ):
        vf.IdentificationSettings(fixed=["mass"])


def test_a_ratio_without_an_interval_says_so(loose_record, benches):
    published = vf.identify(loose_record, benches["low"].valve, "published")
    told = vf.compare(published, vf.Baseline(published.values["coulomb_friction"] / 1.5)).message
    assert told.startswith("friction has grown: Coulomb friction is 1.50 (no interval) times its")


def test_an_unknown_method_is_named(loose_record, benches):
    told = "there is no method 'guess': choose from plant, bench, published, signature"
    with pytest.raises(ValueError, match=told):
        vf.identify(loose_record, benches["low"].valve, method="guess")
    with pytest.raises(ValueError, match="the method 'bench', and method 'published'"):
        vf.identify(loose_record, benches["low"].valve, "bench", method="published")


def test_compare_takes_a_result_or_a_number(result):
    friction = result.parameters["coulomb_friction"]
    half = vf.Baseline(friction.value / 2)
    assert vf.compare(result, half).ratio.value == pytest.approx(2.0, rel=1e-12)
    assert vf.compare(result, result).ratio.value == 1.0


class TestResultsAtWork:
    def test_a_result_is_simulated_as_its_model(self, loose_record, benches, result):
        valve, period = benches["low"].valve, loose_record.sample_period
        by_result = vf.simulate(valve, result, loose_record.pressure, period).position
        by_model = vf.simulate(valve, result.model, loose_record.pressure, period).position
        np.testing.assert_array_equal(by_result, by_model)
        np.testing.assert_array_equal(result.simulate(loose_record.pressure, period), by_model)

    def test_the_difference_of_two_results(self, result):
        """Of a result from itself: zero, and its width twice in squares, without calibration."""
        for name, (difference, width) in result.difference(result).items():
            own = result.parameters[name].without_calibration
            assert difference == 0.0
            assert width == pytest.approx(math.sqrt(2) * own.half_width)
        assert "coulomb_friction" in result.difference(result)
