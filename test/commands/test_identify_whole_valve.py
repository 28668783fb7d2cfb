# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What has changed on a valve beside its friction, where the healthy valve has a recording."""

import json
from dataclasses import replace

import numpy as np
import pytest
from pages import PageReader

from valve_friction_ros.model import Recording, SineWave, simulate


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
