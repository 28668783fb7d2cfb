"""Health of a valve: its baseline, its diagnosis, and the monitor of one valve; no ROS."""

from valve_friction_ros.health.baseline import Baseline, SlidingFriction
from valve_friction_ros.health.by_evidence import (
    Reference,
    baseline_by_evidence,
    diagnosis_by_evidence,
    reference_by_evidence,
    why_not_compared,
)
from valve_friction_ros.health.common_factor import drive_scale, explains, qualified
from valve_friction_ros.health.comparison import (
    Comparison,
    Ratio,
    carried,
    compared,
    friction_words,
)
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
    percentage,
)
from valve_friction_ros.health.friction_monitor import (
    FrictionMonitor,
    IdentificationInput,
    MonitorSettings,
    identify_snapshot,
)
from valve_friction_ros.health.known_numbers import DatedNumber, KnownNumbers
from valve_friction_ros.health.levels import Finding, Level, StatusSignal, by_severity
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.refused_record import RefusedRecordError
from valve_friction_ros.health.standstill import (
    Standstill,
    StandstillCounter,
    standstill_finding,
)
from valve_friction_ros.health.valve_changes import Change, valve_changes
from valve_friction_ros.health.valve_diagnosis import (
    ValveDiagnosis,
    diagnose_numbers,
    diagnose_parameters,
    diagnose_valve,
)
from valve_friction_ros.health.valve_limits import ValveLimits
from valve_friction_ros.health.valve_numbers import valve_numbers

__all__ = [
    "Baseline",
    "Change",
    "Comparison",
    "DatedNumber",
    "Diagnosis",
    "EarlierEstimate",
    "Finding",
    "FrictionLimits",
    "FrictionMonitor",
    "FrictionState",
    "IdentificationInput",
    "KnownNumbers",
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
    "ValveDiagnosis",
    "ValveLimits",
    "baseline_by_evidence",
    "by_severity",
    "carried",
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
    "friction_words",
    "identify_snapshot",
    "leading_ratio",
    "percentage",
    "qualified",
    "reference_by_evidence",
    "standstill_finding",
    "valve_changes",
    "valve_numbers",
    "why_not_compared",
]
