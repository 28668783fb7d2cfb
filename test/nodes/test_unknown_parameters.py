# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Parameters that nobody reads, and geometry that nobody builds: an error at the start."""

import pytest
from live_nodes import Domain, NodeProcess

SHARED = """/**:
  ros__parameters:
    use_sim_time: false
    robot_description: of a node of another package
    mass: 1.6
    columns: {time_column: Zeit, inverted_position: false, opposing_pressure_column: ""}
    qos_overrides./actuator_pressure.subscription.depth: 10
/fv_101/identifier:
  ros__parameters:
    fixed.mass: 1.7
    fixed: {spring_constant: 0.0}
"""


@pytest.fixture
def refused(tmp_path):
    domain = Domain()

    def refused(name, *arguments):
        process = NodeProcess(name, domain, tmp_path, arguments=arguments)
        try:
            assert process.exit_code() == 2
            (line,) = process.errors.splitlines()
            return line
        finally:
            process.kill()

    yield refused
    domain.release()


@pytest.mark.parametrize(
    ("node", "parameter", "cause"),
    [
        ("identifier", "diaphragm_aera:=0.1", "did you mean 'diaphragm_area'?"),
        ("simulator", "travell:=0.1", "did you mean 'travel'?"),
        ("pressure_source", "sample_rat:=100.0", "did you mean 'sample_rate'?"),
        ("identifier", "gain:=1.0", "known are "),
    ],
)
def test_misspelled(refused, node, parameter, cause):
    name = parameter.partition(":")[0]
    line = refused(node, "-p", parameter)
    assert line.startswith(f"cannot start: {node} has no parameter {name!r}: {cause}")


def test_misspelled_in_a_file(refused, tmp_path):
    path = tmp_path / "valve.yaml"
    path.write_text("/**:\n  ros__parameters:\n    pressure_referense: 0.0\n")
    line = refused("identifier", "--params-file", str(path))
    assert line.endswith(
        "identifier has no parameter 'pressure_referense': did you mean 'pressure_reference'?"
    )


@pytest.mark.parametrize(
    ("parameter", "question"),
    [
        ("diaphragm_area:=445.0", "cm² or in² read as m²?"),
        ("travel:=28.6", "mm read as m?"),
        ("pressure_reference:=1.01325", "bar read as Pa?"),
    ],
)
def test_implausible(refused, parameter, question):
    assert refused("identifier", "-p", parameter).endswith(question)


def test_columns_are_not_applied_to_topics(live, tmp_path):
    path = tmp_path / "valve.yaml"
    section = "columns: {inverted_position: true, opposing_pressure_column: p2}"
    path.write_text(f"/**:\n  ros__parameters:\n    {section}\n")
    process = live.start("identifier", arguments=["--params-file", str(path)])
    live.client.parameters("/fv_101/identifier", "travel")
    (line,) = [line for line in process.errors.splitlines() if "WARN" in line]
    assert "columns.inverted_position and columns.opposing_pressure_column: " in line
    assert "is not applied to topics" in line


def test_a_file_that_nodes_of_several_packages_share(live, tmp_path):
    path = tmp_path / "shared.yaml"
    path.write_text(SHARED)
    process = live.start("identifier", arguments=["--params-file", str(path)])
    names = ("fixed.mass", "fixed.spring_constant", "use_sim_time")
    assert live.client.parameters("/fv_101/identifier", *names) == [1.7, 0.0, False]
    (line,) = [line for line in process.errors.splitlines() if "WARN" in line]
    assert line.endswith(
        "no node of this package has the parameter 'robot_description': it is ignored"
    )
