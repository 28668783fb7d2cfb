# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `history` on usage and alarm recordings."""

import json
from pathlib import Path

import pytest
from histories import DAY, OTHER, START, VALVE, success
from kept_rows import csv_rows

from valve_friction_ros.health import Level
from valve_friction_ros.history import (
    AlarmRecording,
    HistoryFile,
    keep_alarm_recording,
    keep_renewal,
    keep_usage,
)
from valve_friction_ros.usage import BINS, Usage, UsedDay

FIRST = START // DAY


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """Three days, a renewal after two of them; another valve that was never identified."""
    history = HistoryFile(tmp_path_factory.mktemp("usage") / "history.sqlite")
    history.add(success())
    times = (3600 * 10**9, *[0] * (BINS - 2), 72_000 * 10**9)
    for n, renewal in enumerate((0, 0, START + 2 * DAY)):
        keep_usage(history, VALVE, "run", [UsedDay(FIRST + n, renewal, Usage(1.5, 10, 4, times))])
    keep_renewal(history, VALVE, START + 2 * DAY)
    keep_usage(history, OTHER, "run", [UsedDay(FIRST, 0, Usage(7.0, 1, 1, times))])
    for n in range(2):
        one = AlarmRecording(START + n, Level.ERROR, Path(f"/alarms/{n}"), "excess friction")
        keep_alarm_recording(history, VALVE, one)
    return history.path


def test_below_the_list(listed, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    figures = "{} m of travel, {} reversals, {} breakaways in {} h monitored"
    lines = listed().splitlines()
    new = figures.format("1.5", 10, 4, 21)
    assert f"usage: {new}, since 2026-09-23 (packing renewed)" in lines
    assert f"usage: {figures.format('4.5', 30, 12, 63)}, in total" in lines
    assert "alarm recordings: 2, the latest 2026-09-21T14:13:20Z ERROR: /alarms/1" in lines


def test_in_json(listed):
    (valve,) = json.loads(listed("--json"))["valves"]
    assert valve["usage"]["since_renewal"]["distance"] == 1.5
    assert valve["usage"]["renewal"] == "2026-09-23T14:13:20Z"
    days = [one["day"] for one in valve["usage"]["days"]]
    assert days == ["2026-09-21", "2026-09-22", "2026-09-23"]
    assert valve["alarm_recordings"][1] == {
        "time": "2026-09-21T14:13:20Z",
        "level": "ERROR",
        "path": "/alarms/1",
        "message": "excess friction",
    }


def test_days(listed, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    lines = [" ".join(line.split()) for line in listed("--usage").splitlines()]
    assert "FV-101 /fv_101/identifier" in lines
    assert "LV-7 /area_2/lv_7/identifier" in lines
    assert "2026-09-22 1.5 10 4 21 1 20 not known" in lines
    assert "2026-09-23 1.5 10 4 21 1 20 2026-09-23" in lines
    output = listed("--usage", "--valve", "FV-101", "--until", "2026-09-22")
    total = "3 m of travel, 20 reversals, 8 breakaways in 42 h monitored, from 2026-09-21 to"
    assert total in output
    assert "in total" not in output


def test_days_in_json_and_csv(listed, tmp_path):
    path = tmp_path / "usage.csv"
    options = ("--valve", "FV-101", "--since", "2026-09-22", "--until", "2026-09-22")
    (valve,) = json.loads(listed("--usage", "--json", "--csv", path, *options))["valves"]
    assert [one["day"] for one in valve["usage"]["days"]] == ["2026-09-22"]
    (row,) = csv_rows(path)
    assert (row["day"], row["tag"], row["packing_renewed"]) == ("2026-09-22", "FV-101", "")
    assert float(row["distance_m"]) == 1.5
    assert float(row["time_at_95_to_100_percent_s"]) == 72_000
    times = [float(row[name]) for name in row if name.startswith("time_at_")]
    assert sum(times) == float(row["time_watched_s"])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--usage", "--plot", "x.png"], "--usage: cannot be combined with --plot"),
        (["--usage", "--since", "2027-01-01"], "no usage of these valves within these times"),
    ],
)
def test_refused(refused, file, options, words):
    assert words in refused("history", file, *options)
