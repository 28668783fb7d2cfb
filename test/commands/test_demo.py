"""The command `demo`: its verdict, its options, and its whole story at a quicker pace."""

import dataclasses
import io
import math
import re
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console

from valve_friction_ros.commands import demo
from valve_friction_ros.identification import IdentificationSettings, identify
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION, LOW_FRICTION
from valve_friction_ros.monitoring import Level
from valve_friction_ros.plots import Case

PNG = b"\x89PNG\r\n\x1a\n"
ASKED = {
    "viscous_friction": 0.001,
    "coulomb_friction": 0.001,
    "spring_constant": 0.001,
    "mass": 0.1,
}


@pytest.fixture(scope="module")
def case(quick_record):
    settings = IdentificationSettings(position_bias=1.13e-3, fixed={"mass": 1.6})
    return Case.of("loose", quick_record, identify(quick_record, BENCH_VALVE, settings))


@pytest.fixture
def outcome(case):
    """Function of relative errors by name: what was identified."""

    def build(label="loose", truth=LOW_FRICTION, **errors):
        identified = {
            name: getattr(truth, name) * (1 + errors.get(name, 0.0)) for name in demo._TOLERANCES
        }
        return demo._Outcome(label, truth, identified, case)

    return build


def test_tolerances_are_what_was_promised():
    assert {name: demo._TOLERANCES[name] for name in ASKED} == ASKED


class TestMissed:
    @pytest.mark.parametrize("name", demo._TOLERANCES)
    @pytest.mark.parametrize("sign", [1, -1])
    def test_each_parameter_is_judged_both_ways(self, outcome, name, sign):
        tolerance = demo._TOLERANCES[name]
        assert outcome(**{name: 0.99 * sign * tolerance}).missed() == []
        assert outcome(**{name: 1.01 * sign * tolerance}).missed() == [name]

    def test_nothing_identified_is_missed(self, outcome):
        assert outcome(coulomb_friction=math.nan).missed() == ["coulomb_friction"]

    def test_of_the_true_packing(self, outcome):
        """The loose packing's friction is no answer for the tight one."""
        tight = outcome(truth=HIGH_FRICTION)._replace(identified=outcome().identified)
        assert set(tight.missed()) >= {"viscous_friction", "coulomb_friction", "static_friction"}


class TestReport:
    @pytest.fixture
    def report(self, tmp_path):
        """Function of outcomes and level: exit code, printed words and picture."""

        def report(outcomes, level):
            output = tmp_path / "[b]demo.png"  # not to be taken for bold
            stream = io.StringIO()
            story = demo._Story(outcomes, level, "excess friction")
            code = demo._report(story, output, Console(file=stream, width=200))
            words = stream.getvalue()
            assert f"picture: {output}" in words
            assert output.read_bytes().startswith(PNG)
            return code, words

        return report

    def test_all_well(self, report, outcome):
        code, words = report([outcome(coulomb_friction=5e-4), outcome("tight")], Level.ERROR)
        assert code == 0
        assert "/diagnostics ERROR: excess friction" in words
        assert re.search(r"coulomb_friction +N +152\.7 +152\.776 +\+0\.0500 % +±0\.1 %", words)
        assert "outside" not in words

    def test_a_missed_tolerance(self, report, outcome):
        code, words = report([outcome(), outcome("tight", mass=-0.2)], Level.ERROR)
        assert code == 1
        assert "outside the tolerance: mass (tight)" in words

    def test_friction_that_was_not_diagnosed(self, report, outcome):
        code, words = report([outcome(), outcome("tight")], Level.WARN)
        assert code == 1
        assert "/diagnostics WARN: excess friction" in words
        assert "the excess friction was not diagnosed" in words


class TestOptions:
    def test_default_picture(self):
        assert demo._parser().parse_args([]).output == Path("valve_friction_demo.png")

    @pytest.mark.parametrize(
        ("name", "message"),
        [
            ("demo.xyz", "not a picture format; choose from ."),
            ("no/demo.png", "there is no folder"),
        ],
    )
    def test_a_bad_picture_is_refused_before_the_nodes_start(
        self, monkeypatch, capsys, tmp_path, name, message
    ):
        monkeypatch.setattr(demo, "running_nodes", pytest.fail)
        assert demo.main(["--output", str(tmp_path / name)]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.startswith(f"demo: {tmp_path / name}: {message}")
        assert err.count("\n") == 1

    def test_unknown_option(self, capsys):
        with pytest.raises(SystemExit) as ended:
            demo.main(["--speed", "10"])
        assert ended.value.code == 2
        assert "unrecognized arguments: --speed 10" in capsys.readouterr().err


def test_nodes_start_as_the_bench_valve():
    nodes = {node.executable: node.parameters for node in demo._nodes()}
    assert set(nodes) == {"identifier", "simulator", "pressure_source"}
    truth = dataclasses.asdict(LOW_FRICTION)
    assert {name: nodes["simulator"][name] for name in truth} == truth
    bias = LOW_FRICTION.spring_preload / LOW_FRICTION.spring_constant
    assert nodes["identifier"]["position_bias"] == bias


@pytest.mark.slow
def test_the_whole_story(ros_environment, tmp_path):
    """Three nodes over DDS: identified, tightened while running, identified again, diagnosed."""
    output = tmp_path / "demo.png"
    done = subprocess.run(
        [sys.executable, Path(__file__).with_name("quick_demo.py"), "--output", output],
        capture_output=True,
        text=True,
        timeout=110,
        check=False,
        cwd=tmp_path,
        env=ros_environment | {"COLUMNS": "200"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    words = " ".join(done.stdout.split())
    assert words.index("the packing is tightened while the valve runs") > words.index("identified;")
    assert "packing tight coulomb_friction N 606 " in words
    assert "/diagnostics ERROR: excess friction: coulomb friction is 3.97 times its bas" in words
    assert "outside the tolerance" not in words
    assert output.read_bytes().startswith(PNG)
