"""Identification of the Karnopp model from recordings; no ROS."""

from valve_friction_ros.identification.assessment import ASSESSED_UNITS, Assessment, assess
from valve_friction_ros.identification.derivatives import Derivatives, differentiate
from valve_friction_ros.identification.estimate import UNITS, Estimate
from valve_friction_ros.identification.identify import identify
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import FIXABLE, IdentificationSettings
from valve_friction_ros.identification.sweep import Sweep, sweep_thresholds
from valve_friction_ros.identification.verdict import AssessedParameter, Verdict

__all__ = [
    "ASSESSED_UNITS",
    "FIXABLE",
    "UNITS",
    "AssessedParameter",
    "Assessment",
    "Derivatives",
    "Estimate",
    "IdentificationSettings",
    "RefusalError",
    "Sweep",
    "Verdict",
    "assess",
    "differentiate",
    "identify",
    "sweep_thresholds",
]
