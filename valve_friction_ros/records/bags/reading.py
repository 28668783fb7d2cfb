# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recordings in rosbag2 bags, read without ROS, by the same buffer as in the node."""

import contextlib
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.records.bags.files import opened, storage_files
from valve_friction_ros.records.bags.rosbags_internals import UndecodableError, decode, stamp_of
from valve_friction_ros.records.bags.storage import DamagedFileError, Storage
from valve_friction_ros.records.bags.topics import (
    PRESSURE_TYPE,
    STEM_TYPE,
    Topic,
    TopicChoice,
    ValveTopics,
    valves_in,
)
from valve_friction_ros.records.recorded_valve import RecordedValve
from valve_friction_ros.records.stretch import Stretch
from valve_friction_ros.streams.record_buffer import RecordBuffer
from valve_friction_ros.streams.samples import joint_position, only_joint, uniform_recording

_ALL = 1e9
"""A window longer than any recording, s."""


class ValveFeed:
    """Fills a `RecordBuffer` from recorded messages of a valve whose topics are both there.

    Without a `joint`, the stem is the only joint, or the joint called `stem`.
    """

    def __init__(
        self, topics: ValveTopics, valve: Valve, joint: str | None, stretch: Stretch
    ) -> None:
        self._topics = topics
        self._joint = joint
        self._joints_seen: set[str] = set()
        self._stretch = stretch
        self._buffer = RecordBuffer(valve, min(stretch.last, _ALL))
        self._first_stamp: int | None = None
        self._undecodable: dict[str, int] = {}
        self._refusal: str | None = None

    @property
    def inputs(self) -> Mapping[Topic, Callable[[bytes], None]]:
        """What takes the messages of which topic."""
        return {
            Topic(name, kind): take
            for name, kind, take in (
                (self._topics.pressure, PRESSURE_TYPE, self._take_pressure),
                (self._topics.stem, STEM_TYPE, self._take_stem),
            )
            if name is not None
        }

    def _wants(self, stamp: int) -> bool:
        if self._first_stamp is None:
            self._first_stamp = stamp
        return self._stretch.contains(stamp - self._first_stamp)

    def _take_pressure(self, data: bytes) -> None:
        try:
            message = decode(data, PRESSURE_TYPE)
        except UndecodableError:
            self._count_undecodable(self._topics.pressure)
            return
        stamp = stamp_of(message)
        if self._wants(stamp):
            self._buffer.add_pressure(stamp, float(message.fluid_pressure))

    def _take_stem(self, data: bytes) -> None:
        try:
            message = decode(data, STEM_TYPE)
        except UndecodableError:
            self._count_undecodable(self._topics.stem)
            return
        stamp = stamp_of(message)
        if not self._wants(stamp):
            return
        self._joints_seen.update(message.name)
        if self._joint is None:
            try:
                self._joint = only_joint(message.name)
            except ValueError as error:
                self._refusal = self._refusal or f"{self._topics.stem}: {error}"
                return
        position = joint_position(message.name, message.position.tolist(), self._joint)
        self._buffer.add_position(stamp, position)

    def _count_undecodable(self, topic: str | None) -> None:
        self._undecodable[str(topic)] = self._undecodable.get(str(topic), 0) + 1

    def notes(self) -> list[str]:
        """Return which messages were left out, and why."""
        notes = [
            f"{count} messages of {topic} cannot be decoded as its type, and were left out"
            for topic, count in self._undecodable.items()
        ]
        cause = self._buffer.snapshot().cleared_because
        if cause is not None:
            notes.append(f"{cause}: what was recorded before that was left out")
        return notes

    def recording(self) -> Recording:
        """Bring both signals onto one grid, as the node does.

        Raises RefusalError if the samples make no record; the remedies are those for a file.
        """
        if self._refusal is not None:
            raise RefusalError(self._refusal)
        snapshot = self._buffer.snapshot()
        if self._joint and self._joints_seen and self._joint not in self._joints_seen:
            joints = ", ".join(sorted(self._joints_seen))
            raise RefusalError(f"{self._topics.stem}: no joint {self._joint!r} among {joints}")
        if snapshot.rejections:
            raise RefusalError(
                f"bad samples: {snapshot.causes()}: use a stretch of the record without them"
            )
        names = (str(self._topics.pressure), str(self._topics.stem))
        return uniform_recording(
            snapshot.pressure,
            snapshot.position,
            names,
            refusal_of=lambda gap: f"{gap.what}: use a stretch of the record without it",
        )


def _valves(
    path: Path, topics: Collection[Topic], choice: TopicChoice, damaged: Mapping[Path, str]
) -> list[ValveTopics]:
    if not topics:
        cause = "; ".join(f"{file.name}: {cause}" for file, cause in damaged.items())
        raise ValueError(
            f"{path}: nothing of it can be read ({cause}): copy or record it anew"
            if damaged
            else f"{path}: the bag is empty: its recorder heard no topic"
        )
    try:
        return valves_in(topics, choice)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _pass_on(storages: Sequence[Storage], feeds: Sequence[ValveFeed]) -> None:
    """Hand each message to its valve, in one pass."""
    takers = {topic: take for feed in feeds for topic, take in feed.inputs.items()}
    for storage in storages:
        for topic, data in storage.messages(takers.keys() & set(storage.topics)):
            takers[topic](data)


def _outcome(feed: ValveFeed, topics: ValveTopics) -> Recording | RefusalError:
    if topics.missing is not None:
        return RefusalError(topics.missing)
    try:
        return feed.recording()
    except RefusalError as refusal:
        return refusal


def _read(
    path: Path,
    files: Sequence[Path],
    damaged: Mapping[Path, str],
    valve: Valve,
    choice: TopicChoice,
    stretch: Stretch,
) -> list[tuple[ValveTopics, ValveFeed]]:
    """Read all valves from a bag; of damaged files, the part that can be salvaged."""
    with contextlib.ExitStack() as stack:
        storages = [stack.enter_context(opened(file, file in damaged)) for file in files]
        topics = {topic for storage in storages for topic in storage.topics}
        found = [
            (each, ValveFeed(each, valve, choice.joint, stretch))
            for each in _valves(path, topics, choice, damaged)
        ]
        _pass_on(storages, [feed for _, feed in found])
    return found


def read_bag(
    path: Path,
    valve: Valve,
    choice: TopicChoice | None = None,
    stretch: Stretch | None = None,
) -> tuple[RecordedValve, ...]:
    """Read the recordings of all valves in a bag, by namespace, in one pass through its messages.

    The messages go through the node's own buffer by their header stamps, in the order in which
    each topic was recorded, so that they give the numbers that the node gave.

    `path` is the folder of a bag, or one of its files: MCAP or SQLite3, compressed or not. Without
    its metadata or index, or cut off, it is read as far as it goes. Raises ValueError, one line
    with the remedy, if the file is no bag of ROS 2, or holds no valve.
    """
    choice, stretch = choice or TopicChoice(), stretch or Stretch()
    files, notes = storage_files(path)
    damaged: dict[Path, str] = {}
    while True:
        try:
            found = _read(path, files, damaged, valve, choice, stretch)
            break
        except DamagedFileError as damage:
            damaged[damage.path] = damage.cause
        except OSError as error:
            raise ValueError(f"{path}: cannot be read: {error.strerror or error}") from None
    notes += [
        f"{file.name} is cut off or damaged ({cause}): it was read as far as it goes"
        for file, cause in damaged.items()
    ]
    return tuple(
        RecordedValve(path, topics.name, _outcome(feed, topics), (*notes, *feed.notes()))
        for topics, feed in found
    )
