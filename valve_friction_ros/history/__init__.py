"""The history of a valve: its database, and the trend of its friction; no ROS."""

from valve_friction_ros.history.alarm_rows import (
    AlarmRecording,
    alarm_recordings,
    keep_alarm_recording,
)
from valve_friction_ros.history.answer_rows import keep_answers, read_answers
from valve_friction_ros.history.entry import (
    FrictionPoint,
    HistoryEntry,
    KeptBaseline,
    KeptValve,
    entry_of,
    trended,
)
from valve_friction_ros.history.evidence_rows import (
    forget_moves_after,
    keep_change,
    keep_moves,
    keep_reference,
    read_change,
    read_moves,
    read_reference,
)
from valve_friction_ros.history.file import HistoryError, HistoryFile
from valve_friction_ros.history.recent_ratios import (
    HistoryMark,
    KeptRatio,
    history_mark,
    ratios_after,
)
from valve_friction_ros.history.told_level import keep_told_level, read_told_level
from valve_friction_ros.history.trend import MONTH, Crossing, Limit, Trend, trend_of
from valve_friction_ros.history.trend_words import (
    LIMIT_NAMES,
    drift_text,
    end_of_trend,
    friction_of,
)
from valve_friction_ros.history.usage_rows import keep_renewal, keep_usage, read_usage
from valve_friction_ros.history.valve_history import ValveHistory, current_trend, valve_histories

__all__ = [
    "LIMIT_NAMES",
    "MONTH",
    "AlarmRecording",
    "Crossing",
    "FrictionPoint",
    "HistoryEntry",
    "HistoryError",
    "HistoryFile",
    "HistoryMark",
    "KeptBaseline",
    "KeptRatio",
    "KeptValve",
    "Limit",
    "Trend",
    "ValveHistory",
    "alarm_recordings",
    "current_trend",
    "drift_text",
    "end_of_trend",
    "entry_of",
    "forget_moves_after",
    "friction_of",
    "history_mark",
    "keep_alarm_recording",
    "keep_answers",
    "keep_change",
    "keep_moves",
    "keep_reference",
    "keep_renewal",
    "keep_told_level",
    "keep_usage",
    "ratios_after",
    "read_answers",
    "read_change",
    "read_moves",
    "read_reference",
    "read_told_level",
    "read_usage",
    "trend_of",
    "trended",
    "valve_histories",
]
