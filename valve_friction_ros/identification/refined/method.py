"""Method "sweep": the published sweep, refined, with intervals, verdicts, a test of the model."""

import math
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.assessment import Assessment
from valve_friction_ros.identification.published.estimate import Estimate
from valve_friction_ros.identification.published.identify import identify
from valve_friction_ros.identification.published.judgement import judge_regression
from valve_friction_ros.identification.published.regression_uncertainty import (
    regression_uncertainty,
)
from valve_friction_ros.identification.published.sweep import Sweep
from valve_friction_ros.identification.refined.judgement import judge_refinement
from valve_friction_ros.identification.refined.model_selection import with_demanded
from valve_friction_ros.identification.refined.model_test import misfit_of
from valve_friction_ros.identification.refined.output_error import OFFSET, SLIP, START, OutputError
from valve_friction_ros.identification.refined.refinement import Refinement
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.excitation import (
    require_enough_samples,
    require_motion,
    require_related_signals,
    require_stem_between_stops,
    require_travel,
    require_two_directions,
)
from valve_friction_ros.model.karnopp_parameters import KarnoppParameters
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals.conditioned_record import condition
from valve_friction_ros.signals.derivative_window import fitting_window

__all__ = ["SweepAssessment", "assess"]

_START_TIME = 0.02


@dataclass(frozen=True, eq=False)
class SweepAssessment(Assessment):
    """The refined model, beside the published sweep.

    Attributes
    ----------
    start : Estimate
        The published method with the derivative window that the record asks for.
    force_fit : float
        Share of the force that `start` reproduces.
    refinement : Refinement or None
        The refined model and its residual; None without a spring, where the stem cannot be
        simulated.
    """

    method: ClassVar[str] = "sweep"

    start: Estimate
    force_fit: float
    refinement: Refinement | None = field(repr=False)

    @property
    def fit(self) -> float:
        """Share of the stem's movement that is reproduced; without a spring, of the force."""
        return self.force_fit if self.misfit is None else self.misfit.fit

    @property
    def rms(self) -> float:
        """Root mean square of simulated less measured position, m; nan without a spring."""
        return math.nan if self.misfit is None else self.misfit.rms

    @property
    def window(self) -> int:
        """Derivative window that the record asks for, samples."""
        return self.start.settings.window

    @property
    def sweep(self) -> Sweep:
        """The published sweep; where it has no answer, that of the start."""
        return (self.published or self.start).sweep

    @property
    def simulated(self) -> NDArray[np.float64] | None:
        """Position of the refined model's stem, m, None without a spring."""
        return None if self.refinement is None else self.refinement.simulated

    def model(self) -> KarnoppParameters:
        """Return the refined model, or without a spring the regressed one, to simulate.

        Raises
        ------
        ValueError
            If a regressed value is impossible; the message names it.
        """
        if self.refinement is None:
            return self.start.parameters()
        return self.refinement.problem.model(self.refinement.coordinates)


def assess(
    recording: Recording,
    valve: Valve,
    settings: IdentificationSettings | None = None,
    window: int | None = None,
) -> SweepAssessment:
    """Identify a record and say how far each number can be trusted.

    The published method starts it, with a derivative window that fits the noise. The model is
    then refined until its simulated stem follows the measured one, with as many extensions as
    the record demands; the scatter between strokes gives the intervals, and these the verdicts.

    Parameters
    ----------
    recording : Recording
        Pressure and stem position.
    valve : Valve
        Geometry.
    settings : IdentificationSettings, optional
        As for `identify`; the refinement takes the fixed parameters and the position bias.
    window : int, optional
        Derivative window of the start, samples; by default the record's noise and bandwidth
        choose it (`fitting_window`). The published estimate takes that of `settings`.

    Returns
    -------
    SweepAssessment
        Parameters with intervals and verdicts.

    Raises
    ------
    RefusalError
        If the record cannot tell; the message says what to do.
    """
    settings = settings or IdentificationSettings()
    require_enough_samples(recording, settings.window)
    require_motion(recording)
    require_two_directions(recording, settings.window)
    require_travel(recording, valve)
    require_stem_between_stops(recording, valve)
    has_spring = settings.fixed.get("spring_constant") != 0.0
    if has_spring:
        require_related_signals(recording)
    published, warnings = _published(recording, valve, settings)
    start_settings = replace(settings, window=window or fitting_window(recording, settings.order))
    if not has_spring:
        return _without_spring(recording, valve, start_settings, published, warnings)
    mass = settings.fixed.get("mass", settings.assumed_mass)
    start_settings = replace(start_settings, fixed={**settings.fixed, "mass": mass})
    start = identify(recording, valve, start_settings)
    problem = OutputError(
        condition(recording),
        valve,
        settings.position_bias,
        settings.fixed.get("static_friction"),
    )
    refinement = with_demanded(
        problem,
        _coordinates(start, recording),
        _free_names(settings),
        _candidates(settings),
    )
    misfit = misfit_of(refinement)
    if misfit.is_gross:
        raise RefusalError(
            f"no friction model reproduces the record (fit {100 * misfit.fit:.0f} %, "
            f"{misfit.systematic * 1e3:.2g} mm of misfit): check for the wrong valve, clocks far "
            "apart, or a packing that changed meanwhile (then clear the buffer and record anew)"
        )
    if not misfit.describes:
        warnings.append(
            f"the Karnopp model does not describe this valve: {misfit.systematic * 1e6:.3g} µm "
            "between the simulated and the measured stem are not noise"
        )
    if OFFSET in refinement.names:
        offset = refinement.coordinates[OFFSET]
        warnings.append(
            f"the stamps of the stem are {abs(offset) * 1e3:.3g} ms "
            f"{'late' if offset > 0 else 'early'} against those of the pressure: check the clocks"
        )
    return SweepAssessment(
        MappingProxyType(judge_refinement(refinement, misfit, settings)),
        published,
        misfit,
        tuple(warnings),
        start,
        regression_uncertainty(recording, valve, start).fit,
        refinement,
    )


def _published(
    recording: Recording, valve: Valve, settings: IdentificationSettings
) -> tuple[Estimate | None, list[str]]:
    """Identify as published; a refusal there is no more than a warning here."""
    try:
        return identify(recording, valve, settings), []
    except RefusalError as refusal:
        return None, [f"the published method has no answer: {refusal}"]


def _without_spring(
    recording: Recording,
    valve: Valve,
    settings: IdentificationSettings,
    published: Estimate | None,
    warnings: list[str],
) -> SweepAssessment:
    estimate = identify(recording, valve, settings)
    regression = regression_uncertainty(recording, valve, estimate)
    return SweepAssessment(
        MappingProxyType(judge_regression(estimate, regression, settings)),
        published,
        None,
        (*warnings, *estimate.warnings),
        estimate,
        regression.fit,
        None,
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
        OFFSET: 0.0,
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
    """Extensions to test.

    Between the ways, Coulomb friction can be told apart only where the preload is known: a
    larger F_c upwards and a smaller one downwards are just a larger F_0.
    """
    known_preload = settings.position_bias is not None or "spring_preload" in settings.fixed
    candidates = {
        "mass": "mass" not in settings.fixed,
        SLIP: "static_friction" not in settings.fixed,
        "coulomb_asymmetry": known_preload,
        "viscous_asymmetry": True,
        OFFSET: True,
    }
    return tuple(name for name, wanted in candidates.items() if wanted)
