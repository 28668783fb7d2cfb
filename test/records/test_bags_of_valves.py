# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Bags: which topics are a valve's, what is written, and what is used of rosbags for it."""

import os
import time
from pathlib import Path

import numpy as np
import pytest
from bags import stamps_of
from processes import ran
from rosbags.rosbag2 import Reader

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE, GRAPHITE_VALVE, Valve
from valve_friction_ros.records.bags.topics import (
    PRESSURE_TYPE,
    STEM_TYPE,
    VALVE_FILE,
    StreamNames,
    Topic,
    TopicChoice,
    valves_in,
)
from valve_friction_ros.records.bags.writing import write_bag
from valve_friction_ros.records.recordings import ReadingOptions, read_recordings
from valve_friction_ros.records.valve_file import read_valve_file
from valve_friction_ros.streams import RecordBuffer


def topics(pressures, stems):
    return [
        *(Topic(name, PRESSURE_TYPE) for name in pressures),
        *(Topic(name, STEM_TYPE) for name in stems),
        Topic("/rosout", "rcl_interfaces/msg/Log"),
    ]


def found(pressures, stems, **choice):
    return [tuple(valve) for valve in valves_in(topics(pressures, stems), TopicChoice(**choice))]


@pytest.mark.parametrize(
    ("pressure", "stem", "name"),
    [
        ("/fv/actuator_pressure", "/fv/stem_state", "/fv"),
        ("/p", "/x", "/"),
        ("/a/b/p", "/a/b/x", "/a/b"),
        ("/plant/pressures/fv", "/plant/stems/fv", "/plant"),
        ("/plant/fv/p", "/joint_states", "/"),
    ],
)
def test_one_of_each_is_a_valve_wherever_they_are(pressure, stem, name):
    assert found([pressure], [stem]) == [(name, pressure, stem)]


@pytest.mark.parametrize(
    ("pressures", "stems", "choice", "valves"),
    [
        ("/b/p /a/p", "/a/x /b/y", {}, ["/a /a/p /a/x", "/b /b/p /b/y"]),
        (
            "/a/supply /a/actuator_pressure /b/actuator_pressure",
            "/a/stem_state /a/arm /b/stem_state",
            {},
            ["/a /a/actuator_pressure /a/stem_state", "/b /b/actuator_pressure /b/stem_state"],
        ),
        (
            "/a/p /b/actuator_pressure /weather/air",
            "/a/x /arm/joint_states",
            {},
            ["/a /a/p /a/x", "/b /b/actuator_pressure None"],
        ),
        (
            "/a/io/p /a/p /b/io/p",
            "/a/x /b/x",
            {"pressure": "io/p"},
            ["/a /a/io/p /a/x", "/b /b/io/p /b/x"],
        ),
        ("/a/p /b/p", "/joint_states", {"pressure": "/b/p"}, ["/ /b/p /joint_states"]),
    ],
    ids=["one of each", "own names first", "half a valve by its name", "within each", "a choice"],
)
def test_the_valves_of_a_bag(pressures, stems, choice, valves):
    told = found(pressures.split(), stems.split(), **choice)
    assert [" ".join(map(str, valve)) for valve in told] == valves


@pytest.mark.parametrize(
    ("pressures", "stems", "option"),
    [
        (["/a/supply", "/a/chamber"], ["/a/x"], "--pressure-topic"),
        (["/a/p"], ["/a/x", "/a/y"], "--stem-topic"),
        (["/a/p", "/b/p"], ["/a/x", "/a/y", "/b/x"], "--stem-topic"),
    ],
)
def test_several_are_named_and_not_guessed_among(pressures, stems, option):
    with pytest.raises(ValueError, match=f": choose one with {option}$"):
        found(pressures, stems)


def test_no_pair_at_all():
    with pytest.raises(ValueError, match="no namespace holds both a pressure and a stem, of /a/p"):
        found(["/a/p", "/b/p"], ["/joint_states"])


def test_many_topics_are_not_all_listed():
    many = [Topic(f"/t{number:02}", "std_msgs/msg/Float64") for number in range(15)]
    with pytest.raises(ValueError, match=r"/t11 \(std_msgs/msg/Float64\) and 3 more: record"):
        valves_in(many, TopicChoice())


NAMES = StreamNames("/fv_101/actuator_pressure", "/plant/stems", "plug")


@pytest.fixture
def buffer(loose_record):
    buffer = RecordBuffer(BENCH_VALVE, 5.0)
    samples = zip(
        stamps_of(loose_record).tolist(), loose_record.pressure, loose_record.position, strict=True
    )
    for stamp, pressure, position in samples:
        buffer.add_pressure(stamp, pressure)
        buffer.add_position(stamp + 1_234_567, position)
    return buffer


def write(folder, buffer, name="fv_101", valve=BENCH_VALVE):
    return write_bag(folder, name, buffer.snapshot(), NAMES, valve, {"assumed_mass": 1.6})


def test_every_sample_to_the_last_bit(tmp_path, buffer):
    bag = write(tmp_path, buffer)
    assert bag == tmp_path / "fv_101"
    expected = buffer.snapshot()
    (valve,) = read_recordings(bag, BENCH_VALVE)
    found, wanted = valve.recording(), expected.recording()
    np.testing.assert_array_equal(found.pressure, wanted.pressure)
    np.testing.assert_array_equal(found.position, wanted.position)
    assert (found.sample_period, found.start_time) == (wanted.sample_period, wanted.start_time)
    assert valve.notes == ()


def test_topics_joint_and_stamps(tmp_path, buffer):
    bag = write(tmp_path, buffer)
    with Reader(bag) as reader:
        assert {c.topic: c.msgtype for c in reader.connections} == {
            NAMES.pressure: "sensor_msgs/msg/FluidPressure",
            NAMES.stem: "sensor_msgs/msg/JointState",
        }
        received = [stamp for _, stamp, _ in reader.messages()]
    snapshot = buffer.snapshot()
    assert received == sorted([*snapshot.pressure.stamps, *snapshot.position.stamps])
    options = ReadingOptions(topics=TopicChoice(joint="stem"))
    (valve,) = read_recordings(bag, BENCH_VALVE, options)
    with pytest.raises(RefusalError, match="no joint 'stem' among plug"):
        valve.recording()


@pytest.mark.parametrize("valve", [BENCH_VALVE, GRAPHITE_VALVE, Valve(0.5, -1e-6, float("inf"))])
def test_the_valve_is_described(tmp_path, buffer, valve):
    description = read_valve_file(write(tmp_path, buffer, valve=valve) / VALVE_FILE)
    assert description.valve == valve
    assert description.known == {"mass": 1.6}


def test_nothing_is_overwritten(tmp_path, buffer):
    (tmp_path / "fv_101_3").write_text("mine")
    bags = [write(tmp_path / "new" / "folder", buffer)]
    bags += [write(tmp_path, buffer) for _ in range(3)]
    assert [bag.name for bag in bags] == ["fv_101", "fv_101", "fv_101_2", "fv_101_4"]
    for bag in bags:
        (valve,) = read_recordings(bag, BENCH_VALVE)
        assert len(valve.recording()) == len(buffer.snapshot().recording())
    assert (tmp_path / "fv_101_3").read_text() == "mine"
    assert len([*tmp_path.iterdir()]) == 5  # nothing else is left


def test_rejected_samples_are_told(tmp_path, buffer):
    last = buffer.snapshot().position.stamps[-1]
    buffer.add_pressure(int(last), 1e9)
    assert len(buffer.snapshot().rejections) == 1
    metadata = (write(tmp_path, buffer) / "metadata.yaml").read_text()
    assert "outside the sensor's range 0 to 250000 Pa (1 samples)" in " ".join(metadata.split())


def test_an_empty_buffer(tmp_path):
    with pytest.raises(RefusalError, match="the buffer is empty: there is nothing to save"):
        write(tmp_path / "new", RecordBuffer(BENCH_VALVE, 5.0))
    assert not (tmp_path / "new").exists()


def test_stamps_that_no_header_holds(tmp_path):
    buffer = RecordBuffer(BENCH_VALVE, 5.0)
    buffer.add_pressure((2**31 - 1) * 1_000_000_000, 1e5)
    assert write(tmp_path, buffer).is_dir()
    buffer.add_pressure(2**31 * 1_000_000_000, 1e5)
    with pytest.raises(RefusalError, match="stamps after the year 2038"):
        write(tmp_path, buffer)


def test_a_folder_that_cannot_be(tmp_path, buffer):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="Not a directory"):
        write(tmp_path / "file" / "folder", buffer)


def test_a_leftover_of_a_killed_process_goes_after_a_day(tmp_path, buffer):
    """No other folder does, and none with a strange file in it."""
    names = (".saving_old", ".saving_new", ".saving_strange", "saving")
    for name in names:
        (tmp_path / name / "fv_101").mkdir(parents=True)
    (tmp_path / ".saving_strange" / "note.txt").touch()
    day_ago = time.time() - 86_500.0
    for name in names[::2] + names[3:]:
        os.utime(tmp_path / name, (day_ago, day_ago))
    bag = write(tmp_path, buffer)
    assert {one.name for one in tmp_path.iterdir()} == {bag.name, *names[1:]}


FULL_DISK = """
import resource, signal, sys
from pathlib import Path
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.streams import RecordBuffer
from valve_friction_ros.records.bags.topics import StreamNames
from valve_friction_ros.records.bags.writing import write_bag

buffer = RecordBuffer(BENCH_VALVE, 60.0)
for number in range(2000):
    buffer.add_pressure(number, 1e5)
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
try:
    names = StreamNames("/p", "/x", "")
    write_bag(Path(sys.argv[1]), "fv_101", buffer.snapshot(), names, BENCH_VALVE, {})
except OSError as error:
    print(error.strerror)
"""


def test_a_file_that_may_not_grow(tmp_path):
    """As on a full disk: the reason is told, and nothing is left behind."""
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).resolve().parents[2])}
    told = ran(tmp_path, program=["-c", FULL_DISK], env=environment)
    assert told == (0, "File too large\n", "")
    assert list(tmp_path.iterdir()) == []


PACKAGE = Path(__file__).parents[2] / "valve_friction_ros"
HOME = PACKAGE / "records" / "bags" / "rosbags_internals.py"


def test_the_version_it_was_checked_with_is_the_pinned_one():
    pinned = (PACKAGE.parent / "requirements" / "run.txt").read_text()
    checked = HOME.read_text().partition("Checked with rosbags ")[2].partition(";")[0]
    assert f"rosbags=={checked}\n" in pinned


def test_nothing_else_imports_undocumented_modules():
    documented = {"rosbags.rosbag2", "rosbags.serde", "rosbags.typesys"}
    for path in PACKAGE.rglob("*.py"):
        for line in path.read_text().splitlines():
            module = line.removeprefix("from ").partition(" import ")[0]
            if line.startswith("from rosbags") and path != HOME:
                assert module in documented, f"{path}: {line}"
