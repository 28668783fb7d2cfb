"""Extensions of the model that a record demands: each is tested before it is estimated."""

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
"""Standard errors by which an extension must differ from zero to be kept.

Chosen: with the fewest blocks (8, so 7 degrees of freedom) chance reaches it in 9 of 10,000
tests."""

_OFFSET_SIGNIFICANCE = 11.0
"""The same for the clock offset. Chosen: twice as much, since a change of F_c and F_0 has nearly
the same effect on a square wave."""

_FALL_SIGNIFICANCE = 3.0
"""The same for a falling friction. Chosen: less, since it must also halve the misfit
(`_IMPROVEMENT`)."""

_SUSPICION = 1.8
"""Standard errors of the score test above which an extension is tried.

Chosen low: the misfit of a missing extension counts as scatter and hides it. A needless trial
costs time only, because `_SIGNIFICANCE` decides."""

_FRICTIONS = ((1.0, 1.0), (0.7, 1.4), (1.4, 0.7), (1.0, 0.3), (1.0, 2.0))
"""Factors of F_c and F_v for further starts. Chosen: friction shifted from F_v to F_c and back."""

_LIKE_PRESLIDING = (CLOCK_OFFSET, "mass")
"""Extensions that are not tested beside a falling friction. There the stem creeps before it breaks
away (presliding), and an early clock or a large mass has the same effect."""

_DROPS = (0.15, 0.35)
"""Starts for F_s − F_c, as shares of F_c. Chosen around the 0.42 of the graphite packing."""

_SLIP_BIAS = 0.2
"""Share of F_s − F_c by which a model without a slip jump overestimates F_c. Chosen: it only sets a
start."""

_STRIBECK_SHARES = (0.5, 0.7)
"""Starts for the Stribeck velocity, as shares of the top speed. Chosen: slower falls act as
jumps."""

_NEUTRAL = frozenset({SLIP, CLOCK_OFFSET, "coulomb_asymmetry", "viscous_asymmetry"})
"""Extensions that are absent at zero."""

_PROMISING = 0.9
"""Share of the rms that the first fit of a falling friction must reach to be refined.

Chosen: a fit that does not gain 10 % will not halve the misfit (`_IMPROVEMENT`)."""

_OFFSETS = (-2.0, -1.0, -0.5, -0.2, -0.1, 0.1, 0.2, 0.5, 1.0, 2.0)
"""Starts for the clock offset, s. Chosen: wrong clocks are off by up to a few seconds; the steps
follow the lag of a converter (1.3 s) and of a stroke, both sizes of the bench."""

_OFFSETS_TRIED = 4
"""Starts that are fitted: those with the smallest residual. Chosen to bound the time."""

_IMPROVEMENT = 0.5
"""Share of the former misfit that a falling friction or a clock offset must reach to be kept.

Chosen: both change the meaning of F_c, so a small gain is not enough."""

_LEAST_GAIN = 1e-6
"""Distance, m, that an extension must explain. Chosen: below the resolution of stem sensors.

An absolute size: 3.5e-5 of the travel of the bench valve."""

_LIGHTEST_TRIED = 0.01
"""Least mass, kg, to start from where the score test gives less. Chosen: below every real stem."""

_LEAST_SLIP = 0.02
_LEAST_ASYMMETRY = 0.02
"""Least slip force over F_c and least asymmetry of an extension.

Chosen below `WEAK_SHARE`: what is left out changes F_c less than a verdict does."""

_LEAST_OFFSET = 1e-3
"""Least clock offset of an extension, s. Chosen: one period at 1 kHz; a slower record has half of
its own period instead."""


def _deviation(refinement: Refinement, name: str) -> float:
    """Distance of a free coordinate from zero, in standard errors."""
    gradient = np.eye(len(refinement.names))[refinement.names.index(name)]
    error = refinement.covariance.standard_error(gradient)
    return refinement.coordinates[name] / error if error > 0 else 0.0


def _score_tests(
    refinement: Refinement, candidates: Sequence[str]
) -> dict[str, tuple[float, float]]:
    """Estimate, by a Newton step, the value that each candidate would have if it were free.

    A score test: the model was refined without the coordinate. The test correlates its residual
    with the change of the motion that the coordinate would cause.

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
    """Return the candidates that the residual suggests, and their suggested values.

    The misfit of a missing extension counts as scatter here and hides part of it, so a low
    threshold of the test is enough; the decision follows when the extension has been refined.
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
    """Refine `names` and the extensions that the record demands.

    A slip jump (F_s above F_c) is tried first, if the plain model does not describe the record or
    its residual suggests a jump. If the record is still not described, other starts, a clock
    offset, and a friction that falls from F_s to F_c over a range of speeds follow. Of the other
    `candidates`, those that their score test suggests are tried. The significant candidate with
    the smallest residual is kept, until no candidate is left.

    Parameters
    ----------
    problem : OutputError
        Record and valve.
    start : mapping of str to float
        All coordinates to start from.
    names : tuple of str
        The coordinates that are free in any case.
    candidates : sequence of str
        Coordinates to test; `SLIP` is among them if F_s is not fixed.

    Returns
    -------
    Refinement
        The free coordinates are `names` and the extensions kept.
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
    """Return whether the score test of an extension exceeds one standard error."""
    value, error = _score_tests(refinement, (name,))[name]
    return value > error


def _from_elsewhere(problem: OutputError, start: Coordinates, names: tuple[str, ...]) -> Refinement:
    """Refine the plain model from several frictions, where the first start does not describe."""
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
    """Refine with each suspected candidate in turn; return those in which it is significant."""
    sure = []
    for name, value in _suspected(refinement, candidates).items():
        at = {**refinement.coordinates, name: _moderate(name, value)}
        trial = _pruned(refine(refinement.problem, at, (*refinement.names, name)), name)
        if _is_nearer(trial, refinement) and _is_sure(trial, name, refinement.coordinates[name]):
            sure.append(trial)
    return sure


def _is_sure(trial: Refinement, name: str, before: float) -> bool:
    """Return whether a refined coordinate changed significantly, and by a relevant amount."""
    value = trial.coordinates[name]
    change = abs(value - before)
    deviation = _deviation(trial, name)
    error = abs(value / deviation) if deviation else math.inf
    needed = _OFFSET_SIGNIFICANCE if name == CLOCK_OFFSET else _SIGNIFICANCE
    return change > needed * error and change > _least(trial, name)


def _pruned(refinement: Refinement, newest: str) -> Refinement:
    """Drop the extensions that the newest extension has made needless."""
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
    """Return whether a larger model explains at least `_LEAST_GAIN` more of the motion."""
    return before.rms**2 - trial.rms**2 > _LEAST_GAIN**2


def _is_slip(refinement: Refinement) -> bool:
    enough = refinement.coordinates[SLIP] > _least(refinement, SLIP)
    return enough and _deviation(refinement, SLIP) > _SIGNIFICANCE


def _least(refinement: Refinement, name: str) -> float:
    """Return the size below which an extension is left out, however significant it is."""
    if name == CLOCK_OFFSET:
        return max(_LEAST_OFFSET, 0.5 * refinement.problem.record.sample_period)
    if name == SLIP:
        return _LEAST_SLIP * refinement.coordinates["coulomb_friction"]
    return 0.0 if name == "mass" else _LEAST_ASYMMETRY


def _moderate(name: str, value: float) -> float:
    """Limit the value that a score test suggests to a range in which the refinement converges."""
    return max(value, _LIGHTEST_TRIED) if name == "mass" else float(np.clip(value, -0.5, 0.5))


def _falling_starts(
    at: Coordinates, top_speed: float, share_of_top_speed: float
) -> list[Coordinates]:
    """Return falling friction curves with the friction of `at` at the top speed."""
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
    """Try clock offsets; keep the best if it halves the misfit and is significant."""
    problem = plain.problem
    starts = _nearest(problem, [{**start, SLIP: 0.0, CLOCK_OFFSET: offset} for offset in _OFFSETS])
    names = (*plain.names, CLOCK_OFFSET)
    fitted = [least_squares_fit(problem, one, names) for one in starts[:_OFFSETS_TRIED]]
    trial = refine(problem, _nearest(problem, fitted)[0], names)
    improved = misfit_of(trial).systematic < _IMPROVEMENT * misfit_of(plain).systematic
    return trial if improved and _is_sure(trial, CLOCK_OFFSET, 0.0) else plain


def _slipping(plain: Refinement, start: Coordinates) -> Refinement:
    """Try a slip jump; keep it if it is significant."""
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
    """Try a slip jump; if it does not describe the record, a fall over a range of speeds.

    The fall is kept if it halves the misfit, and if drop and Stribeck velocity are significant.
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
    significant = all(_deviation(falling, name) > _FALL_SIGNIFICANCE for name in parts)
    worth = falling.coordinates[SLIP] > _least(falling, SLIP)
    return falling if improved and significant and worth else best
