# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Files of `config/` against what the nodes offer: the policy of SROS 2, and other dashboards."""

import json
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from fnmatch import fnmatchcase
from pathlib import Path

import pytest
import yaml
from extension.meanings import meanings

from valve_friction_ros.identification import PARAMETER_UNITS

PROJECT = Path(__file__).resolve().parents[1]
IDENTIFIERS, DRIVER, OPERATOR, DASHBOARD, VIEWER = (
    f"/valves/{name}" for name in ("identifiers", "driver", "operator", "dashboard", "viewer")
)
IDENTIFIER = meanings()["graph"]["identifier"]
VALVES = ["/fv_101", "/area_1/fv_102"]


def policy():
    """Patterns of names by enclave and right, as (kind, right)."""
    root = ET.parse(PROJECT / "config" / "sros2_policy.xml").getroot()
    found = {}
    for enclave in root.iter("enclave"):
        rights = found.setdefault(enclave.get("path"), {})
        for group in enclave.iter():
            for right in ("publish", "subscribe", "request", "reply"):
                if value := group.get(right):
                    assert value == "ALLOW"
                    rights.setdefault(right, []).extend(name.text for name in group)
    return found


POLICY = policy()


def holders(right, name):
    """The enclaves that have a right on a name."""
    return {
        enclave
        for enclave, rights in POLICY.items()
        if any(fnmatchcase(name, pattern) for pattern in rights.get(right, []))
    }


def full(name, valve):
    """A name of the reference as it stands on the graph."""
    name = name.replace("<name>", "coulomb_friction")
    return name.replace("~", f"{valve}/identifier") if name[0] in "~/" else f"{valve}/{name}"


def test_there_are_these_enclaves():
    assert set(POLICY) == {IDENTIFIERS, DRIVER, OPERATOR, DASHBOARD, VIEWER}


@pytest.mark.parametrize("valve", VALVES)
def test_only_drivers_say_what_identifiers_hear(valve):
    for name in IDENTIFIER["subscribed"]:
        topic = full(name, valve)
        assert IDENTIFIERS in holders("subscribe", topic), topic
        assert holders("publish", topic) - {IDENTIFIERS} == {DRIVER}, topic


@pytest.mark.parametrize("valve", VALVES)
def test_only_identifiers_say_what_they_found_and_people_hear_it(valve):
    for name in IDENTIFIER["published"]:
        topic = full(name, valve)
        assert holders("publish", topic) == {IDENTIFIERS}, topic
        assert holders("subscribe", topic) >= {OPERATOR, DASHBOARD, VIEWER}, topic


@pytest.mark.parametrize("valve", VALVES)
def test_only_operators_call_services_and_the_dashboard_those_of_its_buttons(valve):
    pytest.importorskip("nicegui", reason="run `make venv-dashboard`")
    from valve_friction_ros.dashboard.pages.valve_page import _ACTIONS

    assert _ACTIONS.keys() <= {name.removeprefix("~/") for name in IDENTIFIER["services"]}
    for name in [*IDENTIFIER["services"], "~/set_parameters", "~/set_parameters_atomically"]:
        service = full(name, valve)
        callers = {OPERATOR}
        if name.removeprefix("~/") in _ACTIONS:
            callers |= {DASHBOARD}
        assert holders("request", service) == callers, service
        assert holders("reply", service) == {IDENTIFIERS}, service


CONFIG = PROJECT / "config"
SOURCES = PROJECT / "valve_friction_ros" / "nodes" / "identifier"
WRITTEN = ("foxglove_plant.json", "foxglove_valve.json", "plotjuggler_valve.xml")
STATUS = "/fv_101/identifier: friction"


def write(folder, *words):
    pytest.importorskip("foxglove.layouts", reason="run `make venv-test`")
    command = [sys.executable, CONFIG / "write_dashboards.py", *words, "--output", folder]
    subprocess.run(command, check=True, timeout=300)


def test_the_files_are_what_the_script_writes(tmp_path):
    write(tmp_path)
    for name in WRITTEN:
        assert (tmp_path / name).read_text() == (CONFIG / name).read_text()


def test_another_valve(tmp_path):
    write(tmp_path, "/area_1/fv_102")
    for name in WRITTEN[1:]:
        text = (tmp_path / name).read_text()
        assert "/area_1/fv_102/" in text
        assert "101" not in text
    assert "/diagnostics/FV-102//area_1/fv_102/identifier: friction/" in text


def panels(content):
    """All panels of a layout of Foxglove."""
    if content["type"] == "panel":
        yield content
    for item in content.get("items", ()):
        yield from panels(item["content"])


def keys():
    """Keys of `~/estimate` and `/diagnostics` that dashboards draw."""
    return {f"{name} [{unit}]" for name, unit in PARAMETER_UNITS.items()} | {"friction_ratio"}


def sources():
    return "".join(path.read_text() for path in sorted(SOURCES.glob("*.py")))


def test_foxglove_names_what_there_is():
    plant, valve = (json.loads((CONFIG / name).read_text()) for name in WRITTEN[:2])
    kinds = [panel["panelType"] for panel in panels(plant["content"])]
    assert kinds == ["DiagnosticsSummary", "DiagnosticsDetail", "Log"]
    drawn = set()
    for panel in panels(valve["content"]):
        config = panel["config"]
        if panel["panelType"] == "Plot":
            drawn |= {series["value"] for series in config["paths"]}
        elif panel["panelType"] == "ServiceCall":
            node, _, service = config["serviceName"].rpartition("/")
            assert node == "/fv_101/identifier"
            assert re.search(rf'\("{service}", (self\._|partial\()', sources())
        else:
            assert panel["panelType"] == "DiagnosticsDetail"
            assert config["selectedName"] == STATUS
    signals = {"/fv_101/actuator_pressure.fluid_pressure", "/fv_101/stem_state.position[0]"}
    assert signals < drawn
    found = [re.fullmatch(r'/fv_101/identifier/estimate\.values\[:\]\{key=="(.+)"\}\.value', path)
             for path in drawn - signals]  # fmt: skip
    assert {match[1] for match in found} <= keys()
    assert len(found) == 2


def test_plotjuggler_names_what_its_parser_makes():
    """Its series: /TOPIC/HARDWARE_ID/STATUS/KEY of diagnostics, /TOPIC/JOINT/position of joints."""
    root = ET.parse(CONFIG / "plotjuggler_valve.xml").getroot()
    for splitter in root.iter("DockSplitter"):
        assert len(splitter) == int(splitter.get("count")) == len(splitter.get("sizes").split(";"))
    curves = {curve.get("name") for curve in root.iter("curve")}
    prefix = f"/diagnostics/FV-101/{STATUS}/"
    drawn = {name.removeprefix(prefix) for name in curves if name.startswith(prefix)}
    assert drawn <= keys() | {"level"}
    assert curves - {prefix + key for key in drawn} == {
        "/fv_101/actuator_pressure/fluid_pressure",
        "/fv_101/stem_state/stem/position",
    }


def test_a_plant_has_one_fault_for_each_valve_in_ros2_medkit():
    """Its bridge makes a code of a name: capitals and digits, one _ for all between them."""
    names = [f"/area_{k // 40}/fv_{100 + k}/identifier: friction" for k in range(500)]
    codes = {re.sub("[^A-Z0-9]+", "_", one.upper()).strip("_") for one in names}
    assert len(codes) == len(names)
    assert re.sub("[^A-Z0-9]+", "_", STATUS.upper()).strip("_") in (
        CONFIG.parent / "doc/how_to/dashboards.md"
    ).read_text(encoding="utf-8")


def test_the_analyzers_take_every_valve():
    """The keys are those that aggregator.cpp and generic_analyzer.cpp of ros2-jazzy read."""
    (node, section), *more = yaml.safe_load(
        (CONFIG / "diagnostic_aggregator.yaml").read_text()
    ).items()
    assert (node, more) == ("analyzers", [])
    root = section["ros__parameters"]
    valves = root.pop("valves")
    assert set(root) <= {"path", "pub_rate", "other_as_errors", "history_depth", "critical"}
    assert isinstance(root["pub_rate"], float)
    assert isinstance(valves["timeout"], float)
    assert set(valves) <= {"type", "path", "contains", "startswith", "regex", "expected",
                           "remove_prefix", "timeout", "num_items", "discard_stale"}  # fmt: skip
    assert valves["type"] == "diagnostic_aggregator/GenericAnalyzer"
    assert any(part in STATUS for part in valves["contains"])
    assert ': friction"' in sources()
