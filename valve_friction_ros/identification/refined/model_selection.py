"""Which parts of the model a record demands: each is tested before it is estimated."""

import math
from collections.abc import Sequence

import numpy as np

from valve_friction_ros.identification.refined.model_test import misfit_of
from valve_friction_ros.identification.refined.output_error import (
    SLIP,
    Coordinates,
    OutputError,
)
from valve_friction_ros.identification.refined.refinement import (
    Refinement,
    estimating_equation,
    extended,
    least_squares_fit,
    refine,
)
from valve_friction_ros.identification.trust.uncertainty import plain_sandwich
from valve_friction_ros.identification.units import CLOCK_OFFSET

__all__ = ["with_demanded"]

_SIGNIFICANCE = 5.5
"""Standard errors by which a part of the model must differ from nothing to be estimated."""

_OFFSET_SIGNIFICANCE = 11.0
"""The same for the clock offset, which on a square wave F_c and F_0 nearly make up for."""

_FALL_SIGNIFICANCE = 3.0
"""The same for a falling friction, which has halved the misfit before it is asked."""

_SUSPICION = 1.8
"""Standard errors of the score test from which on a part of the model is tried."""

_FRICTIONS = ((1.0, 1.0), (0.7, 1.4), (1.4, 0.7), (1.0, 0.3), (1.0, 2.0))
"""Factors of F_c and F_v to start from."""

_LIKE_PRESLIDING = (CLOCK_OFFSET, "mass")
"""A stem that creeps before it breaks away, as where friction falls it does, looks like one that
is early, or heavy."""

_DROPS = (0.15, 0.35)
"""Starts for F_s − F_c, as shares of F_c."""

_SLIP_BIAS = 0.2
"""Share of a slip jump by which a model without one sees too much Coulomb friction, about."""

_STRIBECK_SHARES = (0.5, 0.7)
"""Starts for the Stribeck velocity, as shares of the top speed."""

_NEUTRAL = frozenset({SLIP, CLOCK_OFFSET, "coulomb_asymmetry", "viscous_asymmetry"})
"""Parts of the model that are absent at zero."""

_PROMISING = 0.9
"""Share of the rms to which a falling curve must come at first sight to be looked at further."""

_OFFSETS = (-2.0, -1.0, -0.5, -0.2, -0.1, 0.1, 0.2, 0.5, 1.0, 2.0)
"""Starts for the clock offset, s."""

_OFFSETS_TRIED = 4
"""Of these, the nearest to the measured stem are refined."""

_IMPROVEMENT = 0.5
"""Share of its misfit to which a falling friction curve, or another clock, must bring it."""

_LEAST_GAIN = 1e-6
"""Distance, m, that a part of the model must account for: what is less is in no real record."""

_LIGHTEST_TRIED = 0.01
"""Mass, kg, to start from at least, where the score test asks for less."""

_LEAST_SLIP = 0.02
_LEAST_ASYMMETRY = 0.02
_LEAST_OFFSET = 1e-3
"""Slip force over F_c, asymmetry and clock offset (s) that are worth a parameter."""


def _deviation(refinement: Refinement, name: str) -> float:
    """Distance of a free coordinate from zero, in standard errors."""
    gradient = np.eye(len(refinement.names))[refinement.names.index(name)]
    error = refinement.covariance.standard_error(gradient)
    return refinement.coordinates[name] / error if error > 0 else 0.0


def _score_tests(
    refinement: Refinement, candidates: Sequence[str]
) -> dict[str, tuple[float, float]]:
    """Estimate what each coordinate that is not free would become if it were, in a Newton step.

    A score test: the model is refined without the coordinate, and the residual that this leaves
    is asked whether it is correlated with the motion that the coordinate would add.

    Returns
    -------
    dict of str to tuple of float
        Estimate of the coordinate, and its standard error, in its own unit.
    """
    problem, at = refinement.problem, refinement.coordinates
    own = estimating_equation(problem, at, problem.units(refinement.names, at))
    steps = {}
    for name, unit in problem.units(tuple(candidates), at).items():
        equation = extended(own, problem, at, {name: unit})
        covariance = plain_sandwich(equation, refinement.stroke)
        error = math.sqrt(float(covariance[-1, -1]))
        steps[name] = at[name] + float(equation.newton_step()[-1]) * unit, error * unit
    return steps


def _suspected(refinement: Refinement, candidates: Sequence[str]) -> dict[str, float]:
    """Return the candidates that the residual asks for, and the values it asks for.

    The misfit that a missing part leaves counts as scatter here and hides some of it, so a
    suspicion is enough; whether the part is there is judged when it has been refined.
    """
    suspects = {}
    for name, (value, error) in _score_tests(refinement, candidates).items():
        change = abs(value - refinement.coordinates[name])
        if error > 0 and change > _SUSPICION * error and change > _least(refinement, name):
            suspects[name] = value
    return suspects


def with_demanded(
    problem: OutputError, start: Coordinates, names: tuple[str, ...], candidates: Sequence[str]
) -> Refinement:
    """Refine `names`, and beside them what the record demands.

    Where the plain model does not describe the record, or its residual leans towards it, a slip
    jump (F_s above F_c) is tried first. If the record is still not described, other starts are,
    another clock, and a friction that falls from F_s to F_c over a range of speeds. Of the other
    `candidates`, those that their score test asks for are tried; the one that surely is there and
    brings the simulated stem nearest is kept, until none is left.

    Parameters
    ----------
    problem : OutputError
        Record and valve.
    start : mapping of str to float
        All coordinates to start from.
    names : tuple of str
        The coordinates that are free in any case.
    candidates : sequence of str
        Coordinates to be tested; `SLIP` among them, if F_s is not fixed.

    Returns
    -------
    Refinement
        With as many free coordinates as the record demands.
    """
    refinement = refine(problem, {**start, SLIP: 0.0}, names)
    may_slip = SLIP in candidates
    if may_slip and not misfit_of(refinement).describes:
        refinement = _slipping(refinement, start)
    if not misfit_of(refinement).describes:
        refinement = _from_elsewhere(problem, {**start, SLIP: 0.0}, names)
        if CLOCK_OFFSET in candidates:
            refinement = _with_offset(refinement, start)
        if may_slip:
            refinement = _with_slip(refinement, start)
    elif may_slip and SLIP not in refinement.names and _is_suspected(refinement, SLIP):
        refinement = _slipping(refinement, start)
    left = [name for name in candidates if name != SLIP and name not in refinement.names]
    if "stribeck_velocity" in refinement.names:
        left = [name for name in left if name not in _LIKE_PRESLIDING]
    while trials := _sure_trials(refinement, left):
        refinement = min(trials, key=lambda trial: trial.rms)
        left = [name for name in left if name not in refinement.names]
    return refinement


def _is_suspected(refinement: Refinement, name: str) -> bool:
    """Tell whether the residual leans towards a part of the model, if only a little."""
    value, error = _score_tests(refinement, (name,))[name]
    return value > error


def _from_elsewhere(problem: OutputError, start: Coordinates, names: tuple[str, ...]) -> Refinement:
    """Refine the plain model from several frictions, where the first start led nowhere."""
    starts = [
        {
            **start,
            "coulomb_friction": coulomb * start["coulomb_friction"],
            "viscous_friction": viscous * start["viscous_friction"],
        }
        for coulomb, viscous in _FRICTIONS
    ]
    fitted = [least_squares_fit(problem, one, names) for one in starts]
    return refine(problem, _nearest(problem, fitted)[0], names)


def _sure_trials(refinement: Refinement, candidates: Sequence[str]) -> list[Refinement]:
    """Refine with each suspected candidate in turn; return those in which it surely is there."""
    sure = []
    for name, value in _suspected(refinement, candidates).items():
        at = {**refinement.coordinates, name: _moderate(name, value)}
        trial = _pruned(refine(refinement.problem, at, (*refinement.names, name)), name)
        if _is_nearer(trial, refinement) and _is_sure(trial, name, refinement.coordinates[name]):
            sure.append(trial)
    return sure


def _is_sure(trial: Refinement, name: str, before: float) -> bool:
    """Tell whether a refined coordinate has surely and noticeably left its former value."""
    value = trial.coordinates[name]
    change = abs(value - before)
    deviation = _deviation(trial, name)
    error = abs(value / deviation) if deviation else math.inf
    needed = _OFFSET_SIGNIFICANCE if name == CLOCK_OFFSET else _SIGNIFICANCE
    return change > needed * error and change > _least(trial, name)


def _pruned(refinement: Refinement, newest: str) -> Refinement:
    """Drop what the newest part of the model has made needless."""
    if "stribeck_velocity" in refinement.names:
        return refinement
    for name in refinement.names:
        if name not in _NEUTRAL or name == newest or _stays(refinement, name):
            continue
        names = tuple(one for one in refinement.names if one != name)
        rest = refine(refinement.problem, {**refinement.coordinates, name: 0.0}, names)
        return _pruned(rest, newest)
    return refinement


def _stays(refinement: Refinement, name: str) -> bool:
    return _is_slip(refinement) if name == SLIP else _is_sure(refinement, name, 0.0)


def _is_nearer(trial: Refinement, before: Refinement) -> bool:
    """Tell whether a larger model brings the simulated stem nearer by more than nothing."""
    return before.rms**2 - trial.rms**2 > _LEAST_GAIN**2


def _is_slip(refinement: Refinement) -> bool:
    enough = refinement.coordinates[SLIP] > _least(refinement, SLIP)
    return enough and _deviation(refinement, SLIP) > _SIGNIFICANCE


def _least(refinement: Refinement, name: str) -> float:
    """Return the size below which a part of the model is of no consequence, however sure."""
    if name == CLOCK_OFFSET:
        return max(_LEAST_OFFSET, 0.5 * refinement.problem.record.sample_period)
    if name == SLIP:
        return _LEAST_SLIP * refinement.coordinates["coulomb_friction"]
    return 0.0 if name == "mass" else _LEAST_ASYMMETRY


def _moderate(name: str, value: float) -> float:
    """Keep the first step from a test where the simulation can follow."""
    return max(value, _LIGHTEST_TRIED) if name == "mass" else float(np.clip(value, -0.5, 0.5))


def _falling_starts(
    at: Coordinates, top_speed: float, share_of_top_speed: float
) -> list[Coordinates]:
    """Friction curves that fall, and reach at the top speed what the one at `at` reaches."""
    highest = at["coulomb_friction"] + at["viscous_friction"] * top_speed
    starts: list[Coordinates] = []
    for drop in _DROPS:
        if share_of_top_speed == 0.0:
            coulomb_friction = (1 - _SLIP_BIAS * drop) * at["coulomb_friction"]
        else:
            coulomb_friction = (1 - drop) * at["coulomb_friction"]
        starts.append(
            {
                **at,
                "coulomb_friction": coulomb_friction,
                "viscous_friction": (highest - coulomb_friction) / top_speed,
                SLIP: drop * at["coulomb_friction"],
                "stribeck_velocity": share_of_top_speed * top_speed,
            }
        )
    return starts


def _nearest(problem: OutputError, candidates: Sequence[Coordinates]) -> list[Coordinates]:
    """Sort candidates by the distance of their simulated stem from the measured one."""
    pressure = problem.record.pressure
    return sorted(candidates, key=lambda one: float(np.mean(problem.residual(one, pressure) ** 2)))


def _with_offset(plain: Refinement, start: Coordinates) -> Refinement:
    """Try clocks that differ; keep the best if it halves the misfit and surely is there."""
    problem = plain.problem
    starts = _nearest(problem, [{**start, SLIP: 0.0, CLOCK_OFFSET: offset} for offset in _OFFSETS])
    names = (*plain.names, CLOCK_OFFSET)
    fitted = [least_squares_fit(problem, one, names) for one in starts[:_OFFSETS_TRIED]]
    trial = refine(problem, _nearest(problem, fitted)[0], names)
    improved = misfit_of(trial).systematic < _IMPROVEMENT * misfit_of(plain).systematic
    return trial if improved and _is_sure(trial, CLOCK_OFFSET, 0.0) else plain


def _slipping(plain: Refinement, start: Coordinates) -> Refinement:
    """Try a slip jump; keep it if it surely is there."""
    problem = plain.problem
    names = (*plain.names, SLIP)
    offset = {CLOCK_OFFSET: plain.coordinates[CLOCK_OFFSET]}
    starts = [
        {**start, **offset},
        *_falling_starts(plain.coordinates, plain.top_speed, 0.0),
        *_falling_starts({**start, **offset}, plain.top_speed, 0.0),
    ]
    fitted = [least_squares_fit(problem, one, names) for one in _nearest(problem, starts)[:2]]
    slip = refine(problem, _nearest(problem, fitted)[0], names)
    return slip if _is_nearer(slip, plain) and _is_slip(slip) else plain


def _with_slip(plain: Refinement, start: Coordinates) -> Refinement:
    """Try a slip jump; where it does not describe, a friction that falls over a range of speeds.

    The fall is kept if it halves the misfit, and the drop and its range of speeds are told.
    """
    problem = plain.problem
    best = _slipping(plain, start)
    before = misfit_of(best)
    if before.describes:
        return best
    names = (*plain.names, SLIP, "stribeck_velocity")
    fitted = [
        least_squares_fit(
            problem, _falling_starts(plain.coordinates, plain.top_speed, share)[-1], names
        )
        for share in _STRIBECK_SHARES
    ]
    nearest = _nearest(problem, fitted)[0]
    distance = float(np.sqrt(np.mean(problem.residual(nearest, problem.record.pressure) ** 2)))
    if distance > _PROMISING * best.rms:
        return best
    falling = refine(problem, nearest, names)
    improved = misfit_of(falling).systematic < _IMPROVEMENT * before.systematic
    parts = (SLIP, "stribeck_velocity")
    told = all(_deviation(falling, name) > _FALL_SIGNIFICANCE for name in parts)
    worth = falling.coordinates[SLIP] > _least(falling, SLIP)
    return falling if improved and told and worth else best
