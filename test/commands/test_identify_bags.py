# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The command on bags: one valve, several, and none; and on CSV as other programs write it."""

import json
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from bags import PRESSURE, messages_of, storage_file, write_bag
from pages import PageReader

from valve_friction_ros.model import Recording


@pytest.fixture
def call(command, bench_yaml):
    """Function of arguments: exit code, stdout and stderr of `identify`."""
    return partial(command, "identify", "--valve", bench_yaml)


@pytest.fixture
def answer(call):
    """Function of arguments: the one JSON object of a success."""

    def answer(*arguments):
        code, out, err = call(*arguments, "--json")
        assert (code, err) == (0, "")
        return json.loads(out)

    return answer


@pytest.fixture
def bag(tmp_path, quick_record):
    return write_bag(tmp_path / "bag", messages_of(quick_record))


@pytest.fixture
def csv_answer(answer, write_csv, columns_of, quick_record):
    return answer(write_csv(columns_of(quick_record)))


@pytest.fixture
def fleet(tmp_path, quick_record):
    """A good valve, one whose stem is stuck, and one without a stem."""
    stuck = Recording(0.01, quick_record.pressure, np.full(len(quick_record), 0.01))
    streams = [
        *messages_of(quick_record),
        *messages_of(stuck, "/fv_102"),
        *(m for m in messages_of(quick_record, "/fv_103") if m[1] == PRESSURE),
    ]
    return write_bag(tmp_path / "fleet", sorted(streams, key=lambda message: message[2]))


class TestOneValve:
    @pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
    def test_the_numbers_of_the_csv_file(self, answer, csv_answer, tmp_path, quick_record, storage):
        bag = write_bag(tmp_path / storage, messages_of(quick_record), storage)
        assert answer(bag) == csv_answer
        assert answer(storage_file(bag)) == csv_answer

    def test_a_cut_bag_is_identified_with_a_note(self, answer, call, bag):
        file = storage_file(bag)
        file.write_bytes(file.read_bytes()[:-3000])
        found = answer(bag)
        assert found["parameters"]["coulomb_friction"]["value"] == pytest.approx(152.7, rel=0.01)
        assert found["warnings"][0] == (
            "bag.mcap is cut off or damaged (File end magic is invalid): it was read as far as it "
            "goes"
        )
        _, out, _ = call(bag)
        assert "note: bag.mcap is cut off or damaged" in out

    def test_a_refusal_tells_of_the_damage(self, call, tmp_path, quick_record):
        bag = write_bag(tmp_path / "bag", messages_of(quick_record), "sqlite3")
        file = storage_file(bag)
        file.write_bytes(file.read_bytes()[:40_000])
        code, out, err = call(bag)
        assert (code, out) == (2, "")
        assert err.startswith(f"valve_friction identify: {bag}, /fv_101: the ")
        assert "; bag.db3 is cut off or damaged (" in err
        assert err.count("\n") == 1

    def test_without_ros(self, bag, bench_yaml):
        """As a process of its own, where no package of ROS can be imported."""
        blocked = "rclpy", "sensor_msgs", "std_msgs", "builtin_interfaces", "rosbag2_py"
        code = (
            f"import sys; sys.modules.update(dict.fromkeys({blocked})); "
            "from valve_friction_ros.commands.main import main; sys.exit(main())"
        )
        done = subprocess.run(
            [sys.executable, "-c", code, "identify", str(bag), "--valve", str(bench_yaml)],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert (done.returncode, done.stderr) == (0, "")
        assert "coulomb_friction" in done.stdout


class TestSeveralValves:
    def test_json(self, call, fleet, csv_answer):
        code, out, err = call(fleet, "--json")
        assert code == 1
        valves = json.loads(out)["valves"]
        assert list(valves) == ["/fv_101", "/fv_102", "/fv_103"]
        assert valves["/fv_101"] == csv_answer
        assert list(valves["/fv_102"]) == list(valves["/fv_103"]) == ["error"]
        assert err.splitlines() == [
            f"valve_friction identify: {valves[name]['error']}" for name in ("/fv_102", "/fv_103")
        ]
        assert valves["/fv_102"]["error"].startswith(
            f"{fleet}, /fv_102: the stem did not move: its position spans 0 µm"
        )

    def test_table(self, call, fleet):
        code, out, err = call(fleet)
        assert code == 1
        assert out.startswith("/fv_101\n")
        assert out.count("published: threshold") == 1
        assert err.count("\n") == 2

    def test_one_of_them(self, answer, call, fleet, csv_answer):
        assert answer(fleet, "--valve-name", "fv_101") == csv_answer
        code, out, err = call(fleet, "--valve-name", "fv_103", "--json")
        assert (code, out) == (2, "")
        assert err == (
            f"valve_friction identify: {fleet}, /fv_103: no sensor_msgs/msg/JointState topic "
            "beside /fv_103/actuator_pressure\n"
        )

    def test_a_picture_is_of_one(self, call, fleet, tmp_path):
        code, out, err = call(fleet, "--plot", tmp_path / "fleet.png")
        assert (code, out) == (2, "")
        assert err == (
            "valve_friction identify: --plot draws one valve: choose one of /fv_101, /fv_102, "
            "/fv_103 by --valve-name\n"
        )
        picture = tmp_path / "one.png"
        assert call(fleet, "--valve-name", "fv_101", "--plot", picture)[0] == 0
        assert picture.read_bytes().startswith(b"\x89PNG")

    def test_a_report_is_of_one(self, call, fleet, tmp_path):
        report = tmp_path / "one.html"
        which = "one valve: choose one of /fv_101, /fv_102, /fv_103 by --valve-name\n"
        for options, purpose in (
            (["--report", report], "--report is of"),
            (["--baseline-coulomb-friction", "150"], "--baseline-coulomb-friction is of"),
        ):
            assert call(fleet, *options) == (2, "", f"valve_friction identify: {purpose} {which}")
        assert not report.exists()
        assert call(fleet, "--valve-name", "fv_101", "--report", report)[0] == 0
        page = PageReader(report.read_text(encoding="utf-8"))
        assert page.said("h1") == ["Friction of fv_101"]
        assert page.table("record")["source"] == (f"{fleet}, /fv_101",)


class TestNoRecording:
    """Whatever is wrong, exit code 2 and one line on stderr."""

    def test_refused(self, call, bag):
        file = storage_file(bag)
        file.write_bytes(file.read_bytes()[:70])
        code, out, err = call(bag)
        assert (code, out) == (2, "")
        assert err.startswith(f"valve_friction identify: {bag}")
        assert "nothing of it can be read (bag.mcap: " in err
        assert err.count("\n") == 1

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (["--joint", "plug"], "no joint 'plug' among stem"),
            (["--pressure-topic", "/p"], "no sensor_msgs/msg/FluidPressure topic /p in it; it "),
            (["--stem-topic", "stem"], "no sensor_msgs/msg/JointState topic stem in it; it holds"),
            (["--valve-name", "fv_1"], "no valve /fv_1 in it; it holds /fv_101"),
            (["--begin", "3", "--end", "2"], "a stretch cannot begin at 3 s and end at 2"),
        ],
    )
    def test_options(self, call, bag, options, words):
        code, out, err = call(bag, *options)
        assert (code, out) == (2, "")
        assert words in err
        assert err.count("\n") == 1
