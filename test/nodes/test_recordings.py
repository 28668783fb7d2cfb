# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recorded topics and saved buffers: the command reads out of them what the node found."""

import contextlib
import io
import json
import math
import os
import re
import time
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

import bags
import numpy as np
import pytest
import yaml
from faulty_identifier import FINISH, FULL, SLOW, faulty
from live_nodes import NAMESPACE, NODE, PROJECT, SECOND, STREAM, SimulatedClock, stamp_of, stamps_of
from processes import ran
from rclpy.duration import Duration
from records import quick_record
from rosbags.rosbag2 import Reader
from sensor_msgs.msg import FluidPressure, JointState
from std_srvs.srv import Trigger

from valve_friction_ros.commands.main import run as command
from valve_friction_ros.identification import UNITS
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.streams import RecordBuffer

WINDOW = 4.0
DAY = 86_400 * SECOND


class Run(NamedTuple):
    """A node that has identified, the numbers that it gave, and a bag of what it heard."""

    client: object
    numbers: dict
    recorded: Path
    folder: Path


def identified(*arguments):
    """The one JSON object of the command."""
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        assert command(["identify", "--json", *map(str, arguments)]) == 0
    return json.loads(printed.getvalue())


def numbers_of(answer):
    """What the node publishes, comparable to the last bit, out of what the command prints."""
    parameters = answer["parameters"]
    figures = {name: answer["evidence"].get(name) for name in ("threshold", "sigma", "r_squared")}
    figures |= {name: answer[name] for name in ("fit", "rms")}
    published = {f"published {name}": parameters[name]["published"] for name in UNITS}
    values = {name: parameters[name]["value"] for name in UNITS}
    return as_told({**figures, **published, **values})


def as_told(numbers):
    return {
        name: repr(float("nan") if value is None else float(value))
        for name, value in numbers.items()
    }


def told_by(client):
    """What the node has published of its last result."""
    return as_told(
        {
            **client.friction(*UNITS, "threshold", "sigma", "r_squared", "fit", "rms"),
            **{f"published {name}": value for name, value in client.published(*UNITS).items()},
        }
    )


def held(record):
    """Count what the node's buffer holds of a record, some of it older than the window."""
    buffer = RecordBuffer(BENCH_VALVE, WINDOW)
    for stamp, pressure, position in zip(
        stamps_of(record).tolist(), record.pressure, record.position, strict=True
    ):
        buffer.add_pressure(stamp, pressure)
        buffer.add_position(stamp, position)
    return len(buffer)


@pytest.fixture(scope="module")
def run(shared, tmp_path_factory):
    """Record the live topics byte by byte while a node identifies its last four of five seconds."""
    folder = tmp_path_factory.mktemp("recorded")
    client, heard = shared.client, []
    for kind, name in ((FluidPressure, "actuator_pressure"), (JointState, "stem_state")):
        topic = f"{NAMESPACE}/{name}"
        full_name = f"sensor_msgs/msg/{kind.__name__}"

        def record(data, topic=topic, full_name=full_name):
            heard.append((topic, full_name, time.time_ns(), bytes(data)))

        client.node.create_subscription(kind, topic, record, STREAM, raw=True)
    parameters = {"window": WINDOW, "save_folder": str(folder / "saved"), "input_timeout": 600.0}
    shared.start("identifier", parameters, script=faulty("disk_trouble"))
    client.connect(readers=2)
    samples = quick_record()
    client.send_record(samples)
    client.identified_whole(held(samples))
    client.wait_until(lambda: len(heard) == 2 * len(samples), "the recorder's messages")
    numbers = told_by(client)
    recorded = bags.write_bag(folder / "heard", heard)
    (folder / "valve.yaml").write_text(yaml.safe_dump(asdict(BENCH_VALVE)))
    return Run(client, numbers, recorded, folder)


def test_a_recorded_run_gives_the_numbers_of_the_node(run):
    valve = run.folder / "valve.yaml"
    answer = identified(run.recorded, "--valve", valve, "--last", WINDOW)
    assert numbers_of(answer) == run.numbers
    whole = identified(run.recorded, "--valve", valve)
    assert numbers_of(whole) != run.numbers  # its first second changes the numbers


def last_stamp(client):
    return stamp_of(client.statuses[-1][0]) if client.statuses else 0


def test_a_played_bag_gives_the_numbers_of_the_live_run(run, live):
    """Its messages come on the topics, and a time of the day before on /clock."""
    live.start("identifier", {"window": WINDOW, "use_sim_time": True, "input_timeout": 600.0})
    client = live.client
    client.connect()
    clock = SimulatedClock(client)
    topics = {"actuator_pressure": client._pressure, "stem_state": client._stem}
    with Reader(run.recorded) as bag:
        messages = [*bag.messages()]
        begun = clock.now = messages[0][1] - DAY - 60 * SECOND
        # The node's time is that of /clock before the first sample comes.
        clock.run_until(lambda: begun <= last_stamp(client), "a status of that time")
        for count, (connection, received, data) in enumerate(messages):
            if count % 100 == 0:
                clock.show(received - DAY)
                for publisher in topics.values():
                    assert publisher.wait_for_all_acked(Duration(seconds=60.0))
            topics[connection.topic.rpartition("/")[2]].publish(bytes(data))
    client.node.create_timer(0.05, lambda: clock.show(clock.now + SECOND // 20))
    client.identified_whole(held(quick_record()))
    assert told_by(client) == run.numbers
    assert begun <= last_stamp(client) <= clock.now


def test_a_saved_buffer_gives_the_numbers_of_the_node(run):
    response = run.client.success("save")
    saved = Path(response)
    assert saved.parent == run.folder / "saved"
    assert re.fullmatch(r"fv_101_\d{8}T\d{6}Z", saved.name)
    with Reader(saved) as bag:
        assert set(bag.topics) == {f"{NAMESPACE}/actuator_pressure", f"{NAMESPACE}/stem_state"}
    for options in (("--valve", saved / "valve.yaml"), ()):  # its own is found
        assert numbers_of(identified(saved, *options)) == run.numbers


def test_a_saved_buffer_knows_the_settings_of_the_node(run):
    changes = {"method": "bench", "fixed.mass": 1.6, "derivative_window": 21}
    assert run.client.set_together(NODE, changes).successful
    assert run.client.trigger("identify").success
    numbers = told_by(run.client)
    assert "nan" not in (numbers["threshold"], numbers["published coulomb_friction"])
    saved = Path(run.client.trigger("save").message)
    before = {"method": "plant", "fixed.mass": math.nan, "derivative_window": 0}
    assert run.client.set_together(NODE, before).successful
    answer = identified(saved)
    assert answer["method"] == "bench"
    assert answer["parameters"]["mass"]["verdict"] == "fixed"
    assert numbers_of(answer) == numbers


def start_saving_into(live, folder, **parameters):
    """Start the node with the disk's troubles, and give it two samples."""
    parameters = {"save_folder": str(folder), "window": WINDOW, **parameters}
    live.start_identifier(parameters, script=faulty("disk_trouble"))
    live.client.send_record(quick_record())
    live.client.identified_whole(held(quick_record()))


def test_what_cannot_be_written_is_told_and_the_node_goes_on(live, tmp_path):
    (tmp_path / "file").write_text("")
    folders = {"save": (tmp_path / FULL, "a bag",
                        "File too large: raise the limit of the size of a file (ulimit -f)"),
               "report": (tmp_path / "file" / "pages", "a report",
                          "Not a directory: choose another folder")}  # fmt: skip
    start_saving_into(live, folders["save"][0], report_folder=folders["report"][0])
    for service, (folder, what, reason) in folders.items():
        assert live.client.refusal(service) == f"cannot write {what} into {folder}: {reason}"
    assert live.client.trigger("identify").success
    assert list((tmp_path / FULL).iterdir()) == []


def test_the_node_goes_on_while_it_saves_and_nobody_on_the_graph_fills_the_disk(live, tmp_path):
    folder = tmp_path / SLOW
    start_saving_into(live, folder, save_megabytes=0.1, report_folder=tmp_path / "pages")
    saving = live.client.request(Trigger, f"{NODE}/save", Trigger.Request())
    live.client.next_status()
    assert live.client.trigger("set_baseline").success
    assert not saving.done()
    (tmp_path / FINISH).touch()
    response = live.client.wait_until_answered(saving)
    assert response.success, response.message
    assert Path(response.message).parent == folder

    answers = [response, *(live.client.trigger("save") for _ in range(7))]
    assert [one.success for one in answers] == sorted(
        (one.success for one in answers), reverse=True
    )
    assert not answers[-1].success
    assert "MB in " in answers[-1].message
    assert "save_megabytes is 0.1: move files away" in answers[-1].message
    files = [one for one in folder.rglob("*") if one.is_file()]
    assert sum(one.stat().st_size for one in files) <= 100_000
    assert len(list(folder.iterdir())) == sum(one.success for one in answers)
    page = live.client.refusal("report")  # some 200 kB
    assert page.startswith("no space left: fv_101 uses ")
    assert list((tmp_path / "pages").iterdir()) == []


def test_an_empty_buffer_is_not_saved(run):
    assert run.client.trigger("clear").success
    assert run.client.refusal("save") == "the buffer is empty: there is nothing to save"


LIBRARIES = ("apsw", "backports", "lz4", "rosbags")
LINE = re.compile(
    r"bags need rosbags, lz4 and backports.zstd \(No module named '\w+'\): "
    r"run `pip install 'rosbags>=0.11.9,<0.12' lz4 backports.zstd`"
)


class TestWithoutBagLibraries:
    """All else works, and a bag is refused with the remedy."""

    @pytest.fixture(autouse=True)
    def without_libraries(self, monkeypatch, tmp_path):
        """Modules of these names that fail as those that are not there do."""
        folder = tmp_path / "missing"
        folder.mkdir()
        for name in LIBRARIES:
            text = f"raise ModuleNotFoundError(\"No module named '{name}'\", name='{name}')\n"
            (folder / f"{name}.py").write_text(text)
        path = [str(folder), str(PROJECT), os.environ.get("PYTHONPATH")]
        monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, path)))

    @pytest.mark.parametrize("name", ["simulator", "pressure_source"])
    def test_a_node_starts(self, live, name):
        process = live.start(name)
        live.client.wait_until(lambda: "ready" in process.errors, "the ready line")

    def test_save_is_refused_and_the_identifier_goes_on(self, live):
        process = live.start_identifier()
        live.client.wait_until(lambda: "ready" in process.errors, "the ready line")
        for _ in range(2):
            response = live.client.refusal("save")
            assert LINE.fullmatch(response), response

    def test_csv_is_identified_and_a_bag_is_refused(self, loose_record, bench_yaml, tmp_path):
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

    def test_a_folder_tells_which_are_bags(self, bench_yaml, tmp_path):
        folder = tmp_path / "records"
        folder.mkdir()
        (folder / "bag.mcap").write_bytes(b"\x89MCAP0\r\n")
        output = tmp_path / "rows.csv"
        options = ("--valve", bench_yaml, "--output", output)
        code, _, error = ran("identify-folder", folder, *options, cwd=PROJECT)
        assert code == 2, error
        assert LINE.search(output.read_text())
