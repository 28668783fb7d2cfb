# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Without the libraries that bags need: all else works, and a bag is refused with the remedy."""

import os
import re

import numpy as np
import pytest
from live_nodes import PROJECT
from processes import ran

LIBRARIES = ("apsw", "backports", "lz4", "rosbags")
LINE = re.compile(
    r"bags need rosbags, lz4 and backports.zstd \(No module named '\w+'\): "
    r"run `pip install 'rosbags>=0.11.9,<0.12' lz4 backports.zstd`"
)


@pytest.fixture(autouse=True)
def without_libraries(monkeypatch, tmp_path):
    """Modules of these names that fail as those that are not there do."""
    folder = tmp_path / "missing"
    folder.mkdir()
    for name in LIBRARIES:
        text = f"raise ModuleNotFoundError(\"No module named '{name}'\", name='{name}')\n"
        (folder / f"{name}.py").write_text(text)
    path = [str(folder), str(PROJECT), os.environ.get("PYTHONPATH")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, path)))


@pytest.mark.parametrize("name", ["simulator", "pressure_source"])
def test_a_node_starts(live, name):
    process = live.start(name)
    live.client.wait_until(lambda: "ready" in process.errors, "the ready line")


def test_save_is_refused_and_the_identifier_goes_on(live):
    process = live.start_identifier()
    live.client.wait_until(lambda: "ready" in process.errors, "the ready line")
    for _ in range(2):
        response = live.client.refusal("save")
        assert LINE.fullmatch(response), response


def test_csv_is_identified_and_a_bag_is_refused(loose_record, bench_yaml, tmp_path):
    columns = np.c_[loose_record.time, loose_record.pressure, loose_record.position]
    file = tmp_path / "record.csv"
    np.savetxt(file, columns, "%.12g", ",", header="time_s,pressure_pa,position_m", comments="")
    options = ("--valve", bench_yaml, "--method", "published")
    code, _, error = ran("identify", file, *options, cwd=PROJECT)
    assert code == 0, error
    bag = tmp_path / "bag.mcap"
    bag.write_bytes(b"\x89MCAP0\r\n")
    code, _, error = ran("identify", bag, *options, cwd=PROJECT)
    assert code == 2
    assert LINE.fullmatch(error.strip().removeprefix("valve_friction identify: "))


def test_a_folder_tells_which_are_bags(bench_yaml, tmp_path):
    folder = tmp_path / "records"
    folder.mkdir()
    (folder / "bag.mcap").write_bytes(b"\x89MCAP0\r\n")
    output = tmp_path / "rows.csv"
    options = ("--valve", bench_yaml, "--output", output)
    code, _, error = ran("identify-folder", folder, *options, cwd=PROJECT)
    assert code == 2, error
    assert LINE.search(output.read_text())
