"""The history of a valve: its database, and the trend of its friction; no ROS."""

from valve_friction_ros.history.entry import (
    FrictionPoint,
    HistoryEntry,
    KeptBaseline,
    KeptValve,
    entry_of,
    trended,
)
from valve_friction_ros.history.evidence_rows import keep_moves, read_moves
from valve_friction_ros.history.file import HistoryError, HistoryFile
from valve_friction_ros.history.trend import MONTH, Crossing, Limit, Trend, trend_of
from valve_friction_ros.history.valve_history import ValveHistory, current_trend, valve_histories

__all__ = [
    "MONTH",
    "Crossing",
    "FrictionPoint",
    "HistoryEntry",
    "HistoryError",
    "HistoryFile",
    "KeptBaseline",
    "KeptValve",
    "Limit",
    "Trend",
    "ValveHistory",
    "current_trend",
    "entry_of",
    "keep_moves",
    "read_moves",
    "trend_of",
    "trended",
    "valve_histories",
]
