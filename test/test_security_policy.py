# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The policy of SROS 2 against what the nodes offer: who may say, hear, call and answer what."""

import xml.etree.ElementTree as ET
from fnmatch import fnmatchcase
from pathlib import Path

import pytest
from extension.meanings import meanings

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
