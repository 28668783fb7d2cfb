"""The messages of one valve in a bag, taken by the same buffer as in the node."""

from collections.abc import Callable, Mapping

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.records.bags.messages import UndecodableError, decode, stamp_of
from valve_friction_ros.records.bags.topics import PRESSURE_TYPE, STEM_TYPE, Topic, ValveTopics
from valve_friction_ros.records.stretch import Stretch
from valve_friction_ros.streams.joint_position import joint_position, only_joint
from valve_friction_ros.streams.record_buffer import RecordBuffer
from valve_friction_ros.streams.uniform_grid import uniform_recording

__all__ = ["ValveFeed"]

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
