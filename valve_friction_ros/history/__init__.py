"""The history of a valve: its database, and the trend of its friction; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.history.alarm_rows import (
        AlarmRecording,
        alarm_recordings,
        keep_alarm_recording,
    )
    from valve_friction_ros.history.answer_rows import keep_answers, read_answers
    from valve_friction_ros.history.copying import CopiedPart, Sender, SentState, copied, sender_of
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
    from valve_friction_ros.history.reader import History
    from valve_friction_ros.history.recent_ratios import (
        HistoryMark,
        KeptRatio,
        history_mark,
        ratios_after,
    )
    from valve_friction_ros.history.schema import Place
    from valve_friction_ros.history.server.address import (
        URL_VARIABLE,
        HistoryServer,
        is_url,
        server_from,
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
    from valve_friction_ros.history.valve_history import (
        ValveHistory,
        current_trend,
        valve_histories,
    )
else:
    __getattr__ = names_on_demand(__name__)

__all__ = [
    "LIMIT_NAMES",
    "MONTH",
    "URL_VARIABLE",
    "AlarmRecording",
    "CopiedPart",
    "Crossing",
    "FrictionPoint",
    "History",
    "HistoryEntry",
    "HistoryError",
    "HistoryFile",
    "HistoryMark",
    "HistoryServer",
    "KeptBaseline",
    "KeptRatio",
    "KeptValve",
    "Limit",
    "Place",
    "Sender",
    "SentState",
    "Trend",
    "ValveHistory",
    "alarm_recordings",
    "copied",
    "current_trend",
    "drift_text",
    "end_of_trend",
    "entry_of",
    "forget_moves_after",
    "friction_of",
    "history_mark",
    "is_url",
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
    "sender_of",
    "server_from",
    "trend_of",
    "trended",
    "valve_histories",
]
