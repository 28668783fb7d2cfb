# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The life of an alarm, after ISA-18.2 and IEC 62682: its states, one table of transitions, events.

An alarm is one of six of a valve. It has a *condition*, which the valve shows, and a *state*, which
is what has become of the condition: raised, acknowledged by somebody, shelved, returned. Each step
is an `AlarmEvent`, which holds the whole alarm from then on, so that the last event of an alarm is
the alarm.
"""

import json
import math
import threading
import uuid
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timezone
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

from valve_friction_ros.health.levels import Level, StatusSignal
from valve_friction_ros.outside_text import printable
from valve_friction_ros.wording import utc_minute, utc_second


class AlarmKind(Enum):
    """What an alarm of a valve is about; the value is its name in files and on the graph."""

    FRICTION_HIGH = "friction_high"
    FRICTION_LOW = "friction_low"
    STUCK = "stuck"
    WHOLE_VALVE = "whole_valve"
    DATA_QUALITY = "data_quality"
    POSITIONER = "positioner"

    @property
    def words(self) -> str:
        """The name in words."""
        return self.value.replace("_", " ")


class AlarmState(Enum):
    """State of an alarm; the letters are those of the states of ISA-18.2."""

    NORMAL = "normal"
    """A: the valve does not show it, and nobody has to do anything."""
    UNACKNOWLEDGED = "unacknowledged"
    """B: the valve shows it, and nobody has acknowledged it."""
    ACKNOWLEDGED = "acknowledged"
    """C: the valve shows it, and somebody has acknowledged it."""
    RETURNED = "returned unacknowledged"
    """D: the valve has shown it, shows it no longer, and nobody has acknowledged it."""
    SHELVED = "shelved"
    """G: somebody does not want to hear of it until a time."""
    OUT_OF_SERVICE = "out of service"
    """I: the valve is being worked on until a time."""

    @property
    def is_suppressed(self) -> bool:
        """Whether nobody is told, whatever the valve shows."""
        return self in (AlarmState.SHELVED, AlarmState.OUT_OF_SERVICE)

    @property
    def needs_answer(self) -> bool:
        """Whether it waits for somebody to acknowledge it."""
        return self in (AlarmState.UNACKNOWLEDGED, AlarmState.RETURNED)


class AlarmAction(Enum):
    """What moves an alarm from state to state; by the valve, the clock or a person."""

    RAISE = "raised"
    WORSEN = "worsened"
    EASE = "eased"
    CLEAR = "cleared"
    EXPIRE = "expired"
    ACKNOWLEDGE = "acknowledged"
    SHELVE = "shelved"
    UNSHELVE = "unshelved"
    TAKE_OUT = "taken out of service"
    PUT_BACK = "put back into service"
    COMMENT = "commented"

    @property
    def is_of_person(self) -> bool:
        """Whether a person does it, who has a name."""
        return self in _OF_PERSONS


_OF_PERSONS = frozenset(
    {
        AlarmAction.ACKNOWLEDGE,
        AlarmAction.SHELVE,
        AlarmAction.UNSHELVE,
        AlarmAction.TAKE_OUT,
        AlarmAction.PUT_BACK,
        AlarmAction.COMMENT,
    }
)


def _table() -> Mapping[tuple[AlarmState, AlarmAction], AlarmState | None]:
    state, do = AlarmState, AlarmAction
    leave = {do.SHELVE: state.SHELVED, do.TAKE_OUT: state.OUT_OF_SERVICE}
    unheard = (do.RAISE, do.WORSEN, do.EASE, do.CLEAR)
    rows: dict[AlarmState, dict[AlarmAction, AlarmState | None]] = {
        state.NORMAL: {do.RAISE: state.UNACKNOWLEDGED, **leave},
        state.UNACKNOWLEDGED: {
            do.WORSEN: state.UNACKNOWLEDGED,
            do.EASE: state.UNACKNOWLEDGED,
            do.CLEAR: state.RETURNED,
            do.ACKNOWLEDGE: state.ACKNOWLEDGED,
            **leave,
        },
        state.ACKNOWLEDGED: {
            do.WORSEN: state.UNACKNOWLEDGED,
            do.EASE: state.ACKNOWLEDGED,
            do.CLEAR: state.NORMAL,
            **leave,
        },
        state.RETURNED: {do.RAISE: state.UNACKNOWLEDGED, do.ACKNOWLEDGE: state.NORMAL, **leave},
        state.SHELVED: {
            **dict.fromkeys(unheard, state.SHELVED),
            **leave,
            do.UNSHELVE: None,
            do.EXPIRE: None,
        },
        state.OUT_OF_SERVICE: {
            **dict.fromkeys(unheard, state.OUT_OF_SERVICE),
            do.TAKE_OUT: state.OUT_OF_SERVICE,
            do.PUT_BACK: None,
            do.EXPIRE: None,
        },
    }
    for one, row in rows.items():
        row[do.COMMENT] = one
    return MappingProxyType(
        {(one, act): to for one, row in rows.items() for act, to in row.items()}
    )


TRANSITIONS = _table()
"""The state after each action that is possible in a state.

None: the condition decides, which is unacknowledged where the valve shows it and normal where not.
"""

_HOUR = 3_600_000_000_000
LONGEST_SHELVING = 30 * 24 * _HOUR
"""Longest time, ns, for which an alarm is shelved. Chosen: what is forgotten comes back."""
LONGEST_ABSENCE = 366 * 24 * _HOUR
"""Longest time, ns, out of service. Chosen: a turnaround is planned for less than a year ahead."""
_LONGEST_NAME, _LONGEST_TEXT = 80, 500


class AlarmError(ValueError):
    """A request that an alarm refuses; one line for the person who made it."""


class Condition(NamedTuple):
    """What the valve shows of an alarm now.

    Attributes
    ----------
    level : Level
        OK where it does not show it.
    status_signal : StatusSignal
        The severity as a status signal of NE 107.
    message : str
        One sentence.
    """

    level: Level = Level.OK
    status_signal: StatusSignal = StatusSignal.GOOD
    message: str = ""


NO_CONDITION = Condition()


@dataclass(frozen=True)
class Alarm:
    """An alarm as it is from its last event on.

    Attributes
    ----------
    kind : AlarmKind
        What it is about.
    state : AlarmState
        Its state.
    condition : Condition
        What the valve shows, also while it is shelved; of one that has returned, nothing.
    raised : int or None
        When the valve began to show it, ns since 1970 (UTC); None where it never has.
    until : int or None
        End of shelving or absence, ns; None in the other states.
    message : str
        The sentence of the condition when it was raised or changed last.

    Raises
    ------
    ValueError
        If state, level and end contradict each other.
    """

    kind: AlarmKind
    state: AlarmState = AlarmState.NORMAL
    condition: Condition = NO_CONDITION
    raised: int | None = None
    until: int | None = None
    message: str = ""

    def __post_init__(self) -> None:
        """Refuse an alarm that contradicts itself."""
        if self.state.is_suppressed != (self.until is not None):
            raise ValueError(f"an alarm that is {self.state.value} until {self.until}")
        shows = self.is_active
        if (self.state in _SHOWN and not shows) or (self.state in _GONE and shows):
            raise ValueError(f"an alarm that is {self.state.value} at {self.condition.level.name}")

    @property
    def is_active(self) -> bool:
        """Whether the valve shows it now."""
        return self.condition.level > Level.OK

    @property
    def is_told(self) -> bool:
        """Whether people are told of it: the valve shows it, and nobody has shelved it."""
        return self.is_active and not self.state.is_suppressed

    def __str__(self) -> str:
        """Return kind and state, with the end of a suppression, on one line."""
        end = "" if self.until is None else f" until {utc_minute(self.until)}"
        return f"{self.kind.words}: {self.state.value}{end}"


_SHOWN = (AlarmState.UNACKNOWLEDGED, AlarmState.ACKNOWLEDGED)
_GONE = (AlarmState.NORMAL, AlarmState.RETURNED)


class AlarmEvent(NamedTuple):
    """One step of an alarm.

    Attributes
    ----------
    time : int
        When, ns since 1970 (UTC).
    action : AlarmAction
        What has happened.
    before : AlarmState
        The state until then.
    alarm : Alarm
        The alarm from then on.
    who, text : str
        The person and their words; empty where the valve or the clock did it.
    """

    time: int
    action: AlarmAction
    before: AlarmState
    alarm: Alarm
    who: str = ""
    text: str = ""


@dataclass(frozen=True)
class AlarmRequest:
    """What a person asks of an alarm.

    Attributes
    ----------
    action : AlarmAction
        Acknowledge, shelve, unshelve, take out of service, put back or comment.
    who : str
        Their name.
    text : str
        Their words; a comment needs some.
    duration : float
        Length of shelving or absence, s; not used by the others.

    Raises
    ------
    AlarmError
        If the name is empty, a text is no line of plain text, or the duration is no time that may
        be shelved.
    """

    action: AlarmAction
    who: str
    text: str = ""
    duration: float = math.nan

    def __post_init__(self) -> None:
        """Refuse what nobody may ask."""
        if not self.action.is_of_person:
            raise AlarmError(f"an alarm is {self.action.value} by the valve, not by request")
        for name, longest in (("who", _LONGEST_NAME), ("text", _LONGEST_TEXT)):
            given = getattr(self, name).strip()
            if len(given) > longest or given != printable(given, longest):
                raise AlarmError(f"{name} must be one line of at most {longest} characters")
            object.__setattr__(self, name, given)
        if not self.who:
            raise AlarmError("who is empty: give your name")
        if self.action is AlarmAction.COMMENT and not self.text:
            raise AlarmError("text is empty: give the comment")
        if (longest_time := _LONGEST.get(self.action)) is None:
            return
        if not 0 < self.duration * 1e9 <= longest_time:
            raise AlarmError(
                f"an alarm cannot be {self.action.value} for {self.duration / 3600:g} h: give a "
                f"duration above 0 and up to {longest_time // _HOUR} h"
            )


_LONGEST = {AlarmAction.SHELVE: LONGEST_SHELVING, AlarmAction.TAKE_OUT: LONGEST_ABSENCE}


def _stepped(alarm: Alarm, action: AlarmAction, time: int, condition: Condition) -> AlarmEvent:
    state = TRANSITIONS[alarm.state, action]
    if state is None:
        state = AlarmState.UNACKNOWLEDGED if condition.level else AlarmState.NORMAL
    is_change = condition.level != alarm.condition.level
    after = Alarm(
        alarm.kind,
        state,
        condition,
        time if action is AlarmAction.RAISE else alarm.raised,
        alarm.until if state.is_suppressed else None,
        condition.message if is_change and condition.level else alarm.message,
    )
    return AlarmEvent(time, action, alarm.state, after)


def followed_by(alarm: Alarm, condition: Condition, time: int) -> tuple[AlarmEvent, ...]:
    """Return what the clock and the valve make of an alarm: nothing, or one event or two.

    Parameters
    ----------
    alarm : Alarm
        The alarm until now.
    condition : Condition
        What the valve shows now.
    time : int
        Now, ns since 1970 (UTC).
    """
    events = []
    if alarm.until is not None and time >= alarm.until:
        events.append(_stepped(alarm, AlarmAction.EXPIRE, time, alarm.condition))
        alarm = events[-1].alarm
    before, now = alarm.condition.level, condition.level
    if before != now:
        if not before or not now:
            action = AlarmAction.CLEAR if before else AlarmAction.RAISE
        else:
            action = AlarmAction.WORSEN if now > before else AlarmAction.EASE
        events.append(_stepped(alarm, action, time, condition if now else NO_CONDITION))
    return tuple(events)


def requested(alarm: Alarm, request: AlarmRequest, time: int) -> AlarmEvent:
    """Return the event of what a person asks of an alarm at a time, ns since 1970 (UTC).

    A person cannot answer an alarm before it was raised: where the clock of the valve is ahead of
    the one that asks, the answer is of the time at which it was raised.

    Raises AlarmError if the alarm is in a state in which that cannot be done.
    """
    action = request.action
    if (alarm.state, action) not in TRANSITIONS:
        verb = action.value
        possible = ", ".join(
            one.value
            for one in AlarmAction
            if one.is_of_person and (alarm.state, one) in TRANSITIONS
        )
        raise AlarmError(f"{alarm} and cannot be {verb} now: it can be {possible}")
    time = max(time, alarm.raised or time)
    state = TRANSITIONS[alarm.state, action]
    if state is None:
        state = AlarmState.UNACKNOWLEDGED if alarm.is_active else AlarmState.NORMAL
    until = alarm.until if state.is_suppressed else None
    if action in _LONGEST:
        until = time + round(request.duration * 1e9)
    after = replace(alarm, state=state, until=until)
    return AlarmEvent(time, action, alarm.state, after, request.who, request.text)


def all_followed(
    alarms: Mapping[AlarmKind, Alarm], conditions: Mapping[AlarmKind, Condition], time: int
) -> tuple[AlarmEvent, ...]:
    """Return what the clock and the valve make of its alarms (`followed_by`).

    An alarm without a condition is followed by the clock alone.
    """
    events: list[AlarmEvent] = []
    for kind in AlarmKind:
        alarm = alarms.get(kind, Alarm(kind))
        events += followed_by(alarm, conditions.get(kind, alarm.condition), time)
    return tuple(events)


def all_requested(
    alarms: Mapping[AlarmKind, Alarm], kind: AlarmKind | None, request: AlarmRequest, time: int
) -> tuple[AlarmEvent, ...]:
    """Return the events of what a person asks of one alarm of a valve, or of all that allow it.

    Of all, those are left out that are normal; they are taken out of service with the valve.

    Raises AlarmError if one is asked that does not allow it, or none of all does.
    """
    if kind is not None:
        return (requested(alarms.get(kind, Alarm(kind)), request, time),)
    some = (alarms.get(one, Alarm(one)) for one in AlarmKind)
    is_of_all = request.action is AlarmAction.TAKE_OUT
    possible = [
        one
        for one in some
        if (one.state, request.action) in TRANSITIONS
        and (is_of_all or one.state is not AlarmState.NORMAL)
    ]
    if not possible:
        standing = alarm_summary(alarms.values()) or "all alarms of the valve are normal"
        raise AlarmError(f"no alarm can be {request.action.value} now: {standing}")
    return tuple(requested(one, request, time) for one in possible)


def alarm_summary(alarms: Iterable[Alarm]) -> str:
    """Say on one line which alarms are not normal; empty where all are."""
    return "; ".join(str(one) for one in alarms if one.state is not AlarmState.NORMAL)


_DAY = 86_400.0


@dataclass(frozen=True)
class AlarmDigest:
    """The alarms of valves at a time, as one letter.

    Attributes
    ----------
    time : datetime
        When, UTC.
    alarms : mapping of (str, str) to mapping of AlarmKind to Alarm
        Alarms by tag and name of the identifier of each valve.
    event_id : str
        The same at each try, so that a receiver counts it once.
    """

    time: datetime
    alarms: Mapping[tuple[str, str], Mapping[AlarmKind, Alarm]]
    event_id: str = field(default_factory=lambda: uuid.uuid4().hex)

    @property
    def new_level(self) -> None:
        """It tells no level."""

    @property
    def title(self) -> str:
        """What it is, for whoever hears that it was not delivered."""
        return f"the digest of {self.time:%Y-%m-%d %H:%M:%S} UTC"

    def body(self) -> bytes:
        """Return it as JSON: what stands or waits for an answer; of what is shelved, the number."""
        every = [
            (tag, node, alarm)
            for (tag, node), of_valve in sorted(self.alarms.items())
            for alarm in of_valve.values()
        ]
        told = [one for one in every if one[2].is_told or one[2].state.needs_answer]
        told.sort(key=lambda one: (-one[2].condition.level, one[2].raised or 0))
        content = {
            "event_id": self.event_id,
            "time": self.time.isoformat(timespec="milliseconds"),
            "digest": {
                "valves": len(self.alarms),
                "errors": sum(one[2].condition.level == Level.ERROR for one in told),
                "warnings": sum(one[2].condition.level == Level.WARN for one in told),
                "unanswered": sum(one[2].state.needs_answer for one in told),
                "suppressed": sum(alarm.state.is_suppressed for _, _, alarm in every),
            },
            "alarms": [
                {
                    "valve": tag,
                    "node": node,
                    "alarm": alarm.kind.value,
                    "state": alarm.state.value,
                    "level": alarm.condition.level.name,
                    "ne_107": alarm.condition.status_signal.value,
                    "raised": None if alarm.raised is None else utc_second(alarm.raised),
                    "message": alarm.message,
                }
                for tag, node, alarm in told
            ],
        }
        return json.dumps(content, ensure_ascii=False).encode()


class DigestDesk:
    """Gathers the alarms of all valves of a process, and composes one letter a day for a receiver.

    Which valves belong together is said by a group, such as an address and an hour. What is heard
    of a valve counts until it says otherwise. A time that goes by while nobody asks, because the
    process is not running, is left out.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._groups: dict[Hashable, dict[tuple[str, str], Mapping[AlarmKind, Alarm]]] = {}
        self._seen: dict[Hashable, float] = {}

    def hear(
        self,
        group: Hashable,
        hour: float,
        valve: tuple[str, str],
        alarms: Mapping[AlarmKind, Alarm],
        now: float,
    ) -> AlarmDigest | None:
        """Take the alarms of a valve; return the letter where its time has come, once.

        Parameters
        ----------
        group : hashable
            What the receivers of a letter have in common.
        hour : float
            Time of the letter, h since midnight, UTC; below 0: none.
        valve : tuple of str
            Tag, and name of the identifier.
        alarms : mapping of AlarmKind to Alarm
            Its alarms now.
        now : float
            s since 1970 (UTC).
        """
        key = (group, hour)
        with self._lock:
            for other, valves in self._groups.items():
                if other != key:
                    valves.pop(valve, None)
            if hour < 0:
                return None
            self._groups.setdefault(key, {})[valve] = dict(alarms)
            begun = (now - 3600 * hour) // _DAY  # days, each from one letter to the next
            before = self._seen.get(key, begun)
            self._seen[key] = max(begun, before)
            if begun <= before:
                return None
            return AlarmDigest(datetime.fromtimestamp(now, timezone.utc), dict(self._groups[key]))
