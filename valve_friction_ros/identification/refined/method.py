"""Method "refined": the published sweep, then a refinement with intervals and verdicts."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from valve_friction_ros.identification.published.estimate import Estimate
from valve_friction_ros.identification.published.evidence import (
    published_beside,
    sweep_evidence,
    sweep_finding,
    with_published,
)
from valve_friction_ros.identification.published.identify import published_fit
from valve_friction_ros.identification.refined.model_selection import with_demanded
from valve_friction_ros.identification.refined.model_test import misfit_of
from valve_friction_ros.identification.refined.output_error import SLIP, START, OutputError
from valve_friction_ros.identification.refined.verdicts import refinement_verdicts
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.result import Result, StemComparison
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.excitation import (
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
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.identification.units import CLOCK_OFFSET
from valve_friction_ros.model.karnopp_parameters import KarnoppParameters
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals.conditioned_record import condition
from valve_friction_ros.signals.measured_record import MeasuredRecord, measured

__all__ = ["METHOD", "identify_refined"]

_START_TIME = 0.02
"""Time, s, over which the median position is the first guess of the start position.

Chosen: 20 samples at 1 kHz. The start position is refined, so only convergence depends on this."""

METHOD = "refined"
"""Name of this method."""


def identify_refined(
    recording: Recording, valve: Valve, settings: IdentificationSettings | None = None
) -> Result:
    """Identify a record, with an interval and a verdict for each parameter.

    The published method gives the start, with a derivative window that fits the noise. The model is
    then refined until its simulated stem follows the measured stem, with as many extensions as
    the record demands. The scatter between strokes gives the intervals, the intervals the verdicts.

    Parameters
    ----------
    recording : Recording
        Pressure and stem position.
    valve : Valve
        Geometry.
    settings : IdentificationSettings, optional
        As for `published_estimate`; the refinement takes the fixed parameters and the position
        bias. Without a `derivative_window` the start takes one that fits the noise and the
        bandwidth of the record (`MeasuredRecord.fitting_window`).

    Returns
    -------
    Result
        Parameters with intervals and verdicts.

    Raises
    ------
    RefusalError
        If the record does not determine the friction; the message names cause and remedy.
    """
    settings = settings or IdentificationSettings()
    if settings.fixed.get("spring_constant") == 0.0:
        raise RefusalError(
            "the method refined simulates the stem, which no force returns without a spring: use "
            "the method best or robust"
        )
    record = measured(recording)
    require_unbroken(record)
    require_plausible_units(record, valve, settings)
    require_enough_samples(record, settings.published_window)
    require_motion(record)
    require_two_directions(record, settings.published_window)
    require_travel(record, valve)
    require_stem_between_stops(record, valve)
    require_related_signals(record)
    published, warnings = published_beside(record, valve, settings)
    window = settings.derivative_window or record.fitting_window(settings.order)
    mass = settings.fixed.get("mass", settings.assumed_mass)
    start_settings = replace(
        settings, derivative_window=window, fixed={**settings.fixed, "mass": mass}
    )
    start = published_fit(record, valve, start_settings)
    outcome = _refined(record, valve, settings, start.estimate)
    misfit, estimate = outcome.misfit, published or start.estimate
    beside = () if published is None else published.warnings
    notes = [f"published estimate: {warning}" for warning in beside]
    return Result(
        method=METHOD,
        recording=recording,
        valve=valve,
        settings=settings,
        parameters=with_published(outcome.parameters, published),
        fit=misfit.fit,
        rms=misfit.rms,
        misfit=misfit,
        derivative_window=window,
        warnings=tuple(dict.fromkeys([*warnings, *outcome.warnings, *notes])),
        evidence=sweep_evidence(estimate),
        findings=(
            f"fit {100 * misfit.fit:.2f} %: the refined model's stem is "
            f"{stem_distance(misfit.rms, valve)}; {misfit.systematic * 1e6:.3g} µm of it is not "
            "noise",
            f"{sweep_finding(estimate)}; refined from {window}",
        ),
        model=outcome.model,
        exhibit=estimate,
        stem=outcome.stem,
        sliding_speed=outcome.sliding_speed,
    )


class _Outcome(NamedTuple):
    """Outcome of a refinement."""

    parameters: Mapping[str, Parameter]
    misfit: Misfit
    warnings: Sequence[str]
    model: KarnoppParameters
    stem: StemComparison
    sliding_speed: float


def _refined(
    record: MeasuredRecord, valve: Valve, settings: IdentificationSettings, start: Estimate
) -> _Outcome:
    """Refine the model from `start` on, and test it."""
    problem = OutputError(
        condition(record),
        valve,
        settings.position_bias,
        settings.fixed.get("static_friction"),
    )
    refinement = with_demanded(
        problem, _coordinates(start, record), _free_names(settings), _candidates(settings)
    )
    misfit = misfit_of(refinement)
    if misfit.is_gross:
        raise RefusalError(
            f"no friction model reproduces the record (fit {100 * misfit.fit:.0f} %, "
            f"{misfit.systematic * 1e3:.2g} mm of misfit): check that both signals belong to this "
            "valve and that their clocks agree; if the packing was changed during the record, "
            "clear the buffer and record again"
        )
    warnings = []
    if not misfit.describes:
        warnings.append(
            f"the Karnopp model does not describe this valve: {misfit.systematic * 1e6:.3g} µm "
            "between the simulated and the measured stem are more than noise"
        )
    if CLOCK_OFFSET in refinement.names:
        offset = refinement.coordinates[CLOCK_OFFSET]
        warnings.append(
            f"the stamps of the stem are {abs(offset) * 1e3:.3g} ms "
            f"{'late' if offset > 0 else 'early'} against those of the pressure: check the clocks"
        )
    conditioned = problem.record
    return _Outcome(
        refinement_verdicts(refinement, misfit, settings),
        misfit,
        [*time_remarks(record, valve), *warnings],
        problem.model(refinement.coordinates),
        StemComparison(conditioned.sample_period, conditioned.position, refinement.simulated),
        mean_speed(refinement.velocity),
    )


def _coordinates(start: Estimate, recording: Recording) -> dict[str, float]:
    first = max(round(_START_TIME / recording.sample_period), 1)
    values = start.values
    slip = max(values.pop("static_friction") - values["coulomb_friction"], 0.0)
    return {
        **values,
        "coulomb_friction": max(values["coulomb_friction"], 0.0),
        "viscous_friction": max(values["viscous_friction"], 0.0),
        SLIP: slip,
        "stribeck_velocity": 0.0,
        "coulomb_asymmetry": 0.0,
        "viscous_asymmetry": 0.0,
        CLOCK_OFFSET: 0.0,
        START: float(np.median(recording.position[:first])),
    }


def _free_names(settings: IdentificationSettings) -> tuple[str, ...]:
    free = [
        name
        for name in ("coulomb_friction", "viscous_friction", "spring_constant", "spring_preload")
        if name not in settings.fixed
    ]
    if settings.position_bias is not None:
        free.remove("spring_preload")
    return (*free, START)


def _candidates(settings: IdentificationSettings) -> tuple[str, ...]:
    """Return the extensions to test.

    The asymmetry of F_c is tested only where the preload is known: a larger F_c upwards with a
    smaller F_c downwards has the effect of a larger F_0.
    """
    known_preload = settings.position_bias is not None or "spring_preload" in settings.fixed
    candidates = {
        "mass": "mass" not in settings.fixed,
        SLIP: "static_friction" not in settings.fixed,
        "coulomb_asymmetry": known_preload,
        "viscous_asymmetry": True,
        CLOCK_OFFSET: True,
    }
    return tuple(name for name, wanted in candidates.items() if wanted)
