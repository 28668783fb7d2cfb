# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `identify` on plants, real machines, packings that slip, and whole valves."""

import dataclasses
import gzip
import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from answers import KEYS, PARAMETER_KEYS, column, none_for_nan, row_of, values
from pages import PageReader

from valve_friction_ros.identification import (
    CALIBRATION,
    UNITS,
    IdentificationSettings,
    identify_plant,
    identify_signature,
    published_estimate,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    LOW_FRICTION,
    Recording,
    SensorNoise,
    SineWave,
    TriangleWave,
    simulate,
)

SETTINGS = IdentificationSettings(assumed_mass=1.6)  # of the valve file


@pytest.fixture(scope="module")
def noisy(quick_record):
    return SensorNoise(position=10e-6, pressure=100.0, seed=1).applied_to(quick_record)


@pytest.fixture
def path(write_csv, columns_of, noisy):
    return write_csv(columns_of(noisy))


def test_the_result_of_the_library(printed, path, noisy, bench_options):
    answer = printed(path, *bench_options)
    expected = identify_plant(noisy, BENCH_VALVE, SETTINGS)
    assert set(answer) == KEYS | {"diagnosis", "findings"}
    assert answer["method"] == expected.method == "plant"
    assert [*answer["parameters"]] == [*UNITS, "sliding_friction"]
    for name, entry in answer["parameters"].items():
        one = expected.parameters[name]
        assert (entry["verdict"], entry["reason"]) == (one.verdict.value, one.reason)
        assert entry["value"] == pytest.approx(none_for_nan(one.value), rel=1e-9)
        assert entry["half_width"] == pytest.approx(none_for_nan(one.half_width), rel=1e-9)
    assert answer["derivative_window"] == 0
    assert answer == printed(path, *bench_options, "--method", "plant")
    assert answer == printed(path, *bench_options, "--method", "best")


def test_the_published_estimate_beside_it(printed, call, path, noisy, bench_options):
    answer = printed(path, *bench_options)
    expected = published_estimate(noisy, BENCH_VALVE, SETTINGS)
    published = column(answer, "published")
    assert published.pop("sliding_friction") is None
    assert published == pytest.approx(expected.values, rel=1e-9)
    assert answer["evidence"]["threshold"] == pytest.approx(expected.threshold, rel=1e-9)
    out = call(path, *bench_options)[1]
    assert row_of(out, "coulomb_friction").endswith(f" {expected.values['coulomb_friction']:.6g}")


def test_a_known_static_friction_is_refused(refusal, path, bench_options):
    assert refusal(path, *bench_options, "--fix", "static_friction=150") == (
        f"{path}: the method plant finds F_s itself and takes no known one: leave it out, or use "
        "the method published"
    )


class TestGap:
    """Fifty samples are lost in the middle of a stroke."""

    @pytest.fixture
    def broken(self, write_csv, columns_of, noisy):
        kept = np.r_[0:400, 450 : len(noisy)]
        columns = {name: column[kept] for name, column in columns_of(noisy).items()}
        return write_csv(columns, "broken.csv")

    def test_it_costs_the_stretch_around_it(self, printed, broken, bench_options):
        answer = printed(broken, *bench_options)
        assert answer["method"] == "plant"
        for name in ("coulomb_friction", "spring_constant"):
            low, high = answer["parameters"][name]["interval"]
            assert low < getattr(LOW_FRICTION, name) < high, name
        friction = answer["parameters"]["coulomb_friction"]
        assert friction["half_width"] < 0.25 * friction["value"]  # the first alarm
        left_out = [note for note in answer["warnings"] if note.endswith(" left out")]
        assert len(left_out) == 2
        assert {entry["published"] for entry in answer["parameters"].values()} == {None}

    @pytest.mark.parametrize("method", ["published", "signature"])
    def test_the_others_refuse_it(self, refusal, broken, bench_options, method):
        assert refusal(broken, *bench_options, "--method", method).startswith(
            f"{broken}: row 402, column 'time_s': gap of 0.51 s: use a stretch of the record"
        )

    def test_no_model_is_validated_through_it(
        self, command, call, broken, path, bench_options, tmp_path
    ):
        estimate = tmp_path / "estimate.json"
        bench = [*bench_options, "--timing-uncertainty", "0"]
        estimate.write_text(call(path, *bench, "--json")[1])
        code, out, err = command("validate", broken, *bench_options, "--estimate", estimate)
        assert (code, out) == (2, "")
        assert "gap of 0.51 s" in err


def timing(answer):
    """The share of the lag in the standard uncertainty of each parameter."""
    return {name: one["timing"] for name, one in answer["evidence"]["uncertainty_budget"].items()}


class TestTimingUncertainty:
    def test_it_reaches_the_settings(self, printed, path, bench_options):
        found = printed(path, *bench_options, "--timing-uncertainty", "0.005")
        assert found["settings"]["timing_uncertainty"] == 0.005
        assert printed(path, *bench_options)["settings"]["timing_uncertainty"] is None

    def test_signals_that_surely_belong_together_have_no_share(self, printed, path, bench_options):
        """And leave the work of friction less uncertain; all values are finite still."""
        sure = printed(path, *bench_options, "--timing-uncertainty", "0")
        unsure = printed(path, *bench_options, "--timing-uncertainty", "0.08")
        assert set(timing(sure).values()) == {0.0}
        for name in ("viscous_friction", "sliding_friction"):
            assert timing(unsure)[name] > 0, name
        widths = [one["parameters"]["sliding_friction"]["half_width"] for one in (sure, unsure)]
        assert 0 < widths[0] < widths[1]
        known = [value for value in values(sure).values() if value is not None]
        assert all(map(math.isfinite, known))

    @pytest.mark.parametrize("text", ["-0.01", "nan", "inf"])
    def test_impossible(self, refusal, path, bench_options, text):
        assert refusal(path, *bench_options, f"--timing-uncertainty={text}").startswith(
            "timing_uncertainty must"
        )


class TestCalibration:
    OPTIONS = ("--area-uncertainty=0.01", "--drive-scale-uncertainty=0.02")

    def test_it_reaches_settings_intervals_and_budget(self, printed, path, bench_options):
        exact = [*bench_options, "--timing-uncertainty", "0"]
        found = printed(path, *exact, *self.OPTIONS, "--position-scale-uncertainty=0.03")
        known = printed(path, *exact)["parameters"]["spring_constant"]
        settings = found["settings"]
        assert [settings[name] for name in CALIBRATION] == [0.01, 0.02, 0.03]
        spring = found["parameters"]["spring_constant"]
        error = math.hypot(0.01, 0.02, 0.03) * known["value"]
        assert spring["value"] == known["value"]
        assert spring["half_width"] == pytest.approx(math.hypot(known["half_width"], 2 * error))
        budget = found["evidence"]["uncertainty_budget"]["spring_constant"]
        assert budget["calibration"] == pytest.approx(error)

    @pytest.mark.parametrize("text", ["-0.01", "nan", "2"])
    def test_impossible(self, refusal, path, bench_options, text):
        assert refusal(path, *bench_options, f"--area-uncertainty={text}").startswith(
            "area_uncertainty must"
        )


EMPS = Path(__file__).resolve().parents[3] / "shared" / "data" / "emps" / "emps_identification.csv"
PUBLISHED = {  # IDIM-LS
    "mass": 95.1089,
    "viscous_friction": 203.5034,
    "coulomb_friction": 20.3935,
    "spring_preload": -3.1648,
}
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.mark.skipif(
    not EMPS.is_file(), reason="the benchmark record is not the project's to distribute"
)
class TestRealMachine:
    @pytest.fixture
    def recorded(self, tmp_path):
        """The published record under the headers that the command expects, gzipped."""
        rows = EMPS.read_text().splitlines()[1:]
        path = tmp_path / "emps.csv.gz"
        with gzip.open(path, "wt") as stream:
            stream.write("\n".join(["time_s,force_n,position_m", *rows]) + "\n")
        return path

    def test_published_values(self, printed, recorded):
        answer = printed(recorded, "--fix", "spring_constant=0")
        for name, value in PUBLISHED.items():
            entry = answer["parameters"][name]
            assert entry["published"] == pytest.approx(value, rel=0.05), name
            low, high = entry["interval"]
            assert entry["value"] == pytest.approx(value, rel=0.02) or low < value < high, name
            assert entry["verdict"] in ("identified", "weak")
        assert values(answer)["spring_constant"] == 0.0
        assert {answer[key] for key in ("rms", "systematic_misfit")} == {None}
        assert answer["model_describes"] is True
        assert 0.9 < answer["fit"] < 1.0
        assert answer["parameters"]["spring_constant"]["verdict"] == "fixed"
        assert answer["evidence"]["published_window"] == 31

    def test_by_its_own_headers(self, printed, recorded):
        names = EMPS.read_text().split("\n", 1)[0].split(",")
        options = ["--time-column", names[0], "--force-column", names[1]]
        options += ["--position-column", names[2], "--fix", "spring_constant=0"]
        assert printed(EMPS, *options) == printed(recorded, "--fix", "spring_constant=0")


class TestSignature:
    """A signature by ``--method signature``, as the library identifies it."""

    @pytest.fixture(scope="class")
    def signature(self, benches):
        pressure = TriangleWave().sample(np.arange(13_000) / 100)
        position = simulate(*benches["high"], pressure, 0.01).position
        return Recording(0.01, pressure, position)

    @pytest.fixture
    def path(self, write_csv, columns_of, signature):
        return write_csv(columns_of(signature))

    @pytest.fixture(scope="class")
    def expected(self, signature):
        return identify_signature(signature, BENCH_VALVE, SETTINGS)

    def test_json(self, printed, path, bench_options, expected):
        answer = printed(path, *bench_options, "--method", "signature")
        assert answer["method"] == "signature"
        assert values(answer) == pytest.approx(
            {name: none_for_nan(value) for name, value in expected.values.items()}, rel=1e-9
        )
        signature = expected.signature
        evidence = answer["evidence"]
        assert evidence["position_bias"] == pytest.approx(signature.position_bias, rel=1e-6)
        assert evidence["dead_zone"] == pytest.approx(signature.dead_zone, rel=1e-9)
        points = [(one["direction"], one["time"]) for one in evidence["breakaway_points"]]
        assert [way for way, _ in points] == [1, -1, 1, -1, 1]
        assert {entry["published"] for entry in answer["parameters"].values()} == {None}
        assert answer["fit"] == pytest.approx(expected.fit, rel=1e-6)

    def test_table_and_picture(self, call, path, bench_options, tmp_path):
        picture = tmp_path / "signature.png"
        code, out, err = call(path, *bench_options, "--method", "signature", "--plot", picture)
        assert (code, err) == (0, "")
        words = " ".join(out.split())
        assert "the model's stem is" in words
        assert "signature: 3 strokes up and 2 down, bias x̄ 1.1" in words
        assert picture.read_bytes().startswith(PNG)

    def test_a_square_wave_is_refused(
        self, call, write_csv, columns_of, square_record, bench_options
    ):
        path = write_csv(columns_of(square_record))
        code, out, err = call(path, *bench_options, "--method", "signature")
        assert (code, out) == (2, "")
        assert err.startswith(
            f"valve_friction identify: {path}: the stem does not slide at a constant"
        )
        assert "slow triangular wave" in err
        assert err.count("\n") == 1


SLIPPING = dataclasses.replace(GRAPHITE_PACKING, mass=1.6)
FALLING = dataclasses.replace(SLIPPING, stribeck_velocity=3.26e-3)
"""A published identification of a graphite packing."""


class TestSlipJumps:
    """Graphite packing: sixteen seconds of a sine at 100 Hz, 10 µm and 100 Pa of noise."""

    NAMES = ("coulomb_friction", "static_friction", "viscous_friction", "spring_constant")

    @pytest.fixture
    def options(self, tmp_path):
        path = tmp_path / "graphite.yaml"
        geometry = dataclasses.asdict(GRAPHITE_VALVE)
        path.write_text("\n".join(f"{name}: {value}" for name, value in geometry.items()))
        return ["--valve", path, "--fix", "mass=1.6", "--method", "bench"]

    @pytest.fixture
    def file_of(self, write_csv, columns_of):
        """Function of a packing and a delay of the stem's stamps (samples): its record."""

        def build(packing, delay=0):
            pressure = SineWave(period=4.0).sample(np.arange(1600) / 100)
            position = simulate(GRAPHITE_VALVE, packing, pressure, 0.01).position
            record = SensorNoise(10e-6, 100.0, seed=1).applied_to(
                Recording(0.01, pressure[delay:], position[: 1600 - delay])
            )
            return write_csv(columns_of(record))

        return build

    def assert_true(self, answer, packing):
        """The bounds of the whole benchmark: 5 %, and no error beyond three half widths."""
        for name in self.NAMES:
            entry, truth = answer["parameters"][name], getattr(packing, name)
            assert entry["verdict"] == "identified", name
            assert entry["value"] == pytest.approx(truth, rel=0.05)
            low, high = entry["interval"]
            assert abs(entry["value"] - truth) < 1.5 * (high - low)
        assert answer["model_describes"] is True
        assert answer["systematic_misfit"] < 10e-6

    def test_a_slip_jump_tells_the_static_friction(self, printed, file_of, options):
        answer = printed(file_of(SLIPPING), *options)
        self.assert_true(answer, SLIPPING)
        assert list(answer["parameters"]) == [*UNITS, "sliding_friction"]

    def test_a_fall_of_the_friction_is_told_with_its_speed(self, printed, file_of, options):
        answer = printed(file_of(FALLING), *options)
        self.assert_true(answer, FALLING)
        assert list(answer["parameters"]) == [*UNITS, "sliding_friction", "stribeck_velocity"]
        entry = answer["parameters"]["stribeck_velocity"]
        assert set(entry) == PARAMETER_KEYS
        assert (entry["unit"], entry["published"]) == ("m/s", None)
        low, high = entry["interval"]
        assert low < FALLING.stribeck_velocity < high

    def test_the_fall_in_the_table(self, call, file_of, options):
        """Between 2.9 and 3.6 mm/s, with its interval, and nothing published to compare with."""
        code, out, err = call(file_of(FALLING), *options)
        assert (code, err) == (0, "")
        row = row_of(out, "stribeck_velocity")
        assert re.fullmatch(
            r"stribeck_velocity 0\.00(29|3[0-6])\d+ \S+ m/s (identified|weak)", row
        ), row

    def test_late_stamps_are_reported(self, printed, file_of, options):
        """Ten samples, 100 ms, by the default; a bench has no lags."""
        path = file_of(SLIPPING, delay=10)
        lag = printed(path, *options[:-2])["evidence"]["imperfections"]["lag"]
        assert abs(lag["value"] - 0.1) < lag["half_width"] < 0.02
        assert printed(path, *options)["model_describes"] is False

    @pytest.mark.parametrize("packing", [SLIPPING, FALLING], ids=["slips", "falls"])
    def test_with_a_lag_in_the_intervals(self, printed, file_of, options, packing):
        """The default finds the same packing, and its wider intervals hold the truth."""
        parameters = printed(file_of(packing), *options[:-2])["parameters"]
        for name in self.NAMES:
            low, high = parameters[name]["interval"]
            assert low < getattr(packing, name) < high, name
        friction = parameters["coulomb_friction"]
        assert friction["half_width"] < 0.05 * friction["value"]
        if packing.stribeck_velocity > 0:
            low, high = parameters["stribeck_velocity"]["interval"]
            assert low < packing.stribeck_velocity < high


@pytest.fixture
def weak_csv(write_csv, benches, columns_of):
    """The quick record of a valve whose spring has lost a third of its stiffness."""
    valve, packing = benches["low"]
    weak = replace(packing, spring_constant=packing.spring_constant * 2 / 3)
    pressure = SineWave(period=10.0).sample(np.arange(1000) / 100)
    recording = Recording(0.01, pressure, simulate(valve, weak, pressure, 0.01).position)
    return write_csv(columns_of(recording), "weak.csv")


@pytest.fixture
def compared(call, weak_csv, quick_csv, bench_yaml):
    """Function of further options: exit code and output of the weak valve against the healthy."""

    def compared(*options):
        files = (weak_csv, "--valve", bench_yaml, "--baseline-recording", quick_csv)
        code, out, _ = call(*files, "--method", "bench", *options)
        return code, out

    return compared


def test_json_and_exit_code(compared):
    code, out = compared("--json", "--fail-on", "error")
    assert code == 3
    answer = json.loads(out)
    assert answer["diagnosis"]["level"] == "OK"
    first, *_ = answer["findings"]
    assert (first["level"], first["ne_107"]) == ("ERROR", "F")
    assert first["message"].startswith("the spring constant has changed: 0.667 times")


def test_a_scale_of_the_sensor_qualifies_the_friction(
    call, write_csv, columns_of, benches, quick_csv, bench_yaml, tmp_path
):
    """In the text, in JSON and on the page, which plans no work on the packing."""
    valve, packing = benches["low"]
    pressure = SineWave(period=10.0).sample(np.arange(1000) / 100)
    position = simulate(valve, packing, pressure, 0.01).position
    reference = valve.pressure_reference
    read = Recording(0.01, reference + 1.5 * (pressure - reference), position)
    path = write_csv(columns_of(read), "scaled.csv")
    page = tmp_path / "page.html"
    options = ("--valve", bench_yaml, "--baseline-recording", quick_csv, "--method", "bench")
    code, out, _ = call(path, *options, "--json", "--report", page)
    assert code == 0
    answer = json.loads(out)
    assert (answer["diagnosis"]["level"], answer["diagnosis"]["ne_107"]) == ("WARN", "C")
    assert answer["diagnosis"]["message"].startswith(
        "friction and spring constant have changed by one factor, which points to the scale of "
        "the pressure sensor and the diaphragm area: check both before any work on the packing"
    )
    report = PageReader(page.read_text())
    # Half as much again is beyond spring_failure: an error, but of the sensors.
    assert (report.status[0], report.status[2]) == ("red", "Check the sensors' scales")
    assert "before any work on the packing, check the scale of the pressure sensor" in report.text
    assert "plan work on the packing" not in report.text


def test_text_and_report(compared, tmp_path):
    report = tmp_path / "report.html"
    code, out = compared("--report", report)
    assert code == 0
    assert "\nERROR: the spring constant has changed: 0.667 times" in out
    page = PageReader(report.read_text())
    assert (page.status[0], page.status[2]) == ("red", "The valve has changed")
    assert "The spring constant has changed: 0.667 times" in page.text
    (table,) = [one for one in page.tables if one[0][0] == "number"]
    (row,) = [one for one in table if one[0].startswith("spring constant")]
    assert row[3].startswith("0.667 times")


def test_a_friction_that_is_given_says_nothing_of_the_spring(call, weak_csv, bench_options):
    options = ("--baseline-coulomb-friction", "152.7", "--method", "bench", "--json")
    code, out, _ = call(weak_csv, *bench_options, *options)
    assert code == 0
    assert json.loads(out)["findings"] == []
