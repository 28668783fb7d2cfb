# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Method "published": the paper's model 1 unchanged, without intervals."""

import math
from collections.abc import Container, Mapping
from dataclasses import replace

from valve_friction_ros.identification.published.estimate import Estimate, possible_model
from valve_friction_ros.identification.published.identify import published_fit, require_published
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.excitation import require_unbroken
from valve_friction_ros.identification.trust.verdict import Parameter, Verdict, fixed
from valve_friction_ros.identification.units import SLIDING, UNITS
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import MeasuredRecord, measured


def published_beside(
    record: MeasuredRecord, valve: Valve, settings: IdentificationSettings
) -> tuple[Estimate | None, list[str]]:
    """Run the published method alongside another method, which has checked the record.

    A refusal becomes a warning.
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


METHOD = "published"
"""Name of this method."""

_NO_INTERVAL = "the published method gives no interval"


def identify_published(
    recording: Recording, valve: Valve, settings: IdentificationSettings | None = None
) -> Result:
    """Identify a record as published (`published_estimate`); every verdict is weak or fixed.

    Parameters
    ----------
    recording : Recording
        Pressure and stem position.
    valve : Valve
        Geometry.
    settings : IdentificationSettings, optional
        The paper's by default, with the preload as a separate regressor.

    Returns
    -------
    Result
        Parameters without intervals.

    Raises
    ------
    RefusalError
        If the record does not determine the friction; the message names cause and remedy.
    """
    settings = settings or IdentificationSettings()
    record = measured(recording)
    require_published(record, valve, settings)
    found = published_fit(record, valve, settings)
    estimate = found.estimate
    parameters = {name: _stated(name, estimate, settings.fixed) for name in estimate.values}
    parameters[SLIDING] = _without_interval(SLIDING, found.sliding_friction)
    return Result(
        method=METHOD,
        recording=recording,
        valve=valve,
        settings=settings,
        parameters=with_published(parameters, estimate),
        fit=found.share_of_force,
        rms=math.nan,
        misfit=None,
        derivative_window=settings.published_window,
        warnings=estimate.warnings,
        evidence=sweep_evidence(estimate),
        findings=(sweep_finding(estimate),),
        model=possible_model(estimate),
        exhibit=estimate,
        sliding_speed=found.sliding_speed,
    )


def _stated(name: str, estimate: Estimate, given: Container[str]) -> Parameter:
    value = estimate.values[name]
    if name in given:
        return fixed(name, value)
    if name in estimate.fixed:
        return fixed(name, value, "assumed: the record does not determine it")
    return _without_interval(name, value)


def _without_interval(name: str, value: float) -> Parameter:
    return Parameter(name, value, math.nan, math.nan, Verdict.WEAK, _NO_INTERVAL)
