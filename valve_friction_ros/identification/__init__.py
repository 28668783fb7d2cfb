"""Identification of the Karnopp model from recordings; no ROS."""

from valve_friction_ros.identification.assessment import ASSESSED_UNITS, Assessment
from valve_friction_ros.identification.identified_model import IdentifiedModel, identified_model
from valve_friction_ros.identification.methods import DEFAULT_METHOD, METHODS, Method, method_named
from valve_friction_ros.identification.published.derivatives import Derivatives, differentiate
from valve_friction_ros.identification.published.estimate import UNITS, Estimate
from valve_friction_ros.identification.published.identify import identify
from valve_friction_ros.identification.published.sweep import Sweep, sweep_thresholds
from valve_friction_ros.identification.refined.method import SweepAssessment, assess
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import FIXABLE, IdentificationSettings
from valve_friction_ros.identification.signature.force_balance import (
    ForceBalanceAssessment,
    assess_force_balance,
)
from valve_friction_ros.identification.signature.strokes import BreakawayPoint, SignatureStroke
from valve_friction_ros.identification.signature.valve_signature import (
    ValveSignature,
    valve_signature,
)
from valve_friction_ros.identification.steps.step_detection import find_steps
from valve_friction_ros.identification.steps.step_response import (
    Bracket,
    StepMetrics,
    StepTest,
    step_test,
)
from valve_friction_ros.identification.steps.validation import Validation, validate
from valve_friction_ros.identification.trust.verdict import AssessedParameter, Verdict

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
