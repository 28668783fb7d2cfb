# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The list of alarms: its filters, its rows, and the actions on an alarm."""

import asyncio
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple
from zoneinfo import ZoneInfo

from valve_friction_ros.dashboard.context import Answer, Operator, ServiceRequest
from valve_friction_ros.dashboard.history_cache import HistoryCache
from valve_friction_ros.dashboard.plant_rows import address_of, moment
from valve_friction_ros.health import AlarmAction, AlarmError, AlarmKind, AlarmRequest, AlarmState
from valve_friction_ros.health.alarms import TRANSITIONS
from valve_friction_ros.history import AlarmFilter, HistoryError, KeptAlarmEvent
from valve_friction_ros.outside_text import printable
from valve_friction_ros.streams import DAY
from valve_friction_ros.wording import alarm_advice

RANGES = {
    "1 h": DAY // 24,
    "1 day": DAY,
    "1 week": 7 * DAY,
    "1 month": 30 * DAY,
    "1 year": 366 * DAY,
}
"""Selectable time spans before now, ns."""
ALL = "all"
MOST_ROWS = 500
"""Maximum number of rows on a page; the CSV has all."""
_LONGEST_SEARCH = 200

ACTIONS = {
    AlarmAction.ACKNOWLEDGE: "Acknowledge",
    AlarmAction.SHELVE: "Shelve",
    AlarmAction.UNSHELVE: "Unshelve",
    AlarmAction.TAKE_OUT: "Take out of service",
    AlarmAction.PUT_BACK: "Put back into service",
    AlarmAction.COMMENT: "Comment",
}
"""Actions of a person, with the labels of their buttons."""

_SERVICES = {
    AlarmAction.ACKNOWLEDGE: ("acknowledge", None),
    AlarmAction.SHELVE: ("shelve", None),
    AlarmAction.UNSHELVE: ("unshelve", None),
    AlarmAction.COMMENT: ("comment", None),
    AlarmAction.TAKE_OUT: ("out_of_service", True),
    AlarmAction.PUT_BACK: ("out_of_service", False),
}
LASTING = frozenset({AlarmAction.SHELVE, AlarmAction.TAKE_OUT})
"""Actions that last for a set time."""


def possible(state: str) -> tuple[AlarmAction, ...]:
    """Return the actions that an alarm allows in a state, given in words."""
    return tuple(
        one for one in ACTIONS if any(s.value == state and a is one for s, a in TRANSITIONS)
    )


class Asked(NamedTuple):
    """Request of a person: action, name and comment; for a lasting action also its hours."""

    action: AlarmAction
    who: str
    text: str = ""
    hours: float = 8.0


def request_of(asked: Asked, kind: str) -> ServiceRequest:
    """Return the service call for a request on one kind of alarm, or on ``all``."""
    name, switch = _SERVICES[asked.action]
    values = {
        "alarm_kind": kind,
        "alarm_who": asked.who,
        "alarm_text": asked.text,
        "alarm_hours": asked.hours,
    }
    return ServiceRequest(name, values, switch)


@dataclass(frozen=True)
class AlarmSelection:
    """Filters of an alarm page.

    Attributes
    ----------
    is_journal : bool
        Whether to list all events; else only alarms that are not normal.
    span : str
        Name of the time span before now (`RANGES`), or ``all``.
    search : str
        Words; each must occur in tag, name, sentence, person or text.
    area : str
        Area of the valves, including its sub-areas.
    states : frozenset of AlarmState
        States to list; empty for all.
    kinds : frozenset of AlarmKind
        Kinds of alarm to list; empty for all.
    """

    is_journal: bool = False
    span: str = ALL
    search: str = ""
    area: str = "/"
    states: frozenset[AlarmState] = frozenset()
    kinds: frozenset[AlarmKind] = frozenset()

    @classmethod
    def from_query(cls, query: Mapping[str, str]) -> "AlarmSelection":
        """Read the filters from an address; ignore unknown parts."""
        states, kinds = query.get("state", "").split(","), query.get("kind", "").split(",")
        span = query.get("span", ALL)
        return cls(
            is_journal=query.get("view") == "events",
            span=span if span in RANGES else ALL,
            search=query.get("q", "")[:_LONGEST_SEARCH],
            area=query.get("area", "/")[:_LONGEST_SEARCH] or "/",
            states=frozenset(one for one in AlarmState if one.name.lower() in states),
            kinds=frozenset(one for one in AlarmKind if one.value in kinds),
        )

    def to_query(self) -> dict[str, str]:
        """Return the parts of the address, without defaults."""
        parts = {
            "view": "events" if self.is_journal else "",
            "span": "" if self.span == ALL else self.span,
            "q": self.search,
            "area": "" if self.area == "/" else self.area,
            "state": ",".join(one.name.lower() for one in AlarmState if one in self.states),
            "kind": ",".join(one.value for one in AlarmKind if one in self.kinds),
        }
        return {key: text for key, text in parts.items() if text}

    def address(self, more: Mapping[str, str], path: str = "/alarms") -> str:
        """Return the address of this list, with further parts."""
        return address_of(path, {**self.to_query(), **more})

    def chosen(self, now: int) -> AlarmFilter:
        """Return the filter of the history at a time, ns since 1970."""
        since = now - RANGES[self.span] if self.span in RANGES else AlarmFilter().since
        return AlarmFilter(
            since=since,
            area=self.area,
            states=self.states,
            kinds=self.kinds,
            words=self.search,
        )


def row_of(number: int, one: KeptAlarmEvent, zone: ZoneInfo, href: str, is_journal: bool) -> Any:
    """Return a row under fixed keys, with `number` as its identity."""
    event, alarm = one.event, one.event.alarm
    level = alarm.condition.level
    by = f"{event.action.value} by {event.who}" if event.who else event.action.value
    return {
        "i": number,
        "href": href,
        "tag": printable(one.valve.tag, 80),
        "area": printable(one.area, 120),
        "kind": alarm.kind.words,
        "state": alarm.state.value,
        "until": "" if alarm.until is None else moment(alarm.until, zone)[:16],
        "css": level.name.lower() if alarm.is_told else "unknown",
        "level": level.name if alarm.is_active else "",
        "advice": alarm_advice(alarm.kind.value, level.name) if alarm.is_told else "",
        "say": printable(alarm.message, 300),
        "when": moment(event.time, zone),
        "raised": moment(alarm.raised, zone)[:16],
        "by": printable(by, 120),
        "text": printable(event.text, 500),
        "can": [] if is_journal else [a.name for a in possible(alarm.state.value)],
    }


def areas_of(valves: Iterable[str]) -> tuple[str, ...]:
    """Return the areas of identifiers, with all enclosing areas, sorted."""
    found = {"/"}
    for name in valves:
        parts = name.strip("/").split("/")[:-2]
        found |= {"/" + "/".join(parts[: k + 1]) for k in range(len(parts))}
    return tuple(sorted(found))


class HistoryOperator:
    """Answers alarms through the history; identifiers follow the history file.

    An identifier that shares its process with many valves offers no alarm services.

    Parameters
    ----------
    history : HistoryCache
        The history.
    services : Operator or None
        Calls the services of identifiers: for all other requests, and for alarms of valves without
        a history file here. None if no identifier is heard.
    """

    def __init__(self, history: HistoryCache, services: Operator | None = None) -> None:
        self._history, self._services = history, services

    async def call(self, node: str, request: ServiceRequest) -> Answer:
        """Make a request on one or all alarms of a valve, or call another service."""
        history, called = self._history, (request.name, request.switch)
        action = next((action for action, one in _SERVICES.items() if one == called), None)
        kept = next((one for one in history.valves if one.name == node), None)
        if self._services is not None and (action is None or kept is None or not history.is_file):
            return await self._services.call(node, request)
        if action is None or kept is None:
            if action is None:
                return Answer(
                    False, "this dashboard shows only a history: there is no identifier to ask"
                )
            return Answer(False, f"{node}: the history has no such valve")
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
