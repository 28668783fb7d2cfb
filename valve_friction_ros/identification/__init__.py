"""Identification of the Karnopp model from recordings; no ROS."""

from valve_friction_ros.identification.assessment import ASSESSED_UNITS, Assessment
from valve_friction_ros.identification.derivatives import Derivatives, differentiate
from valve_friction_ros.identification.estimate import UNITS, Estimate
from valve_friction_ros.identification.force_balance import (
    ForceBalanceAssessment,
    assess_force_balance,
)
from valve_friction_ros.identification.identified_model import IdentifiedModel, identified_model
from valve_friction_ros.identification.identify import identify
from valve_friction_ros.identification.methods import DEFAULT_METHOD, METHODS, Method, method_named
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import FIXABLE, IdentificationSettings
from valve_friction_ros.identification.signature_strokes import BreakawayPoint, SignatureStroke
from valve_friction_ros.identification.step_detection import find_steps
from valve_friction_ros.identification.step_response import (
    Bracket,
    StepMetrics,
    StepTest,
    step_test,
)
from valve_friction_ros.identification.sweep import Sweep, sweep_thresholds
from valve_friction_ros.identification.sweep_assessment import SweepAssessment, assess
from valve_friction_ros.identification.validation import Validation, validate
from valve_friction_ros.identification.valve_signature import ValveSignature, valve_signature
from valve_friction_ros.identification.verdict import AssessedParameter, Verdict

__all__ = [
    "ASSESSED_UNITS",
    "DEFAULT_METHOD",
    "FIXABLE",
    "METHODS",
    "UNITS",
    "AssessedParameter",
    "Assessment",
    "Bracket",
    "BreakawayPoint",
    "Derivatives",
    "Estimate",
    "ForceBalanceAssessment",
    "IdentificationSettings",
    "IdentifiedModel",
    "Method",
    "RefusalError",
    "SignatureStroke",
    "StepMetrics",
    "StepTest",
    "Sweep",
    "SweepAssessment",
    "Validation",
    "ValveSignature",
    "Verdict",
    "assess",
    "assess_force_balance",
    "differentiate",
    "find_steps",
    "identified_model",
    "identify",
    "method_named",
    "step_test",
    "sweep_thresholds",
    "validate",
    "valve_signature",
]
