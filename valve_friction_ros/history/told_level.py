"""The level of a valve that its alerts have told last, in the history."""

from valve_friction_ros.health.levels import Level
from valve_friction_ros.history.connection import has_table
from valve_friction_ros.history.entry import KeptValve
from valve_friction_ros.history.file import HistoryFile
from valve_friction_ros.history.reader import History
from valve_friction_ros.history.rows import valve_id
from valve_friction_ros.history.schema import HistoryError, reading, writing

__all__ = ["keep_told_level", "read_told_level"]


def keep_told_level(file: HistoryFile, valve: KeptValve, level: Level) -> None:
    """Keep the level that was told last; raises HistoryError if it cannot be written."""
    with writing(file.path) as connection:
        connection.execute(
            "INSERT INTO told_level (valve_id, level) VALUES (?, ?) "
            "ON CONFLICT (valve_id) DO UPDATE SET level = excluded.level",
            (valve_id(connection, valve), int(level)),
        )


def read_told_level(file: History, valve: str) -> Level | None:
    """Return the level that was told last of the valve of this name, if any.

    Raises HistoryError if the file cannot be read.
    """
    with reading(file.place) as connection:
        if not has_table(connection, "told_level"):
            return None
        row = connection.execute(
            "SELECT level FROM told_level JOIN valve ON valve.id = valve_id WHERE name = ?",
            (valve,),
        ).fetchone()
    try:
        return None if row is None else Level(row[0])
    except ValueError as error:
        raise HistoryError(f"{file.place}: a row holds no level: {error}") from None
