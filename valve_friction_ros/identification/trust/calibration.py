# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Calibration: what the unknown scales of diaphragm area and sensors add to an interval."""

import math
from collections.abc import Mapping
from dataclasses import replace

from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.verdict import WEAK_SHARE, Parameter, Verdict
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.wording import percentage

BUDGET = "uncertainty_budget"
"""Name of the evidence that splits the standard uncertainty of each parameter by its sources."""

_EXPONENTS: Mapping[str, tuple[int, int]] = {
    "mass": (1, -1),
    "viscous_friction": (1, -1),
    "coulomb_friction": (1, 0),
    "static_friction": (1, 0),
    "sliding_friction": (1, 0),
    "spring_constant": (1, -1),
    "spring_preload": (1, 0),
    "stribeck_velocity": (0, 1),
    "limit_velocity": (0, 1),
}
"""Powers of the scales of force and length that a parameter grows with; of others none."""

OF_FORCE = frozenset(name for name, (force, _) in _EXPONENTS.items() if force)
"""Parameters that grow with the scale of the forces."""

COVERAGE = 2.0
"""Half width of a 95 % interval over the standard uncertainty (GUM, k = 2)."""


def calibration_share(name: str, settings: IdentificationSettings, driven_by: Drive) -> float:
    """Return the relative standard uncertainty of a parameter by the calibration.

    A parameter is a product of powers of the scales, so that their relative uncertainties, each
    times its power, add in squares (GUM 5.1.6). Area and pressure make the scale of a force; a
    drive that is a force has that of its sensor alone. A preload by a known bias is k·x̄.
    """
    if name == "spring_preload" and settings.position_bias is not None:
        name = "spring_constant"
    force, length = _EXPONENTS.get(name, (0, 0))
    area = settings.area_uncertainty if driven_by is Drive.PRESSURE else 0.0
    return math.hypot(
        force * area,
        force * settings.drive_scale_uncertainty,
        length * settings.position_scale_uncertainty,
    )


def calibrated(one: Parameter, share: float) -> Parameter:
    """Widen the interval of an estimate by a relative standard uncertainty of its scale.

    Both are independent, and add in squares. The verdict follows from the wider interval; as the
    record determines the value all the same, it is weak at most. A given value stays, and one
    without an interval.
    """
    error = share * abs(one.value)
    is_estimate = one.half_width >= 0 and one.verdict is not Verdict.FIXED
    if not (error > 0 and is_estimate) or one.uncalibrated is not None:
        return one
    width = math.hypot(one.half_width, COVERAGE * error)
    wide = width / abs(one.value)
    verdict, reason = one.verdict, one.reason
    if wide > WEAK_SHARE:
        verdict = Verdict.WEAK
        told = f"with the calibration its interval is ±{percentage(wide)} of its value"
        reason = f"{reason}; {told}" if reason else told
    return replace(
        one,
        standard_error=math.hypot(one.standard_error, error),
        half_width=width,
        verdict=verdict,
        reason=reason,
        uncalibrated=one,
    )


def with_calibration(
    parameters: Mapping[str, Parameter],
    evidence: Mapping[str, object],
    settings: IdentificationSettings,
    driven_by: Drive,
) -> tuple[dict[str, Parameter], dict[str, object]]:
    """Return parameters with the calibration in their intervals, and evidence with its budget.

    A method without a budget of its own gets one where there is a calibration to tell of: the
    standard error is the share of the record. What has been widened before is not widened again.
    """
    shares = {name: calibration_share(name, settings, driven_by) for name in parameters}
    found = {name: calibrated(one, shares[name]) for name, one in parameters.items()}
    told = evidence.get(BUDGET)
    budget = dict(told) if isinstance(told, Mapping) else {}
    if not budget and any(shares.values()):
        budget = {
            name: {"record": one.without_calibration.standard_error}
            for name, one in found.items()
            if one.standard_error > 0
        }
    for name, sources in budget.items():
        one = found.get(name)
        error = 0.0 if one is None or one.uncalibrated is None else shares[name] * abs(one.value)
        budget[name] = {**sources, "calibration": error}
    return found, {**evidence, BUDGET: budget} if budget else dict(evidence)
