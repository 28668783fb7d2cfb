# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Limits of a first survey in the commands: options go before the valve file, which says graphite.

The valve of the example has a dead band (F_c + F_s)/k of 2·400/204941 m, 13.7 % of its travel.
"""

import csv
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
RECORDING = EXAMPLES / "five_seconds.csv"
CASES = [
    ([], "good"),
    (["--packing", "ptfe"], "watch"),
    (["--survey-watch", "0.12"], "watch"),
    (["--survey-watch", "0.02", "--survey-bad", "0.05"], "bad"),
]


@pytest.fixture
def valve(tmp_path):
    text = (EXAMPLES / "fv_101.yaml").read_text()
    place = "    travel: 0.028575"
    assert place in text
    path = tmp_path / "graphite.yaml"
    path.write_text(text.replace(place, f"    packing: graphite\n{place}"))
    return path


@pytest.mark.parametrize(("given", "survey"), CASES)
def test_of_a_recording(printed, valve, given, survey):
    shown = printed(RECORDING, "--valve", valve, "--method", "bench", *given)
    assert shown["diagnosis"]["survey"] == survey


def test_it_is_said_at_the_end_of_the_table(call, valve):
    code, out, _ = call(RECORDING, "--valve", valve, "--method", "bench")
    assert code == 0
    assert "no baseline yet" in out.splitlines()[-1]
    assert out.rstrip().endswith("good, by the limits of the first survey")


@pytest.mark.parametrize(("given", "survey"), CASES[:2])
def test_of_a_folder(command, valve, given, survey, tmp_path):
    folder = tmp_path / "recordings"
    folder.mkdir()
    (folder / RECORDING.name).write_bytes(RECORDING.read_bytes())
    table = tmp_path / "results.csv"
    words = folder, "--valve", valve, "--method", "bench", "--output", table
    assert command("identify-folder", *words, *given)[0] == 0
    with table.open(newline="") as lines:
        assert [row["survey"] for row in csv.DictReader(lines)] == [survey]


def test_limits_out_of_order_are_refused(refusal, valve):
    words = "0 < survey_watch < survey_bad, got survey_watch 0.5, survey_bad 0.3"
    assert words in refusal(RECORDING, "--valve", valve, "--survey-watch", "0.5")
