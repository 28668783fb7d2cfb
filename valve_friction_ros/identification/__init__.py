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
    from valve_friction_ros.identification.drawing import (
        IMPERFECTIONS_FOUND as IMPERFECTIONS_FOUND,
        Curve as Curve,
        Drawing as Drawing,
        Panel as Panel,
    )
    from valve_friction_ros.identification.engine.method import (
        expected_half_widths as expected_half_widths,
        identify_bench as identify_bench,
        identify_plant as identify_plant,
    )
    from valve_friction_ros.identification.methods import (
        METHODS as METHODS,
        Method as Method,
        identify as identify,
        method_named as method_named,
    )
    from valve_friction_ros.identification.published.identify import (
        identify_published as identify_published,
        published_estimate as published_estimate,
    )
    from valve_friction_ros.identification.published.sweep import (
        Estimate as Estimate,
        Sweep as Sweep,
        sweep_thresholds as sweep_thresholds,
    )
    from valve_friction_ros.identification.refusal import RefusalError as RefusalError
    from valve_friction_ros.identification.rendering import (
        parameter_cells as parameter_cells,
        parameter_columns as parameter_columns,
        parameter_mapping as parameter_mapping,
        plain as plain,
    )
    from valve_friction_ros.identification.result import (
        Result as Result,
        StemComparison as StemComparison,
    )
    from valve_friction_ros.identification.settings import (
        CALIBRATION as CALIBRATION,
        DEFAULT_METHOD as DEFAULT_METHOD,
        FIXABLE as FIXABLE,
        FORMER_METHODS as FORMER_METHODS,
        METHOD_NAMES as METHOD_NAMES,
        MOST_UNCERTAIN as MOST_UNCERTAIN,
        PARAMETER_UNITS as PARAMETER_UNITS,
        SLIDING as SLIDING,
        STATED as STATED,
        TIMING_UNCERTAINTY as TIMING_UNCERTAINTY,
        UNITS as UNITS,
        IdentificationSettings as IdentificationSettings,
        current_name as current_name,
    )
    from valve_friction_ros.identification.signature.force_balance import (
        identify_signature as identify_signature,
    )
    from valve_friction_ros.identification.signature.valve_signature import (
        BreakawayPoint as BreakawayPoint,
        SignatureStroke as SignatureStroke,
        ValveSignature as ValveSignature,
        valve_signature as valve_signature,
    )
    from valve_friction_ros.identification.steps.step_response import (
        Bracket as Bracket,
        StepMetrics as StepMetrics,
        StepTest as StepTest,
        find_steps as find_steps,
        step_test as step_test,
    )
    from valve_friction_ros.identification.steps.validation import (
        IdentifiedModel as IdentifiedModel,
        Validation as Validation,
        identified_model as identified_model,
        validate as validate,
    )
    from valve_friction_ros.identification.trust.plausible_units import (
        require_valve_units as require_valve_units,
    )
    from valve_friction_ros.identification.trust.uncertainty import (
        COMPARABLE as COMPARABLE,
        SPEED_EXPONENT as SPEED_EXPONENT,
    )
    from valve_friction_ros.identification.trust.verdict import (
        LEAST_FIT as LEAST_FIT,
        Misfit as Misfit,
        Parameter as Parameter,
        Verdict as Verdict,
    )
    from valve_friction_ros.wording import (
        percentage as percentage,
        two_digits as two_digits,
    )
else:
    __getattr__ = names_on_demand(__name__)
