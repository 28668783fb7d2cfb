# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `identify` as people and programs use it: table, picture, JSON, and refusals."""

import json
import math

import matplotlib.image
import numpy as np
import pytest
from answers import KEYS, column, known, none_for_nan, row_of, values
from pages import PNG
from processes import ran

from valve_friction_ros.identification import (
    PARAMETER_UNITS,
    UNITS,
    IdentificationSettings,
    identify_bench,
)
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.wording import two_digits

SETTINGS = IdentificationSettings(assumed_mass=1.6)  # of the valve file
BENCH = ("--method", "bench")


@pytest.fixture(scope="session")
def result(quick_record):
    return identify_bench(quick_record, BENCH_VALVE, SETTINGS)


class TestTable:
    def test_every_parameter_with_interval_and_verdict(
        self, told, result, quick_csv, bench_options
    ):
        out = told("identify", quick_csv, *bench_options, *BENCH)
        for name, unit in UNITS.items():
            one = result.parameters[name]
            published = format(result.estimate.values[name], ".6g")
            if math.isnan(one.value):
                assert row_of(out, name) == f"{name} – {unit} not identifiable {published}"
            else:
                size = one.half_width
                digits = f"{size:.0f}" if size >= 100 else f"{size:.2g}"
                said = f"{one.value:.6g} {digits} {unit} {one.verdict.value} {published}"
                assert row_of(out, name) == f"{name} {said}"
        assert "nan" not in out

    def test_reasons_fit_and_notes(self, call, printed, result, quick_csv, bench_options):
        answer = printed(quick_csv, *bench_options, *BENCH)
        words = " ".join(call(quick_csv, *bench_options, *BENCH)[1].split())
        for name, entry in answer["parameters"].items():
            if entry["reason"]:
                assert f"{name} {entry['verdict']}: {entry['reason']}" in words
        misfit = result.misfit
        share = f"{100 * misfit.rms / BENCH_VALVE.travel:.2g} % of travel"
        assert (
            f"fit {100 * misfit.fit:.2f} %: the simulated stem deviates from the measured stem"
            in words
        )
        assert f" by {two_digits(misfit.rms * 1e6)} µm rms, {share}, of which " in words
        assert f", of which {two_digits(misfit.systematic * 1e6)} µm is more than noise" in words
        sweep = answer["evidence"]
        assert f"threshold δv {sweep['threshold']:.4g} m/s, {sweep['samples']} samples" in words
        assert "window 31 samples" in words
        for warning in answer["warnings"]:
            assert f"note: {warning}" in words


class TestPlot:
    def test_a_picture_and_the_numbers(self, printed, quick_csv, bench_options, tmp_path):
        picture = tmp_path / "record.png"
        assert set(printed(quick_csv, *bench_options, "--plot", picture)) >= KEYS
        assert picture.read_bytes().startswith(PNG)
        pixels = matplotlib.image.imread(picture)
        assert min(pixels.shape[:2]) > 500
        assert np.unique(pixels.reshape(-1, pixels.shape[2]), axis=0).shape[0] > 10  # colours

    def test_a_place_it_cannot_go_to(self, refusal, quick_csv, bench_options, tmp_path):
        picture = tmp_path / "no" / "record.png"
        told = refusal(quick_csv, *bench_options, "--plot", picture)
        assert told.startswith(f"{picture}: there is no folder")


POSITION_BIAS = 1.13e-3
FOUR_COLUMNS = ["--position-bias", str(POSITION_BIAS)]


class TestProcesses:
    """As typed into a shell."""

    def test_without_ros(self, quick_csv, bench_options, tmp_path):
        """Not even a figure needs rclpy, nor the global state of matplotlib."""
        blocked = (
            "import sys; sys.modules['rclpy'] = sys.modules['matplotlib.pyplot'] = None; "
            "from valve_friction_ros.commands.main import main; sys.exit(main())"
        )
        picture = tmp_path / "record.png"
        arguments = ("identify", quick_csv, *bench_options, "--plot", picture)
        code, out, err = ran(*arguments, program=["-c", blocked])
        assert (code, err) == (0, "")
        assert "coulomb_friction" in out
        assert picture.read_bytes().startswith(PNG)


class TestJson:
    def test_the_result_of_the_library(self, printed, quick_csv, result, bench_options):
        answer = printed(quick_csv, *bench_options, *BENCH)
        assert set(answer) == KEYS | {"diagnosis", "findings"}
        assert list(answer["parameters"]) == [*UNITS, "sliding_friction"]
        assert answer["sliding_speed"] == result.sliding_speed
        for name, entry in answer["parameters"].items():
            expected = result.parameters[name]
            assert entry == {
                "value": none_for_nan(expected.value),
                "standard_error": none_for_nan(expected.standard_error),
                "half_width": none_for_nan(expected.half_width),
                "interval": [none_for_nan(end) for end in expected.interval],
                "verdict": expected.verdict.value,
                "reason": expected.reason,
                "published": result.estimate.values.get(name),
                "unit": PARAMETER_UNITS[name],
            }
        assert answer["fit"] == result.misfit.fit
        assert answer["rms"] == result.misfit.rms
        assert answer["systematic_misfit"] == result.misfit.systematic
        assert answer["model_describes"] is True
        assert answer["derivative_window"] == result.derivative_window
        assert answer["settings"]["derivative_window"] is None
        assert answer["settings"]["assumed_mass"] == 1.6


ALL = ("mass=1.542", "viscous_friction=4865", "coulomb_friction=152.7", "spring_constant=2.05e5")


@pytest.mark.parametrize(
    ("baseline", "level", "fail_on", "code"),
    [
        (152.7, "OK", "warn", 0),
        (100.0, "WARN", "warn", 3),
        (100.0, "WARN", "error", 0),
        (50.0, "ERROR", "warn", 3),
        (50.0, "ERROR", "error", 3),
        (50.0, "ERROR", None, 0),
    ],
)
def test_the_diagnosis_may_fail_the_command(
    call, quick_csv, bench_options, baseline, level, fail_on, code
):
    options = ["--baseline-coulomb-friction", baseline, *BENCH, "--json"]
    options += ["--fail-on", fail_on] if fail_on else []
    found, out, err = call(quick_csv, *bench_options, *options)
    assert (found, err) == (code, "")
    assert json.loads(out)["diagnosis"]["level"] == level


def test_without_a_baseline_nothing_was_compared(call, quick_csv, bench_options):
    code, out, err = call(quick_csv, *bench_options, *BENCH, "--fail-on", "warn")
    assert code == 0
    assert out.splitlines()[-1].startswith("unknown: no baseline yet; ")
    assert err == (
        "valve_friction identify: --fail-on: no baseline, so friction was not compared: give "
        "--baseline-recording or --baseline-coulomb-friction\n"
    )


@pytest.mark.parametrize("method", ["plant", "bench", "published"])
def test_all_parameters_are_given(printed, quick_csv, bench_options, method):
    """Nothing is left to identify; the model is compared with the record all the same.

    The published method adds an F_s of its own, with which its model may not move at all.
    """
    given = [option for one in (*ALL, "spring_preload=231.65") for option in ("--fix", one)]
    answer = printed(quick_csv, *bench_options, *given, "--method", method)
    assert answer["parameters"]["coulomb_friction"]["verdict"] == "fixed"
    assert answer["fit"] > 0.99 or method == "published"


class TestOptions:
    def test_fixed_by_value_and_by_name(self, printed, quick_csv, bench_options):
        answer = printed(
            quick_csv, *bench_options, "--fix", "spring_constant=2.05e5", "--fix", "mass"
        )
        fixed = {name for name, verdict in column(answer, "verdict").items() if verdict == "fixed"}
        assert fixed == {"spring_constant", "mass"}
        assert values(answer)["spring_constant"] == 2.05e5
        assert values(answer)["mass"] == 1.6  # of the valve file
        assert answer["warnings"] == []
        for name in fixed:
            entry = answer["parameters"][name]
            assert entry["standard_error"] == 0.0
            assert entry["interval"] == [entry["value"]] * 2
            assert entry["published"] == entry["value"]

    def test_position_bias(self, printed, quick_csv, bench_options):
        answer = printed(quick_csv, *bench_options, *FOUR_COLUMNS)
        found = column(answer, "published")
        assert found["spring_preload"] == pytest.approx(
            found["spring_constant"] * POSITION_BIAS, rel=1e-12
        )
        assert values(answer) == values(printed(quick_csv, *bench_options))

    def test_window_and_order_are_those_of_the_published_estimate(
        self, printed, quick_csv, quick_record, bench_options
    ):
        answer = printed(quick_csv, *bench_options, *BENCH, "--derivative-window", 15, "--order", 4)
        settings = IdentificationSettings(derivative_window=15, order=4, assumed_mass=1.6)
        assert answer["evidence"]["published_window"] == 15
        assert answer["settings"]["order"] == 4
        expected = identify_bench(quick_record, BENCH_VALVE, settings)
        assert column(answer, "published") == {**expected.estimate.values, "sliding_friction": None}
        assert known(answer) == {
            name: value for name, value in expected.values.items() if not math.isnan(value)
        }

    def test_what_the_valve_file_states_is_compared(self, call, printed, quick_csv, tmp_path):
        """Twice the area of the bench valve, with the spring of its data sheet."""
        path = tmp_path / "valve.yaml"
        text = "diaphragm_area: 0.089\npressure_reference: 41740.0\nspring_constant: 2.05e5\n"
        path.write_text(text)
        answer = printed(quick_csv, "--valve", path)
        found = answer["evidence"]["contradicted_data"]["spring_constant"]
        assert (found["cause"], found["stated"]) == ("area scale", 2.05e5)
        assert found["factor"] == pytest.approx(2.0, rel=1e-2)
        assert "check diaphragm_area (doubled)" in answer["warnings"][0]
        assert "identified" not in column(answer, "verdict").values()
        _, out, _ = call(quick_csv, "--valve", path)
        assert f"note: {answer['warnings'][0]}" in " ".join(out.split())
        path.write_text(text.replace("0.089", "0.0445"))
        fixed = printed(quick_csv, "--valve", path, "--fix", "spring_constant")
        assert fixed["settings"]["stated"] == {}
        assert "contradicted_data" not in fixed["evidence"]

    @pytest.mark.parametrize("header", ["force_n", "F [N]"])
    def test_force(
        self, printed, write_csv, columns_of, quick_record, quick_csv, bench_options, header
    ):
        """The actuator's force in the file, and no valve file: the same sums, the same result."""
        columns = columns_of(quick_record)
        pressure = columns.pop("pressure_pa")
        path = write_csv(columns | {header: BENCH_VALVE.actuator_force(pressure)}, "force.csv")
        found = printed(path, "--force-column", header, *BENCH, "--fix", "mass=1.6")
        expected = printed(quick_csv, *bench_options, *BENCH, "--fix", "mass=1.6")
        assert column(found, "published") == column(expected, "published")
        assert column(found, "verdict") == column(expected, "verdict")
        # The speed is that of the simulated stem, so it is as equal as the numbers are.
        assert known(found) == pytest.approx(known(expected), rel=1e-6)
        assert found["sliding_speed"] == pytest.approx(expected["sliding_speed"], rel=1e-6)
        # The first survey is by the travel, which the valve file tells.
        assert [one in found for one in ("diagnosis", "findings")] == [False, False]
        # How a table of other headers was read is noted.
        assert [one.partition(":")[0] for one in found["warnings"]] in ([], ["read as"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.update({k: v[:29] for k, v in c.items()}), "the record is too short: 29 sa"),
        (lambda c: c["position_m"].fill(0.01), "the stem did not move: its position spans 0 µm"),
        (lambda c: c["position_m"].put(range(50, 150), math.nan), "row 52, column 'position_m': "),
        (lambda c: c["time_s"].put(50, 0.48), "row 52, column 'time_s' goes back (0.48 s after 0"),
        (lambda c: c["pressure_pa"].put(50, 260000.0), "row 52, column 'pressure_pa': 260000 Pa "),
        (lambda c: c.pop("time_s"), "cannot tell which column is the time, of position_m, "),
        (lambda c: c.update(position_m=1e3 * c["position_m"]), "the stem position runs from 3.691"),
        (lambda c: c.update(position_m=0.028 - c["position_m"]), "the stem moves against the pres"),
        (lambda c: c.update(pressure_pa=np.roll(c["pressure_pa"], 250)), "no friction model repro"),
    ],
    ids=["short", "still", "nan", "back", "range", "no time", "mm", "inverted", "no model"],
)
@pytest.mark.parametrize("how", [[], ["--json"]], ids=["table", "json"])
def test_records(refusal, write_csv, columns_of, quick_record, bench_options, change, message, how):
    columns = {name: np.array(column) for name, column in columns_of(quick_record).items()}
    change(columns)
    path = write_csv(columns)
    picture = path.with_suffix(".png")
    told = refusal(path, *bench_options, *how, "--plot", picture)
    assert told.startswith(f"{path}: {message}")
    assert not picture.exists()


def test_no_valve_file_for_a_pressure(refusal, quick_csv):
    assert refusal(quick_csv).startswith(
        "pressure needs the diaphragm_area: give a valve file with --valve; "
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--fix mass=heavy", "--fix mass=heavy: 'heavy' is not a number"),
        ("--fix spring_constant", "--fix spring_constant: give a value, as spring_constant="),
        ("--fix weight=1", "'weight' is not a parameter that can be fixed: choose from mass"),
        ("--fix coulomb_fricton=400", "'coulomb_fricton' is not a parameter that can be fixed; d"),
        ("--fix mass=1 --fix mass=2", "--fix mass is given twice"),
        ("--fix mass --fix mass", "--fix mass is given twice"),
        ("--fix mass=nan", "mass must be finite, got nan"),
        ("--fix static_friction=150", "FILE: the method plant finds F_s itself"),
        ("--derivative-window 30", "derivative_window must be odd and at least order + 2 = 5"),
        (
            "--method published --derivative-window 101",
            "FILE: the record is too short: 1000 samples",
        ),
        ("--position-bias nan", "position_bias must be finite, got nan"),
        ("--timing-uncertainty=-0.01", "timing_uncertainty must"),
        ("--area-uncertainty=nan", "area_uncertainty must"),
    ],
)
def test_options(refusal, quick_csv, bench_options, options, message):
    told = refusal(quick_csv, *bench_options, *options.split())
    assert told.startswith(message.replace("FILE", str(quick_csv)))
