# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Identification of the Karnopp parameters from a recording, as published."""

import math
from collections.abc import Container, Mapping
from dataclasses import replace
from sys import float_info
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.published.sweep import (
    Estimate,
    ForceBalanceRegression,
    Sweep,
    force_balance_regression,
    possible_model,
    sweep_thresholds,
)
from valve_friction_ros.identification.refusal import LittleMotionError, RefusalError
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import SLIDING, UNITS, IdentificationSettings
from valve_friction_ros.identification.trust import excitation
from valve_friction_ros.identification.trust.plausible_units import require_plausible_units
from valve_friction_ros.identification.trust.uncertainty import mean_speed
from valve_friction_ros.identification.trust.verdict import Parameter, Verdict, fixed
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import MeasuredRecord, measured, runs_of, velocity_noise

_RESOLUTION = 1e-12
"""Residuals below this share of the largest in the sweep are rounding, not misfit.

Chosen: double precision rounds forces at 1e-16, and the sweep adds up some 10,000 of them."""


def choose_threshold(sweep: Sweep, window: int) -> int:
    """Choose the step of the sweep whose estimates are determined best: its index.

    The published rule takes the region of smallest σ_s. Taken literally it fails: far up the
    sweep a handful of samples, all of nearly one speed, fits any parameters, and σ_s is smallest
    where it means least. The criterion must be the smallest uncertainty of the *estimates*, not of
    the force. Their covariance is σ_s²·(ΦᵀΦ)⁻¹, and its determinant, the generalised variance,

        ln det = 2·n_P·ln σ_s − ln det ΦᵀΦ ,

    weighs both sides of the sweep in one number that no choice of units changes (the
    D-criterion of experimental design). Below the plateau resting samples violate (4) and raise
    σ_s; above it the loss of samples, and of the range of speed, lowers det ΦᵀΦ. The smallest
    value lies on the plateau, at its low end where σ_s has settled, and so keeps the most
    samples that still obey the sliding force balance. Steps with fewer samples than n_P windows
    are left out, because the derivatives within one window are not independent.

    Raises RefusalError if no threshold leaves enough samples to determine the free parameters.
    """
    usable = np.isfinite(sweep.sigma) & (sweep.samples >= sweep.free * window)
    if not usable.any():
        raise LittleMotionError(
            f"no threshold leaves enough samples in motion to determine {sweep.free} parameters: "
            "record more strokes, or fix a parameter"
        )
    floor = _RESOLUTION * max(float(np.nanmax(sweep.sigma)), float_info.min)
    criterion = 2 * sweep.free * np.log(np.maximum(sweep.sigma, floor)) - sweep.log_information
    return int(np.argmin(np.where(usable, criterion, np.inf)))


_AT_REST = 4.0
"""A stem rests while its speed is below this many standard deviations of the velocity's noise.

White noise exceeds 4 standard deviations in 6 of 100,000 samples."""

_AT_REST_SHARE = 1e-3
"""In a noiseless record a stem rests while its speed is below this share of its top speed.

Chosen: above zero by far more than rounding, and below every speed that the sweep uses."""

_FIRST_MARK, _SECOND_MARK = 4.0, 16.0
"""Displacements, in standard deviations of the rest, whose crossings locate the onset of motion.

The first is above nearly all noise, like `_AT_REST`. The second is four times the first, chosen:
far enough to measure the growth, near enough that the force still grows steadily."""

_ROUNDING = 1e-12
"""Rounding error of a displacement, m: a noiseless rest has the mark zero, and still lies within
it.

Four decades above the rounding of a position of 30 mm, 3e-18·m, and far below any sensor."""


class Breakaway(NamedTuple):
    """The last sample of a rest, and the direction of the motion that follows (+1 up, −1 down)."""

    sample: int
    direction: int


def _last_within(displacement: NDArray[np.float64], mark: float) -> int:
    """Last index before the displacement stays beyond `mark`, −1 if it is never within."""
    within = np.flatnonzero(displacement <= mark + _ROUNDING)
    return int(within[-1]) if within.size else -1


def _onset(displacement: NDArray[np.float64], spread: float) -> int | None:
    """Index of the last sample at rest of a displacement that grows, None if it is not visible."""
    first = _last_within(displacement, _FIRST_MARK * spread)
    second = _last_within(displacement, _SECOND_MARK * spread)
    if first < 0 or second == displacement.size - 1:
        return None
    if second <= first:
        return first
    place = np.arange(second + 1)
    trials = []
    for power in (1, 2):
        start = first - (second - first) / ((_SECOND_MARK / _FIRST_MARK) ** (1 / power) - 1)
        growth = (np.maximum(place - start, 0) / (second - start)) ** power
        misfit = displacement[: second + 1] - _SECOND_MARK * spread * growth
        trials.append((float(misfit @ misfit), start))
    onset = round(min(trials)[1])
    return onset if onset >= 0 else None


def find_breakaways(recording: Recording, settings: IdentificationSettings) -> list[Breakaway]:
    """Find the instants at which the stem leaves a rest, in time order.

    A rest is a stretch of at least two derivative windows without a speed that the noise cannot
    explain. The part of the rest before the next motion gives its position and its noise.
    The instants t₁ and t₂ at which the displacement passes 4 and 16 standard deviations of that
    noise put the onset at t₁ − (t₂ − t₁)/(4^(1/p) − 1) if it grows as time to the power p:
    p = 2 under a growing force, p = 1 after a slip jump, whichever has the smaller residual.
    Without noise the three instants coincide.
    """
    window = settings.published_window
    record = measured(recording)
    derivatives = record.derivatives(window, settings.order)
    speed = np.abs(derivatives.velocity)
    noise = velocity_noise(record.white_noise, record.sample_period, window, settings.order)
    moving = speed > max(_AT_REST * noise, _AT_REST_SHARE * float(speed.max()))
    for begin, end in runs_of(moving):
        # The filter spreads any true motion over a window: a shorter burst is noise.
        moving[begin:end] = end - begin >= window // 2
    still = ~moving
    found = []
    for begin, end in runs_of(still):
        if end - begin < 2 * window or end == still.size:
            continue
        first_moving = end + derivatives.margin
        rest = recording.position[begin + window : first_moving - window // 2]
        level, spread = float(np.median(rest)), float(np.std(rest))
        stretch = recording.position[first_moving - window : first_moving + 2 * window] - level
        onset = _onset(np.abs(stretch), spread)
        if onset is not None:
            found.append(Breakaway(first_moving - window + onset, int(np.sign(stretch[-1]))))
    return found


_MASS_TOLERANCE = 0.25
"""Relative change of a regressed mass with half the derivative window, up to which it is kept.

Chosen from 54 simulated records (3 packings, 3 excitations, 3 levels of noise, with and without
x̄): masses within 10 % of the truth changed by 5 % at most; wrong masses, except one, by 45 % or
more."""


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
            "the record contains no breakaway from rest: static_friction is set to coulomb_friction"
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
        The paper's by default, with the preload as a separate regressor.

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
    return published_fit(record, valve, settings)[0]


def require_published(
    record: MeasuredRecord, valve: Valve, settings: IdentificationSettings
) -> None:
    """Refuse a record with a gap, or whose stem does not move both ways."""
    excitation.require_unbroken(record)
    excitation.require_enough_samples(record, settings.published_window)
    excitation.require_motion(record, valve.travel)
    excitation.require_drive(record, valve)
    require_plausible_units(record, valve, settings)
    excitation.require_two_directions(record, settings.published_window)


def published_fit(
    record: MeasuredRecord, valve: Valve, settings: IdentificationSettings
) -> tuple[Estimate, ForceBalanceRegression]:
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
    return estimate, regression


def published_beside(
    record: MeasuredRecord, valve: Valve, settings: IdentificationSettings
) -> tuple[Estimate | None, list[str]]:
    """Run the published method alongside another method, which has checked the record.

    A refusal becomes a warning.
    """
    try:
        excitation.require_unbroken(record)
        return published_fit(record, valve, settings)[0], []
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

    The settings are the paper's by default, with the preload as a separate regressor.

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
    estimate, regression = published_fit(record, valve, settings)
    speed = mean_speed(regression.speed[regression.speed > estimate.threshold])
    parameters = {name: _stated(name, estimate, settings.fixed) for name in estimate.values}
    parameters[SLIDING] = _without_interval(
        SLIDING, estimate.coulomb_friction + estimate.viscous_friction * speed
    )
    return Result(
        method=METHOD,
        recording=recording,
        valve=valve,
        settings=settings,
        parameters=with_published(parameters, estimate),
        fit=_share_of_force(estimate, regression),
        rms=math.nan,
        misfit=None,
        derivative_window=settings.published_window,
        warnings=estimate.warnings,
        evidence=sweep_evidence(estimate),
        findings=(sweep_finding(estimate),),
        model=possible_model(estimate),
        exhibit=estimate,
        sliding_speed=speed,
    )


def _share_of_force(estimate: Estimate, regression: ForceBalanceRegression) -> float:
    """Share of the moving stem's force that is reproduced, 1 − |residual| / |force − mean|."""
    moving = regression.speed > estimate.threshold
    values = np.array([estimate.values[name] for name in regression.names])
    force = regression.force[moving]
    left = regression.columns[moving] @ values - force
    whole = float(np.linalg.norm(force - force.mean()))
    return 1 - float(np.linalg.norm(left)) / whole if whole > 0 else 0.0


def _stated(name: str, estimate: Estimate, given: Container[str]) -> Parameter:
    value = estimate.values[name]
    if name in given:
        return fixed(name, value)
    if name in estimate.fixed:
        return fixed(name, value, "assumed: the record does not determine it")
    return _without_interval(name, value)


def _without_interval(name: str, value: float) -> Parameter:
    return Parameter(name, value, math.nan, math.nan, Verdict.WEAK, _NO_INTERVAL)
