# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `plan-test`: what it knows, what it writes, what it refuses."""

import json
import re
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
import yaml
from histories import VALVE, success
from kept_rows import csv_rows

from valve_friction_ros.history import HistoryFile
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, simulate
from valve_friction_ros.planning import plan_test

SPRING = ("--spring-constant", "205000", "--spring-preload", "231.65")
KNOWN = (*SPRING, "--coulomb-friction", "152.7", "--viscous-friction", "4865")
QUICK = ("--duration", "15", "--from", "40 %", "--to", "60", "--sample-rate", "40")


PLANS = {}


@pytest.fixture(autouse=True)
def searched_once(monkeypatch):
    """The same question has the same answer, as the tests of planning show: it is found once."""

    def answered(*question):
        *asked, progress = question
        if repr(asked) not in PLANS:
            PLANS[repr(asked)] = plan_test(*asked, progress)
        return PLANS[repr(asked)]

    monkeypatch.setattr("valve_friction_ros.commands.plan_test.plan_test", answered)


@pytest.fixture
def plan(told, bench_yaml, tmp_path):
    """Function of options: what is printed; the file is `test.csv`."""

    def plan(*options):
        output = ("--output", tmp_path / "test.csv")
        return told("plan-test", "--valve", bench_yaml, *output, *options)

    return plan


@pytest.fixture
def refusal(refused, bench_yaml, tmp_path):
    """Function of options: the one line on stderr; nothing is written."""

    def refusal(*options):
        output = tmp_path / "test.csv"
        line = refused("plan-test", "--valve", bench_yaml, "--output", output, *options)
        assert not output.exists()
        return line

    return refusal


def test_the_file_moves_the_stem_as_it_was_told(plan, tmp_path):
    picture = tmp_path / "plan.png"
    out = plan(*KNOWN, *QUICK, "--converter-lag", "0", "--figure", picture, "--json")
    told = json.loads(out, parse_constant=pytest.fail)
    rows = csv_rows(tmp_path / "test.csv")
    times, pressures = np.array([(row["time_s"], row["pressure_pa"]) for row in rows], float).T
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(told["duration"], abs=1e-6)
    assert times[-1] <= 15.0
    time = np.arange(0.0, times[-1], 0.02)
    stem = simulate(BENCH_VALVE, LOW_FRICTION, np.interp(time, times, pressures), 0.02)
    likely = told["forecasts"][1]
    assert likely["friction"] == told["likely"] == "as assumed"
    reach = [stem.position.min(), stem.position.max()]
    assert reach == pytest.approx(likely["position_range"], abs=2e-5)
    assert 0.4 < reach[0] / BENCH_VALVE.travel < reach[1] / BENCH_VALVE.travel < 0.6
    friction = likely["parameters"]["coulomb_friction"]
    assert friction["value"] == 152.7
    assert 0 < friction["half_width"] < 50
    play = told["play"]
    assert play["converter_lag"] == 0.0
    assert play["file_minimum"] <= pressures.min() < pressures.max() <= play["file_maximum"]
    rate = np.max(np.abs(np.diff(pressures) / np.diff(times)))
    assert rate < play["file_rate"] < 1.01 * rate
    assert matplotlib.image.imread(picture).shape[0] > 500


def test_the_text_says_that_nothing_moves_and_how_to_play_it(plan, tmp_path):
    out = plan(*KNOWN, *QUICK)
    words = " ".join(out.split())
    assert "Nothing has been moved." in words
    assert "put the loop in manual" in words
    assert "% of the travel (40 to 60 % with the friction assumed)" in words
    assert "1.5 to 1.8 times as wide" in words
    assert "never the topic of the measured pressure" in words
    plays = [line for line in out.splitlines() if line.startswith("ros2 run")]
    on_valve, watched, on_bench = plays
    assert watched.startswith("ros2 run valve_friction_ros stroke_player --ros-args -r ")
    given = dict(one.split(":=") for one in re.findall(r"-p (\S+)", watched))
    assert Path(given["file"]) == tmp_path / "test.csv"
    travel = 0.028575
    low, high = (float(given[f"position_{end}"]) / travel for end in ("minimum", "maximum"))
    assert 0.35 < low < 0.5 < high < 0.65  # within 40 to 60 % of the travel, and a margin of 5 %
    for line in (on_valve, on_bench):
        assert line.startswith("ros2 run valve_friction_ros pressure_source --ros-args -r ")
        assert f"-p file:={tmp_path / 'test.csv'}" in line
    assert "-r actuator_pressure:=" in on_valve
    assert "-p converter_lag:=0.0" in on_valve
    assert "-r __ns:=" in on_bench
    assert "-p converter_lag:=0.0" not in on_bench
    assert "coulomb_friction [N]" in out


def friction(out):
    return [one["parameters"]["coulomb_friction"]["value"] for one in json.loads(out)["forecasts"]]


def test_an_earlier_result_and_the_history_know_the_friction(plan, tmp_path):
    values = {"coulomb_friction": 200.0, "static_friction": None, "viscous_friction": 5e3}
    values |= {"spring_constant": 2.05e5, "spring_preload": 231.65}
    estimate = tmp_path / "estimate.json"
    parameters = {name: {"value": value} for name, value in values.items()}
    estimate.write_text(json.dumps({"parameters": parameters}))
    assert friction(plan("--estimate", estimate, *QUICK, "--json")) == [100.0, 200.0, 400.0]
    history = tmp_path / "history.sqlite"
    HistoryFile(history).add(success(friction=180.0))
    known = ("--history", history, "--valve-name", VALVE.tag, "--friction-factor", "1")
    assert friction(plan(*known, *SPRING, *QUICK, "--json", "--replace")) == [180.0]


def test_without_any_friction_a_range_is_planned_for(plan):
    out = plan(*SPRING, "--duration", "25", "--sample-rate", "20", "--json")
    names = [one["friction"] for one in json.loads(out)["forecasts"]]
    assert names == ["light", "medium", "heavy"]


def test_refusals(refusal, tmp_path):
    assert refusal().startswith("the spring_constant is unknown")
    assert refusal(*KNOWN, "--duration", "3").startswith("3 s do not allow")
    assert refusal(*KNOWN, "--from", "70", "--to", "30").startswith("the part of the travel")
    assert "2 spring" not in refusal(*KNOWN, "--friction-factor", "0.5")
    assert refusal(*SPRING, "--spring-constant", "0").startswith("a machine without a spring")
    assert "no.json" in refusal("--estimate", tmp_path / "no.json")
    assert "no.sqlite" in refusal("--history", tmp_path / "no.sqlite")
    assert "there is no folder" in refusal(*KNOWN, "--figure", tmp_path / "none" / "a.png")


def test_a_file_that_is_there_stays(refused, bench_yaml, tmp_path):
    path = tmp_path / "test.csv"
    path.write_text("mine")
    options = ("--valve", bench_yaml, "--output", path, *KNOWN, *QUICK)
    assert "--replace" in refused("plan-test", *options)
    assert path.read_text() == "mine"


@pytest.mark.parametrize("text", ["half", "-1", "101", "nan"])
def test_percentages(refusal, text):
    assert "not a percentage of the travel" in refusal(*KNOWN, f"--from={text}")


class TestWithoutRos:
    """Set points for a control system, and a form for a person."""

    def test_the_table_is_the_test_in_other_units(self, plan, tmp_path, bench_yaml):
        table, form = tmp_path / "steps.csv", tmp_path / "form.txt"
        valve = tmp_path / "valve.yaml"
        parameters = {**yaml.safe_load(bench_yaml.read_text()), "valve_tag": "31-FV 7"}
        valve.write_text(yaml.safe_dump({"/**": {"ros__parameters": parameters}}))
        named = ("--valve", valve, "--table", table, "--form", form)
        out = plan(*KNOWN, *QUICK, *named)
        assert "s, too short for a person: lower --pressure-rate" in out
        rows = csv_rows(table)
        corners = [tuple(map(float, row.values())) for row in csv_rows(tmp_path / "test.csv")]
        ends = [float(row["time_s"]) + float(row["within_s"]) for row in rows]
        assert ends == pytest.approx([time for time, _ in corners], abs=0.011)
        pressures = np.array([pressure for _, pressure in corners])

        def column(name):
            return [float(row[name]) for row in rows]

        assert column("pressure_kpa") == pytest.approx(pressures / 1e3, abs=1e-3)
        # 0 % is where the spring begins to move: P_ref + F_0/S_a; 100 % is k·travel/S_a above it.
        low = BENCH_VALVE.pressure_reference + 231.65 / BENCH_VALVE.diaphragm_area
        span = 205000 * BENCH_VALVE.travel / BENCH_VALVE.diaphragm_area
        share = (pressures - low) / span
        assert column("setpoint_percent") == pytest.approx(100 * share, abs=0.006)
        assert column("setpoint_ma") == pytest.approx(4 + 16 * share, abs=6e-4)
        assert any("reversal" in row["tells"] for row in rows)
        text = form.read_text()
        is_rest = [row["tells"].startswith("rest") for row in rows]
        assert 0 < sum(is_rest) == len(rows) - text.count("[ ]   _______")  # of less than 2 s
        assert "ABORT" in text
        assert "valve 31-FV 7   date" in text
        assert "of the travel, measured from the end without air," in text
        assert f"{float(rows[0]['abort_above_mm']):.1f} mm" in text

    def test_a_signal_that_does_not_hold_the_test_is_refused_before_the_search(
        self, refusal, tmp_path, monkeypatch
    ):
        monkeypatch.setattr("valve_friction_ros.commands.plan_test.plan_test", pytest.fail)
        for signal in ("0.9..1.0 bar", "0.9..x"):
            wanted = ("--table", tmp_path / "steps.csv", "--signal-range", signal)
            assert signal[:3] in refusal(*KNOWN, *QUICK, *wanted)

    def test_table_and_form_in_psi_and_inch(self, plan, refused, tmp_path):
        """1 psi is 6894.757 Pa, and 1 in 25.4 mm: the same steps, to 1 Pa and to 0.01 mm."""
        written = {}
        us = ("--pressure-unit", "PSI", "--position-unit", "inch")
        for name, units in (("si", ()), ("us", us)):
            table, form = tmp_path / f"{name}.csv", tmp_path / f"{name}.txt"
            options = ("--table", table, "--form", form, "--replace", *units)
            plan(*KNOWN, "--friction-factor", "1", *QUICK, *options)
            written[name] = csv_rows(table), form.read_text()
        (metric, _), (inches, text) = written["si"], written["us"]
        assert "pressure_kpa" not in inches[0]
        for one, other in zip(inches, metric, strict=True):
            assert one["setpoint_ma"] == other["setpoint_ma"]
            assert float(one["pressure_psi"]) * 6.894757 == pytest.approx(
                float(other["pressure_kpa"]), abs=1.1e-3
            )
            for end in ("below", "above"):
                limit = float(one[f"abort_{end}_in"]) * 25.4
                assert limit == pytest.approx(float(other[f"abort_{end}_mm"]), abs=0.011)
        assert f"{float(inches[0]['abort_above_in']):.3f} in" in text
        assert "kPa" not in text
        assert " mm" not in text
        assert "--pressure-unit" in refused("plan-test", "--pressure-unit", "percent")
