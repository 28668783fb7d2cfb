# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Life cycle of an alarm after ISA-18.2 and IEC 62682: states, transitions and events.

A valve has six alarms. Each has a *condition*, which the valve shows, and a *state*, which records
the handling of the condition: raised, acknowledged, shelved, returned. Each step is an
`AlarmEvent`. It holds the complete alarm from then on, so the last event gives the present alarm.
"""

import json
import math
import threading
import uuid
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timezone
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

from valve_friction_ros.health.levels import Level, StatusSignal
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.outside_text import printable
from valve_friction_ros.wording import alarm_advice, utc_minute, utc_second


class AlarmKind(Enum):
    """Subject of an alarm; the value is its name in files and on the ROS graph."""

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
    """State of an alarm, with the letters of ISA-18.2."""

    NORMAL = "normal"
    """A: inactive, no action required."""
    UNACKNOWLEDGED = "unacknowledged"
    """B: active, not acknowledged."""
    ACKNOWLEDGED = "acknowledged"
    """C: active, acknowledged."""
    RETURNED = "returned unacknowledged"
    """D: returned to normal before it was acknowledged."""
    SHELVED = "shelved"
    """G: suppressed by a person until a set time."""
    OUT_OF_SERVICE = "out of service"
    """I: the valve is under maintenance until a set time."""

    @property
    def is_suppressed(self) -> bool:
        """Whether nobody is notified, whatever the valve shows."""
        return self in (AlarmState.SHELVED, AlarmState.OUT_OF_SERVICE)

    @property
    def needs_answer(self) -> bool:
        """Whether it waits for an acknowledgement."""
        return self in (AlarmState.UNACKNOWLEDGED, AlarmState.RETURNED)


class AlarmAction(Enum):
    """Action on an alarm by the valve, the clock or a person."""

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
        """Whether a named person does it."""
        by_valve = (AlarmAction.RAISE, AlarmAction.WORSEN, AlarmAction.EASE, AlarmAction.CLEAR)
        return self not in (*by_valve, AlarmAction.EXPIRE)


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
"""The state after each action that a state allows.

None: the condition decides; unacknowledged where it is active, else normal.
"""

_HOUR = 3_600_000_000_000
LONGEST_SHELVING = 30 * 24 * _HOUR
"""Longest time of shelving, ns. Chosen: a forgotten alarm comes back."""
LONGEST_ABSENCE = 366 * 24 * _HOUR
"""Longest time, ns, out of service. Chosen: a turnaround is planned for less than a year ahead."""
_SKEW = 24 * _HOUR
"""Chosen: clocks that differ by more than this, ns, have been set."""
_LONGEST_NAME, _LONGEST_TEXT = 80, 500


class AlarmError(ValueError):
    """A refused request, explained in one line to the person who made it."""


class Condition(NamedTuple):
    """The present condition of an alarm.

    Attributes
    ----------
    level : Level
        Severity; OK where it is inactive.
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
    """An alarm since its last event.

    Attributes
    ----------
    kind : AlarmKind
        Its subject.
    state : AlarmState
        Its state.
    condition : Condition
        The condition that the valve shows, also while the alarm is shelved; inactive once returned.
    raised : int or None
        When it was last raised, ns since 1970 (UTC); None if never.
    until : int or None
        End of shelving or of the time out of service, ns; None in the other states.
    message : str
        The message of the condition when it was raised or last changed level.

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
        if self.state.is_suppressed != (self.until is not None):
            raise ValueError(f"an alarm that is {self.state.value} until {self.until}")
        shows = self.is_active
        if (self.state in _SHOWN and not shows) or (self.state in _GONE and shows):
            raise ValueError(f"an alarm that is {self.state.value} at {self.condition.level.name}")

    @property
    def is_active(self) -> bool:
        """Whether its condition is active."""
        return self.condition.level > Level.OK

    @property
    def is_told(self) -> bool:
        """Whether people are notified of it: it is active and not suppressed."""
        return self.is_active and not self.state.is_suppressed

    @property
    def advice(self) -> str:
        """What to do about it, as a sentence."""
        return alarm_advice(self.kind.value, self.condition.level.name)

    @property
    def standing(self) -> str:
        """Its state, and the end of a suppression."""
        end = "" if self.until is None else f" until {utc_minute(self.until)}"
        return f"{self.state.value}{end}"

    def has_expired(self, time: int) -> bool:
        """Return whether shelving or the time out of service has ended by a time, ns.

        One that ends later than anybody may ask for was begun by a clock that has been set back
        since: it would suppress the alarm for years.
        """
        if self.until is None:
            return False
        is_shelved = self.state is AlarmState.SHELVED
        longest = LONGEST_SHELVING if is_shelved else LONGEST_ABSENCE
        return not 0 < self.until - time <= longest + _SKEW

    def __str__(self) -> str:
        """Return its kind and standing on one line."""
        return f"{self.kind.words}: {self.standing}"


_SHOWN = (AlarmState.UNACKNOWLEDGED, AlarmState.ACKNOWLEDGED)
_GONE = (AlarmState.NORMAL, AlarmState.RETURNED)


class AlarmEvent(NamedTuple):
    """One step of an alarm.

    Attributes
    ----------
    time : int
        When, ns since 1970 (UTC).
    action : AlarmAction
        What happened.
    before : AlarmState
        The state until then.
    alarm : Alarm
        The alarm from then on.
    who, text : str
        The person and their comment; empty where the valve or the clock acted.
    """

    time: int
    action: AlarmAction
    before: AlarmState
    alarm: Alarm
    who: str = ""
    text: str = ""


@equal_by_fields
@dataclass(frozen=True)
class AlarmRequest:
    """A person's request to an alarm.

    Attributes
    ----------
    action : AlarmAction
        Acknowledge, shelve, unshelve, take out of service, put back or comment.
    who : str
        Name of the person.
    text : str
        Their comment; required by the action to comment.
    duration : float
        Duration of shelving or of the time out of service, s; unused by the other actions.

    Raises
    ------
    AlarmError
        If the action is not a person's, the name is empty, a required comment is missing, a text is
        not one line of plain text, or the duration is out of bounds.
    """

    action: AlarmAction
    who: str
    text: str = ""
    duration: float = math.nan

    def __post_init__(self) -> None:
        if not self.action.is_of_person:
            raise AlarmError(f"an alarm is {self.action.value} by the valve, not by request")
        for name, longest in (("who", _LONGEST_NAME), ("text", _LONGEST_TEXT)):
            given = getattr(self, name).strip()
            if len(given) > longest or given != printable(given, longest):
                raise AlarmError(f"{name} must be one line of at most {longest} characters")
            object.__setattr__(self, name, given)
        if not self.who:
            raise AlarmError("who is empty: state your name")
        if self.action is AlarmAction.COMMENT and not self.text:
            raise AlarmError("the comment is empty: write one")
        if (longest_time := _LONGEST.get(self.action)) is None:
            return
        if not 0 < self.duration * 1e9 <= longest_time:
            raise AlarmError(
                f"an alarm cannot be {self.action.value} for {self.duration / 3600:g} h: give a "
                f"duration above 0 and up to {longest_time // _HOUR} h"
            )


_LONGEST = {AlarmAction.SHELVE: LONGEST_SHELVING, AlarmAction.TAKE_OUT: LONGEST_ABSENCE}


def _following(alarm: Alarm, action: AlarmAction, condition: Condition) -> AlarmState:
    """Return the state after an action, where the condition decides if the table does not."""
    state = TRANSITIONS[alarm.state, action]
    if state is None:
        return AlarmState.UNACKNOWLEDGED if condition.level else AlarmState.NORMAL
    return state


def _stepped(alarm: Alarm, action: AlarmAction, time: int, condition: Condition) -> AlarmEvent:
    state = _following(alarm, action, condition)
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
    """Return the events of the clock and the valve on an alarm at a time, ns: none, one or two."""
    events = []
    if alarm.has_expired(time):
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
    """Return the event of a person's request at a time, ns since 1970 (UTC).

    A person cannot answer an alarm before it was raised. Where the clock of the valve is ahead of
    the requester's, the event takes the time at which the alarm was raised.

    Raises AlarmError if the state of the alarm does not allow the action.
    """
    action = request.action
    if (alarm.state, action) not in TRANSITIONS:
        allowed = [do for do in AlarmAction if do.is_of_person and (alarm.state, do) in TRANSITIONS]
        possible = ", ".join(do.value for do in allowed)
        raise AlarmError(f"{alarm} and cannot be {action.value} now: it can be {possible}")
    time = max(time, alarm.raised or time)
    state = _following(alarm, action, alarm.condition)
    until = alarm.until if state.is_suppressed else None
    if action in _LONGEST:
        until = time + round(request.duration * 1e9)
    after = replace(alarm, state=state, until=until)
    return AlarmEvent(time, action, alarm.state, after, request.who, request.text)


def all_followed(
    alarms: Mapping[AlarmKind, Alarm], conditions: Mapping[AlarmKind, Condition], time: int
) -> tuple[AlarmEvent, ...]:
    """Return the events of the clock and the valve on all its alarms (`followed_by`).

    Only the clock acts on an alarm that `conditions` does not name.
    """
    events: list[AlarmEvent] = []
    for kind in AlarmKind:
        alarm = alarms.get(kind, Alarm(kind))
        events += followed_by(alarm, conditions.get(kind, alarm.condition), time)
    return tuple(events)


def all_requested(
    alarms: Mapping[AlarmKind, Alarm], kind: AlarmKind | None, request: AlarmRequest, time: int
) -> tuple[AlarmEvent, ...]:
    """Return the events of a person's request to one alarm of a valve, or to all that allow it.

    A request to all skips normal alarms, unless it takes the valve out of service.

    Raises AlarmError if the alarm named, or every alarm, does not allow the action.
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
        standing = alarm_summary(alarms.get(one, Alarm(one)) for one in AlarmKind)
        raise AlarmError(f"no alarm can be {request.action.value} now: {standing}")
    return tuple(requested(one, request, time) for one in possible)


def alarm_summary(
    alarms: Iterable[Alarm], standing: Callable[[Alarm], str] = lambda one: one.standing
) -> str:
    """Return one line with the alarms of a valve, those in the same state together."""
    kinds: defaultdict[str, list[str]] = defaultdict(list)
    for one in alarms:
        kinds[standing(one)].append(one.kind.words)
    return "; ".join(
        f"all alarms of the valve are {state}"
        if len(some) == len(AlarmKind)
        else f"{', '.join(some)}: {state}"
        for state, some in kinds.items()
    )


_DAY = 86_400.0


@dataclass(frozen=True)
class AlarmDigest:
    """The alarms of several valves at a time, in one message.

    Attributes
    ----------
    time : datetime
        Time, UTC.
    alarms : mapping of (str, str) to mapping of AlarmKind to Alarm
        Alarms by tag and identifier name of each valve.
    event_id : str
        The same on each delivery attempt, so that a receiver can drop duplicates.
    """

    time: datetime
    alarms: Mapping[tuple[str, str], Mapping[AlarmKind, Alarm]]
    event_id: str = field(default_factory=lambda: uuid.uuid4().hex)

    @property
    def new_level(self) -> None:
        """None: a digest reports no change of level."""

    @property
    def title(self) -> str:
        """Name of the digest in the report of a failed delivery."""
        return f"the digest of {self.time:%Y-%m-%d %H:%M:%S} UTC"

    def body(self) -> bytes:
        """Return the active or unanswered alarms as JSON, with the number of suppressed alarms."""
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
    """Collects the alarms of all valves of a process for one daily digest per receiver.

    Valves with the same group, such as an address, and the same hour share a digest. The last
    alarms heard of a valve hold until it sends others. A digest that falls due while the process is
    not running is skipped.
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
        """Take the alarms of a valve; return the digest, once, when it is due.

        Parameters
        ----------
        group : hashable
            Identifies the receivers of a digest.
        hour : float
            Time of the digest, h since midnight, UTC; below 0 for no digest.
        valve : tuple of str
            Tag and identifier name.
        alarms : mapping of AlarmKind to Alarm
            Its present alarms.
        now : float
            Present time, s since 1970 (UTC).
        """
        key = (group, hour)
        with self._lock:
            for other, valves in self._groups.items():
                if other != key:
                    valves.pop(valve, None)
            if hour < 0:
                return None
            self._groups.setdefault(key, {})[valve] = dict(alarms)
            begun = (now - 3600 * hour) // _DAY  # days, each from one digest to the next
            before = self._seen.get(key, begun)
            self._seen[key] = max(begun, before)
            if begun <= before:
                return None
            return AlarmDigest(datetime.fromtimestamp(now, timezone.utc), dict(self._groups[key]))
