"""Identification of the Karnopp model from recordings; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.identification.drawing import Curve, Drawing, Exhibit, Panel
    from valve_friction_ros.identification.methods import (
        FORMER_METHODS,
        METHODS,
        Method,
        identify,
        method_named,
        method_used,
    )
    from valve_friction_ros.identification.model_to_simulate import (
        IdentifiedModel,
        identified_model,
    )
    from valve_friction_ros.identification.published.estimate import Estimate
    from valve_friction_ros.identification.published.identify import published_estimate
    from valve_friction_ros.identification.published.method import identify_published
    from valve_friction_ros.identification.published.sweep import Sweep, sweep_thresholds
    from valve_friction_ros.identification.published.sweep_drawing import sweep_panels
    from valve_friction_ros.identification.refined.method import identify_refined
    from valve_friction_ros.identification.refusal import RefusalError
    from valve_friction_ros.identification.rendering import (
        parameter_cells,
        parameter_columns,
        parameter_mapping,
        plain,
    )
    from valve_friction_ros.identification.result import Result, StemComparison
    from valve_friction_ros.identification.robust.expectation import expected_half_widths
    from valve_friction_ros.identification.robust.method import (
        IMPERFECTIONS_FOUND,
        identify_robust,
    )
    from valve_friction_ros.identification.settings import (
        CALIBRATION,
        DEFAULT_METHOD,
        FIXABLE,
        METHOD_NAMES,
        MOST_UNCERTAIN,
        STATED,
        TIMING_UNCERTAINTY,
        IdentificationSettings,
    )
    from valve_friction_ros.identification.signature.force_balance import identify_signature
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
    from valve_friction_ros.identification.trust.misfit import LEAST_FIT, Misfit
    from valve_friction_ros.identification.trust.plausible_units import require_valve_units
    from valve_friction_ros.identification.trust.rounding import percentage, two_digits
    from valve_friction_ros.identification.trust.verdict import Parameter, Verdict
    from valve_friction_ros.identification.units import (
        CLOCK_OFFSET,
        PARAMETER_UNITS,
        SLIDING,
        UNITS,
    )
else:
    __getattr__ = names_on_demand(__name__)

__all__ = [
    "CALIBRATION",
    "CLOCK_OFFSET",
    "DEFAULT_METHOD",
    "FIXABLE",
    "FORMER_METHODS",
    "IMPERFECTIONS_FOUND",
    "LEAST_FIT",
    "METHODS",
    "METHOD_NAMES",
    "MOST_UNCERTAIN",
    "PARAMETER_UNITS",
    "SLIDING",
    "STATED",
    "TIMING_UNCERTAINTY",
    "UNITS",
    "Bracket",
    "BreakawayPoint",
    "Curve",
    "Drawing",
    "Estimate",
    "Exhibit",
    "IdentificationSettings",
    "IdentifiedModel",
    "Method",
    "Misfit",
    "Panel",
    "Parameter",
    "RefusalError",
    "Result",
    "SignatureStroke",
    "StemComparison",
    "StepMetrics",
    "StepTest",
    "Sweep",
    "Validation",
    "ValveSignature",
    "Verdict",
    "expected_half_widths",
    "find_steps",
    "identified_model",
    "identify",
    "identify_published",
    "identify_refined",
    "identify_robust",
    "identify_signature",
    "method_named",
    "method_used",
    "parameter_cells",
    "parameter_columns",
    "parameter_mapping",
    "percentage",
    "plain",
    "published_estimate",
    "require_valve_units",
    "step_test",
    "sweep_panels",
    "sweep_thresholds",
    "two_digits",
    "validate",
    "valve_signature",
]
