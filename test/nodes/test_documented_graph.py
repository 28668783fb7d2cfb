# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The page of the nodes holds the topics and services that they offer."""

from pathlib import Path

import pytest
from extension.node_graph import graph_as_markdown, graph_of

PAGE = Path(__file__).resolve().parents[2] / "doc" / "reference" / "nodes.md"


@pytest.mark.usefixtures("ros_environment")
@pytest.mark.parametrize(
    ("node", "some"),
    [
        ("identifier", {"stem_command", "~/friction/mass", "~/identify"}),
        ("simulator", {"actuator_pressure", "stem_state"}),
        ("pressure_source", {"actuator_pressure"}),
        ("stroke_player", {"stem_state", "pressure_set_point", "~/start", "~/stop"}),
        ("dashboard", {"/diagnostics"}),
    ],
)
def test_each_topic_and_service_has_a_meaning(node, some):
    found = graph_of(node)
    assert some <= {name for names in found.values() for name in names}
    page = PAGE.read_text(encoding="utf-8")
    for kind, names in found.items():
        if names:
            assert f"```{{node-graph}} {node} {kind}\n" in page
            text = graph_as_markdown(node, kind)
            assert all(name.rpartition("/")[2] in text for name in names)
