"""Ratios of a plant's valves in the history, read from where one has stopped before."""

from typing import NamedTuple

from valve_friction_ros.history.file import HistoryFile
from valve_friction_ros.history.schema import reading

__all__ = ["KeptRatio", "ratios_after"]


class KeptRatio(NamedTuple):
    """Friction of a valve over its baseline, and the row, valve's name and time (ns) of it."""

    row: int
    valve: str
    time: int
    ratio: float


def ratios_after(file: HistoryFile, row: int, since: int) -> tuple[KeptRatio, ...]:
    """Return the ratios of all valves in rows after one, made since a time, ns; oldest row first.

    Raises HistoryError if the file cannot be read.
    """
    with reading(file.path) as connection:
        rows = connection.execute(
            "SELECT identification.id, valve.name, time_ns, ratio FROM identification "
            "JOIN valve ON valve.id = valve_id "
            "WHERE identification.id > ? AND time_ns >= ? AND ratio IS NOT NULL "
            "ORDER BY identification.id",
            (row, since),
        ).fetchall()
    return tuple(KeptRatio(*one) for one in rows)
