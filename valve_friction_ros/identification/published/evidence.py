# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The figures of the published sweep in a result: as numbers, in words, beside the parameters."""

from collections.abc import Mapping
from dataclasses import replace

from valve_friction_ros.identification.published.estimate import Estimate
from valve_friction_ros.identification.published.identify import published_fit
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.excitation import require_unbroken
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.identification.units import UNITS
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import MeasuredRecord


def published_beside(
    record: MeasuredRecord, valve: Valve, settings: IdentificationSettings
) -> tuple[Estimate | None, list[str]]:
    """Run the published method beside another one, which has checked the record.

    Its refusal becomes a warning.
    """
    try:
        require_unbroken(record)
        return published_fit(record, valve, settings).estimate, []
    except RefusalError as refusal:
        return None, [f"the published method refused the record: {refusal}"]


def sweep_evidence(estimate: Estimate) -> dict[str, float | int]:
    """Return the figures of the chosen threshold, SI units."""
    return {
        "threshold": estimate.threshold,
        "samples": estimate.samples,
        "sigma": estimate.sigma,
        "r_squared": estimate.r_squared,
        "published_window": estimate.settings.published_window,
    }


def sweep_finding(estimate: Estimate) -> str:
    """Return the figures of the chosen threshold as a sentence."""
    return (
        f"published: threshold δv {estimate.threshold:.4g} m/s, {estimate.samples} samples above "
        f"it, σ_s {estimate.sigma:.4g} N, R² {estimate.r_squared:.6f}, window "
        f"{estimate.settings.published_window} samples"
    )


def with_published(
    parameters: Mapping[str, Parameter], estimate: Estimate | None
) -> dict[str, Parameter]:
    """Add the published value to each parameter of the Karnopp model."""
    if estimate is None:
        return dict(parameters)
    return {
        name: replace(each, published=estimate.values[name]) if name in UNITS else each
        for name, each in parameters.items()
    }
