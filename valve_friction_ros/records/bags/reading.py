"""Recordings in rosbag2 bags, read without ROS."""

import contextlib
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.records.bags.files import opened, storage_files
from valve_friction_ros.records.bags.storage import DamagedFileError, Storage
from valve_friction_ros.records.bags.topics import Topic, TopicChoice, ValveTopics, valves_in
from valve_friction_ros.records.bags.valve_feed import ValveFeed
from valve_friction_ros.records.recorded_valve import RecordedValve
from valve_friction_ros.records.stretch import Stretch

__all__ = ["read_bag"]


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
