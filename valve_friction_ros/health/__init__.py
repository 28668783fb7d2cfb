# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Health of a valve: its baseline, its diagnosis, and the monitor of one valve; no ROS."""

from valve_friction_ros.health.alarm_conditions import Delay, FrictionHold
from valve_friction_ros.health.alarm_digest import AlarmDigest, DigestDesk
from valve_friction_ros.health.alarms import (
    Alarm,
    AlarmAction,
    AlarmError,
    AlarmEvent,
    AlarmKind,
    AlarmRequest,
    AlarmState,
    Condition,
)
from valve_friction_ros.health.baseline import (
    Baseline,
    BaselineLack,
    BaselineRefusalError,
    Lack,
    SlidingFriction,
)
from valve_friction_ros.health.by_evidence import (
    Reference,
    baseline_by_evidence,
    diagnosis_by_evidence,
    lack_of_moves,
    reference_by_evidence,
    why_not_compared,
)
from valve_friction_ros.health.common_factor import drive_scale, explains, qualified
from valve_friction_ros.health.comparison import Comparison, Ratio, carried, compared, friction_name
from valve_friction_ros.health.diagnosis import (
    Diagnosis,
    EarlierEstimate,
    FrictionLimits,
    FrictionState,
    Side,
    StandingAlarm,
    dead_band,
    dead_band_half_width,
    diagnose,
    diagnose_again,
    leading_ratio,
)
from valve_friction_ros.health.friction_monitor import (
    FrictionMonitor,
    IdentificationInput,
    MonitorSettings,
    identify_snapshot,
    identify_with_numbers,
)
from valve_friction_ros.health.known_numbers import KnownNumbers
from valve_friction_ros.health.levels import Finding, Level, StatusSignal, by_severity
from valve_friction_ros.health.measured import DatedNumber, Measured
from valve_friction_ros.health.refused_record import RefusedRecordError
from valve_friction_ros.health.standstill import Standstill, StandstillCounter, standstill_finding
from valve_friction_ros.health.survey import Survey, SurveyLimits, surveyed
from valve_friction_ros.health.valve_changes import valve_changes
from valve_friction_ros.health.valve_diagnosis import (
    ValveDiagnosis,
    diagnose_numbers,
    diagnose_parameters,
    diagnose_valve,
)
from valve_friction_ros.health.valve_limits import ValveLimits
from valve_friction_ros.health.valve_numbers import OF_ONE_RESULT, comparable_numbers, valve_numbers

__all__ = [
    "OF_ONE_RESULT",
    "Alarm",
    "AlarmAction",
    "AlarmDigest",
    "AlarmError",
    "AlarmEvent",
    "AlarmKind",
    "AlarmRequest",
    "AlarmState",
    "Baseline",
    "BaselineLack",
    "BaselineRefusalError",
    "Comparison",
    "Condition",
    "DatedNumber",
    "Delay",
    "Diagnosis",
    "DigestDesk",
    "EarlierEstimate",
    "Finding",
    "FrictionHold",
    "FrictionLimits",
    "FrictionMonitor",
    "FrictionState",
    "IdentificationInput",
    "KnownNumbers",
    "Lack",
    "Level",
    "Measured",
    "MonitorSettings",
    "Ratio",
    "Reference",
    "RefusedRecordError",
    "Side",
    "SlidingFriction",
    "StandingAlarm",
    "Standstill",
    "StandstillCounter",
    "StatusSignal",
    "Survey",
    "SurveyLimits",
    "ValveDiagnosis",
    "ValveLimits",
    "baseline_by_evidence",
    "by_severity",
    "carried",
    "comparable_numbers",
    "compared",
    "dead_band",
    "dead_band_half_width",
    "diagnose",
    "diagnose_again",
    "diagnose_numbers",
    "diagnose_parameters",
    "diagnose_valve",
    "diagnosis_by_evidence",
    "drive_scale",
    "explains",
    "friction_name",
    "identify_snapshot",
    "identify_with_numbers",
    "lack_of_moves",
    "leading_ratio",
    "qualified",
    "reference_by_evidence",
    "standstill_finding",
    "surveyed",
    "valve_changes",
    "valve_numbers",
    "why_not_compared",
]
