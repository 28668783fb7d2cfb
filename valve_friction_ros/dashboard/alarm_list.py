# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Alarms in words: which are listed, their rows, and what may be asked of them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple
from urllib.parse import urlencode
from zoneinfo import ZoneInfo

from valve_friction_ros.dashboard.context import ServiceRequest
from valve_friction_ros.dashboard.plant_rows import moment
from valve_friction_ros.health import AlarmAction, AlarmKind, AlarmState
from valve_friction_ros.health.alarms import TRANSITIONS
from valve_friction_ros.history import AlarmFilter, KeptAlarmEvent
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
"""Times before now that can be chosen, ns."""
ALL = "all"
MOST_ROWS = 500
"""Rows of a page; the CSV has all."""
_LONGEST_SEARCH = 200

ACTIONS = {
    AlarmAction.ACKNOWLEDGE: "Acknowledge",
    AlarmAction.SHELVE: "Shelve",
    AlarmAction.UNSHELVE: "Unshelve",
    AlarmAction.TAKE_OUT: "Take out of service",
    AlarmAction.PUT_BACK: "Put back into service",
    AlarmAction.COMMENT: "Comment",
}
"""What a person may ask, as a button says it."""

_SERVICES = {
    AlarmAction.ACKNOWLEDGE: ("acknowledge", None),
    AlarmAction.SHELVE: ("shelve", None),
    AlarmAction.UNSHELVE: ("unshelve", None),
    AlarmAction.COMMENT: ("comment", None),
    AlarmAction.TAKE_OUT: ("out_of_service", True),
    AlarmAction.PUT_BACK: ("out_of_service", False),
}
LASTING = frozenset({AlarmAction.SHELVE, AlarmAction.TAKE_OUT})
"""What lasts for a time."""


def possible(state: str) -> tuple[AlarmAction, ...]:
    """Return what may be asked of an alarm in a state, which is given in words."""
    return tuple(
        one for one in ACTIONS if any(s.value == state and a is one for s, a in TRANSITIONS)
    )


class Asked(NamedTuple):
    """What a person asks: the action, their name and words, and for how long, h, where it lasts."""

    action: AlarmAction
    who: str
    text: str = ""
    hours: float = 8.0


def request_of(asked: Asked, kind: str) -> ServiceRequest:
    """Return the call of the service by which that is asked of an alarm, or of ``all``."""
    name, switch = _SERVICES[asked.action]
    values = {
        "alarm_kind": kind,
        "alarm_who": asked.who,
        "alarm_text": asked.text,
        "alarm_hours": asked.hours,
    }
    return ServiceRequest(name, values, switch)


def action_of(request: ServiceRequest) -> AlarmAction | None:
    """Return what a call of a service asks of an alarm; None where it asks something else."""
    asked = (request.name, request.switch)
    return next((action for action, one in _SERVICES.items() if one == asked), None)


@dataclass(frozen=True)
class AlarmSelection:
    """What a page of alarms lists.

    Attributes
    ----------
    is_journal : bool
        Whether all events are listed; else the alarms that are not normal.
    span : str
        Name of the time before now (`RANGES`), or ``all``.
    search : str
        Words; each must be in tag, name, sentence, person or text.
    area : str
        Area of the valves, with the areas in it.
    states : frozenset of AlarmState
        States that are listed; empty: all.
    kinds : frozenset of AlarmKind
        Alarms that are listed; empty: all.
    """

    is_journal: bool = False
    span: str = ALL
    search: str = ""
    area: str = "/"
    states: frozenset[AlarmState] = frozenset()
    kinds: frozenset[AlarmKind] = frozenset()

    @classmethod
    def from_query(cls, query: Mapping[str, str]) -> "AlarmSelection":
        """Read an address; what is unknown in it is left out."""
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
        """Return what an address has to hold; nothing that is usual."""
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
        query = urlencode({**self.to_query(), **more})
        return f"{path}?{query}" if query else path

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
    """Return a row under fixed keys; `number` tells it apart."""
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
    """Return the areas that names of identifiers lie in, with the areas around them, sorted."""
    found = {"/"}
    for name in valves:
        parts = name.strip("/").split("/")[:-2]
        found |= {"/" + "/".join(parts[: k + 1]) for k in range(len(parts))}
    return tuple(sorted(found))
