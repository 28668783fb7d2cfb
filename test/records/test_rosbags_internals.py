# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is used of rosbags beyond its documented names is there, and nowhere else in the package."""

import inspect
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

import pytest
from bags import messages_of, storage_file, write_bag

from valve_friction_ros.model import Recording

PACKAGE = Path(__file__).parents[2] / "valve_friction_ros"
HOME = PACKAGE / "records" / "bags" / "rosbags_internals.py"


def moved(what):
    pytest.fail(f"rosbags {version('rosbags')} has no {what} any more: mend {HOME.name}")


@pytest.fixture(scope="module")
def reader():
    try:
        return import_module("rosbags.rosbag2.storage_mcap").McapReader
    except (ImportError, AttributeError):
        moved("rosbags.rosbag2.storage_mcap.McapReader")


@pytest.mark.parametrize("name", ["messages", "messages_scan"])
def test_messages_of_connections(reader, name):
    method = getattr(reader, name, None) or moved(f"McapReader.{name}")
    if [*inspect.signature(method).parameters][:2] != ["self", "connections"]:
        moved(f"McapReader.{name}(connections)")


def test_chunks_tell_of_an_index(reader, tmp_path):
    record = Recording(1e-3, [1e5, 1.1e5], [0.01, 0.02])
    opened = reader(storage_file(write_bag(tmp_path / "bag", messages_of(record))))
    opened.open()
    try:
        if not all(getattr(chunk, "channel_count", None) for chunk in opened.chunks or [None]):
            moved("McapReader.chunks with a channel_count each")
    finally:
        opened.close()


def test_decoders_return_where_they_stopped():
    typesys = import_module("rosbags.typesys")
    types, kind = typesys.get_typestore(typesys.Stores.ROS2_JAZZY), "std_msgs/msg/Float64"
    data = bytes(types.serialize_cdr(types.types[kind](data=2.5), kind))[4:]
    try:
        definition = types.get_msgdef(kind)
        message, end = definition.deserialize_cdr_le(data + b"more", 0, definition.cls, types)
        assert definition.deserialize_cdr_be
    except (AttributeError, TypeError):
        moved("Typestore.get_msgdef with deserialize_cdr_le, deserialize_cdr_be and cls")
    assert (message.data, end) == (2.5, 8)


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
