# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""History of a valve: its database and the trend of its friction; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.history.alarm_rows import (
        AlarmFeed as AlarmFeed,
        AlarmFilter as AlarmFilter,
        AlarmSteps as AlarmSteps,
        KeptAlarmEvent as KeptAlarmEvent,
        alarm_events as alarm_events,
        alarm_feed as alarm_feed,
        alarms_as_csv as alarms_as_csv,
        follow_alarms as follow_alarms,
        read_alarms as read_alarms,
        request_alarms as request_alarms,
        request_many as request_many,
        suppression_ends as suppression_ends,
    )
    from valve_friction_ros.history.copying import CopiedPart as CopiedPart, copied as copied
    from valve_friction_ros.history.entry import (
        AlarmRecording as AlarmRecording,
        HistoryEntry as HistoryEntry,
        KeptBaseline as KeptBaseline,
        KeptValve as KeptValve,
        entry_of as entry_of,
        trended as trended,
    )
    from valve_friction_ros.history.history import (
        History as History,
        HistoryFile as HistoryFile,
        HistoryMark as HistoryMark,
        KeptRatio as KeptRatio,
        LastState as LastState,
        history_mark as history_mark,
        last_states as last_states,
        ratios_after as ratios_after,
    )
    from valve_friction_ros.history.outbox import (
        Sender as Sender,
        SentState as SentState,
        sender_of as sender_of,
    )
    from valve_friction_ros.history.place import (
        URL_VARIABLE as URL_VARIABLE,
        HistoryError as HistoryError,
        HistoryServer as HistoryServer,
        Place as Place,
        is_url as is_url,
        server_from as server_from,
    )
    from valve_friction_ros.history.service_rows import (
        alarm_recordings as alarm_recordings,
        current_trend as current_trend,
        forget_moves_after as forget_moves_after,
        keep_alarm_recording as keep_alarm_recording,
        keep_answers as keep_answers,
        keep_change as keep_change,
        keep_moves as keep_moves,
        keep_reference as keep_reference,
        keep_renewal as keep_renewal,
        keep_told_level as keep_told_level,
        keep_usage as keep_usage,
        read_answers as read_answers,
        read_change as read_change,
        read_moves as read_moves,
        read_reference as read_reference,
        read_told_level as read_told_level,
        read_usage as read_usage,
        valve_histories as valve_histories,
    )
    from valve_friction_ros.history.trend import (
        LIMIT_NAMES as LIMIT_NAMES,
        MONTH as MONTH,
        Crossing as Crossing,
        Limit as Limit,
        Trend as Trend,
        ValveHistory as ValveHistory,
        drift_text as drift_text,
        end_of_trend as end_of_trend,
        friction_of as friction_of,
        trend_of as trend_of,
    )
else:
    __getattr__ = names_on_demand(__name__)
