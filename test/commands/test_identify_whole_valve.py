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
        code, out, _ = call(*files, "--method", "refined", *options)
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
    options = ("--baseline-coulomb-friction", "152.7", "--method", "refined", "--json")
    code, out, _ = call(weak_csv, *bench_options, *options)
    assert code == 0
    assert json.loads(out)["findings"] == []
