# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Each setting is declared once, and all that a user meets of it is made from that."""

import os
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest

from valve_friction_ros import settings
from valve_friction_ros.identification import IdentificationSettings
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION
from valve_friction_ros.settings import IDENTIFICATION, KARNOPP, NODES, VALVE, is_known

PROJECT = Path(__file__).resolve().parents[1]
BEFORE = "    polynomial_order = Setting("
ADDED = '    steps = Setting(330, (1, 349), option="--steps"); """Thresholds of the sweep [-]."""\n'
USE = """
import argparse, importlib.util, sys
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType, SimpleNamespace

place = Path(sys.argv[1])
spec = importlib.util.spec_from_file_location("valve_friction_ros.settings", place)
settings = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(settings)

from valve_friction_ros.commands.arguments.declared import DECLARATIONS
from valve_friction_ros.commands.arguments.identification import identification_settings
from valve_friction_ros.fleet.job import Options
from valve_friction_ros.history.entry import settings_text
from valve_friction_ros.nodes.identifier.node import monitor_settings
from valve_friction_ros.nodes.plumbing.parameters import declare_parameters
from valve_friction_ros.nodes.start import _help_text
from valve_friction_ros.records import ReadingOptions, read_valve_file
from extension.command_options import command_as_markdown
from extension.node_parameters import parameters_as_markdown

declared = {}
node = SimpleNamespace(
    add_on_set_parameters_callback=id,
    add_pre_set_parameters_callback=id,
    declare_parameter=lambda name, *rest: declared.update({name: rest}),
)
declare_parameters(node, settings.NODES["identifier"])
default, descriptor = declared["steps"]
assert (default, descriptor.description) == (330, "Thresholds of the sweep [-]")
assert descriptor.integer_range[0].to_value == 349
values = {one.name: one.default for one in settings.NODES["identifier"]} | {"steps": 40}
kept = monitor_settings(values)
assert kept.identification.steps == 40
assert '"steps": 40' in settings_text(kept) or '"steps":40' in settings_text(kept)

place = place.with_name("valve.yaml")
place.write_text("diaphragm_area: 0.04\\nsteps: 41\\n")
described = read_valve_file(place)
parser = argparse.ArgumentParser()
DECLARATIONS["identify"](parser)
by_file = identification_settings(parser.parse_args(["record.csv"]), described)
by_option = identification_settings(parser.parse_args(["record.csv", "--steps=42"]), described)
assert (by_file.steps, by_option.steps) == (41, 42)
wanted = Options(described.valve, ReadingOptions(), "plant", by_file)
assert wanted.fingerprint() != replace(wanted, settings=by_option).fingerprint()

assert "  steps: 330  # Thresholds of the sweep [-]" in _help_text("identifier", "")
shown = "`steps`\\n: `330`; 1 to 349\\n\\n  Thresholds of the sweep.\\n"
assert shown in parameters_as_markdown("identifier")
assert "`--steps N`\\n: thresholds of the sweep (330)\\n" in command_as_markdown("identify")
"""


def test_a_new_setting_is_one_line(tmp_path):
    """It is a parameter, an option, a key of the valve file, kept, and in the reference."""
    pytest.importorskip("rclpy", reason="needs ROS")
    source = (PROJECT / "valve_friction_ros" / "settings.py").read_text(encoding="utf-8")
    assert source.count(BEFORE) == 1
    place = tmp_path / "settings.py"
    place.write_text(source.replace(BEFORE, ADDED + BEFORE), encoding="utf-8")
    paths = os.pathsep.join([str(PROJECT), str(PROJECT / "doc")])
    done = subprocess.run(
        [sys.executable, "-c", USE, place],
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("node", NODES)
def test_a_default_is_within_its_range(node):
    for one in NODES[node]:
        value = one.assumed if one.default is None else one.default
        if one.limits is not None and value is not None:
            assert one.limits[0] <= value <= one.limits[1], one.name
        if one.choices:
            assert value in one.choices
        assert len(one.meaning) > 10


def test_the_defaults_are_those_of_the_value_types():
    assert {one.name: one.assumed for one in VALVE} == vars(BENCH_VALVE)
    karnopp = {one.name: one.default for one in KARNOPP}
    assert karnopp == {name: getattr(LOW_FRICTION, name) for name in karnopp}
    given = {one.name: one.default for one in IDENTIFICATION if one.is_given(one.default)}
    assert settings.identification_from(given) == IdentificationSettings()


def test_the_settings_are_those_of_an_identification():
    known = {field.name for field in fields(IdentificationSettings)} - {"steps", "resolution"}
    known -= {"stated", "assumed"}  # what the file says, and does not say, by its own names
    assert {one.field.partition(".")[0] for one in IDENTIFICATION} - {"method"} == known


@pytest.mark.parametrize(
    ("name", "known"),
    [
        ("use_sim_time", True),
        ("qos_overrides./a.subscription.depth", True),
        ("columns.time_column", True),
        ("session_file", True),
        ("diaphragm_aera", False),
        ("fixed.mas", False),
    ],
)
def test_known(name, known):
    assert is_known(name) == known
