# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Identification of the Karnopp model from recordings; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.identification.drawing import Curve, Drawing, Exhibit, Panel
    from valve_friction_ros.identification.engine.expectation import expected_half_widths
    from valve_friction_ros.identification.engine.method import identify_bench, identify_plant
    from valve_friction_ros.identification.friction_drawing import IMPERFECTIONS_FOUND
    from valve_friction_ros.identification.methods import (
        METHODS,
        Method,
        identify,
        method_named,
    )
    from valve_friction_ros.identification.model_to_simulate import (
        IdentifiedModel,
        identified_model,
    )
    from valve_friction_ros.identification.published.estimate import Estimate
    from valve_friction_ros.identification.published.identify import published_estimate
    from valve_friction_ros.identification.published.method import identify_published
    from valve_friction_ros.identification.published.sweep import Sweep, sweep_thresholds
    from valve_friction_ros.identification.refusal import RefusalError
    from valve_friction_ros.identification.rendering import (
        parameter_cells,
        parameter_columns,
        parameter_mapping,
        plain,
    )
    from valve_friction_ros.identification.result import Result, StemComparison
    from valve_friction_ros.identification.settings import (
        CALIBRATION,
        DEFAULT_METHOD,
        FIXABLE,
        FORMER_METHODS,
        METHOD_NAMES,
        MOST_UNCERTAIN,
        STATED,
        TIMING_UNCERTAINTY,
        IdentificationSettings,
        current_name,
    )
    from valve_friction_ros.identification.signature.force_balance import identify_signature
    from valve_friction_ros.identification.signature.strokes import BreakawayPoint, SignatureStroke
    from valve_friction_ros.identification.signature.valve_signature import (
        ValveSignature,
        valve_signature,
    )
    from valve_friction_ros.identification.steps.step_response import (
        Bracket,
        StepMetrics,
        StepTest,
        find_steps,
        step_test,
    )
    from valve_friction_ros.identification.steps.validation import Validation, validate
    from valve_friction_ros.identification.trust.misfit import LEAST_FIT, Misfit
    from valve_friction_ros.identification.trust.plausible_units import require_valve_units
    from valve_friction_ros.identification.trust.sliding import COMPARABLE, SPEED_EXPONENT
    from valve_friction_ros.identification.trust.verdict import Parameter, Verdict
    from valve_friction_ros.identification.units import (
        CLOCK_OFFSET,
        PARAMETER_UNITS,
        SLIDING,
        UNITS,
    )
    from valve_friction_ros.wording import percentage, two_digits
else:
    __getattr__ = names_on_demand(__name__)

__all__ = [
    "CALIBRATION",
    "CLOCK_OFFSET",
    "COMPARABLE",
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
    "SPEED_EXPONENT",
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
    "current_name",
    "expected_half_widths",
    "find_steps",
    "identified_model",
    "identify",
    "identify_bench",
    "identify_plant",
    "identify_published",
    "identify_signature",
    "method_named",
    "parameter_cells",
    "parameter_columns",
    "parameter_mapping",
    "percentage",
    "plain",
    "published_estimate",
    "require_valve_units",
    "step_test",
    "sweep_thresholds",
    "two_digits",
    "validate",
    "valve_signature",
]
