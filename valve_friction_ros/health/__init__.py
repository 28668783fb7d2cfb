# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Health of a valve: baseline, diagnosis, alarms and the monitor of one valve; no ROS."""

from valve_friction_ros.health.alarm_conditions import (
    Delay as Delay,
    FrictionHold as FrictionHold,
)
from valve_friction_ros.health.alarms import (
    Alarm as Alarm,
    AlarmAction as AlarmAction,
    AlarmDigest as AlarmDigest,
    AlarmError as AlarmError,
    AlarmEvent as AlarmEvent,
    AlarmKind as AlarmKind,
    AlarmRequest as AlarmRequest,
    AlarmState as AlarmState,
    Condition as Condition,
    DigestDesk as DigestDesk,
)
from valve_friction_ros.health.baseline import (
    Baseline as Baseline,
    BaselineLack as BaselineLack,
    BaselineRefusalError as BaselineRefusalError,
    Lack as Lack,
    SlidingFriction as SlidingFriction,
)
from valve_friction_ros.health.by_evidence import (
    Reference as Reference,
    baseline_by_evidence as baseline_by_evidence,
    diagnosis_by_evidence as diagnosis_by_evidence,
    lack_of_moves as lack_of_moves,
    reference_by_evidence as reference_by_evidence,
    why_not_compared as why_not_compared,
)
from valve_friction_ros.health.comparison import (
    Comparison as Comparison,
    Ratio as Ratio,
    carried as carried,
    compared as compared,
    friction_name as friction_name,
)
from valve_friction_ros.health.diagnosis import (
    Diagnosis as Diagnosis,
    EarlierEstimate as EarlierEstimate,
    FrictionLimits as FrictionLimits,
    FrictionState as FrictionState,
    Side as Side,
    StandingAlarm as StandingAlarm,
    dead_band as dead_band,
    dead_band_half_width as dead_band_half_width,
    diagnose as diagnose,
    diagnose_again as diagnose_again,
    leading_ratio as leading_ratio,
)
from valve_friction_ros.health.friction_monitor import (
    FrictionMonitor as FrictionMonitor,
    IdentificationInput as IdentificationInput,
    MonitorSettings as MonitorSettings,
    identify_snapshot as identify_snapshot,
    identify_with_numbers as identify_with_numbers,
)
from valve_friction_ros.health.levels import (
    Finding as Finding,
    Level as Level,
    StatusSignal as StatusSignal,
    Survey as Survey,
    SurveyLimits as SurveyLimits,
    by_severity as by_severity,
    surveyed as surveyed,
)
from valve_friction_ros.health.measured import (
    DatedNumber as DatedNumber,
    Measured as Measured,
    valve_changes as valve_changes,
)
from valve_friction_ros.health.standstill import (
    Standstill as Standstill,
    StandstillCounter as StandstillCounter,
    standstill_finding as standstill_finding,
)
from valve_friction_ros.health.valve_diagnosis import (
    KnownNumbers as KnownNumbers,
    ValveDiagnosis as ValveDiagnosis,
    ValveLimits as ValveLimits,
    diagnose_numbers as diagnose_numbers,
    diagnose_valve as diagnose_valve,
    drive_scale as drive_scale,
    explains as explains,
    qualified as qualified,
)
from valve_friction_ros.health.valve_numbers import (
    OF_ONE_RESULT as OF_ONE_RESULT,
    RefusedRecordError as RefusedRecordError,
    comparable_numbers as comparable_numbers,
    valve_numbers as valve_numbers,
)
