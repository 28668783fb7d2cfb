# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Method "published": the paper's model 1 as it is, without intervals."""

import math
from collections.abc import Container

from valve_friction_ros.identification.published.estimate import Estimate, possible_model
from valve_friction_ros.identification.published.evidence import (
    sweep_evidence,
    sweep_finding,
    with_published,
)
from valve_friction_ros.identification.published.identify import published_fit, require_published
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.verdict import Parameter, Verdict, fixed
from valve_friction_ros.identification.units import SLIDING
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import measured

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
