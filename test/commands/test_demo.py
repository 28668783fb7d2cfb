# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `demo`, its verdict and its whole story, and the client of its bench."""

import contextlib
import io
import json
import math
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from pages import PNG
from processes import ran, wait_until
from rich.console import Console

from valve_friction_ros.commands.demo import command as demo
from valve_friction_ros.commands.demo import plant
from valve_friction_ros.commands.demo.bench import (
    NodeProcess,
    quick_discovery,
    running_nodes,
)
from valve_friction_ros.commands.demo.command import TOLERANCES, Outcome, identified
from valve_friction_ros.figures import Case
from valve_friction_ros.health import Level
from valve_friction_ros.identification import (
    UNITS,
    IdentificationSettings,
    Parameter,
    RefusalError,
    Verdict,
    identify_bench,
)
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION
from valve_friction_ros.nodes.plumbing.rclpy_private import PROFILES
from valve_friction_ros.settings import KARNOPP

HALF_WIDTH = 0.01  # of the value


@pytest.fixture(scope="module")
def case(quick_record):
    settings = IdentificationSettings(position_bias=1.13e-3, fixed={"mass": 1.6})
    return Case.of("loose", identify_bench(quick_record, BENCH_VALVE, settings))


def identified_value(name, value, verdict=Verdict.IDENTIFIED, reason=""):
    half_width = HALF_WIDTH * abs(value)
    return Parameter(name, value, half_width / 2, half_width, verdict, reason)


@pytest.fixture
def outcome(case):
    """Function of relative errors of the published values by name: what was identified.

    `assessed` replaces parameters of the identified model, which is right but for them.
    """

    def build(label="loose", truth=LOW_FRICTION, assessed=(), **errors):
        published = {
            name: getattr(truth, name) * (1 + errors.get(name, 0.0)) for name in TOLERANCES
        }
        right = {name: identified_value(name, getattr(truth, name)) for name in TOLERANCES}
        right |= {one.name: one for one in assessed}
        return Outcome(label, truth, published, right, case)

    return build


def test_tolerances_are_what_was_promised():
    names = ("viscous_friction", "coulomb_friction", "spring_constant", "mass")
    assert [TOLERANCES[name] for name in names] == [0.02, 0.01, 0.002, 0.1]


class TestMissed:
    @pytest.mark.parametrize("name", TOLERANCES)
    @pytest.mark.parametrize("sign", [1, -1])
    def test_each_parameter_is_judged_both_ways(self, outcome, name, sign):
        tolerance = TOLERANCES[name]
        assert outcome(**{name: 0.99 * sign * tolerance}).missed() == []
        assert outcome(**{name: 1.01 * sign * tolerance}).missed() == [name]

    def test_nothing_identified_is_missed(self, outcome):
        assert outcome(coulomb_friction=math.nan).missed() == ["coulomb_friction"]

    @pytest.mark.parametrize("name", TOLERANCES)
    @pytest.mark.parametrize("sign", [1, -1])
    def test_an_interval_that_is_untrue(self, outcome, name, sign):
        """An identified value may be off by three half widths, at 1 % of the value each."""

        def off_by(half_widths):
            value = getattr(LOW_FRICTION, name) / (1 - sign * half_widths * HALF_WIDTH)
            return outcome(assessed=[identified_value(name, value)])

        assert off_by(2.99).missed() == []
        assert off_by(3.01).missed() == [name]

    @pytest.mark.parametrize("verdict", [Verdict.WEAK, Verdict.NOT_IDENTIFIABLE, Verdict.FIXED])
    def test_only_identified_values_are_promised(self, outcome, verdict):
        value = math.nan if verdict is Verdict.NOT_IDENTIFIABLE else 1.5
        assert outcome(assessed=[identified_value("mass", value, verdict)]).missed() == []
        assert outcome(assessed=[identified_value("mass", 1.1)]).missed() == ["mass"]


class TestReport:
    @pytest.fixture
    def report(self, tmp_path):
        """Function of outcomes and level: exit code, printed words and picture."""

        def report(outcomes, level):
            output = tmp_path / "[b]demo.png"  # not to be taken for bold
            stream = io.StringIO()
            console = Console(file=stream, width=200)
            code = demo._report(outcomes, level, "excess friction", output, console)
            words = stream.getvalue()
            assert f"picture: {output}" in words
            assert output.read_bytes().startswith(PNG)
            return code, words

        return report

    def test_all_well(self, report, outcome):
        code, words = report([outcome(coulomb_friction=5e-4), outcome("tight")], Level.ERROR)
        assert code == 0
        assert "/diagnostics ERROR: excess friction" in words
        row = r"coulomb_friction +N +152\.7 +152\.776 +\+0\.050 % +152\.7 +1\.5 +identified"
        assert re.search(row, words)
        assert "outside" not in words

    def test_a_number_without_a_verdict_is_never_shown(self, report, outcome):
        withheld = identified_value(
            "static_friction", math.nan, Verdict.NOT_IDENTIFIABLE, "no slip jump"
        )
        given = Parameter("mass", 1.6, 0.0, 0.0, Verdict.FIXED)
        _, words = report([outcome(assessed=[withheld, given])], Level.ERROR)
        row = r"static_friction +N +152\.7 +152\.7 +\+0\.000 % +– +not identifiable *$"
        assert re.search(row, words, re.MULTILINE)
        assert re.search(
            r"mass +kg +1\.542 +1\.542 +\+0\.000 % +1\.6 +fixed *$", words, re.MULTILINE
        )
        assert "nan" not in words

    def test_a_missed_tolerance_and_a_friction_that_was_not_diagnosed(self, report, outcome):
        code, words = report([outcome(), outcome("tight", mass=-0.2)], Level.ERROR)
        assert code == 1
        assert "outside tolerance: mass (tight)" in words
        code, words = report([outcome(), outcome("tight")], Level.WARN)
        assert code == 1
        assert "/diagnostics WARN: excess friction" in words
        assert "the excess friction was not diagnosed" in words


class FakeClient:
    """A bench whose identifier answers with an estimate of this time."""

    def __init__(self, recording, values, time="22:14"):
        self._recording = recording
        self._values = values
        self._time = time

    @property
    def diagnostic_values(self):
        return self._values

    def recording(self):
        return self._recording

    def trigger(self, service):
        assert service == "identify"
        self._values = self._values | {"estimate_time": self._time}

    def wait(self, done, _timeout, what):
        assert done(), what


class TestIdentify:
    """What is read from the diagnostic of the identifier."""

    @pytest.fixture
    def values(self):
        diagnostic = {
            "estimate_valid": "true",
            "estimate_time": "22:13",
            "threshold [m/s]": "0.002",
            "warnings": "check the clocks",
        }
        for name in TOLERANCES:
            diagnostic |= {
                f"{name} [{UNITS[name]}]": "3.5",
                f"{name} half width [{UNITS[name]}]": "0.25",
                f"{name} verdict": "weak",
                f"{name} reason": "2 strokes only",
                f"{name} published [{UNITS[name]}]": "3.0",
            }
        return diagnostic | {
            "mass [kg]": "nan",
            "mass half width [kg]": "nan",
            "mass verdict": "not identifiable",
        }

    def test_a_friction_that_is_not_identifiable_is_an_outcome_too(self, quick_record, values):
        """It is judged with the rest, not waited for."""
        unknown = {
            "estimate_valid": "false",
            "coulomb_friction [N]": "nan",
            "coulomb_friction half width [N]": "nan",
            "coulomb_friction verdict": "not identifiable",
        }
        found = identified(FakeClient(quick_record, values | unknown), "loose", LOW_FRICTION)
        assert found.found["coulomb_friction"].verdict is Verdict.NOT_IDENTIFIABLE
        assert found.published["coulomb_friction"] == 3.0

    @pytest.mark.parametrize("time", [None, "22:13"])
    def test_an_older_estimate_is_not_the_one_asked_for(self, quick_record, values, time):
        with pytest.raises(AssertionError, match="diagnostic of the estimate"):
            identified(FakeClient(quick_record, values, time), "loose", LOW_FRICTION)

    def test_no_published_estimate_is_a_failure_with_its_reason(self, quick_record, values):
        withheld = {name: value for name, value in values.items() if "published" not in name}
        del withheld["threshold [m/s]"]
        with pytest.raises(RefusalError, match=r"^no published estimate: check the clocks$"):
            identified(FakeClient(quick_record, withheld), "loose", LOW_FRICTION)


def test_a_bad_picture_is_refused_before_the_nodes_start(monkeypatch, refused, tmp_path):
    monkeypatch.setattr(demo, "running_nodes", pytest.fail)
    path = tmp_path / "no" / "demo.png"
    assert refused("demo", "--output", path).startswith(f"{path}: there is no folder")


def test_nodes_start_as_the_bench_valve():
    """With noise: a demo without it would prove nothing."""
    nodes = {node.executable: node.parameters for node in demo._nodes()}
    assert set(nodes) == {"identifier", "simulator", "pressure_source"}
    assert not {one.name for one in KARNOPP} & nodes["simulator"].keys()
    assert all(getattr(LOW_FRICTION, one.name) == one.default for one in KARNOPP)
    bias = LOW_FRICTION.spring_preload / LOW_FRICTION.spring_constant
    assert nodes["identifier"]["position_bias"] == bias
    assert nodes["simulator"]["position_noise"] >= 3e-6
    assert nodes["pressure_source"]["pressure_noise"] > 0
    assert nodes["pressure_source"]["time_jitter"] > 0
    # Of one seed, the noise of both would be the same numbers.
    assert nodes["simulator"]["noise_seed"] != nodes["pressure_source"]["noise_seed"]


class TestPlant:
    def test_each_packing_has_its_fate(self):
        steps = {one.fate: [one.friction(step) for step in range(30)] for one in plant.VALVES}
        assert steps["healthy"] == [300.0] * 30
        assert steps["tightening"] == sorted(steps["tightening"])
        assert steps["tightening"][-1] == pytest.approx(900.0)
        assert steps["leaking"] == sorted(steps["leaking"], reverse=True)
        assert steps["leaking"][-1] == pytest.approx(90.0)
        assert {each[0] for each in steps.values()} == {300.0}

    def test_no_two_sensors_have_the_same_noise(self, tmp_path):
        seeds = [
            node.parameters["noise_seed"]
            for number, valve in enumerate(plant.VALVES)
            for node in plant.plant_nodes(valve, number, tmp_path / "history.sqlite")
            if node.executable != "identifier"
        ]
        assert len(set(seeds)) == len(seeds) == 6

    def test_without_nicegui_it_says_so_in_one_line(self, refused, monkeypatch):
        monkeypatch.setitem(sys.modules, "nicegui", None)
        monkeypatch.setattr(plant.importlib.util, "find_spec", lambda _: None)
        monkeypatch.setattr(demo, "free_domain", pytest.fail)
        told = refused("demo", "--dashboard")
        assert told.startswith("the dashboard needs NiceGUI: run `pip install")


def children(pid):
    return Path(f"/proc/{pid}/task/{pid}/children").read_text().split()


@pytest.mark.parametrize("request_to_end", [signal.SIGINT, signal.SIGHUP])
def test_interrupted(request_to_end, ros_environment, tmp_path):
    """Ctrl-C, or a closed terminal, while the nodes run: one line, and no node stays."""
    before = signal.signal(request_to_end, signal.default_int_handler)  # nohup ignores SIGHUP
    process = subprocess.Popen(
        [sys.executable, "-m", "valve_friction_ros", "demo"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=ros_environment,
    )
    signal.signal(request_to_end, before)
    wait_until(lambda: len(children(process.pid)) >= 3)
    time.sleep(1.0)
    nodes = children(process.pid)
    process.send_signal(request_to_end)
    _, err = process.communicate(timeout=300)
    assert process.returncode == 130
    assert err == "valve_friction demo: interrupted\n"
    assert not any(Path(f"/proc/{node}").exists() for node in nodes)


@pytest.mark.slow
def test_the_whole_story(ros_environment, tmp_path):
    """Three nodes over DDS: identified, tightened while running, identified again, diagnosed."""
    output = tmp_path / "demo.png"
    script, surroundings = Path(__file__).with_name("quick_demo.py"), {"COLUMNS": "200"}
    where = {"cwd": tmp_path, "env": ros_environment | surroundings}
    code, out, err = ran("demo", "--output", output, program=[script], **where)
    assert code == 0, out + err
    assert "Traceback" not in err
    words = " ".join(out.split())
    assert words.index("the packing is tightened while the valve runs") > words.index("identified;")
    loose, tight = re.findall(
        r"coulomb_friction N (\S+) (\S+) [+-]\S+ % (\S+) (\S+) identified", words
    )
    assert [loose[0], tight[0]] == ["152.7", "606"]
    for true, published, found_value, half_width in (loose, tight):
        assert float(published) == pytest.approx(float(true), rel=TOLERANCES["coulomb_friction"])
        assert abs(float(found_value) - float(true)) <= 3 * float(half_width)
    assert len(re.findall(r"static_friction N \S+ \S+ \S+ % – not identifiable", words)) == 2
    said = re.search(
        r"/diagnostics ERROR: excess friction: sliding friction at (\S+) mm/s is (\S+) "
        r"\((\S+) to (\S+)\) times its baseline; "
        "the stem ignores reversals smaller than 21 % of its travel",
        words,
    )
    assert said, words[-1500:]
    speed, ratio, low, high = map(float, said.groups())
    grown = (606.0 + 44800.0 * 1e-3 * speed) / (152.7 + 4865.0 * 1e-3 * speed)
    assert low < ratio < high
    assert ratio == pytest.approx(grown, rel=0.06)  # tight, it is slower, and may have fallen
    assert "outside tolerance" not in words
    assert output.read_bytes().startswith(PNG)


def test_what_a_client_is_told(ros_environment):
    """Two nodes and a client as processes: every failure has its reason, and all end well."""
    script = Path(__file__).with_name("bench_visit.py")
    code, out, err = ran(program=[script], env=ros_environment)
    assert code == 0, err
    assert "Traceback" not in err
    told = json.loads(out)
    assert told["before"] == [0.0, None, {}]
    assert told["identify"].startswith("identify: no ")
    assert "actuator_pressure" in told["identify"]
    assert told["clear"]
    assert told["impossible"].startswith("/fv_7/simulator refused: ")
    assert "static_friction" in told["impossible"]
    assert told["possible"] is None
    assert "actuator_pressure" in told["message"]
    assert told["estimate_valid"] == "false"
    assert told["exit codes"] == [0, 0]


@pytest.mark.parametrize("given", [None, "ROS_AUTOMATIC_DISCOVERY_RANGE", PROFILES])
def test_discovery_stays_on_this_machine_and_what_the_user_has_set_stays(monkeypatch, given):
    names = {"ROS_AUTOMATIC_DISCOVERY_RANGE", PROFILES}
    for name in names:
        monkeypatch.delenv(name, raising=False)
    if given:
        monkeypatch.setenv(given, "of the user")
    found = quick_discovery()
    assert set(found) == names - {given}
    assert found.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST") == "LOCALHOST"
    assert Path(found.get(PROFILES, __file__)).is_file()


def test_processes_end_with_the_context_even_after_an_error():
    """An unknown node ends by itself at once, or is ended."""
    node = NodeProcess("no_such_node", {})
    with contextlib.suppress(ZeroDivisionError), running_nodes([node, node], "fv_7") as processes:
        1 / 0  # noqa: B018
    assert len(processes) == 2
    assert all(process.returncode is not None for process in processes)
