# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a node loads at its start: nothing that only a later request needs."""

import subprocess
import sys

import pytest

SLOW = {
    "scipy.stats",
    "scipy.signal",
    "matplotlib",
    "pandas",
    "jinja2",
    "rich",
    "sqlalchemy",  # until a history is opened
}


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
