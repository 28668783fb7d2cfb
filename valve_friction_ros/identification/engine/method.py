# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Methods "plant" and "bench": one engine, with and without the imperfections of a plant."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from valve_friction_ros.held_signals import (
    archive_dead_band,
    as_archived,
    as_sent_on_change,
    sent_dead_band,
    without_repeats,
)
from valve_friction_ros.identification.drawing import FRICTION_CURVE, IMPERFECTIONS_FOUND
from valve_friction_ros.identification.engine import verdicts
from valve_friction_ros.identification.engine.balance_regression import SECOND_ORDER
from valve_friction_ros.identification.engine.coordinates import Profile
from valve_friction_ros.identification.engine.departures import Departed, static_friction
from valve_friction_ros.identification.engine.fitted_record import fitted_record
from valve_friction_ros.identification.engine.friction_curve import (
    FrictionCurve,
    checked_by_curve,
    curve_evidence,
    curve_numbers,
    friction_curves,
    timed_numbers,
)
from valve_friction_ros.identification.engine.intervals import (
    ASYMMETRY,
    OMITTED,
    UNSEEN,
    Estimated,
    NumbersAt,
    estimated,
    found_sizes,
    reported_numbers,
)
from valve_friction_ros.identification.engine.lags import LagPrior, LagProfile
from valve_friction_ros.identification.engine.levels import curve_of_levels
from valve_friction_ros.identification.engine.moving_part import MovingPart, moving_part
from valve_friction_ros.identification.engine.posterior_fit import PosteriorFit
from valve_friction_ros.identification.engine.search import Prior, posteriors_at, search
from valve_friction_ros.identification.published.identify import (
    published_beside,
    sweep_evidence,
    sweep_finding,
    with_published,
)
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.result import Result, StemComparison
from valve_friction_ros.identification.settings import (
    REGRESSED,
    SLIDING,
    UNITS,
    IdentificationSettings,
)
from valve_friction_ros.identification.trust import excitation
from valve_friction_ros.identification.trust.plausible_units import (
    require_plausible_units,
    time_remarks,
)
from valve_friction_ros.identification.trust.uncertainty import (
    COMPARABLE,
    CORRELATION,
    NORMAL_QUANTILE,
    SPEED_EXPONENT,
    Correlation,
    correlation_of,
    mean_speed,
)
from valve_friction_ros.identification.trust.verdict import (
    BUDGET,
    COVERAGE,
    Misfit,
    Parameter,
    Verdict,
    calibration_share,
    stem_distance,
)
from valve_friction_ros.model.recording import Recording, StampedRecord, StampedSignal
from valve_friction_ros.model.valve import KarnoppParameters, Valve
from valve_friction_ros.signals import MeasuredRecord, measured
from valve_friction_ros.wording import lasting, three_digits, two_digits

_WINDOWS, _SHORTEST_WINDOW = 10, 3
"""Means of the position in which a record must show both directions, and fewest samples in each:
sensors that send on change and historians leave few."""

_SAME_SPEED = 0.1
"""Share by which the simulated and the measured stem may differ in their mean speeds: measured
speeds of simulated stems, with and without noise, were up to 4 % too low."""

_CLEARLY = 1.0 / 3.0
"""Half width over the sliding friction below which force and stem clearly belong together.

Chosen: noise, drift or another valve's pressure gave 0.49 and more in 116 records."""


def identify_plant(
    recording: Recording, valve: Valve, settings: IdentificationSettings | None = None
) -> Result:
    """Identify a record of a plant, at its own time stamps and with imperfections in the fit.

    The most probable model is found where each imperfection (lags, curved spring, friction that
    changes, …) has a Gaussian prior about zero. An imperfection that the record does not determine
    widens every interval that depends on it.

    Parameters
    ----------
    recording : Recording
        Pressure and stem position; `Recording.stamped` is used where it is given.
    valve : Valve
        Geometry.
    settings : IdentificationSettings, optional
        Fixed parameters, assumed mass and timing uncertainty (by default `TIMING_UNCERTAINTY`).
        Derivative window, order, sweep, position bias and a fixed limit velocity apply to the
        published method, whose estimate is given alongside.

    Returns
    -------
    Result
        Parameters with intervals and verdicts, including `sliding_friction`, the work of friction
        per distance. The evidence is the uncertainty budget of each: its standard uncertainty due
        to the record and to the timing. The derivative window is 0.

    Raises
    ------
    RefusalError
        If the record does not determine the friction; the message names cause and remedy.
    """
    return _identified(recording, valve, settings or IdentificationSettings(), Profile.PLANT)


def identify_bench(
    recording: Recording, valve: Valve, settings: IdentificationSettings | None = None
) -> Result:
    """Identify a record of a rig with good instruments: the Karnopp model alone.

    Like `identify_plant`, without imperfections. The signals are synchronous to the stated timing
    uncertainty, and exactly where none is stated. The intervals hold only as far as that is true.
    """
    return _identified(recording, valve, settings or IdentificationSettings(), Profile.BENCH)


def _identified(
    recording: Recording, valve: Valve, settings: IdentificationSettings, profile: Profile
) -> Result:
    """Identify with the priors of a profile."""
    if "static_friction" in settings.fixed:
        raise RefusalError(
            f"the method {profile.value} finds F_s itself: do not fix it, or use the method "
            "published"
        )
    uniform = measured(recording)
    require_moving_stem(uniform, valve, settings)
    stamped, bands = stamped_record(recording)
    part = moving_part(stamped)
    record = part.record
    lag = lag_prior_of(settings, profile, record)
    curves = friction_curves(record, valve, lag, known_of(settings))
    has_spring = settings.fixed.get("spring_constant") != 0.0
    levels = curve_of_levels(stamped, valve) if has_spring else None
    balanced, departed = curve_numbers(curves), None
    if has_spring:
        departed = static_friction(record, valve, balanced, lag)
    static = math.nan if departed is None else departed.static_friction.value
    try:
        excitation.require_related_signals(recording)
        outcome = _of_simulation(record, valve, settings, profile, curves, balanced, static)
    except RefusalError as refusal:
        if not _dissipates(balanced):
            if levels is None:
                raise
            curves, balanced = [levels], dict(levels.numbers)
        force = float(np.ptp(valve.force_per_drive * record.drive.value))
        outcome = _of_force_balance(curves, balanced, settings, str(refusal), force)
    outcome = _as_sampled(_with_departures(outcome, departed), record, lag, curves, levels)
    outcome = _as_stored(outcome, bands, record, valve, lag)
    published, beside = published_beside(uniform, valve, settings)
    misfit = outcome.misfit
    return Result(
        method=profile.value,
        recording=recording,
        valve=valve,
        settings=settings,
        parameters=with_published(outcome.parameters, published),
        fit=misfit.fit,
        rms=math.nan if outcome.stem is None else misfit.rms,
        misfit=misfit,
        derivative_window=0,
        warnings=(
            *time_remarks(uniform, valve),
            *_doubts(misfit),
            *outcome.warnings,
            *verdicts.sampling_remarks(record),
            *verdicts.archive_remarks(recording, stamped),
            *beside,
        ),
        evidence={
            **({} if published is None else sweep_evidence(published)),
            BUDGET: {
                name: {"record": one.record, "timing": one.timing}
                for name, one in outcome.numbers.items()
            },
            IMPERFECTIONS_FOUND: {
                name: {"value": one.value, "half_width": one.half_width}
                for name, one in outcome.imperfections.items()
                if one.half_width > 0
            },
            **({} if outcome.correlation is None else {CORRELATION: outcome.correlation}),
            FRICTION_CURVE: curve_evidence(curves),
            COMPARABLE: _comparable(outcome.numbers[SLIDING], balanced.get(SPEED_EXPONENT)),
        },
        findings=(
            *outcome.findings,
            *_of_stretch(part),
            *_left_to_published(settings),
            *(() if published is None else (sweep_finding(published),)),
        ),
        model=outcome.model,
        exhibit=published,
        stem=None if outcome.stem is None else outcome.stem._replace(pauses=part.pauses),
        sliding_speed=outcome.sliding_speed,
    )


def _of_stretch(part: MovingPart) -> tuple[str, ...]:
    """Say how much of the motion in a long record was used."""
    if not part.is_stretch:
        return ()
    return (
        f"used the {lasting(part.duration)} with the most stem travel out of "
        f"{lasting(part.motion)} of motion",
    )


def _comparable(sliding: Estimated, exponent: Estimated | None) -> dict[str, float]:
    """Return what a comparison with another record of the same sensors needs (`COMPARABLE`)."""
    found = {"shared_half_width": sliding.shared_half_width}
    if exponent is not None:
        found |= {"speed_exponent": exponent.value, "half_width": exponent.own_half_width}
    return found


def _dissipates(balanced: Mapping[str, Estimated]) -> bool:
    """Whether friction clearly takes work from the force, as it does if both belong to one valve.

    A force that its converter rounds coarsely may still belong to that valve.
    """
    if (sliding := balanced.get(SLIDING)) is None:
        return False
    return sliding.value > max(sliding.rounding, sliding.but_rounding / _CLEARLY)


class _Outcome(NamedTuple):
    """Results of a simulation or, where none follows the record, of the force balance."""

    parameters: Mapping[str, Parameter]
    numbers: Mapping[str, Estimated]
    misfit: Misfit
    sliding_speed: float
    findings: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    imperfections: Mapping[str, Estimated] = MappingProxyType({})
    correlation: Correlation | None = None
    model: KarnoppParameters | None = None
    stem: StemComparison | None = None


def _of_simulation(
    record: StampedRecord,
    valve: Valve,
    settings: IdentificationSettings,
    profile: Profile,
    curves: Sequence[FrictionCurve],
    balanced: Mapping[str, Estimated],
    static: float,
) -> _Outcome:
    """Simulate the stem by the profile; the friction curve is its start and its check."""
    if settings.fixed.get("spring_constant") == 0.0:
        raise RefusalError(
            "the forces with and against the motion do not differ significantly: check that both "
            "signals belong to this machine, and that it has no spring"
        )
    prior = prior_of(settings, profile, valve, record)
    fits = search(fitted_record(record, valve), prior, curves, static)
    fit, numbers = fits[0], estimated(fits, numbers_of(profile), prior.lag)
    misfit = verdicts.fit_misfit(fit, numbers, profile)
    if misfit.is_gross:
        raise RefusalError(
            f"no friction model reproduces the record (fit {100 * misfit.fit:.0f} %, "
            f"{misfit.systematic * 1e3:.2g} mm misfit): check that both signals belong to this "
            "valve, their units and the travel; if the packing or the pressure of the process "
            "changed, use another stretch; if most moves are faster than the samples, "
            f"{lasting(_interval(record))} apart, {_faster(record)}"
        )
    if profile.has_imperfections:
        follows = not verdicts.split_doubt(fits, misfit, profile, prior.lag.reach)
        if follows:
            balanced = timed_numbers(curves, LagProfile.of(fits, prior.lag))
        numbers = checked_by_curve(numbers, balanced, follows, fit.at["slip_force"])
        if "mass" in numbers and not prior.lag.is_known:
            # Seen late by τ, a spring seems to have the mass k·τ²/2: what a shift leaves of a lag.
            by_lags = fit.at["spring_constant"] * SECOND_ORDER**2
            mass = numbers["mass"]
            numbers["mass"] = replace(mass, half_width=math.hypot(mass.half_width, by_lags))
        misfit = verdicts.fit_misfit(fit, numbers)
    imperfections = estimated(fits, found_sizes, prior.lag)
    return _Outcome(
        parameters=verdicts.fit_verdicts(fits, numbers, settings, misfit, profile, prior.lag.reach),
        numbers=numbers,
        misfit=misfit,
        sliding_speed=_sliding_speed(fit, curves),
        findings=(
            f"fit {100 * misfit.fit:.2f} %: the simulated stem deviates from the measured stem by "
            f"{stem_distance(misfit.rms, valve)}, of which "
            f"{two_digits(misfit.systematic * 1e6)} µm is more than noise",
        ),
        warnings=verdicts.found_imperfections(fit, imperfections["lag"]),
        imperfections=imperfections,
        correlation=_correlation(fit, numbers_of(profile)),
        model=_model(fit),
        stem=_stem(fit, record),
    )


def _correlation(fit: PosteriorFit, numbers_at: NumbersAt) -> Correlation:
    """Return the correlation of the numbers at the most probable point."""
    numbers = numbers_at(fit.model, fit.at)
    gradients = {
        name: np.array([one.gradient.get(free, 0.0) for free in fit.names])
        for name, one in numbers.items()
    }
    own = {name: one.definition**2 for name, one in numbers.items()}
    return correlation_of(gradients, fit.covariance, own)


def _with_departures(outcome: _Outcome, departed: Departed | None) -> _Outcome:
    """Take F_s from the departures of the stem, unless a simulated stem has identified it."""
    name = "static_friction"
    known = outcome.parameters[name]
    if departed is None or known.verdict in (Verdict.IDENTIFIED, Verdict.FIXED):
        return outcome
    one = departed.static_friction
    return outcome._replace(
        parameters={**outcome.parameters, name: verdicts.judged(name, one, one.half_width)},
        numbers={**outcome.numbers, name: one},
        findings=(
            *outcome.findings,
            f"the static friction is taken from {departed.departures} breakaways of the stem from "
            "rest",
        ),
    )


def _interval(record: StampedRecord) -> float:
    """Return the sampling interval of the slower signal, s, each repeated value taken once."""
    return max(without_repeats(one).period for one in (record.drive, record.position))


def _faster(record: StampedRecord) -> str:
    """Return the remedy of a record that is too slow for its moves."""
    is_compressed = any(map(archive_dead_band, (record.drive, record.position)))
    return "export it without compression" if is_compressed else "sample faster"


def _as_sampled(
    outcome: _Outcome,
    record: StampedRecord,
    lag: LagPrior,
    curves: Sequence[FrictionCurve],
    levels: FrictionCurve | None,
) -> _Outcome:
    """Doubt the friction that a lag of one sample would move, and compare it with the levels.

    No lag affects the levels. Where the sliding friction agrees with theirs, the narrower interval
    holds; that of the moves includes the difference where a lag of one sample matters. Where it
    does not agree, the levels are more probable, and the interval includes both. If there certainly
    is no lag, the moves need no check.
    """
    by_sample = curves[0].by_sample if curves and lag.deviation is None else 0.0
    doubted = verdicts.doubted_by_sampling(
        outcome.parameters, by_sample, _interval(record), curves[0].fit if curves else 1.0
    )
    known = outcome.numbers.get(SLIDING)
    if levels is None or (lag.is_known and known is not levels.numbers[SLIDING]):
        return outcome._replace(parameters=doubted)
    level, reason = levels.numbers[SLIDING], verdicts.BY_LEVELS
    shown = (
        "the levels at which force and stem rest show a friction near rest of "
        f"{three_digits(level.value)} ± {two_digits(level.half_width)} N"
    )
    if known is not None and known is not level and known.value > 0:
        apart = abs(known.value - level.value)
        if apart <= math.hypot(known.half_width, level.half_width):
            if abs(by_sample) > known.half_width:
                of_levels = math.hypot(apart, NORMAL_QUANTILE * level.record)
                known = replace(known, half_width=math.hypot(known.half_width, of_levels))
            reason = ""
            if known.half_width <= level.half_width:
                level = known
                reason = "" if outcome.misfit.describes else outcome.parameters[SLIDING].reason
        else:
            level = replace(level, half_width=max(level.half_width, apart))
            reason = verdicts.unlike_levels(known.value)
            doubted = verdicts.weakened(doubted, reason)
    return outcome._replace(
        parameters={
            **doubted,
            SLIDING: verdicts.judged(SLIDING, level, level.half_width, reason),
        },
        numbers={**outcome.numbers, SLIDING: level},
        findings=(*outcome.findings, shown),
    )


_UNSEEN, _SCAN = 0.04, 0.4
"""Half width, over the sliding friction, of what a stem does between two samples, and the period,
s, above which it is added.

Calibrated on 240 simulated records of historians, scanned every 0.5 to 5 s; checked on 120 others.
"""


def _as_stored(
    outcome: _Outcome,
    bands: tuple[float, float],
    record: StampedRecord,
    valve: Valve,
    lag: LagPrior,
) -> _Outcome:
    """Widen the friction by what was not sent, or not stored, of the force and of the spring.

    `bands` are the dead bands of the sources of drive and stem.

    A held value is behind the signal by up to a dead band, on the same side throughout a move, so
    no averaging removes that. Nor does it show what happened between two samples, unless the timing
    of slow signals is stated.
    """
    drive, position = (
        max(archive_dead_band(held), sent)
        for held, sent in zip((record.drive, record.position), bands, strict=True)
    )
    spring = outcome.parameters["spring_constant"].value
    if math.isnan(spring):
        spring = valve.force_per_drive * np.ptp(record.drive.value) / np.ptp(record.position.value)
    banded = math.hypot(valve.force_per_drive * drive, spring * position) / math.sqrt(12.0)
    unseen = 0.0
    if _interval(record) > _SCAN and lag.deviation is None:
        unseen = _UNSEEN * abs(outcome.numbers[SLIDING].value) / NORMAL_QUANTILE
    hidden = {OMITTED: banded, UNSEEN: unseen}
    if not any(hidden.values()):
        return outcome
    total = math.hypot(*hidden.values())
    parameters, numbers = dict(outcome.parameters), dict(outcome.numbers)
    for name in (SLIDING, "coulomb_friction", "static_friction"):
        known, one = parameters.get(name), numbers.get(name)
        if known is None or one is None or known.verdict is Verdict.FIXED:
            continue
        numbers[name] = wider = replace(
            one,
            half_width=math.hypot(one.half_width, NORMAL_QUANTILE * total),
            record=math.hypot(one.record, total),
            sources={
                **one.sources,
                **{name: math.hypot(one.sources.get(name, 0.0), d) for name, d in hidden.items()},
            },
        )
        if math.isfinite(known.value):
            width = math.hypot(known.half_width, NORMAL_QUANTILE * total)
            by_width = verdicts.judged(name, one, known.half_width).reason
            reason = "" if known.reason == by_width else known.reason
            parameters[name] = verdicts.judged(name, wider, width, reason)
    return outcome._replace(parameters=parameters, numbers=numbers)


def _sliding_speed(fit: PosteriorFit, curves: Sequence[FrictionCurve]) -> float:
    """Return the mean speed over the distance, m/s; simulated if it agrees with the measured one.

    A simulation smooths noise, but does not know the speed of a jump between two samples. There the
    measured speed is returned, which is alike in all records of the same sensor and motion.
    """
    speed = mean_speed(fit.model.simulate(fit.at).velocity)
    if not curves:
        return speed
    measured_speed = curves[0].sliding_speed
    return speed if abs(speed - measured_speed) < _SAME_SPEED * measured_speed else measured_speed


def _of_force_balance(
    curves: Sequence[FrictionCurve],
    numbers: Mapping[str, Estimated],
    settings: IdentificationSettings,
    why: str,
    force_range: float,
) -> _Outcome:
    """Use the force balance of the sliding stem alone; `why` says why no stem was simulated."""
    numbers = {name: one for name, one in numbers.items() if name != SPEED_EXPONENT}
    best = next(one for one in curves if one.numbers[SLIDING].value == numbers[SLIDING].value)
    misfit = verdicts.curve_misfit(best, numbers[SLIDING])
    reproduced = f"the force balance reproduces {100 * misfit.fit:.2f} % of the force"
    beyond = (
        f"; {misfit.words} of the residual is more than noise" if misfit.systematic > 0.0 else ""
    )
    return _Outcome(
        parameters=verdicts.curve_verdicts(numbers, settings, best.stribeck_velocity, force_range),
        numbers=numbers,
        misfit=misfit,
        sliding_speed=best.sliding_speed,
        correlation=best.correlation,
        findings=(reproduced + beyond,),
        warnings=() if settings.fixed.get("spring_constant") == 0.0 else (f"simulation: {why}",),
        model=_balanced_model(numbers, settings),
    )


def require_moving_stem(
    record: MeasuredRecord, valve: Valve, settings: IdentificationSettings
) -> None:
    """Refuse a record whose stem does not move both ways within the travel."""
    excitation.require_drive(record, valve)
    require_plausible_units(record, valve, settings)
    window = int(np.clip(len(record) // _WINDOWS, _SHORTEST_WINDOW, settings.published_window))
    excitation.require_enough_samples(record, window)
    excitation.require_motion(record, valve.travel)
    excitation.require_two_directions(record, window, valve.travel)
    excitation.require_within_travel(record, valve)
    excitation.require_changing_drive(record)


def stamped_record(recording: Recording) -> tuple[StampedRecord, tuple[float, float]]:
    """Return the samples at their own stamps, or on the grid if they have none.

    What a historian has interpolated is held. The dead bands of sources of drive and stem that send
    on change are returned, too.
    """
    if (stamped := recording.stamped) is not None:
        signals = as_archived(stamped.drive, stamped.position)
        first, second = map(sent_dead_band, signals)
        drive, position = map(as_sent_on_change, signals, (first, second))
        return replace(stamped, drive=drive, position=position), (first, second)
    excitation.require_unbroken(recording)
    time = recording.time
    drive, position = (StampedSignal(time, one) for one in (recording.drive, recording.position))
    drive, position = as_archived(drive, position)
    return StampedRecord(drive, position, recording.driven_by), (0.0, 0.0)


def prior_of(
    settings: IdentificationSettings,
    profile: Profile = Profile.PLANT,
    valve: Valve | None = None,
    record: StampedRecord | None = None,
) -> Prior:
    """Return the prior knowledge of any valve and record, or of those given."""
    known = known_of(settings)
    area = 0.0
    if valve is not None and settings.assumed_mass == IdentificationSettings.assumed_mass:
        area = valve.diaphragm_area or 0.0
    mass = known.get("mass", settings.assumed_mass)
    return Prior(lag_prior_of(settings, profile, record), mass, known, profile, area)


def numbers_of(profile: Profile) -> NumbersAt:
    """Return the reported numbers as functions of a point of the fit."""
    asymmetry = ASYMMETRY if profile.has_imperfections else 0.0
    return partial(reported_numbers, asymmetry=asymmetry)


def known_of(settings: IdentificationSettings) -> dict[str, float]:
    """Return the known parameters that a force balance has."""
    return {name: value for name, value in settings.fixed.items() if name in REGRESSED}


def lag_prior_of(
    settings: IdentificationSettings,
    profile: Profile = Profile.PLANT,
    record: StampedRecord | None = None,
) -> LagPrior:
    """Return the prior of the lag between the signals, of any record or of the one given."""
    timing = settings.timing_uncertainty
    deviation = 0.0 if timing is None and not profile.has_imperfections else timing
    return LagPrior(deviation) if record is None else LagPrior.of(deviation, record)


def _balanced_model(
    numbers: Mapping[str, Estimated], settings: IdentificationSettings
) -> KarnoppParameters | None:
    """Return the Karnopp model of a force balance; None where one of its numbers is impossible."""
    values = {name: one.value for name, one in numbers.items()} | known_of(settings)
    try:
        values.setdefault("mass", settings.assumed_mass)
        values.setdefault("static_friction", values["coulomb_friction"])
        return KarnoppParameters(**{name: values[name] for name in UNITS})
    except (KeyError, ValueError):
        return None


def _doubts(misfit: Misfit) -> tuple[str, ...]:
    if misfit.describes:
        return ()
    return (
        "the Karnopp model does not describe this valve: the residual exceeds the noise by "
        f"{misfit.words}",
    )


def _left_to_published(settings: IdentificationSettings) -> tuple[str, ...]:
    """Say that a position bias is not used in a fit that finds the preload."""
    if settings.position_bias is None:
        return ()
    return (
        f"the position bias of {settings.position_bias * 1e3:.4g} mm belongs to the published "
        "method only: this method finds the preload",
    )


def _stem(fit: PosteriorFit, stamped: StampedRecord) -> StemComparison:
    """Return the measured stem and the simulated reading of its sensor, at each step."""
    record = fit.model.record
    steps = np.arange(record.force.size) * record.period
    readings = fit.model.readings(fit.at).mean(axis=0)
    measured, simulated = (np.interp(steps, record.time, y) for y in (record.position, readings))
    start = max(float(stamped.drive.time[0]), float(stamped.position.time[0]))
    return StemComparison(record.period, measured, simulated, start)


def _model(fit: PosteriorFit) -> KarnoppParameters:
    """Return the Karnopp model without its imperfections."""
    values = {name: fit.at[name] for name in (*REGRESSED, "limit_velocity", "stribeck_velocity")}
    static = fit.at["coulomb_friction"] + fit.at["slip_force"]
    return KarnoppParameters(**values, static_friction=static)


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
    recording, valve, parameters
        Simulated with the noise of the sensors, from this valve with these parameters.
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
    require_moving_stem(measured(recording), valve, settings)
    excitation.require_related_signals(recording)
    truth = {
        "coulomb_friction": parameters.coulomb_friction,
        "viscous_friction": parameters.viscous_friction,
        "spring_constant": parameters.spring_constant,
        "spring_preload": parameters.spring_preload,
        "slip_force": parameters.static_friction - parameters.coulomb_friction,
        "mass": parameters.mass,
        "start_position": start,
    }
    stamped, _ = stamped_record(recording)
    prior = prior_of(settings, Profile.PLANT, valve, stamped)
    fits = posteriors_at(fitted_record(stamped, valve), prior, truth, with_competitors)
    numbers: Mapping[str, Estimated] = estimated(fits, lag=prior.lag)
    if with_competitors:
        curves = friction_curves(stamped, valve, prior.lag, known_of(settings))
        numbers = checked_by_curve(
            numbers,
            timed_numbers(curves, LagProfile.of(fits, prior.lag)),
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
