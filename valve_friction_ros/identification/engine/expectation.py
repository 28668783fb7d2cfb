# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Intervals that the method "plant" would report for a record of a known valve."""

import math
from collections.abc import Mapping

from valve_friction_ros.identification.engine.fitted_record import fitted_record
from valve_friction_ros.identification.engine.friction_curve import (
    checked_by_curve,
    friction_curves,
    timed_numbers,
)
from valve_friction_ros.identification.engine.intervals import Estimated, estimated
from valve_friction_ros.identification.engine.lags import LagProfile
from valve_friction_ros.identification.engine.method import (
    known_of,
    lag_prior_of,
    prior_of,
    require_record,
    stamped_record,
)
from valve_friction_ros.identification.engine.search import posteriors_at
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.verdict import COVERAGE, calibration_share
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import KarnoppParameters, Valve
from valve_friction_ros.signals import measured


def expected_half_widths(
    recording: Recording,
    valve: Valve,
    parameters: KarnoppParameters,
    settings: IdentificationSettings | None = None,
    *,
    start: float,
    with_competitors: bool = True,
) -> Mapping[str, float]:
    """Return the half widths of the 95 % intervals to expect from a simulated record.

    They are those of the posterior (HᵀW²H/κ + Λ)⁻¹ at the simulated valve itself: the sensitivities
    H of the exact simulation, the noise W of both sensors, and the priors Λ of the imperfections
    with which `identify_plant` fits, including lags of the signals. No search is run.

    Parameters
    ----------
    recording : Recording
        Simulated with the noise of the sensors.
    valve : Valve
        Geometry.
    parameters : KarnoppParameters
        Parameters of the simulation.
    settings : IdentificationSettings, optional
        Settings of the identification.
    start : float
        Simulated position at the first sample, m.
    with_competitors : bool
        Whether to include models that explain the record by a lag in place of viscous friction;
        that takes some ten times as long, and matters most for F_v.

    Raises
    ------
    RefusalError
        If the method would refuse the record.
    """
    settings = settings or IdentificationSettings()
    require_record(measured(recording), valve, settings)
    truth = {
        "coulomb_friction": parameters.coulomb_friction,
        "viscous_friction": parameters.viscous_friction,
        "spring_constant": parameters.spring_constant,
        "spring_preload": parameters.spring_preload,
        "slip_force": parameters.static_friction - parameters.coulomb_friction,
        "mass": parameters.mass,
        "start_position": start,
    }
    stamped = stamped_record(recording)
    fits = posteriors_at(
        fitted_record(stamped, valve), prior_of(settings, valve=valve), truth, with_competitors
    )
    numbers: Mapping[str, Estimated] = estimated(fits, lag=lag_prior_of(settings))
    if with_competitors:
        curves = friction_curves(stamped, valve, lag_prior_of(settings), known_of(settings))
        numbers = checked_by_curve(
            numbers,
            timed_numbers(curves, LagProfile.of(fits)),
            follows=True,
            slip_force=truth["slip_force"],
        )
    return {
        name: math.hypot(
            one.half_width,
            COVERAGE * calibration_share(name, settings, valve.driven_by) * one.value,
        )
        for name, one in numbers.items()
    }
