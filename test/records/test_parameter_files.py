# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A file of parameters of nodes describes a valve, as the nodes would take it."""

from pathlib import Path

import pytest

from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.records.valve_file import read_valve_file

CONFIG = Path(__file__).resolve().parents[2] / "config"
PLANT = """/**:
  ros__parameters:
    diaphragm_area: 0.0445
    travel: 0.03
    window: 30.0
    use_sim_time: false
/fv_101/identifier:
  ros__parameters: {travel: 0.04, fixed.mass: 1.7}
/fv_102:
  identifier:
    ros__parameters:
      fixed: {mass: 1.8}
  simulator:
    ros__parameters: {diaphragm_area: 0.1}
"""


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "plant.yaml"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize("name", ["bench_low", "bench_high", "monitor"])
def test_the_files_of_the_package(name):
    found = read_valve_file(CONFIG / f"{name}.yaml")
    assert found.valve.diaphragm_area == BENCH_VALVE.diaphragm_area
    assert found.known["mass"] == 1.6
    assert found.settings.get("position_bias") == (None if name == "monitor" else 0.00113)


def test_what_all_share_and_what_is_ones_own(write):
    path = write(PLANT)
    first, second = (read_valve_file(path, name) for name in ("fv_101", "/fv_102"))
    assert (first.valve.travel, second.valve.travel) == (0.04, 0.03)
    assert (first.settings["fixed.mass"], second.settings["fixed.mass"]) == (1.7, 1.8)
    assert second.valve.diaphragm_area == 0.0445
    with pytest.raises(ValueError, match=r"fv_101, fv_102\): choose one by --valve-name"):
        read_valve_file(path)


def test_a_misspelled_key(write):
    path = write("/**:\n  ros__parameters: {diaphragm_area: 0.04, warn_ration: 1.2}\n")
    with pytest.raises(ValueError, match=r"unknown key 'warn_ration'; did you mean 'warn_ratio'\?"):
        read_valve_file(path)


def test_what_stands_for_nothing(write):
    path = write("diaphragm_area: 0.04\nderivative_window: 0\nfixed: {mass: .nan}\nwindow: 60.0\n")
    found = read_valve_file(path)
    assert dict(found.settings) == {}
    assert dict(found.known) == {}
