# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A setting is one line and a method one function: all that a user meets is made from that."""

import math
import os
from dataclasses import fields, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from processes import printed

from valve_friction_ros import settings
from valve_friction_ros.figures import save_picture
from valve_friction_ros.fleet.rows import result_cells
from valve_friction_ros.health import Baseline, FrictionMonitor, MonitorSettings, diagnose
from valve_friction_ros.history import HistoryFile, KeptValve, entry_of
from valve_friction_ros.identification import (
    UNITS,
    Curve,
    Drawing,
    IdentificationSettings,
    Panel,
    Result,
    identify,
    methods,
)
from valve_friction_ros.identification.trust.verdict import not_identifiable, with_verdict
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, Recording
from valve_friction_ros.nodes.identifier.status import estimate_status
from valve_friction_ros.reports import IdentifiedRecord, identification_report, render
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
    add_post_set_parameters_callback=id,
    declare_parameters=lambda _, rows: declared.update({name: rest for name, *rest in rows}),
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
    printed("-c", USE, place, env=os.environ | {"PYTHONPATH": paths})


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


NANOSECONDS = 1_000_000_000


class Width:
    """The exhibit of the method: half the width of the loop, by stroke."""

    def __init__(self, force):
        self.force = force

    def drawing(self, parameters, valve):
        strokes = np.arange(3)
        width = Panel(
            "width",
            "stroke [1]",
            "half width [N]",
            (Curve(strokes, np.full(3, self.force)),),
            level=parameters["coulomb_friction"],
        )
        return Drawing(
            (width,),
            "Half width of the loop",
            "Half the width of the loop, by stroke.",
            "A line over three strokes.",
            loop=(Curve([valve.pressure_reference], [0.0], "o", "balance"),),
            settings={"strokes used": "3"},
        )


def identify_width(recording, valve, settings=None):
    """Take half the width of the loop as friction, and know nothing else."""
    force = valve.actuator_force(recording.drive)
    friction = 0.5 * float(np.ptp(force))
    parameters = {name: not_identifiable(name, "the width does not tell") for name in UNITS}
    found = with_verdict("coulomb_friction", friction, 1.0, 2.0)
    return Result(
        method="width",
        recording=recording,
        valve=valve,
        settings=settings or IdentificationSettings(),
        parameters={**parameters, "coulomb_friction": replace(found, published=friction + 1)},
        fit=0.9,
        rms=math.nan,
        misfit=None,
        derivative_window=0,
        warnings=("a width is not a model",),
        evidence={"strokes": 3},
        findings=("the loop is wide",),
        exhibit=Width(friction),
    )


@pytest.fixture(autouse=True)
def registered(monkeypatch):
    known = MappingProxyType({**methods.METHODS, "width": identify_width})
    monkeypatch.setattr(methods, "METHODS", known)


@pytest.fixture
def recording():
    """A loop of 2 kPa, on a diaphragm of 0.0445 m²: half of it is 44.5 N."""
    phase = np.linspace(0, 4 * np.pi, 400)
    return Recording(0.01, 1e5 + 1e3 * np.sin(phase), 0.01 + 1e-3 * np.sin(phase - 0.5))


@pytest.fixture
def result(recording):
    return identify(recording, BENCH_VALVE, method="width")


def test_it_renders(result):
    shown = result.to_dict()
    friction = shown["parameters"]["coulomb_friction"]
    assert friction["value"] == pytest.approx(44.5, rel=1e-4)
    assert (shown["method"], shown["evidence"]) == ("width", {"strokes": 3})
    assert "the loop is wide" in result.summary()
    assert "method width" in str(result)
    assert "method width" in result._repr_html_()
    frame = pytest.importorskip("pandas") and result.to_frame()
    assert frame.loc["coulomb_friction", "value"] == friction["value"]


def test_it_is_drawn(result, tmp_path):
    figure = result.plot()
    panels = {axes.get_label(): axes for axes in figure.axes}
    assert set(panels) == {"pressure", "stem", "signature", "width"}
    assert panels["width"].get_ylabel() == "half width [N]"
    assert [text.get_text() for text in panels["signature"].get_legend().get_texts()] == ["balance"]
    (note,) = panels["width"].texts
    assert note.get_text() == "$F_c$ = 44.5 ± 2.0 N: identified"
    save_picture(figure, tmp_path / "width.png")


def test_its_report(result):
    page = identification_report(IdentifiedRecord("FV-1", "made up", result, Baseline(40.0)))
    assert "Half width of the loop" in [section.title for section in page.sections]
    text = render(page)
    for words in ("by stroke.", "strokes used", "a width is not a model", "Published method"):
        assert words in text


def test_its_rows_and_diagnostics(recording, tmp_path):
    monitor = FrictionMonitor(MonitorSettings(BENCH_VALVE, method="width"))
    for time, pressure, position in zip(
        recording.time, recording.pressure, recording.position, strict=True
    ):
        monitor.buffer.add_pressure(round(time * NANOSECONDS), pressure)
        monitor.buffer.add_position(round(time * NANOSECONDS), position)
    snapshot, settings = monitor.input()
    result = methods.method_named(settings.method)(snapshot.recording(), settings.valve)
    monitor.accept(result, NANOSECONDS)
    friction = result.parameters["coulomb_friction"]

    cells = result_cells("fv_1", result, diagnose(result, BENCH_VALVE), ())
    assert (cells["method"], cells["coulomb_friction_n"]) == ("width", friction.value)

    history = HistoryFile(tmp_path / "history.sqlite")
    history.add(entry_of(monitor, KeptValve("/fv_1", "FV-1"), snapshot, settings, NANOSECONDS))
    (entry,) = history.entries()
    assert (entry.method, entry.friction) == ("width", friction)
    assert entry.to_dict()["parameters"] == result.to_dict()["parameters"]

    status = estimate_status(monitor, "fv_1", "FV-1", (), None, {})
    values = {each.key: each.value for each in status.values}
    assert values["method"] == "width"
    assert float(values["coulomb_friction [N]"]) == pytest.approx(friction.value, rel=1e-8)
    assert float(values["coulomb_friction published [N]"]) == pytest.approx(friction.published)
    assert values["estimate_valid"] == "true"
