# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recognition of bags, and the topics of each valve."""

import contextlib
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple

PRESSURE_TYPE = "sensor_msgs/msg/FluidPressure"
STEM_TYPE = "sensor_msgs/msg/JointState"

_OWN_NAMES = {PRESSURE_TYPE: "actuator_pressure", STEM_TYPE: "stem_state"}
"""Names of the topics of this package."""

VALVE_FILE = "valve.yaml"
"""File name of a valve description in the folder of a bag."""

_MOST_LISTED = 12
"""Largest number of topics in a message."""


class Topic(NamedTuple):
    """A topic in a bag."""

    name: str
    type: str


@dataclass(frozen=True)
class TopicChoice:
    """Topics, joint and valve to read from an ambiguous bag."""

    pressure: str | None = None
    stem: str | None = None
    """Topics of pressure and stem; without a leading slash the name is relative to the namespace of
    each valve. None: found by type."""
    joint: str | None = None
    """Name of the joint of the stem; None: the only joint, or the joint called `stem`."""
    valve: str | None = None
    """Namespace of the single valve to read; None: all."""


class StreamNames(NamedTuple):
    """Topics of the samples of a valve, and the joint that is the stem; empty if unknown."""

    pressure: str = ""
    stem: str = ""
    joint: str = ""


class ValveTopics(NamedTuple):
    """A valve in a bag: its namespace and its topics, one of which may be missing."""

    name: str
    pressure: str | None
    stem: str | None

    @property
    def missing(self) -> str | None:
        """Message about a missing topic; None if both are present."""
        if self.pressure is None:
            return f"no {PRESSURE_TYPE} topic beside {self.stem}"
        if self.stem is None:
            return f"no {STEM_TYPE} topic beside {self.pressure}"
        return None


def _namespace(topic: str) -> str:
    return topic.rpartition("/")[0] or "/"


def _listed(topics: Iterable[Topic]) -> str:
    names = sorted(f"{topic.name} ({topic.type})" for topic in set(topics))
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return ", ".join(names[:_MOST_LISTED]) + more


def _candidates(topics: Collection[Topic], kind: str, asked: str | None) -> dict[str, list[str]]:
    """Return the topics of a type, or the requested topics, by namespace."""
    names = sorted({topic.name for topic in topics if topic.type == kind})
    if asked is None:
        found = [(_namespace(name), name) for name in names]
    elif asked.startswith("/"):
        found = [(_namespace(name), name) for name in names if name == asked]
    else:
        ending = f"/{asked}"
        found = [(name[: -len(ending)] or "/", name) for name in names if name.endswith(ending)]
    if not found:
        wanted = f"no {kind} topic" + ("" if asked is None else f" {asked}")
        raise ValueError(f"{wanted} in it; it holds {_listed(topics)}: record the valve's topics")
    by_namespace: dict[str, list[str]] = {}
    for namespace, name in found:
        by_namespace.setdefault(namespace, []).append(name)
    return by_namespace


def _one(names: list[str], kind: str, option: str) -> str | None:
    """Choose one of the topics of a type in a namespace."""
    own = [name for name in names if name.rpartition("/")[2] == _OWN_NAMES[kind]]
    if len(names) > 1 and len(own) != 1:
        raise ValueError(f"several {kind} topics ({', '.join(names)}): choose one with {option}")
    return next(iter(own or names), None)


def _common_namespace(*namespaces: str) -> str:
    levels = zip(*(namespace.split("/") for namespace in namespaces), strict=False)
    return "/".join(parts[0] for parts in takewhile(lambda one: len({*one}) == 1, levels)) or "/"


def _paired(pressures: dict[str, list[str]], stems: dict[str, list[str]]) -> list[ValveTopics]:
    """Pair the topics of each namespace; a single pressure and a single stem form a pair."""
    if len(pressures) == len(stems) == 1:
        namespace = _common_namespace(*pressures, *stems)
        pressures, stems = ({namespace: next(iter(each.values()))} for each in (pressures, stems))
    return [
        ValveTopics(
            namespace,
            _one(pressures.get(namespace, []), PRESSURE_TYPE, "--pressure-topic"),
            _one(stems.get(namespace, []), STEM_TYPE, "--stem-topic"),
        )
        for namespace in sorted(pressures.keys() | stems.keys())
    ]


def _is_a_valve(valve: ValveTopics) -> bool:
    """Return whether a pressure or a stem alone belongs to a valve.

    Other pressure sensors and other joints have the same types, so the name decides.
    """
    names = {topic.rpartition("/")[2] for topic in (valve.pressure, valve.stem) if topic}
    return valve.missing is None or bool(names & set(_OWN_NAMES.values()))


def valves_in(topics: Collection[Topic], choice: TopicChoice) -> list[ValveTopics]:
    """Find the valves of a bag by namespace; one of the topics of this package may be missing.

    A valve is a namespace with a topic of each type. If the whole bag has only one of each, or one
    of each is named, they form a valve in any namespace. Raises ValueError, with the content of the
    bag, if there is no valve or the topics are ambiguous.
    """
    pressures = _candidates(topics, PRESSURE_TYPE, choice.pressure)
    stems = _candidates(topics, STEM_TYPE, choice.stem)
    valves = _paired(pressures, stems)
    if any(name and name.startswith("/") for name in (choice.pressure, choice.stem)):
        valves = [valve for valve in valves if valve.missing is None]
    if all(valve.missing for valve in valves):
        streams = [topic for topic in topics if topic.type in (PRESSURE_TYPE, STEM_TYPE)]
        raise ValueError(
            f"no namespace holds both a pressure and a stem, of {_listed(streams)}: choose them "
            "with --pressure-topic and --stem-topic"
        )
    valves = [valve for valve in valves if _is_a_valve(valve)]
    if choice.valve is None:
        return valves
    wanted = f"/{choice.valve.strip('/')}"
    chosen = [valve for valve in valves if valve.name == wanted]
    if not chosen:
        names = ", ".join(valve.name for valve in valves)
        raise ValueError(f"no valve {wanted} in it; it holds {names}")
    return chosen


_LIBRARIES = ("rosbags", "lz4", "backports")
"""Top-level modules for bags; rosbags itself requires the others."""

_REMEDY = "run `pip install 'rosbags>=0.11.9,<0.12' lz4 backports.zstd`"


@contextlib.contextmanager
def bag_libraries() -> Iterator[None]:
    """Guard the import of modules of this folder that need rosbags, lz4 and backports.zstd.

    Raises ValueError, with what to install, if one of these is missing or has another version.
    """
    try:
        yield
    except ImportError as error:
        library = (error.name or "").partition(".")[0]
        if library not in _LIBRARIES:
            raise
        raise ValueError(
            f"bags need rosbags, lz4 and backports.zstd ({error}): {_REMEDY}"
        ) from None


MCAP = b"\x89MCAP0\r\n"
SQLITE = b"SQLite format 3\0"
ZSTD = b"\x28\xb5\x2f\xfd"
ROS_1 = b"#ROSBAG V"

_SUFFIXES = (".mcap", ".db3", ".zstd", ".bag")


def first_bytes(path: Path) -> bytes:
    """Return the first bytes of a file, which determine its format."""
    with path.open("rb") as stream:
        return stream.read(16)


def is_bag(path: Path) -> bool:
    """Return whether a file or folder is a bag, by its content or ending."""
    if path.is_dir() or path.suffix in _SUFFIXES:
        return True
    try:
        return first_bytes(path).startswith((MCAP, SQLITE, ZSTD, ROS_1))
    except OSError:
        return False


class DamagedFileError(Exception):
    """A damaged storage file, which is the first argument."""

    def __init__(self, path: Path, cause: str) -> None:
        super().__init__(path, cause)
        self.path = path
        self.cause = cause.rstrip(".")
