"""Method "robust": every imperfection of a plant takes part in the fit, with a stated prior."""

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
from valve_friction_ros.identification.robust.intervals import estimated
from valve_friction_ros.identification.robust.numbers import found_sizes
from valve_friction_ros.identification.robust.posterior_fit import PosteriorFit
from valve_friction_ros.identification.robust.remarks import sampling_remarks
from valve_friction_ros.identification.robust.search import Prior, search
from valve_friction_ros.identification.robust.sentences import found_imperfections
from valve_friction_ros.identification.robust.verdicts import fit_misfit, fit_verdicts
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
    require_stem_between_stops,
    require_travel,
    require_two_directions,
    require_unbroken,
)
from valve_friction_ros.identification.trust.misfit import Misfit, stem_distance
from valve_friction_ros.identification.trust.plausible_units import (
    require_plausible_units,
    time_remarks,
)
from valve_friction_ros.identification.trust.sliding import mean_speed
from valve_friction_ros.model.karnopp_parameters import KarnoppParameters
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.stamped import StampedRecord, StampedSignal
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals.measured_record import MeasuredRecord, measured

__all__ = [
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
    require_record(uniform, valve, settings)
    record = stamped_record(recording)
    fits = search(fitted_record(record, valve), prior_of(settings))
    fit, numbers = fits[0], estimated(fits)
    misfit = fit_misfit(fit, numbers)
    published, beside = published_beside(uniform, valve, settings)
    if misfit.is_gross:
        raise RefusalError(
            f"no friction model reproduces the record (fit {100 * misfit.fit:.0f} %, "
            f"{misfit.systematic * 1e3:.2g} mm of misfit): check that both signals belong to this "
            "valve, and their units, and that its stem reaches both ends of the travel; if the "
            "packing was changed during the record, clear the buffer and record again"
        )
    return Result(
        method=METHOD,
        recording=recording,
        valve=valve,
        settings=settings,
        parameters=with_published(fit_verdicts(fit, numbers, settings, misfit), published),
        fit=misfit.fit,
        rms=misfit.rms,
        misfit=misfit,
        derivative_window=0,
        warnings=(
            *time_remarks(uniform, valve),
            *_doubts(misfit),
            *found_imperfections(fit),
            *sampling_remarks(record),
            *beside,
        ),
        evidence={
            **({} if published is None else sweep_evidence(published)),
            BUDGET: {
                name: {"record": one.budget.record, "timing": one.budget.timing}
                for name, one in numbers.items()
            },
            IMPERFECTIONS_FOUND: {
                name: {"value": one.value, "half_width": one.half_width}
                for name, one in estimated(fits, found_sizes).items()
            },
        },
        findings=(
            f"fit {100 * misfit.fit:.2f} %: the most probable model's stem is "
            f"{stem_distance(misfit.rms, valve)}; {misfit.systematic * 1e6:.3g} µm of it is not "
            "noise",
            *(() if published is None else (sweep_finding(published),)),
        ),
        model=_model(fit),
        exhibit=published,
        stem=_stem(fit),
        sliding_speed=mean_speed(fit.model.simulate(fit.at).velocity),
    )


def has_no_place_for(settings: IdentificationSettings) -> str:
    """Return the setting that this fit has no place for; empty if there is none."""
    if settings.fixed.get("spring_constant") == 0.0:
        return "a machine without a spring"
    if settings.position_bias is not None:
        return "a known position bias"
    return "a known static friction" if "static_friction" in settings.fixed else ""


def require_record(record: MeasuredRecord, valve: Valve, settings: IdentificationSettings) -> None:
    """Refuse a record without the motion that determines friction."""
    require_drive(record, valve)
    require_plausible_units(record, valve, settings)
    require_enough_samples(record, settings.published_window)
    require_motion(record)
    require_two_directions(record, settings.published_window)
    require_travel(record, valve)
    require_stem_between_stops(record, valve)
    require_related_signals(record)


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
    known = {name: value for name, value in settings.fixed.items() if name in REGRESSED}
    timing = settings.timing_uncertainty
    return Prior(
        TIMING_UNCERTAINTY if timing is None else timing,
        known.get("mass", settings.assumed_mass),
        known,
    )


def _doubts(misfit: Misfit) -> tuple[str, ...]:
    if misfit.describes:
        return ()
    return (
        f"the Karnopp model does not describe this valve: {misfit.systematic * 1e6:.3g} µm "
        "between the simulated and the measured stem are more than noise",
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
