# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A further method is one function that returns a `Result`: everything else shows it unasked."""

import math
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

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
from valve_friction_ros.model import BENCH_VALVE, Recording
from valve_friction_ros.nodes.identifier.status import estimate_status
from valve_friction_ros.reports import IdentifiedRecord, identification_report, render

SECOND = 1_000_000_000


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
        warnings=("a width is no model",),
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
    for words in ("by stroke.", "strokes used", "a width is no model", "Published method"):
        assert words in text


def test_its_rows_and_diagnostics(recording, tmp_path):
    monitor = FrictionMonitor(MonitorSettings(BENCH_VALVE, method="width"))
    for time, pressure, position in zip(
        recording.time, recording.pressure, recording.position, strict=True
    ):
        monitor.buffer.add_pressure(round(time * SECOND), pressure)
        monitor.buffer.add_position(round(time * SECOND), position)
    snapshot, settings = monitor.input()
    result = methods.method_named(settings.method)(snapshot.recording(), settings.valve)
    monitor.accept(result, SECOND)
    friction = result.parameters["coulomb_friction"]

    cells = result_cells("fv_1", result, diagnose(result, BENCH_VALVE), ())
    assert (cells["method"], cells["coulomb_friction_n"]) == ("width", friction.value)

    history = HistoryFile(tmp_path / "history.sqlite")
    history.add(entry_of(monitor, KeptValve("/fv_1", "FV-1"), snapshot, settings, SECOND))
    (entry,) = history.entries()
    assert (entry.method, entry.friction) == ("width", friction)
    assert entry.to_dict()["parameters"] == result.to_dict()["parameters"]

    status = estimate_status(monitor, "fv_1", "FV-1", ())
    values = {each.key: each.value for each in status.values}
    assert values["method"] == "width"
    assert float(values["coulomb_friction [N]"]) == pytest.approx(friction.value, rel=1e-8)
    assert float(values["coulomb_friction published [N]"]) == pytest.approx(friction.published)
    assert values["estimate_valid"] == "true"
