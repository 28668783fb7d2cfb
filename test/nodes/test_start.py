"""What a node loads at its start: nothing that only a later request needs."""

import subprocess
import sys

import pytest

SLOW = {"scipy.stats", "scipy.signal", "matplotlib", "pandas", "jinja2", "rich"}


@pytest.mark.parametrize("node", ["identifier.node", "identifiers", "simulator"])
def test_a_node_starts_without_slow_modules(node):
    code = (
        f"import sys, valve_friction_ros.nodes.{node}; "
        "from valve_friction_ros.model import compile_kernels; compile_kernels(); "
        "print(*sys.modules, sep='\\n')"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    ).stdout.split()
    assert f"valve_friction_ros.nodes.{node}" in loaded
    assert SLOW.isdisjoint(loaded)
