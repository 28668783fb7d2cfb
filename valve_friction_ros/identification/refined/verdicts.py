"""Verdicts on the parameters of a refinement."""

import math
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.refined.output_error import SLIP, START
from valve_friction_ros.identification.refined.refinement import Refinement, estimating_equation
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.limits import (
    FALL_SPEED,
    NO_SLIP,
    finest_half_share,
    too_few_strokes,
)
from valve_friction_ros.identification.trust.misfit import Misfit
from valve_friction_ros.identification.trust.sliding import (
    FINEST_SLIDING,
    SLIDING,
    mean_sliding_friction,
)
from valve_friction_ros.identification.trust.uncertainty import CONFIDENCE, worst_case
from valve_friction_ros.identification.trust.verdict import (
    Parameter,
    fixed,
    not_identifiable,
    with_verdict,
)
from valve_friction_ros.identification.units import CLOCK_OFFSET, UNITS

__all__ = ["refinement_verdicts"]

_SPRING = ("mass", "spring_constant", "spring_preload", CLOCK_OFFSET)
"""Parameters whose verdicts stand where the friction model is doubted: no friction enters them."""

_SLIDING_STEP = 1e-4
"""Step of the sliding friction's differences, in the natural sizes of the coordinates."""

_RECTANGLE = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2) / math.sqrt(3)
"""Half width of an interval over the half width of a rectangular distribution."""


def refinement_verdicts(
    refinement: Refinement, misfit: Misfit, settings: IdentificationSettings
) -> dict[str, Parameter]:
    """Give each parameter of a refined model its verdict.

    The half width of an interval is the standard error by the scatter between strokes, times
    Student's quantile. Where a mass is assumed, the effect of its error is added in squares; the
    error is taken as uniform within plus or minus the mass itself. Where the misfit exceeds noise,
    its largest possible effect (`worst_case`) is added in full. No half width is less than 0.05 %
    of its value, 0.02 % of a spring constant or 0.3 % of a sliding friction.
    """
    covariance = refinement.covariance
    samples = refinement.simulated.size
    systematic = worst_case(refinement.equation.curvature, samples, misfit.excess)
    by_mass = _shift_by_assumed_mass(refinement, settings)
    values = {
        **vars(refinement.problem.model(refinement.coordinates)),
        CLOCK_OFFSET: refinement.coordinates[CLOCK_OFFSET],
    }

    def width_of(gradient: NDArray[np.float64]) -> float:
        bound = _root(float(gradient @ systematic @ gradient))
        lean = _RECTANGLE * abs(float(gradient @ by_mass))
        return math.hypot(covariance.half_width(gradient), lean) + bound

    few = too_few_strokes(samples // max(refinement.stroke, 1))
    doubt = _doubt(refinement, misfit)
    extras = (name for name in refinement.names if name not in (*UNITS, SLIP, START))
    parameters = {}
    for name in (*UNITS, *extras):
        gradient = _gradient(refinement, name, settings)
        if name in settings.fixed:
            parameters[name] = fixed(name, settings.fixed[name])
        elif name == "mass" and name not in refinement.names:
            assumed = refinement.coordinates["mass"]
            parameters[name] = not_identifiable(
                name,
                f"inertia is too small a part of the force to measure; {assumed:g} kg is assumed",
            )
        elif name == "static_friction" and SLIP not in refinement.names:
            parameters[name] = not_identifiable(name, NO_SLIP)
        else:
            error = covariance.standard_error(gradient)
            width = max(width_of(gradient), finest_half_share(name, settings) * abs(values[name]))
            reason = few or ("" if name in _SPRING else doubt)
            parameters[name] = with_verdict(name, values[name], error, width, reason)
    value, gradient = _sliding(refinement)
    error, width = covariance.standard_error(gradient), width_of(gradient)
    width, reason = max(width, FINEST_SLIDING * value), few or _model_doubt(misfit)
    parameters[SLIDING] = with_verdict(SLIDING, value, error, width, reason)
    return parameters


def _sliding(refinement: Refinement) -> tuple[float, NDArray[np.float64]]:
    """Return the sliding friction of the simulated stem, N, and its gradient.

    The velocities stay as they are: they follow from the record, not from one coordinate.
    """
    problem, at, velocity = refinement.problem, refinement.coordinates, refinement.velocity
    value = mean_sliding_friction(problem.model(at), velocity)
    gradient = []
    for name, size in problem.units(refinement.names, at).items():
        moved = problem.model({**at, name: at[name] + _SLIDING_STEP * size})
        change = mean_sliding_friction(moved, velocity) - value
        gradient.append(change / (_SLIDING_STEP * size))
    return value, np.array(gradient)


def _shift_by_assumed_mass(
    refinement: Refinement, settings: IdentificationSettings
) -> NDArray[np.float64]:
    """Change of the free coordinates where the assumed mass is wrong by 100 %."""
    if "mass" in settings.fixed or "mass" in refinement.names:
        return np.zeros(len(refinement.names))
    at = refinement.coordinates
    units = refinement.problem.units((*refinement.names, "mass"), at)
    curvature = estimating_equation(refinement.problem, at, units).curvature
    own, cross = curvature[:-1, :-1], curvature[:-1, -1]
    step = np.linalg.lstsq(own, cross, rcond=1e-14)[0]
    sizes = np.array([*units.values()])[:-1]
    return np.asarray(step * sizes * (at["mass"] / units["mass"]), dtype=np.float64)


def _root(variance: float) -> float:
    return math.sqrt(variance) if variance >= 0 else math.nan


def _model_doubt(misfit: Misfit) -> str:
    """Return why every friction is at most weak, or an empty string."""
    if misfit.describes:
        return ""
    return (
        "the Karnopp model does not describe this valve: "
        f"{misfit.systematic * 1e6:.3g} µm of misfit are not noise"
    )


def _doubt(refinement: Refinement, misfit: Misfit) -> str:
    """Return why what the friction is made of is at most weak, or an empty string."""
    if doubt := _model_doubt(misfit):
        return doubt
    speed = refinement.top_speed
    if speed < FALL_SPEED:
        return (
            f"valid up to {speed * 1e3:.2g} mm/s, the top speed of the record: "
            f"friction may fall further up to {FALL_SPEED * 1e3:.2g} mm/s; record faster strokes"
        )
    return ""


def _gradient(
    refinement: Refinement, name: str, settings: IdentificationSettings
) -> NDArray[np.float64]:
    """Differentiate a parameter with respect to the free coordinates of the refinement."""
    gradient = np.zeros(len(refinement.names))
    if name == "static_friction":
        for part in ("coulomb_friction", SLIP):
            if part in refinement.names:
                gradient[refinement.names.index(part)] = 1.0
    elif name == "spring_preload" and settings.position_bias is not None:
        gradient[refinement.names.index("spring_constant")] = settings.position_bias
    elif name in refinement.names:
        gradient[refinement.names.index(name)] = 1.0
    return gradient
