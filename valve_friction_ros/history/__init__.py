# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The history of a valve: its database, and the trend of its friction; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.history.alarm_rows import (
        AlarmFeed,
        AlarmFilter,
        AlarmSteps,
        KeptAlarmEvent,
        alarm_events,
        alarm_feed,
        alarms_as_csv,
        area_of,
        follow_alarms,
        read_alarms,
        request_alarms,
        request_many,
        standing_alarms,
    )
    from valve_friction_ros.history.copying import (
        CopiedPart,
        copied,
    )
    from valve_friction_ros.history.entry import (
        AlarmRecording,
        HistoryEntry,
        KeptBaseline,
        KeptValve,
        entry_of,
        trended,
    )
    from valve_friction_ros.history.history import (
        History,
        HistoryFile,
        HistoryMark,
        KeptRatio,
        history_mark,
        ratios_after,
    )
    from valve_friction_ros.history.outbox import (
        Sender,
        SentState,
        sender_of,
    )
    from valve_friction_ros.history.place import (
        URL_VARIABLE,
        HistoryError,
        HistoryServer,
        Place,
        is_url,
        server_from,
    )
    from valve_friction_ros.history.service_rows import (
        alarm_recordings,
        current_trend,
        forget_moves_after,
        keep_alarm_recording,
        keep_answers,
        keep_change,
        keep_moves,
        keep_reference,
        keep_renewal,
        keep_told_level,
        keep_usage,
        read_answers,
        read_change,
        read_moves,
        read_reference,
        read_told_level,
        read_usage,
        valve_histories,
    )
    from valve_friction_ros.history.trend import (
        LIMIT_NAMES,
        MONTH,
        Crossing,
        Limit,
        Trend,
        ValveHistory,
        drift_text,
        end_of_trend,
        friction_of,
        trend_of,
    )
else:
    __getattr__ = names_on_demand(__name__)

__all__ = [
    "LIMIT_NAMES",
    "MONTH",
    "URL_VARIABLE",
    "AlarmFeed",
    "AlarmFilter",
    "AlarmRecording",
    "AlarmSteps",
    "CopiedPart",
    "Crossing",
    "History",
    "HistoryEntry",
    "HistoryError",
    "HistoryFile",
    "HistoryMark",
    "HistoryServer",
    "KeptAlarmEvent",
    "KeptBaseline",
    "KeptRatio",
    "KeptValve",
    "Limit",
    "Place",
    "Sender",
    "SentState",
    "Trend",
    "ValveHistory",
    "alarm_events",
    "alarm_feed",
    "alarm_recordings",
    "alarms_as_csv",
    "area_of",
    "copied",
    "current_trend",
    "drift_text",
    "end_of_trend",
    "entry_of",
    "follow_alarms",
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
    "read_alarms",
    "read_answers",
    "read_change",
    "read_moves",
    "read_reference",
    "read_told_level",
    "read_usage",
    "request_alarms",
    "request_many",
    "sender_of",
    "server_from",
    "standing_alarms",
    "trend_of",
    "trended",
    "valve_histories",
]
