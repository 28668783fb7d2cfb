# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Bags and report pages: ``~/save`` and ``~/report``, and the recording of an alarm."""

import contextlib
import re
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rclpy.node import Node

from valve_friction_ros import history as database
from valve_friction_ros.health.friction_monitor import FrictionMonitor
from valve_friction_ros.health.levels import Level
from valve_friction_ros.history import AlarmRecording, HistoryError
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import STATED
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.nodes.identifier.history_writer import HistoryWriter
from valve_friction_ros.nodes.identifier.response_watch import ResponseWatch
from valve_friction_ros.nodes.identifier.usage_watch import UsageWatch
from valve_friction_ros.nodes.plumbing.output_folder import OutputFolder, free_path, valve_name
from valve_friction_ros.nodes.plumbing.processes import give_back_memory, imported
from valve_friction_ros.nodes.plumbing.worker import InternalError, Worker, bugs_reported
from valve_friction_ros.records.bags.topics import StreamNames, bag_libraries
from valve_friction_ros.records.files import disk_trouble
from valve_friction_ros.settings import IDENTIFICATION
from valve_friction_ros.streams import Samples, Snapshot, nanoseconds, utc, utc_second


def bag_writer(
    node: Node, valve: Valve, names: StreamNames
) -> Callable[[Path, str, Snapshot, Path | None], Path]:
    """Return a function that writes a snapshot as a named bag into a folder, in any thread.

    Its last argument is the bag to replace, if any. It returns the path of the bag. It raises
    RefusalError if the libraries for bags are missing or the snapshot is empty, and OSError.
    """
    names_of = (*(one.name for one in IDENTIFICATION), *STATED)
    described = {name: node.get_parameter(name).value for name in names_of}
    described = {name: value for name, value in described.items() if value is not None}

    def write(folder: Path, name: str, snapshot: Snapshot, replaced: Path | None) -> Path:
        # Imported late, because it costs memory and time, and most nodes never save.
        try:
            with bag_libraries():
                from valve_friction_ros.records.bags.writing import write_bag  # noqa: PLC0415
        except ValueError as error:
            raise RefusalError(str(error)) from None

        return write_bag(folder, name, snapshot, names, valve, described, replaced)

    return write


class BagSaver:
    """Writes the buffer as bags within a limit of disk space.

    Raises ValueError if the folder cannot be used.
    """

    def __init__(self, node: Node, monitor: FrictionMonitor) -> None:
        self._node, self._monitor = node, monitor
        self._folder = OutputFolder(node.get_parameter("save_folder").value, "saved", "a bag")

    async def saved(self, names: StreamNames, worker: ThreadPoolExecutor) -> Path:
        """Write the present buffer in a thread of `worker`; return the path of the bag.

        Raises RefusalError if it cannot be written, there is not enough space, or the libraries for
        bags are missing.
        """
        now = self._node.get_clock().now().nanoseconds
        snapshot, settings = self._monitor.input()
        write = bag_writer(self._node, settings.valve, names)
        return await self._folder.kept(
            self._node, now, worker, lambda folder, name: write(folder, name, snapshot, None)
        )


class ReportWriter:
    """Writes pages on the last result, with all further data on the valve.

    Raises ValueError if the folder cannot be used.
    """

    def __init__(
        self,
        node: Node,
        monitor: FrictionMonitor,
        history: HistoryWriter,
        usage: UsageWatch,
        response: ResponseWatch,
        apart: Callable[..., Any],
    ) -> None:
        self._node, self._apart = node, apart
        self._monitor, self._history = monitor, history
        self._usage, self._response = usage, response
        given = node.get_parameter("report_folder").value
        self._folder = OutputFolder(given, "reports", "a report")

    async def written(self, worker: ThreadPoolExecutor) -> Path:
        """Write a page on the last result, in a thread of `worker`; return its path.

        Raises RefusalError if there is no result, the page cannot be written, or there is not
        enough space.
        """
        write_page = self.of_now()

        def write(folder: Path, name: str) -> Path:
            path = free_path(folder, name, ".html")
            write_page(path)
            return path

        return await self._folder.kept(self._node, self._monitor.stamp or 0, worker, write)

    def of_now(self) -> Callable[[Path], None]:
        """Return a function that writes a page on the present last result to a path, in any thread.

        Raises RefusalError if there is no result. The function itself may raise OSError.
        """
        monitor, history = self._monitor, self._history
        if monitor.result is None or monitor.stamp is None:
            raise RefusalError("the valve has no result to report: identify it first")
        time, kept, notes = utc(monitor.stamp), history.baseline, list[str]()
        healthy = kept.record if kept is not None and kept.baseline == monitor.baseline else None
        if monitor.refusal is not None:
            notes.append(f"a later record was refused: {monitor.refusal}")
        if (diagnosis := monitor.diagnosis()).alarm is not None:
            notes.append(f"an alarm from an earlier record is still active: {diagnosis.message}")
        facts = {
            "name": history.valve.tag,
            "source": f"node {self._node.get_fully_qualified_name()}, "
            f"identified {time:%Y-%m-%d %H:%M:%S} UTC",
            "dated": f"identified {time:%Y-%m-%d %H:%M} UTC",
            "result": monitor.result,
            "baseline": monitor.baseline,
            "limits": monitor.settings.limits,
            "valve_limits": monitor.settings.valve_limits,
            "known": monitor.known,
            "healthy": healthy,
            "usage": self._usage.usage(),
            "usage_limits": self._usage.limits(),
            "response": self._response.summary,
        }

        def write(path: Path) -> None:
            before, unread = None, []
            try:
                before = history.read()
            except HistoryError as error:
                unread = [f"no trend, because the history cannot be read: {error}"]
            told = facts | {"history": before, "notes": (*notes, *unread)}
            # Imported late, because its libraries cost memory, and most nodes never report.
            room = "valve_friction_ros.reports"
            self._apart(imported, room, "write_identification_report", path, told)
            give_back_memory()

        return write


PAGE = "report.html"
"""File name of the report page, in the folder of the bag."""

_DESCRIPTION = "metadata.yaml"
"""The file that marks a folder as a bag."""
_BESIDE = re.compile(rf"valve\.yaml|(\.\d+_)?{re.escape(PAGE)}")
"""Files next to the bag, including the draft of a page."""


def _size_of(recording: Path) -> int:
    return sum(one.stat().st_size for one in recording.iterdir())


def _remove_recording(recording: Path) -> None:
    """Remove the files of a recording, and its folder if it is then empty.

    The file that marks the recording goes last: if the node is killed meanwhile, the rest is still
    a recording and can be removed later.
    """
    for one in sorted(recording.iterdir(), key=lambda one: one.name == _DESCRIPTION):
        if _is_written(one):
            one.unlink()
    recording.rmdir()


def remove_oldest(
    folder: Path, valve: str, most: int, most_bytes: float, new: Path | None = None
) -> None:
    """Remove the oldest recordings of a valve until both limits are met.

    Of successive recordings at one level the first is removed last: it shows how the trouble
    began, while the others show a fluctuating level.

    Only folders that are named like such a recording and contain nothing else are considered. The
    `new` recording is included in the limits but never removed. Raises OSError if something cannot
    be removed.
    """
    pattern = re.compile(rf"alarm_{re.escape(valve)}_(\d{{8}}T\d{{6}}Z)_(WARN|ERROR)(?:_(\d+))?")
    found: dict[Path, tuple[str, int, str]] = {}
    for place in sorted(folder.iterdir()) if folder.is_dir() else ():
        if not place.is_dir() or place.is_symlink():
            continue
        if (name := pattern.fullmatch(place.name)) and _is_recording(place):
            found[place] = name[1], int(name[3] or 1), name[2]
    oldest = _useless_first(found)
    if new in oldest:
        oldest.remove(new)
        oldest.append(new)
    sizes = [_size_of(place) for place in oldest]
    while oldest and oldest[0] != new and (len(oldest) > most or sum(sizes) > most_bytes):
        _remove_recording(oldest.pop(0))
        sizes.pop(0)


def _useless_first(found: Mapping[Path, tuple[str, int, str]]) -> list[Path]:
    """Sort recordings by age, with the first of each run at one level after all others."""
    firsts: list[Path] = []
    others: list[Path] = []
    before = ""
    for place, (_, _, level) in sorted(found.items(), key=lambda item: item[1]):
        (others if level == before else firsts).append(place)
        before = level
    return others + firsts


def _is_recording(place: Path) -> bool:
    """Return whether a folder contains only a recording, or nothing."""
    files = list(place.iterdir())
    is_bag = any(one.name == _DESCRIPTION for one in files)
    return all(map(_is_written, files)) and (is_bag or not files)


def _is_written(file: Path) -> bool:
    """Return whether the node writes files of this name into this folder."""
    name, folder = file.name, re.sub(r"_\d+$", "", file.parent.name)  # without its running number
    return name in (_DESCRIPTION, f"{folder}.mcap") or _BESIDE.fullmatch(name) is not None


_LATE = 1.0
"""Time, s, that a recording waits for late samples."""


class _Rise(NamedTuple):
    """A rise of the level: level, time, message, buffer at that time and its bag."""

    level: Level
    time: int
    message: str
    before: Snapshot
    newest: int | None
    clock: float
    first: "Future[AlarmRecording] | None" = None


class AlarmRecorder:
    """Saves the buffer from before and after a rise of the level, one rise at a time.

    The samples before the rise are saved at once, so that they survive if the node is killed. A bag
    that includes the samples after the rise replaces them.

    The level includes only what samples can show, and not silent inputs, a history that cannot be
    written or the life of a packing. The level at the start is not a rise. For a pause after a rise
    only higher levels are recorded, so that a fluctuating level does not fill the disk. The worker
    writes; the executor's thread checks the outcome once a second.
    """

    def __init__(
        self,
        node: Node,
        monitor: FrictionMonitor,
        history: HistoryWriter,
        reports: ReportWriter,
        worker: Worker,
    ) -> None:
        self._node, self._monitor, self._history = node, monitor, history
        self._reports, self._worker = reports, worker
        given = node.get_parameter("alarm_folder").value
        self._folder = OutputFolder(given, "alarms", "an alarm's recording")
        self._level: Level | None = None
        self._rise: _Rise | None = None
        self._last_rise: tuple[Level, float] | None = None
        self._first: Future[AlarmRecording] | None = None
        self._bag: Future[AlarmRecording] | None = None
        self._page: Future[str | None] | None = None
        self._latest = history.last_alarm()
        self._problem: str | None = None

    def follow(self, level: Level, message: str, names: StreamNames) -> None:
        """Follow the level of the valve; start and end recordings."""
        before, self._level = self._level, level
        self._settle()
        if before is not None and level > before:
            self._risen(level, message, names)
        is_writing = self._bag is not None or self._page is not None
        if self._rise is not None and not is_writing and self._is_over(self._rise):
            after, _ = self._monitor.input()
            whole = _joined(self._rise.before, after)
            self._bag = self._written(self._rise, whole, names, self._rise.first)
            self._rise = None

    def values(self) -> dict[str, str]:
        """Return the latest recording, and the cause of any failure since."""
        values: dict[str, str] = {}
        if self._latest is not None:
            values["alarm_recording"] = str(self._latest.path)
            values["alarm_recording [time]"] = utc_second(self._latest.time)
            values["alarm_recording level"] = self._latest.level.name
        if self._problem is not None:
            values["alarm_recording problem"] = self._problem
        return values

    def _parameter(self, name: str) -> float:
        return float(self._node.get_parameter(name).value)

    def _risen(self, level: Level, message: str, names: StreamNames) -> None:
        last, now = self._last_rise, time.monotonic()
        if self._parameter("alarm_recording") <= 0:
            return
        if self._rise is not None:
            level = max(level, self._rise.level)
            self._rise = self._rise._replace(level=level, message=message)
            self._last_rise = level, self._rise.clock
            return
        pause = self._parameter("alarm_pause")
        if last is not None and now - last[1] < pause and level <= last[0]:
            return
        buffer, stamp = self._monitor.buffer, self._node.get_clock().now().nanoseconds
        rise = _Rise(level, stamp, message, buffer.snapshot(), buffer.newest_stamp, now)
        self._first = self._written(rise, rise.before, names)
        self._rise = rise._replace(first=self._first)
        self._last_rise = level, now

    def _is_over(self, rise: _Rise) -> bool:
        """Return whether the time after a rise is over, by the stamps or else by the clock."""
        after = min(self._parameter("alarm_recording"), self._monitor.settings.window)
        before, newest = rise.newest, self._monitor.buffer.newest_stamp
        if before is not None and newest is not None and newest - before >= nanoseconds(after):
            return True
        return time.monotonic() - rise.clock >= after + _LATE

    def _written(
        self,
        rise: _Rise,
        samples: Snapshot,
        names: StreamNames,
        first: Future[AlarmRecording] | None = None,
    ) -> Future[AlarmRecording]:
        """Write a bag in the worker; it replaces the first bag of the rise."""
        node = self._node
        most, room = self._bounds()
        valve = valve_name(node)
        name = f"alarm_{valve}_{utc(rise.time):%Y%m%dT%H%M%SZ}_{rise.level.name}"
        write = bag_writer(node, self._monitor.settings.valve, names)

        def write_bag() -> AlarmRecording:
            # The worker runs its jobs in order, so the first bag is done.
            before = None if first is None or first.exception() else first.result().path
            with self._folder.opened() as folder:
                remove_oldest(folder, valve, most - (before is None), room, new=before)
                path = write(folder, name, samples, before)
                size = _size_of(path)
                if size > room:
                    _remove_recording(path)
                    raise RefusalError(
                        f"a bag of {size / 1e6:.3g} MB has no room in alarm_megabytes "
                        f"({room / 1e6:g}): raise it"
                    )
                remove_oldest(folder, valve, most, room, new=path)
            return AlarmRecording(rise.time, rise.level, path, rise.message)

        return self._worker.submit(write_bag)

    def _write_page(self, path: Path) -> None:
        """Write the page into the folder of the bag; this is slow, so the bag is written first."""
        try:
            write = self._reports.of_now()
        except RefusalError:
            return  # after a restart there is an alarm without a result
        valve, (most, room), page = valve_name(self._node), self._bounds(), path / PAGE

        def write_page() -> str | None:
            try:
                if page.is_symlink():  # writing would follow the link
                    page.unlink()
                write(page)
                if _size_of(path) > room:
                    page.unlink()
                    return f"{page} does not fit into alarm_megabytes: increase it"
                remove_oldest(path.parent, valve, most, room, new=path)
            except OSError as error:
                return f"{page} was not written: {disk_trouble(error)}"
            return None

        self._page = self._worker.submit(write_page)

    def _bounds(self) -> tuple[int, float]:
        """Return the largest number of recordings, and their disk space, bytes."""
        most = int(self._parameter("alarm_recordings"))
        return most, 1e6 * self._parameter("alarm_megabytes")

    def _settle(self) -> None:
        if self._first is not None and self._first.done():
            first, self._first = self._first, None
            with self._trouble_told("the alarm was not recorded"):
                self._keep(first.result())
        if self._page is not None and self._page.done():
            page, self._page = self._page, None
            with self._trouble_told("the page was not written"):
                self._problem = page.result()
        if self._bag is not None and self._bag.done():
            bag, self._bag = self._bag, None
            with self._trouble_told("the alarm was not recorded"):
                self._saved(bag.result())

    @contextlib.contextmanager
    def _trouble_told(self, what: str) -> Iterator[None]:
        try:
            with bugs_reported(self._node):
                yield
        except (RefusalError, InternalError) as error:
            before, self._problem = self._problem, f"{what}: {error}"
            if self._problem != before:
                self._node.get_logger().warning(self._problem)

    def _saved(self, recording: AlarmRecording) -> None:
        self._latest, self._problem = recording, None
        self._node.get_logger().info(f"the alarm is recorded: {recording.path}")
        self._keep(recording)
        with self._trouble_told("the page was not written"):
            self._write_page(recording.path)

    def _keep(self, recording: AlarmRecording) -> None:
        valve, days = self._history.valve, self._parameter("history_days")
        self._history.keep_soon(
            lambda file: database.keep_alarm_recording(file, valve, recording, days)
        )


def _joined(before: Snapshot, after: Snapshot) -> Snapshot:
    """Join two copies of a buffer; samples after a jump back of the clock are left out."""
    return after._replace(
        pressure=_following(before.pressure, after.pressure),
        position=_following(before.position, after.position),
        rejections=tuple(dict.fromkeys((*before.rejections, *after.rejections))),
    )


def _following(before: Samples, after: Samples) -> Samples:
    if not before.stamps.size:
        return after
    new = slice(int(np.searchsorted(after.stamps, before.stamps[-1], side="right")), None)
    return Samples.joined(before, Samples(after.stamps[new], after.values[new]))
