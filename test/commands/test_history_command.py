# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `history`, as a person runs it."""

import argparse
import json
import math
from dataclasses import replace

import matplotlib.image
import pytest
from histories import DAY, OTHER, START, VALVE, at_other_speeds, success
from histories import refused as refusal_at
from kept_rows import csv_rows

from valve_friction_ros.commands.arguments.declared import DECLARATIONS
from valve_friction_ros.health import Baseline, FrictionLimits, Level
from valve_friction_ros.history import MONTH, HistoryFile, KeptBaseline
from valve_friction_ros.identification import Verdict

BASELINE = Baseline(141.0, 1.0)
DRIFT = 3.0


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """Twenty weeks of one valve, with a refusal, and two identifications of another."""
    history = HistoryFile(tmp_path_factory.mktemp("history") / "history.sqlite")
    history.add(success(START - 30 * DAY, 300.0))  # before the packing was replaced
    history.set_baseline(VALVE, KeptBaseline(BASELINE, START + 1, START))
    for week in range(20):
        friction = 150.0 + DRIFT * week * 7 * DAY / MONTH
        history.add(success(START + week * 7 * DAY, friction, 1.0, baseline=BASELINE))
    history.add(refusal_at(START + DAY, "too little travel: move the valve"))
    history.add(success(START, 80.0, valve=OTHER, verdict=Verdict.WEAK))
    history.add(success(START + DAY, valve=OTHER))
    return history.path


@pytest.fixture
def valves(listed):
    """Function of arguments of `history` on the file of the tests: the valves, by JSON."""
    return lambda *arguments, **path: json.loads(listed("--json", *arguments, **path))["valves"]


class TestTable:
    def test_entries_with_trend(self, listed, monkeypatch):
        monkeypatch.setenv("COLUMNS", "160")
        lines = [" ".join(line.split()) for line in listed().splitlines()]
        assert "FV-101 /fv_101/identifier" in lines
        assert "LV-7 /area_2/lv_7/identifier" in lines
        assert "2026-09-21 14:13:20 F_c 150.0 ± 1.0 identified 1.06 OK friction normal" in lines
        assert "2026-09-22 14:13:20 – refused OK too little travel: move the valve" in lines
        assert "2026-09-21 14:13:20 F_c 80.0 ± 3.0 weak OK friction normal: so" in lines
        (drift,) = (line for line in lines if "drifts" in line)
        assert drift.startswith("trend: Coulomb friction drifts by +3.00 ± 0.")
        assert drift.endswith("N per month, over 20 days with records, 2026-09-21 to 2027-02-01")
        (limit,) = (line for line in lines if "expected on" in line)
        assert limit.startswith("trend: warn_ratio (176.2 N) expected on 2027-06-1")

    def test_an_insignificant_drift_has_no_number(self, tmp_path, listed, valves):
        history = HistoryFile(tmp_path / "history.sqlite")
        for day, friction in enumerate((150.0, 154.0, 151.0, 156.0, 153.0)):
            history.add(success(START + day * DAY, friction))
        output = listed(path=history.path)
        assert (
            "no significant drift of Coulomb friction over 5 days with records, 2026-09" in output
        )
        assert "month" not in output
        (valve,) = valves(path=history.path)
        found = [valve["trend"][name] for name in ("significant", "drift_n_per_month", "crossing")]
        assert found == [False, None, None]

    def test_two_methods_make_no_common_trend(self, tmp_path, valves):
        """The last one's alone: here five days that lie 100 N above those before."""
        history = HistoryFile(tmp_path / "history.sqlite")
        for day in range(10):
            method, friction = ("bench", 150.0) if day < 5 else ("signature", 250.0)
            history.add(success(START + day * DAY, friction, method=method))
        (valve,) = valves(path=history.path)
        assert (valve["trend"]["days"], valve["trend"]["significant"]) == (5, False)

    def test_other_speeds_than_that_of_the_baseline(self, tmp_path, listed):
        """The list ended without a word, below a friction that grew from week to week."""
        history = at_other_speeds(tmp_path / "history.sqlite")
        assert "trend: none, because 3 of 4 records move" in " ".join(
            listed(path=history.path).split()
        )

    def test_too_few_days_have_no_trend(self, listed, valves):
        assert "trend" not in listed("--valve", "LV-7")
        (valve,) = valves("--valve", "LV-7")
        assert valve["trend"] is None


class TestBaselines:
    """Each change of a baseline, with who made it, and what it replaced."""

    @pytest.fixture
    def changed(self, tmp_path):
        history = HistoryFile(tmp_path / "changed.sqlite")
        grown, later = Baseline(600.0, 8.0), START + DAY
        kept = KeptBaseline(
            grown, later, START, replaced=BASELINE, by="set_baseline", level=Level.ERROR
        )
        history.add(success(START, 600.0, baseline=BASELINE))
        history.set_baseline(VALVE, kept)
        history.add(success(START + 2 * DAY, 600.0, baseline=grown))
        back = {"by": "restore_baseline", "level": Level.OK, "replaced": grown}
        history.set_baseline(
            VALVE, replace(kept, baseline=BASELINE, time=START + 3 * DAY, since=0, **back)
        )
        history.set_baseline(VALVE, replace(kept, time=START + 4 * DAY, withdrawn=True, **back))
        return history.path

    def test_in_the_table_by_time_and_in_json(self, listed, valves, changed, monkeypatch):
        monkeypatch.setenv("COLUMNS", "160")
        words = " ".join(listed(path=changed).split())
        rows = [f"2026-{row}" for row in words.split("2026-")[1:]]
        assert ["baseline" in row for row in rows] == [False, True, False, True, True]
        old, new = "Coulomb friction 141.0 ± 1.0 N", "Coulomb friction 600.0 ± 8.0 N"
        assert rows[1].startswith("2026-09-22 14:13:20 baseline ERROR set_baseline: ")
        assert rows[1].strip().endswith(f"{new}; previous: {old}")
        assert rows[3].startswith("2026-09-24 14:13:20 baseline OK restore_baseline: ")
        assert rows[3].strip().endswith(f"{old}; previous: {new}")
        assert rows[4].strip().endswith(f"OK restore_baseline: none; previous: {new}")
        (valve,) = valves(path=changed)
        told = [(one["baseline"], one["replaced"]) for one in valve["baselines"]]
        assert told == [(600.0, 141.0), (141.0, 600.0), (None, 600.0)]


class TestJson:
    def test_an_entry(self, valves):
        valve = valves("--valve", "FV-101")[0]
        assert (valve["name"], valve["tag"]) == VALVE
        entry = valve["entries"][1]
        assert entry["time"] == "2026-09-21T14:13:20.000Z"
        assert (entry["begin"], entry["end"]) == ("2026-09-21T14:12:20.000Z", entry["time"])
        friction = entry["parameters"]["coulomb_friction"]
        assert friction == {
            "value": 150.0,
            "standard_error": 0.5,
            "half_width": 1.0,
            "interval": [149.0, 151.0],
            "unit": "N",
            "verdict": "identified",
            "reason": "",
            "published": None,
        }
        assert entry["parameters"]["static_friction"]["value"] is None
        assert entry["diagnosis"]["ratio"] == pytest.approx(150 / 141)
        assert (entry["baseline"], entry["baseline_half_width"]) == (141.0, 1.0)
        assert entry["limits"] == FrictionLimits().ratios
        assert entry["settings"]["valve"]["diaphragm_area"] == 0.0445
        assert entry["refusal"] == ""

    def test_the_trend_begins_with_the_last_baseline(self, valves):
        trend = valves("--valve", "FV-101")[0]["trend"]
        assert trend["begin"] == "2026-09-21T14:13:20.000Z"
        assert trend["drift_n_per_month"] == pytest.approx(DRIFT)
        assert 0 < trend["half_width_n_per_month"] < DRIFT
        crossing = trend["crossing"]
        assert (crossing["limit"], crossing["level_n"]) == ("warn_ratio", 176.25)
        assert crossing["earliest"] < crossing["expected"] < crossing["latest"]


class TestChoice:
    def test_by_any_name(self, valves):
        for name in ("FV-101", "fv_101", "/fv_101", "/fv_101/identifier"):
            assert [one["name"] for one in valves("--valve", name)] == [VALVE.name]
        found = valves("--valve", "area_2/lv_7", "--valve", "FV-101")
        assert {one["name"] for one in found} == {VALVE.name, OTHER.name}

    @pytest.mark.parametrize(
        ("arguments", "times"),
        [
            (["--since", "2026-09-22"], ["2026-09-22T14:13:20.000Z"]),
            (["--until", "2026-09-21"], ["2026-09-21T14:13:20.000Z"]),
            (
                ["--since", "2026-09-21T14:13:20Z", "--until", "2026-09-22T14:13:20+00:00"],
                ["2026-09-21T14:13:20.000Z"],
            ),
            (["--since", "2026-09-22T16:13:20+02:00"], ["2026-09-22T14:13:20.000Z"]),
        ],
    )
    def test_by_time(self, valves, arguments, times):
        (valve,) = valves("--valve", "LV-7", *arguments)
        assert [entry["time"] for entry in valve["entries"]] == times

    def test_a_trend_of_the_time_before_the_baseline(self, tmp_path, valves):
        history = HistoryFile(tmp_path / "history.sqlite")
        for day in range(9):
            history.add(success(START + day * DAY, 150.0 + day, 0.1))
        history.set_baseline(VALVE, KeptBaseline(BASELINE, START + 6 * DAY, START + 6 * DAY))
        (before,) = valves("--until", "2026-09-26", path=history.path)
        assert before["trend"]["days"] == 6
        assert valves(path=history.path)[0]["trend"] is None


def test_csv(listed, tmp_path, file):
    path = tmp_path / "history.csv"
    listed("--csv", path)
    rows = csv_rows(path)
    entries = HistoryFile(file).entries()
    assert len(rows) == len(entries) == 24
    for row, entry in zip(rows, entries, strict=True):
        friction = row["coulomb_friction_n"]
        assert (float(friction) if friction else None) == (entry.friction and entry.friction.value)
        assert (row["valve"], row["tag"], row["refusal"]) == (*entry.valve, entry.refusal)
        assert row["static_friction_n"] == ""
    first = next(row for row in rows[1:] if row["tag"] == "FV-101")
    assert first["time"] == "2026-09-21T14:13:20.000Z"
    assert (first["coulomb_friction_half_width_n"], first["mass_kg"]) == ("1.0", "1.0")
    assert first["coulomb_friction_verdict"] == "identified"
    assert math.isclose(float(first["ratio"]), 150 / 141)
    assert (first["level"], first["baseline_n"]) == ("OK", "141.0")


def test_plot(listed, tmp_path):
    path = tmp_path / "history.png"
    listed("--plot", path)
    assert matplotlib.image.imread(path).std() > 0.05


class TestErrors:
    """One line, and exit code 2."""

    def test_no_file_and_an_empty_one(self, refused, tmp_path):
        path = tmp_path / "none.sqlite"
        line = refused("history", path)
        assert str(path) in line
        assert "there is no such file" in line
        assert not path.exists()
        HistoryFile(path).prepare()
        assert "no identification" in refused("history", path)

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (["--valve", "FV-999"], ["FV-999", VALVE.name, OTHER.name]),
            (["--until", "1999-12-31"], ["no identification of these valves"]),
            (["--since", "yesterday"], ["--since", "yesterday"]),
            (["--since", "2026-13-01"], ["--since", "2026-13-01"]),
            (["--since", "1969-12-31"], ["--since", "1969-12-31"]),
            (["--since", "3000-01-01"], ["--since", "3000-01-01"]),
            (["--plot", "history.txt"], ["not a picture format"]),
        ],
    )
    def test_options(self, refused, file, options, words):
        line = refused("history", file, *options)
        assert [word for word in words if word not in line] == []

    def test_too_many_panels(self, refused, tmp_path):
        history = HistoryFile(tmp_path / "many.sqlite")
        for number in range(13):
            history.add(success(valve=VALVE._replace(name=f"/fv_{number}/identifier")))
        line = refused("history", history.path, "--plot", tmp_path / "many.png")
        assert "one to 12 valves can be plotted, got 13: choose some with --valve" in line


def test_the_default_file():
    """That of the nodes."""
    parser = argparse.ArgumentParser()
    DECLARATIONS["history"](parser)
    assert parser.parse_args([]).file.parts[-2:] == ("valve_friction_ros", "history.sqlite")


def test_the_latest_diagnosis_may_fail_the_command(tmp_path, command):
    """Of each valve the last counts: an alarm that has gone is none."""
    history = HistoryFile(tmp_path / "history.sqlite")
    grown = success(START, 300.0, baseline=BASELINE)
    history.add(replace(grown, diagnosis=replace(grown.diagnosis, level=Level.ERROR)))
    assert command("history", history.path, "--fail-on", "error")[0] == 3
    assert command("history", history.path)[0] == 0
    history.add(success(START + DAY, baseline=BASELINE))
    code, out, err = command("history", history.path, "--fail-on", "warn")
    assert (code, err) == (0, "")
    assert "ERROR" in out
