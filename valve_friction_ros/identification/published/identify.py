# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Identification of the Karnopp parameters from a recording, as published."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.published.breakaway import find_breakaways
from valve_friction_ros.identification.published.estimate import Estimate
from valve_friction_ros.identification.published.regression import (
    ForceBalanceRegression,
    force_balance_regression,
)
from valve_friction_ros.identification.published.sweep import Sweep, sweep_thresholds
from valve_friction_ros.identification.published.threshold import choose_threshold
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.excitation import (
    require_drive,
    require_enough_samples,
    require_motion,
    require_two_directions,
    require_unbroken,
)
from valve_friction_ros.identification.trust.plausible_units import require_plausible_units
from valve_friction_ros.identification.trust.sliding import mean_speed
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import MeasuredRecord, measured

_MASS_TOLERANCE = 0.25
"""Relative change of a regressed mass with half the derivative window, up to which it is kept.

Chosen from 54 simulated records (3 packings, 3 excitations, 3 levels of noise, with and without
x̄): masses within 10 % of the truth changed by 5 % at most; wrong masses, but one, by 45 % or
more."""


class PublishedFit(NamedTuple):
    """An estimate with the regression that it solves."""

    estimate: Estimate
    regression: ForceBalanceRegression

    @property
    def share_of_force(self) -> float:
        """Share of the moving stem's force that is reproduced, 1 − |residual| / |force − mean|."""
        regression = self.regression
        moving = regression.speed > self.estimate.threshold
        values = np.array([self.estimate.values[name] for name in regression.names])
        force = regression.force[moving]
        left = regression.columns[moving] @ values - force
        whole = float(np.linalg.norm(force - force.mean()))
        return 1 - float(np.linalg.norm(left)) / whole if whole > 0 else 0.0

    @property
    def sliding_speed(self) -> float:
        """Mean speed over the distance, m/s, of the samples above the threshold."""
        speed = self.regression.speed
        return mean_speed(speed[speed > self.estimate.threshold])

    @property
    def sliding_friction(self) -> float:
        """F_c + F_v·|ẋ| at that speed, N: the work of friction over the distance."""
        estimate = self.estimate
        return estimate.coulomb_friction + estimate.viscous_friction * self.sliding_speed


def chosen_step(
    regression: ForceBalanceRegression, settings: IdentificationSettings, window: int
) -> tuple[Sweep, int]:
    """Sweep the thresholds (8), or a fixed threshold; return the sweep and the chosen step."""
    given = settings.fixed.get("limit_velocity")
    if given is not None:
        thresholds = np.array([given])
    else:
        step = float(regression.speed.max()) / settings.resolution
        thresholds = step * np.arange(1, settings.steps + 1)
    sweep = sweep_thresholds(regression, thresholds)
    return sweep, choose_threshold(sweep, window)


def _mass_by_shorter_window(
    record: MeasuredRecord,
    force: NDArray[np.float64],
    settings: IdentificationSettings,
    threshold: float,
) -> float:
    """Mass at `threshold` with about half the derivative window; nan without a solution."""
    window = max((settings.published_window // 2) | 1, (settings.order + 2) | 1)
    derivatives = record.derivatives(window, settings.order)
    regression = force_balance_regression(force, record.position, derivatives, settings)
    return float(sweep_thresholds(regression, np.array([threshold])).estimates["mass"][0])


def _why_mass_is_unknown(mass: float, other: float) -> str | None:
    """Return why the record does not determine the mass, or None if it does."""
    if mass <= 0:
        return f"its estimate is {mass:.4g} kg"
    if not abs(other - mass) <= _MASS_TOLERANCE * mass:
        return f"{mass:.4g} kg becomes {other:.4g} kg with half the derivative window"
    return None


def _static_friction(
    record: MeasuredRecord,
    force: NDArray[np.float64],
    settings: IdentificationSettings,
    values: dict[str, float],
    warnings: list[str],
) -> float:
    """F_s by (9): the median over all breakaways, not below F_c."""
    breakaways = find_breakaways(record, settings)
    coulomb_friction = values["coulomb_friction"]
    if not breakaways:
        warnings.append(
            "the record shows no breakaway from rest: static_friction is set to coulomb_friction"
        )
        return coulomb_friction
    samples = np.array([breakaway.sample for breakaway in breakaways])
    directions = np.array([breakaway.direction for breakaway in breakaways])
    pull = (
        force[samples]
        - values["spring_constant"] * record.position[samples]
        - values["spring_preload"]
    )
    return max(float(np.median(directions * pull)), coulomb_friction)


def published_estimate(
    recording: Recording, valve: Valve, settings: IdentificationSettings | None = None
) -> Estimate:
    """Identify the friction of a valve from a recording, as the paper does.

    Derivatives by Appendix A, the sweep (3) to (8) with σ_s (17) and R²_s (18), the threshold
    chosen on its plateau (`choose_threshold`), and F_s by (9) from the instants of breakaway.

    Parameters
    ----------
    recording : Recording
        Pressure and stem position, several strokes in both directions.
    valve : Valve
        Diaphragm area and pressure reference.
    settings : IdentificationSettings, optional
        The paper's by default, with the preload as a regressor of its own.

    Returns
    -------
    Estimate
        Parameters, quality figures, warnings and the sweep behind them.

    Raises
    ------
    RefusalError
        If the record is too short, has no motion or one direction only, or too few samples.

    Notes
    -----
    Between two levels of pressure the force balance does not determine all five parameters: a
    square wave through a first-order lag moves the stem by two exponentials and a level each
    way, which gives four equations. The weakest parameter, the mass, then depends on the derivative
    window instead of the record. A regressed mass is therefore kept only if it is positive and
    stays within 25 % when the window is halved. Otherwise `assumed_mass` replaces it, with a
    warning. Inertia is about 0.01 N of 5000 N on the bench valve, so the other parameters hardly
    change.
    """
    settings, record = settings or IdentificationSettings(), measured(recording)
    require_published(record, valve, settings)
    return published_fit(record, valve, settings).estimate


def require_published(
    record: MeasuredRecord, valve: Valve, settings: IdentificationSettings
) -> None:
    """Refuse a record with a gap, or whose stem does not move both ways."""
    require_unbroken(record)
    require_enough_samples(record, settings.published_window)
    require_motion(record)
    require_drive(record, valve)
    require_plausible_units(record, valve, settings)
    require_two_directions(record, settings.published_window)


def published_fit(
    record: MeasuredRecord, valve: Valve, settings: IdentificationSettings
) -> PublishedFit:
    """Identify a checked record as `published_estimate` does, and return the regression too."""
    warnings: list[str] = []
    derivatives = record.derivatives(settings.published_window, settings.order)
    force = valve.actuator_force(record.drive)
    regression = force_balance_regression(force, record.position, derivatives, settings)
    sweep, chosen = chosen_step(regression, settings, settings.published_window)
    if "mass" not in settings.fixed:
        reason = _why_mass_is_unknown(
            float(sweep.estimates["mass"][chosen]),
            _mass_by_shorter_window(record, force, settings, float(sweep.thresholds[chosen])),
        )
        if reason is not None:
            warnings.append(
                f"the record does not determine the mass ({reason}): "
                f"{settings.assumed_mass:g} kg is assumed"
            )
            settings = replace(settings, fixed={**settings.fixed, "mass": settings.assumed_mass})
            regression = regression.fixing("mass", settings.assumed_mass)
            sweep, chosen = chosen_step(regression, settings, settings.published_window)
    values = {name: float(column[chosen]) for name, column in sweep.estimates.items()}
    threshold = float(sweep.thresholds[chosen])
    for name, value in values.items():
        if value < 0 and name != "spring_preload":
            warnings.append(f"{name} is negative ({value:.4g}): the model does not fit this record")
    static_friction = settings.fixed.get("static_friction")
    if static_friction is None:
        static_friction = _static_friction(record, force, settings, values, warnings)
    elif static_friction < values["coulomb_friction"]:
        warnings.append(
            f"the fixed static_friction ({static_friction:.4g} N) lies below the identified "
            f"coulomb_friction ({values['coulomb_friction']:.4g} N)"
        )
    estimate = Estimate(
        **values,
        static_friction=static_friction,
        threshold=threshold,
        samples=int(sweep.samples[chosen]),
        sigma=float(sweep.sigma[chosen]),
        r_squared=float(sweep.r_squared[chosen]),
        fixed=tuple(settings.fixed),
        warnings=tuple(warnings),
        settings=settings,
        sweep=sweep,
    )
    return PublishedFit(estimate, regression)
