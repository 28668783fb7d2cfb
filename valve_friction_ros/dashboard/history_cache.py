# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The history for the pages, read in a thread and only when the file has changed.

Where no identifier is heard, it also supplies a plant with its valves.
"""

import contextlib
import json
import math
import threading
import time
from collections import OrderedDict, defaultdict, deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import fmean, median
from typing import TYPE_CHECKING, NamedTuple

from valve_friction_ros import history as database
from valve_friction_ros.dashboard.live_state import Plant, Quantity, Status, Unread, ValveView
from valve_friction_ros.health.alarms import Alarm, AlarmError, AlarmKind, AlarmState
from valve_friction_ros.health.levels import Level, StatusSignal, Survey
from valve_friction_ros.history import (
    AlarmFilter,
    HistoryError,
    KeptAlarmEvent,
    KeptValve,
    Place,
    ValveHistory,
)
from valve_friction_ros.history.place import file_state
from valve_friction_ros.history.status_values import (
    alarm_values,
    baseline_values,
    exact_time,
    ratio_values,
    result_values,
    trend_values,
)
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.outside_text import printable
from valve_friction_ros.streams import DAY, END_OF_TIME

if TYPE_CHECKING:
    from valve_friction_ros.history import HistoryMark, LastState


_SPARK_POINTS = 40
_TOP, _BOTTOM = 2.0, 22.0


class Sparkline(NamedTuple):
    """SVG paths of the ratios over time and of a line at 1, with the number of days."""

    path: str
    base: str
    days: int


def sparkline(times: Sequence[int], ratios: Sequence[float]) -> Sparkline | None:
    """Draw ratios over their times, ns; return None for fewer than two ratios.

    The height is logarithmic and spans at least a factor of 1.6, so that noise looks small. Medians
    reduce many points to `_SPARK_POINTS`.
    """
    found = sorted((t, math.log(r)) for t, r in zip(times, ratios, strict=True) if 0 < r < math.inf)
    if len(found) < 2:
        return None
    begin = found[0][0]
    span = found[-1][0] - begin or 1
    places: defaultdict[int, list[tuple[int, float]]] = defaultdict(list)
    for stamp, height in found:
        place = min((stamp - begin) * _SPARK_POINTS // span, _SPARK_POINTS - 1)
        places[place].append((stamp, height))
    points = [
        (fmean(t for t, _ in some) - begin, median(y for _, y in some)) for some in places.values()
    ]
    low = min(0.0, *(y for _, y in points))
    high = max(0.0, *(y for _, y in points))
    spare = max(0.0, math.log(1.6) - (high - low)) / 2
    low, high = low - spare, high + spare

    def at(y: float) -> float:
        return round(_BOTTOM - (y - low) / (high - low) * (_BOTTOM - _TOP), 1)

    steps = [f"{100 * t / span:.1f} {at(y)}" for t, y in points]
    return Sparkline(f"M{'L'.join(steps)}", f"M0 {at(0.0)}L100 {at(0.0)}", round(span / DAY))


_SPARK_DAYS = 400
_MOST_RATIOS = 800
"""Maximum number of ratios in the sparkline of a valve."""
_READ_DEPTH = 1100 * DAY
"""Maximum time span, ns, to read of the history of a valve."""
_MOST_CACHED = 8
"""Number of valves whose histories are kept in memory."""
_SERVER_PAUSE = 2.0
"""Minimum time between two queries to a server, s."""


def _view_of_last(state: "LastState") -> ValveView:
    return ValveView(
        state.valve.name,
        printable(state.valve.tag, 80),
        state.level,
        state.status_signal,
        printable(state.message, 2000),
        identified=state.time,
        ratio=state.ratio,
        parameters=tuple(
            Quantity(one.name, one.value, one.half_width, "N", one.verdict.value, one.reason)
            for one in state.frictions
        ),
    )


class HistoryCache:
    """Cached contents of the history, for all valves and per valve.

    `refresh` and `valve` read the file, so call them in a worker thread; the cached contents are
    available at once. A read error becomes the `problem`, and earlier contents remain. A server may
    be slow: `refresh` queries it in another thread and does not wait. Without a place there is no
    history, and no `file`. `refresh` also ends shelving where no identifier does it.

    Parameters
    ----------
    place : Path or HistoryServer or None
        The history.
    is_followed : callable
        Returns whether an identifier of this name runs, which acts for the clock on its alarms.
    """

    def __init__(
        self, place: Place | None, is_followed: Callable[[str], bool] = lambda _: False
    ) -> None:
        self.file = None if place is None else database.History(place)
        self._path = place if isinstance(place, Path) else None  # None: nothing, or a server
        self._asking: threading.Thread | None = None
        self._asked = -_SERVER_PAUSE
        self._rows: set[int] = set()
        self._lock = threading.Lock()
        self._seen: tuple[object, ...] = ()
        self._mark: HistoryMark | None = None
        self._row = 0
        self._number = 0
        self._ratios: defaultdict[str, deque[tuple[int, float]]] = defaultdict(
            lambda: deque(maxlen=_MOST_RATIOS)
        )
        self._sparks: dict[str, Sparkline | None] = {}
        self._histories: OrderedDict[str, ValveHistory | None] = OrderedDict()
        self._is_followed = is_followed
        self._ends: dict[KeptValve, int] = {}
        """Earliest end of shelving or time out of service of each valve, ns."""
        self.valves: tuple[KeptValve, ...] = ()
        self.last: dict[str, ValveView] = {}
        """The last known state of each valve, by the name of its identifier."""
        self.problem: str | None = None if place else "no history_file is named: nothing is kept"
        self.revision = 0
        self.alarm_revision = 0

    def refresh(self) -> bool:
        """Read new rows if the file has changed, and return whether it has.

        For a server, start a query; its answer arrives later.
        """
        if self.file is None or self._path is not None:
            return self._refresh()
        is_asking = self._asking is not None and self._asking.is_alive()
        if not is_asking and time.monotonic() - self._asked >= _SERVER_PAUSE:
            self._asked = time.monotonic()
            self._asking = threading.Thread(target=self._refresh, name="history", daemon=True)
            self._asking.start()
        return False

    def _refresh(self) -> bool:
        with self._lock:
            if self.file is None:
                return False
            self._end_suppressions(self.file)
            if not self._may_be_new():
                return False
            since = time.time_ns() - _SPARK_DAYS * DAY
            try:
                mark = database.history_mark(self.file)
                if self._mark is None or mark.alarm_event != self._mark.alarm_event:
                    self._ends = database.suppression_ends(self.file)
                    self.alarm_revision += 1
                if self._mark is not None and mark.database != self._mark.database:
                    self._begin_anew()
                if mark == self._mark and mark.settled and self.problem is None:
                    return False
                valves = self.file.valves()
                last = database.last_states(self.file)
                found = database.ratios_after(self.file, self._row, since)
            except (HistoryError, ValueError) as error:
                is_new, self.problem = str(error) != self.problem, str(error)
                self.revision += is_new
                return is_new
            self.problem, self._mark = None, mark
            found = tuple(one for one in found if one.row not in self._rows)
            for one in found:
                self._ratios[one.valve].append((one.time, one.ratio))
            self._rows.update(one.row for one in found)
            if mark.settled:  # no new row can precede the last one
                self._row = max(self._row, mark.identification)
                self._rows = {row for row in self._rows if row > self._row}
            for valve in {one.valve for one in found}:
                self._sparks[valve] = sparkline(*zip(*self._ratios[valve], strict=True))
            self._histories.clear()
            unknown = {valve.name: ValveView(valve.name, valve.tag) for valve in valves}
            self.last = unknown | {one.valve.name: _view_of_last(one) for one in last}
            self.valves = valves  # last: other threads must find the rest complete
            self.revision += 1
            return True

    def _end_suppressions(self, file: database.History) -> None:
        """Write what the clock does to alarms, where no identifier does it."""
        now = time.time_ns()
        for valve in [one for one, end in self._ends.items() if end <= now]:
            if not self._is_followed(valve.name):
                with contextlib.suppress(AlarmError, HistoryError):  # not ours to write
                    database.follow_alarms(file, valve, {}, now)

    def _may_be_new(self) -> bool:
        """Return whether there may be new rows; start again if the file has been replaced."""
        if self._path is None:
            return True
        if (state := file_state(self._path)) == self._seen:
            return False
        self._seen, number = state, state[0].number
        if number and self._number and number != self._number:
            self._begin_anew()
        self._number = number or self._number
        return True

    def _begin_anew(self) -> None:
        self._mark, self._row = None, 0
        self._rows.clear()
        self._ratios.clear()
        self._sparks.clear()

    def alarms(
        self, chosen: AlarmFilter, is_journal: bool, most: int = 100_000
    ) -> tuple[KeptAlarmEvent, ...]:
        """Read all alarm events, or the last event of each alarm not normal, the newest first.

        Raises HistoryError if the history cannot be read.
        """
        if self.file is None:
            return ()
        return database.alarm_events(self.file, chosen, most, is_standing=not is_journal)

    def valve_alarms(self, node: str) -> tuple[Alarm, ...] | None:
        """Read the alarms of a valve that are not normal; None if no file holds the valve.

        Raises HistoryError if the file cannot be read.
        """
        if self.file is None or not self.is_file or all(one.name != node for one in self.valves):
            return None
        alarms = database.read_alarms(self.file, node)
        known = (alarms.get(kind, Alarm(kind)) for kind in AlarmKind)
        return tuple(one for one in known if one.state is not AlarmState.NORMAL)

    @property
    def is_file(self) -> bool:
        """Whether the history is a file, which identifiers on this machine follow."""
        return self._path is not None

    def spark(self, node: str) -> Sparkline | None:
        """Return the sparkline of a valve, or None."""
        return self._sparks.get(node)

    def valve(self, node: str) -> ValveHistory | None:
        """Read the history of a valve; return None if it has no history.

        Raises HistoryError if the file cannot be read.
        """
        if self.file is None:
            return None
        with self._lock:
            if node not in self._histories:
                kept = tuple(one for one in self.valves if one.name == node)
                since, until = (time.time_ns() + sign * _READ_DEPTH for sign in (-1, 1))
                found = database.valve_histories(self.file, kept, since, until)
                self._histories[node] = found[0] if found else None
                while len(self._histories) > _MOST_CACHED:
                    self._histories.popitem(last=False)
            return self._histories[node]


def status_of(kept: ValveHistory) -> Status:
    """Return the status of a valve as its identifier would publish it, without alarms.

    The numbers come from the last successful identification, the comparison from the last baseline.
    """
    last = kept.entries[-1]
    found = next((one for one in reversed(kept.entries) if not one.refusal), None)
    diagnosis = (found or last).diagnosis
    told = [diagnosis.message]
    values = {
        "estimate_valid": str(not last.refusal).lower(),
        "reason": last.refusal,
        "NE 107": diagnosis.status_signal.value,
    }
    if last.refusal:
        told.insert(0, f"the last record was refused: {last.refusal}")
    if found is not None:
        built = json.loads(found.settings).get("valve", {})
        valve = Valve(**{name: value for name, value in built.items() if value is not None})
        values["estimate_time"] = exact_time(found.time)
        values |= result_values(found, valve)
    baseline = None if kept.set_baseline is None else kept.set_baseline.baseline
    values |= baseline_values(baseline)
    if baseline is None and diagnosis.survey is not Survey.UNKNOWN:
        values["survey"] = diagnosis.survey.value
    values |= ratio_values(diagnosis.ratio)
    values |= trend_values(kept.trend)
    name, message = f"{kept.valve.name}: friction", "; ".join(told)
    return Status(name, diagnosis.level, kept.valve.tag, message, values)


def _with_alarms(status: Status, alarms: Mapping[AlarmKind, Alarm]) -> Status:
    """Return the status with its alarms; an active whole-valve alarm can raise the level."""
    level, told = status.level, [status.message]
    values = {**status.values, **alarm_values(alarms)}
    for one in alarms.values():
        if one.is_told and one.kind is AlarmKind.WHOLE_VALVE:
            told.append(one.condition.message)
            if one.condition.level > level:
                level = one.condition.level
                values["NE 107"] = one.condition.status_signal.value
    return status._replace(level=level, message="; ".join(told), values=values)


class KeptValves(HistoryCache):
    """A history that supplies a plant with statuses, in place of identifiers."""

    def __init__(self, place: Place, plant: Plant) -> None:
        super().__init__(place)
        self._plant, self._history = plant, database.History(place)
        self._told = (-1, -1)
        self._read: HistoryMark | None = None
        self._statuses: dict[KeptValve, list[Status]] = {}

    def _refresh(self) -> bool:
        is_new = super()._refresh()
        state = (self.revision, self.alarm_revision)
        if state != self._told and self.problem is None:
            self._told = state
            try:
                self._tell()
            except HistoryError as error:
                self.problem, self._told = str(error), (-1, -1)
        return is_new

    def _tell(self) -> None:
        """Pass on the statuses of all valves; an alarm event alone rereads no histories."""
        now = time.monotonic()
        self._plant.expect(self.last.values())
        mark = None if self._mark is None else self._mark._replace(alarm_event=0)
        if mark != self._read or mark is None or not mark.settled:
            self._statuses.clear()
        self._read = mark
        for valve in self.valves:
            try:
                if valve not in self._statuses:
                    found = database.valve_histories(self._history, (valve,), 0, END_OF_TIME)
                    self._statuses[valve] = [status_of(one) for one in found]
                alarms = database.read_alarms(self._history, valve.name)
                statuses = [_with_alarms(one, alarms) for one in self._statuses[valve]]
            except (ValueError, TypeError, KeyError) as error:
                signal = {"NE 107": StatusSignal.CHECK_FUNCTION.value}
                told = f"not readable: {error}"
                name = f"{valve.name}: friction"
                statuses = [Status(name, Level.WARN, valve.tag, told, signal)]
            for status in statuses:
                self._plant.hear(Unread(status.name, status._replace), now)
