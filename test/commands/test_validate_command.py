# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `validate`, from the estimate that `identify` wrote."""

import json
from functools import partial

import matplotlib.image
import numpy as np
import pytest

from valve_friction_ros.identification import validate
from valve_friction_ros.model import (
    BENCH_VALVE,
    KarnoppParameters,
    Recording,
    SensorNoise,
    SineWave,
    TriangleWave,
    simulate,
)

RATE = 100


@pytest.fixture
def file_of(benches, write_csv, columns_of):
    """Function of an excitation, its duration and a name: the noisy record of a tight packing."""

    def file_of(excitation, duration, name):
        pressure = excitation.sample(np.arange(round(duration * RATE)) / RATE)
        position = simulate(*benches["high"], pressure, 1 / RATE).position
        record = Recording(1 / RATE, pressure, position)
        return write_csv(columns_of(SensorNoise(10e-6, 100.0, seed=1).applied_to(record)), name)

    return file_of


@pytest.fixture
def other_csv(file_of):
    """The paper's sine, one period."""
    return file_of(SineWave(), 35.5, "other.csv")


@pytest.fixture
def estimate(tmp_path):
    """Function of values by name: a file as `identify --json` writes it."""

    def write(**changes):
        values = {
            "mass": None,
            "viscous_friction": 4.48e4,
            "coulomb_friction": 606.0,
            "static_friction": None,
            "spring_constant": 2.05e5,
            "spring_preload": 231.65,
            **changes,
        }
        path = tmp_path / "estimate.json"
        parameters = {name: {"value": value} for name, value in values.items()}
        path.write_text(json.dumps({"parameters": parameters}))
        return path

    return write


@pytest.fixture
def call(command):
    """Function of arguments: exit code, stdout and stderr of `validate`."""
    return partial(command, "validate")


@pytest.fixture
def refused(refused):
    """Function of arguments: the one line with which the command refuses."""
    return partial(refused, "validate")


@pytest.mark.parametrize(
    ("method", "excitation", "duration"),
    [("bench", SineWave(period=10.0), 40.0), ("signature", TriangleWave(), 130.0)],
)
def test_a_model_validates_on_a_record_it_has_not_seen(
    method, excitation, duration, file_of, other_csv, bench_options, tmp_path, told, printed
):
    """A record that suits the method is identified, and the slow sine simulated with the model."""
    path = file_of(excitation, duration, "identified.csv")
    estimate = tmp_path / "estimate.json"
    estimate.write_text(told("identify", path, *bench_options, "--method", method, "--json"))
    answer = json.loads(estimate.read_text())
    assert answer["method"] == method
    assert answer["parameters"]["coulomb_friction"]["value"] == pytest.approx(606.0, rel=0.02)
    found = printed(other_csv, *bench_options, "--estimate", estimate)
    assert found["fit"] > 0.995
    assert found["rms"] == pytest.approx(10e-6, abs=10e-6)
    assert found["parameters"]["mass"] == 1.6  # of the valve file


class TestAnswer:
    def test_the_numbers_of_the_library(self, printed, estimate, other_csv, bench_options):
        path = estimate(static_friction=606.0, mass=1.75)
        answer = printed(other_csv, *bench_options, "--estimate", path)
        table = np.loadtxt(other_csv, delimiter=",", skiprows=1)
        record = Recording(1 / RATE, table[:, 2], table[:, 1])
        model = KarnoppParameters(1.75, 4.48e4, 606.0, 606.0, 2.05e5, 231.65)
        expected = validate(record, BENCH_VALVE, model)
        assert answer["fit"] == expected.fit
        assert answer["rms"] == expected.rms
        assert answer["rms_share_of_travel"] == expected.rms / BENCH_VALVE.travel
        assert answer["maximum_error"] == expected.maximum_error
        assert answer["samples"] == len(record)
        assert answer["notes"] == []
        assert KarnoppParameters(**answer["parameters"]) == model

    def test_for_people(self, call, estimate, other_csv, bench_options):
        _, out, _ = call(other_csv, *bench_options, "--estimate", estimate())
        lines = out.splitlines()
        assert lines[0].startswith("fit 99.")
        assert lines[0].endswith("1 − ‖y − ŷ‖ / ‖y − ȳ‖)")
        assert lines[1].startswith("rms error ")
        assert lines[1].endswith("% of travel")
        assert lines[2].startswith("largest error ")
        assert lines[3:] == [
            "note: mass is not identified: 1.6 kg, of the valve file",
            "note: static_friction is not identified: 606 N, the coulomb_friction",
        ]

    @pytest.mark.parametrize(
        ("friction", "options", "code", "least"),
        [
            (606.0, ["--fail-below", "90"], 0, None),
            (3000.0, [], 0, 90),
            (3000.0, ["--fail-below", "-1000"], 0, 90),
            (3000.0, ["--fail-below", "95 %"], 3, 95),
        ],
    )
    def test_a_poor_fit(
        self, call, estimate, other_csv, bench_options, friction, options, code, least
    ):
        """It is said in words, and by the exit code if that is asked for."""
        path = estimate(coulomb_friction=friction)
        options = [*bench_options, "--estimate", path, *options]
        found, out, err = call(other_csv, *options)
        assert (found, err) == (code, "")
        said = [line for line in out.splitlines() if line.startswith("poor: ")]
        assert len(said) == (least is not None)
        assert all(f"less than {least} % of this movement" in line for line in said)
        found, out, _ = call(other_csv, *options, "--json")
        assert found == code
        assert json.loads(out)["poor"] == (said[0] if said else None)

    def test_a_picture(self, told, estimate, other_csv, bench_options, tmp_path):
        path = tmp_path / "validation.png"
        told("validate", other_csv, *bench_options, "--estimate", estimate(), "--plot", path)
        assert matplotlib.image.imread(path).shape[0] > 500


class TestRefusals:
    @pytest.mark.parametrize(
        ("content", "cause"),
        [
            ("{", "not JSON"),
            ("[" * 200_000, "not JSON: it is nested too deeply"),
            ('{"a":' * 200_000, "not JSON: it is nested too deeply"),
            (" " * 20_000_000, "more than 10 MB"),
            ("[]", "contains no parameters: give a file written by `valve_friction identify --js"),
            ('{"valves": {}}', "contains several valves: identify one of them with --valve-name"),
            ('{"parameters": {"mass": 1}}', "parameters.mass has no value"),
            ('{"parameters": {"mass": {"value": "1"}}}', "must be a number or null, got '1'"),
            ('{"parameters": {"mass": {"value": 1' + "0" * 5000 + "}}}", "or null, got inf"),
            ('{"parameters": {"weight": {"value": 1}}}', "unknown parameter 'weight'"),
            ('{"parameters": {"' + "m" * 100_000 + '": 1}}', "unknown parameter 'mmm"),
        ],
        ids=lambda text: text[:20],
    )
    def test_what_is_no_estimate(self, refused, tmp_path, other_csv, bench_options, content, cause):
        path = tmp_path / "bad.json"
        path.write_text(content)
        message = refused(other_csv, *bench_options, "--estimate", path)
        assert f"{path}: " in message
        assert cause in message
        assert len(message) < 500

    def test_no_file(self, refused, tmp_path, other_csv, bench_options, estimate):
        path = tmp_path / "none"
        assert f"{path}: cannot be read" in refused(other_csv, *bench_options, "--estimate", path)
        assert str(path) in refused(path, *bench_options, "--estimate", estimate())
