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
