"""Method "robust": every imperfection of a plant takes part in the fit, with a stated prior."""

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from valve_friction_ros.identification.published.evidence import (
    published_beside,
    sweep_evidence,
    sweep_finding,
    with_published,
)
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.result import Result, StemComparison
from valve_friction_ros.identification.robust.fitted_record import fitted_record
from valve_friction_ros.identification.robust.friction_curve import (
    FrictionCurve,
    LagPrior,
    checked_by_curve,
    curve_evidence,
    curve_numbers,
    friction_curves,
)
from valve_friction_ros.identification.robust.intervals import Estimated, estimated
from valve_friction_ros.identification.robust.numbers import found_sizes
from valve_friction_ros.identification.robust.posterior_fit import PosteriorFit
from valve_friction_ros.identification.robust.remarks import sampling_remarks
from valve_friction_ros.identification.robust.search import Prior, search
from valve_friction_ros.identification.robust.sentences import found_imperfections
from valve_friction_ros.identification.robust.verdicts import (
    curve_misfit,
    curve_verdicts,
    fit_misfit,
    fit_verdicts,
)
from valve_friction_ros.identification.settings import (
    REGRESSED,
    TIMING_UNCERTAINTY,
    IdentificationSettings,
)
from valve_friction_ros.identification.trust.calibration import BUDGET
from valve_friction_ros.identification.trust.excitation import (
    require_drive,
    require_enough_samples,
    require_motion,
    require_related_signals,
    require_two_directions,
    require_unbroken,
    require_within_travel,
)
from valve_friction_ros.identification.trust.misfit import Misfit, stem_distance
from valve_friction_ros.identification.trust.plausible_units import (
    require_plausible_units,
    time_remarks,
)
from valve_friction_ros.identification.trust.sliding import SLIDING, mean_speed
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.model.karnopp_parameters import KarnoppParameters
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.stamped import StampedRecord, StampedSignal
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals.measured_record import MeasuredRecord, measured
from valve_friction_ros.signals.stamped_noise import stamped_noise

__all__ = [
    "FRICTION_CURVE",
    "IMPERFECTIONS_FOUND",
    "METHOD",
    "has_no_place_for",
    "identify_robust",
    "prior_of",
    "require_record",
    "stamped_record",
]

METHOD = "robust"
"""Name of this method."""

IMPERFECTIONS_FOUND = "imperfections"
"""Name of the evidence that holds lag, slip force and asymmetry, with half widths
(`found_sizes`)."""

FRICTION_CURVE = "friction_curve"
"""Name of the evidence that holds friction over speed, SI units (`FrictionCurve`)."""

_AROUND = 2.0
_END = 20
_MOVED_NOISE, _MOVED_SHARE = 8.0, 5e-3
"""Time, s, kept before and after the motion; samples whose median is where the stem stands; and
the distance at which it has left there, in deviations of its noise and as a share of its range."""

_CLEARLY = 1.0 / 3.0
"""Half width over the sliding friction below which force and stem surely belong together.

Chosen: noise, drift or another valve's pressure gave 0.49 and more in 116 records."""


def identify_robust(
    recording: Recording, valve: Valve, settings: IdentificationSettings | None = None
) -> Result:
    """Identify a record of a plant: stamps as they are, imperfections in the fit.

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
        Derivative window, order, sweep and a fixed limit velocity do not matter here.

    Returns
    -------
    Result
        Parameters with intervals and verdicts, `sliding_friction` among them: the work of friction
        over the distance. The evidence is the uncertainty budget of each: its standard uncertainty
        by the record and by the timing. The derivative window is 0.

    Raises
    ------
    RefusalError
        If the record does not determine the friction; the message names cause and remedy.
    """
    settings = settings or IdentificationSettings()
    if unfit := has_no_place_for(settings):
        raise RefusalError(f"the method robust has no place for {unfit}: use the method refined")
    uniform = measured(recording)
    require_moving_stem(uniform, valve, settings)
    record = around_motion(stamped_record(recording))
    curves = friction_curves(record, valve, lag_prior_of(settings), known_of(settings))
    balanced = curve_numbers(curves)
    try:
        require_related_signals(uniform)
        outcome = _of_simulation(record, valve, settings, curves, balanced)
    except RefusalError as refusal:
        if not _dissipates(balanced):
            raise
        outcome = _of_force_balance(curves, balanced, settings, str(refusal))
    published, beside = published_beside(uniform, valve, settings)
    misfit = outcome.misfit
    return Result(
        method=METHOD,
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
            *sampling_remarks(record),
            *beside,
        ),
        evidence={
            **({} if published is None else sweep_evidence(published)),
            BUDGET: {
                name: {"record": one.budget.record, "timing": one.budget.timing}
                for name, one in outcome.numbers.items()
            },
            IMPERFECTIONS_FOUND: {
                name: {"value": one.value, "half_width": one.half_width}
                for name, one in outcome.imperfections.items()
            },
            FRICTION_CURVE: curve_evidence(curves),
        },
        findings=(
            outcome.finding,
            *(() if published is None else (sweep_finding(published),)),
        ),
        model=outcome.model,
        exhibit=published,
        stem=outcome.stem,
        sliding_speed=outcome.sliding_speed,
    )


def _dissipates(balanced: Mapping[str, Estimated]) -> bool:
    """Whether friction surely takes work from the force, as it does where both are of one valve."""
    sliding = balanced.get(SLIDING)
    return sliding is not None and sliding.half_width < _CLEARLY * sliding.value


class _Outcome(NamedTuple):
    """What a simulation or, where none follows the record, the force balance says of it."""

    parameters: Mapping[str, Parameter]
    numbers: Mapping[str, Estimated]
    misfit: Misfit
    sliding_speed: float
    finding: str
    warnings: tuple[str, ...] = ()
    imperfections: Mapping[str, Estimated] = MappingProxyType({})
    model: KarnoppParameters | None = None
    stem: StemComparison | None = None


def _of_simulation(
    record: StampedRecord,
    valve: Valve,
    settings: IdentificationSettings,
    curves: Sequence[FrictionCurve],
    balanced: Mapping[str, Estimated],
) -> _Outcome:
    """Simulate the stem with all imperfections; the friction curve is its start and its check."""
    if settings.fixed.get("spring_constant") == 0.0:
        raise RefusalError(
            "the forces with and against the motion do not surely differ: check that both signals "
            "belong to this machine, and that it has no spring"
        )
    fits = search(fitted_record(record, valve), prior_of(settings), curves)
    fit, numbers = fits[0], estimated(fits)
    misfit = fit_misfit(fit, numbers)
    if misfit.is_gross:
        raise RefusalError(
            f"no friction model reproduces the record (fit {100 * misfit.fit:.0f} %, "
            f"{misfit.systematic * 1e3:.2g} mm of misfit): check that both signals belong to this "
            "valve, and their units, and that its stem reaches both ends of the travel; if the "
            "packing was changed during the record, clear the buffer and record again"
        )
    numbers = checked_by_curve(numbers, balanced, fit.inflation)
    misfit = fit_misfit(fit, numbers)
    return _Outcome(
        parameters=fit_verdicts(fit, numbers, settings, misfit),
        numbers=numbers,
        misfit=misfit,
        sliding_speed=mean_speed(fit.model.simulate(fit.at).velocity),
        finding=(
            f"fit {100 * misfit.fit:.2f} %: the most probable model's stem is "
            f"{stem_distance(misfit.rms, valve)}; {misfit.systematic * 1e6:.3g} µm of it is not "
            "noise"
        ),
        warnings=found_imperfections(fit),
        imperfections=estimated(fits, found_sizes),
        model=_model(fit),
        stem=_stem(fit),
    )


def _of_force_balance(
    curves: Sequence[FrictionCurve],
    numbers: Mapping[str, Estimated],
    settings: IdentificationSettings,
    why: str,
) -> _Outcome:
    """Take the force balance of the sliding stem alone; `why` says why none was simulated."""
    best = next(one for one in curves if one.numbers[SLIDING].value == numbers[SLIDING].value)
    misfit = curve_misfit(best, numbers[SLIDING])
    return _Outcome(
        parameters=curve_verdicts(numbers, settings, best.stribeck_velocity),
        numbers=numbers,
        misfit=misfit,
        sliding_speed=best.sliding_speed,
        finding=(
            f"the force balance of the sliding stem reproduces {100 * misfit.fit:.2f} % of the "
            f"force; {misfit.words} of the rest are not noise"
        ),
        warnings=() if settings.fixed.get("spring_constant") == 0.0 else (f"simulation: {why}",),
        model=_balanced_model(numbers, settings),
    )


def has_no_place_for(settings: IdentificationSettings) -> str:
    """Return the setting that this fit has no place for; empty if there is none."""
    if settings.position_bias is not None:
        return "a known position bias"
    return "a known static friction" if "static_friction" in settings.fixed else ""


def require_moving_stem(
    record: MeasuredRecord, valve: Valve, settings: IdentificationSettings
) -> None:
    """Refuse a record whose stem does not move both ways within the travel."""
    require_drive(record, valve)
    require_plausible_units(record, valve, settings)
    require_enough_samples(record, settings.published_window)
    require_motion(record)
    require_two_directions(record, settings.published_window)
    require_within_travel(record, valve)


def require_record(record: MeasuredRecord, valve: Valve, settings: IdentificationSettings) -> None:
    """Refuse a record in which the stem does not move both ways, or not with the drive."""
    require_moving_stem(record, valve, settings)
    require_related_signals(record)


def around_motion(record: StampedRecord) -> StampedRecord:
    """Return the part of a record in which the stem moves, and `_AROUND` before and after it.

    A stem that stands, at a stop above all, says nothing of its friction.
    """
    stem = record.position
    span = float(np.ptp(stem.value))
    reach = max(_MOVED_NOISE * stamped_noise(stem), _MOVED_SHARE * span)
    ends = [float(np.median(part)) for part in (stem.value[:_END], stem.value[-_END:])]
    left = np.flatnonzero(np.abs(stem.value - ends[0]) > reach)
    back = np.flatnonzero(np.abs(stem.value - ends[1]) > reach)
    if not (left.size and back.size):
        return record
    begin, end = stem.time[left[0]] - _AROUND, stem.time[back[-1]] + _AROUND
    signals = []
    for signal in (record.drive, stem):
        kept = (signal.time >= begin) & (signal.time <= end)
        if np.count_nonzero(kept) < StampedSignal.FEWEST:
            return record
        signals.append(StampedSignal(signal.time[kept], signal.value[kept]))
    return StampedRecord(signals[0], signals[1], record.driven_by)


def stamped_record(recording: Recording) -> StampedRecord:
    """Return the samples at their own stamps, or on the grid where there are no others."""
    if recording.stamped is not None:
        return recording.stamped
    require_unbroken(recording)
    time = recording.time
    return StampedRecord(
        StampedSignal(time, recording.drive),
        StampedSignal(time, recording.position),
        recording.driven_by,
    )


def prior_of(settings: IdentificationSettings) -> Prior:
    """Return what is known before a record is seen."""
    known = known_of(settings)
    timing = settings.timing_uncertainty
    return Prior(
        TIMING_UNCERTAINTY if timing is None else timing,
        known.get("mass", settings.assumed_mass),
        known,
    )


def known_of(settings: IdentificationSettings) -> dict[str, float]:
    """Return the known parameters that a force balance has."""
    return {name: value for name, value in settings.fixed.items() if name in REGRESSED}


def lag_prior_of(settings: IdentificationSettings) -> LagPrior:
    """Return what is known of the lag between the signals."""
    return LagPrior(settings.timing_uncertainty)


def _balanced_model(
    numbers: Mapping[str, Estimated], settings: IdentificationSettings
) -> KarnoppParameters | None:
    """Return the Karnopp model of a force balance; None where one of its numbers is impossible."""
    values = {name: one.value for name, one in numbers.items()} | known_of(settings)
    try:
        return KarnoppParameters(
            mass=values.get("mass", settings.assumed_mass),
            viscous_friction=values["viscous_friction"],
            coulomb_friction=values["coulomb_friction"],
            static_friction=values.get("static_friction", values["coulomb_friction"]),
            spring_constant=values["spring_constant"],
            spring_preload=values["spring_preload"],
        )
    except (KeyError, ValueError):
        return None


def _doubts(misfit: Misfit) -> tuple[str, ...]:
    if misfit.describes:
        return ()
    return (
        f"the Karnopp model does not describe this valve: {misfit.words} of what was measured are "
        "more than noise",
    )


def _stem(fit: PosteriorFit) -> StemComparison:
    """Return the measured and the simulated stem at the steps of the simulation."""
    record = fit.model.record
    steps = np.arange(record.force.size) * record.period
    position = np.interp(steps, record.time, record.position)
    return StemComparison(record.period, position, fit.model.simulate(fit.at).position)


def _model(fit: PosteriorFit) -> KarnoppParameters:
    """Return the Karnopp model without its imperfections."""
    at = fit.at
    return KarnoppParameters(
        mass=at["mass"],
        viscous_friction=at["viscous_friction"],
        coulomb_friction=at["coulomb_friction"],
        static_friction=at["coulomb_friction"] + at["slip_force"],
        spring_constant=at["spring_constant"],
        spring_preload=at["spring_preload"],
        limit_velocity=at["limit_velocity"],
        stribeck_velocity=at["stribeck_velocity"],
    )
