# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is told of the alarms of many valves once a day."""

import json
import threading
import uuid
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from datetime import datetime, timezone

from valve_friction_ros.health.alarms import Alarm, AlarmKind
from valve_friction_ros.health.levels import Level
from valve_friction_ros.wording import utc_second

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
