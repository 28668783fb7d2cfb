"""What an alert says."""

import json
import math
import uuid
from dataclasses import dataclass, field
from datetime import datetime, timezone

from valve_friction_ros.health import Level

__all__ = ["Alert"]


def _now() -> datetime:
    return datetime.now(timezone.utc)


def _new_id() -> str:
    return uuid.uuid4().hex


@dataclass(frozen=True)
class Alert:
    """A change of the level of a valve.

    Attributes
    ----------
    valve : str
        Tag of the valve.
    node : str
        Name of its identifier, fully qualified.
    old_level, new_level : Level
        The level that was told last, and that of now.
    ne_107 : str
        Status signal of NE 107; empty: good.
    message : str
        The message of the diagnosis.
    friction_ratio : float or None
        Friction over its baseline; None or nan where it is not known.
    time : datetime
        When the level was seen, by the system's clock, UTC.
    event_id : str
        The same at each try, so that a receiver counts an event once.
    """

    valve: str
    node: str
    old_level: Level
    new_level: Level
    ne_107: str
    message: str
    friction_ratio: float | None = None
    time: datetime = field(default_factory=_now)
    event_id: str = field(default_factory=_new_id)

    def body(self) -> bytes:
        """Return the alert as JSON: the attributes by name, the time after ISO 8601."""
        ratio = self.friction_ratio
        content = {
            "event_id": self.event_id,
            "time": self.time.astimezone(timezone.utc).isoformat(timespec="milliseconds"),
            "valve": self.valve,
            "node": self.node,
            "old_level": self.old_level.name,
            "new_level": self.new_level.name,
            "ne_107": self.ne_107,
            "message": self.message,
            "friction_ratio": None if ratio is None or not math.isfinite(ratio) else ratio,
        }
        return json.dumps(content, ensure_ascii=False).encode()
