# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Bags for tests, written by rosbags."""

import numpy as np
import pytest

pytest.importorskip("rosbags")  # not there where only rosdep installed

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

TYPES = get_typestore(Stores.ROS2_JAZZY)
PRESSURE = "sensor_msgs/msg/FluidPressure"
STEM = "sensor_msgs/msg/JointState"
START = 1_700_000_000_123_456_789
"""Stamp of the first sample, ns: not a whole number of anything."""


def _header(stamp):
    time = TYPES.types["builtin_interfaces/msg/Time"](*divmod(int(stamp), 1_000_000_000))
    return TYPES.types["std_msgs/msg/Header"](time, "valve")


def pressure_message(stamp, pressure):
    message = TYPES.types[PRESSURE](_header(stamp), float(pressure), 0.0)
    return bytes(TYPES.serialize_cdr(message, PRESSURE))


def stem_message(stamp, *positions, names=("stem",), little_endian=True):
    none = np.zeros(0)
    message = TYPES.types[STEM](_header(stamp), list(names), np.array(positions), none, none)
    return bytes(TYPES.serialize_cdr(message, STEM, little_endian=little_endian))


def number_message(value):
    kind = "std_msgs/msg/Float64"
    return bytes(TYPES.serialize_cdr(TYPES.types[kind](float(value)), kind))


def stamps_of(record):
    return START + round(record.sample_period * 1e9) * np.arange(len(record))


def messages_of(record, namespace="/fv_101", pressure="actuator_pressure", stem="stem_state"):
    """Both streams of a recording as (topic, type, stamp, bytes) in the order of time."""
    for stamp, p, x in zip(stamps_of(record), record.pressure, record.position, strict=True):
        yield f"{namespace}/{pressure}", PRESSURE, stamp, pressure_message(stamp, p)
        yield f"{namespace}/{stem}", STEM, stamp, stem_message(stamp, x)


def write_bag(path, messages, storage="mcap", compression="none"):
    """Write (topic, type, stamp, bytes) as a bag; received a millisecond after their stamps."""
    writer = Writer(path, version=9, storage_plugin=StoragePlugin[storage.upper()])
    writer.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
    connections = {}
    with writer:
        for topic, kind, stamp, data in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=TYPES)
            writer.write(connections[topic], int(stamp) + 1_000_000, data)
    return path


def storage_file(bag):
    """The one storage file of a bag."""
    (file,) = (path for path in bag.iterdir() if path.name != "metadata.yaml")
    return file
