# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A dashboard of what a history keeps, where no identifier is heard: nothing here needs ROS."""

import asyncio
import json
import time
from collections.abc import Mapping
from functools import partial

from valve_friction_ros import history as database
from valve_friction_ros.dashboard.alarm_list import action_of
from valve_friction_ros.dashboard.context import Answer, Operator, ServiceRequest
from valve_friction_ros.dashboard.history_cache import HistoryCache
from valve_friction_ros.dashboard.live_state import Plant, Status, Unread
from valve_friction_ros.dashboard.live_strip import LiveStrip
from valve_friction_ros.health import (
    Alarm,
    AlarmError,
    AlarmKind,
    AlarmRequest,
    Level,
    StatusSignal,
    Survey,
    dead_band,
    dead_band_half_width,
)
from valve_friction_ros.health.diagnosis import survey_of
from valve_friction_ros.history import HistoryEntry, HistoryError, Place, ValveHistory
from valve_friction_ros.history.status_values import (
    alarm_values,
    baseline_values,
    exact_time,
    ratio_values,
    result_values,
    trend_values,
)
from valve_friction_ros.model.valve import Valve

_FOREVER = 2**63 - 1


def _valve_of(entry: HistoryEntry) -> Valve:
    """Return the valve of an identification, as its settings describe it."""
    kept = json.loads(entry.settings).get("valve", {})
    return Valve(**{name: value for name, value in kept.items() if value is not None})


def status_of_history(kept: ValveHistory, alarms: Mapping[AlarmKind, Alarm]) -> Status:
    """Return what is known of a valve as its identifier would say it.

    The last identification that was no refusal gives the numbers, and the last baseline what they
    are compared with; an alarm that is told raises the level.
    """
    last = kept.entries[-1]
    found = next((one for one in reversed(kept.entries) if not one.refusal), None)
    diagnosis = (found or last).diagnosis
    level, signal, told = diagnosis.level, diagnosis.status_signal, [diagnosis.message]
    for one in alarms.values():
        if one.is_told and one.kind is AlarmKind.WHOLE_VALVE:
            told.append(one.condition.message)
            if one.condition.level > level:
                level, signal = one.condition.level, one.condition.status_signal
    values = {
        "estimate_valid": str(not last.refusal).lower(),
        "reason": last.refusal,
        "NE 107": signal.value,
    }
    if last.refusal:
        told.insert(0, f"the last record was refused: {last.refusal}")
    if found is not None:
        valve = _valve_of(found)
        band, half_width = dead_band(found, valve), dead_band_half_width(found, valve)
        values["estimate_time"] = exact_time(found.time)
        values |= result_values(found.to_dict(), band, half_width)
        survey = survey_of(found, valve)
        if kept.set_baseline is None and survey is not Survey.UNKNOWN:
            values["survey"] = survey.value
    baseline = None if kept.set_baseline is None else kept.set_baseline.baseline
    values |= baseline_values(baseline)
    values |= ratio_values(diagnosis.ratio)
    values |= trend_values(kept.trend)
    values |= alarm_values(alarms)
    return Status(f"{kept.valve.name}: friction", level, kept.valve.tag, "; ".join(told), values)


def _unreadable(node: str, tag: str, error: Exception) -> Status:
    signal = StatusSignal.CHECK_FUNCTION.value
    return Status(
        f"{node}: friction", Level.WARN, tag, f"not readable: {error}", {"NE 107": signal}
    )


class KeptValves(HistoryCache):
    """A history that tells a plant of its valves, as their identifiers would.

    Parameters
    ----------
    place : Path or HistoryServer
        The history.
    plant : Plant
        Whom it tells.
    """

    def __init__(self, place: Place, plant: Plant) -> None:
        super().__init__(place)
        self._plant = plant
        self._history = database.History(place)
        self._told = (-1, -1)

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
        now = time.monotonic()
        self._plant.expect(self.valves)
        for node, tag in self.valves:
            try:
                (kept,) = database.valve_histories(
                    self._history, (database.KeptValve(node, tag),), 0, _FOREVER
                ) or (None,)
                if kept is None:
                    continue
                status = status_of_history(kept, database.read_alarms(self._history, node))
            except (ValueError, TypeError, KeyError) as error:
                status = _unreadable(node, tag, error)
            self._plant.hear(Unread(status.name, partial(_same, status)), now)


def _same(status: Status) -> Status:
    return status


class HistoryOperator:
    """Answers alarms in the file of the history, which their identifiers follow.

    An identifier that shares its process with many valves offers no services for that.

    Parameters
    ----------
    history : HistoryCache
        The history.
    services : Operator or None
        Calls the services of identifiers: for all else, and for the alarms of valves that the file
        does not keep. None: no identifier is heard.
    """

    def __init__(self, history: HistoryCache, services: Operator | None = None) -> None:
        self._history, self._services = history, services

    async def call(self, node: str, request: ServiceRequest) -> Answer:
        """Make a request on an alarm of a valve, or on all of them; or call another service."""
        action, history = action_of(request), self._history
        kept = next((one for one in history.valves if one.name == node), None)
        if action is None or kept is None or not history.is_file:
            if self._services is not None:
                return await self._services.call(node, request)
            if action is None:
                return Answer(False, "no identifier is asked: this dashboard shows a history alone")
            if kept is None:
                return Answer(False, f"{node}: the history has no such valve")
            return Answer(False, "the history is on a server: ask the identifier of the valve")
        kind, hours = request.values["alarm_kind"], request.values["alarm_hours"]
        try:
            asked = AlarmRequest(
                action,
                str(request.values["alarm_who"]),
                str(request.values["alarm_text"]),
                3600 * float(hours) if isinstance(hours, (int, float)) else 0.0,
            )
            of = None if kind == "all" else AlarmKind(kind)
            alarms = await asyncio.to_thread(history.answer_valve, kept, of, asked)
        except (AlarmError, HistoryError) as error:
            return Answer(False, str(error))
        return Answer(True, "; ".join(map(str, alarms)))


class NoSignals:
    """Nothing comes of any signal."""

    def watch(self, _node: str) -> LiveStrip:
        """Return a strip that stays empty."""
        return LiveStrip(60.0)

    def unwatch(self, _node: str) -> None:
        """Do nothing."""
