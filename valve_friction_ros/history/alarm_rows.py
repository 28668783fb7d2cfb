"""The recordings of alarms in the history."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from valve_friction_ros.health.levels import Level
from valve_friction_ros.history.connection import has_table
from valve_friction_ros.history.entry import KeptValve
from valve_friction_ros.history.file import HistoryFile
from valve_friction_ros.history.reader import History
from valve_friction_ros.history.retention import forget_older
from valve_friction_ros.history.rows import valve_id
from valve_friction_ros.history.schema import HistoryError, reading, writing

__all__ = ["AlarmRecording", "alarm_recordings", "keep_alarm_recording"]


@dataclass(frozen=True)
class AlarmRecording:
    """The record that was saved when the level of a valve had risen.

    Attributes
    ----------
    time : int
        When the level rose, ns since 1970 (UTC).
    level : Level
        The level from then on.
    path : Path
        The bag, with the page of the report in its folder; it may have been removed since.
    message : str
        The diagnosis of that time.
    """

    time: int
    level: Level
    path: Path
    message: str

    def to_dict(self) -> dict[str, Any]:
        """Return a mapping of plain values; the time is ns since 1970 (UTC)."""
        return {
            "time": self.time,
            "level": self.level.name,
            "path": str(self.path),
            "message": self.message,
        }


def keep_alarm_recording(
    file: HistoryFile, valve: KeptValve, one: AlarmRecording, days: float = 0.0
) -> None:
    """Keep that an alarm was recorded; delete those of its valve `days` older, none for 0.

    Raises HistoryError if it cannot be written.
    """
    with writing(file.path) as connection:
        row = valve_id(connection, valve)
        connection.execute(
            "DELETE FROM alarm_recording WHERE valve_id = ? AND time_ns = ?", (row, one.time)
        )
        connection.execute(
            "INSERT OR REPLACE INTO alarm_recording (valve_id, time_ns, level, path, message) "
            "VALUES (?, ?, ?, ?, ?)",
            (row, one.time, int(one.level), str(one.path), one.message),
        )
        forget_older(connection, "alarm_recording", "time_ns", row, one.time, days)


def alarm_recordings(file: History, valve: str) -> tuple[AlarmRecording, ...]:
    """Return the recordings of the valve of this name, oldest first; an older file holds none.

    Raises HistoryError if the file cannot be read.
    """
    with reading(file.place) as connection:
        if not has_table(connection, "alarm_recording"):
            return ()
        rows = connection.execute(
            "SELECT time_ns, level, path, message FROM alarm_recording "
            "JOIN valve ON valve.id = valve_id WHERE name = ? ORDER BY time_ns, path",
            (valve,),
        ).fetchall()
    try:
        return tuple(
            AlarmRecording(time, Level(level), Path(path), message)
            for time, level, path, message in rows
        )
    except (TypeError, ValueError) as error:
        raise HistoryError(f"{file.place}: a row holds no recording: {error}") from None
