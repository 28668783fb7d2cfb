# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Most probable coordinates of a model with priors, and their remaining uncertainty."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from sys import float_info
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.engine.broad_model import BroadModel
from valve_friction_ros.identification.engine.coordinates import (
    BOUNDS,
    TIMING,
    Coordinates,
    jacobian,
    physical,
    straight,
)
from valve_friction_ros.identification.engine.fitted_record import inflation, stroke_cells

_ROUNDS = 12
_ROUNDING = 1e-9


def bounded_minimum(
    curvature: NDArray[np.float64], slope: NDArray[np.float64], lowest: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Minimise q'·A·q/2 − b'·q under q ≥ `lowest`, by an active set.

    The `curvature` A is positive semi-definite, with a diagonal of about one, and b is the `slope`;
    `lowest` is at most zero, minus infinity without a bound. A coordinate that would leave its
    range is held at its bound, and the others are solved again; a held coordinate is released where
    the form falls inwards, for half of the rounds at most.
    """
    free = np.ones(slope.size, dtype=np.bool_)
    q = np.zeros_like(slope)
    for turn in range(_ROUNDS):
        rest = slope[free] - curvature[np.ix_(free, ~free)] @ q[~free]
        q[free] = np.linalg.lstsq(curvature[np.ix_(free, free)], rest, rcond=1e-13)[0]
        outside = free & (q < lowest)
        if outside.any():
            q[outside] = lowest[outside]
            free &= ~outside
            continue
        inwards = ~free & (curvature @ q - slope < -_ROUNDING)
        if not inwards.any() or turn > _ROUNDS // 2:
            break
        free |= inwards
    return np.asarray(np.maximum(q, lowest), dtype=np.float64)


_DAMPINGS = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 0.03, 0.3, 3.0)
_SHORTER = (1.0, 0.5, 0.2)
_WORTH = 0.1
"""Fall of the sum of squares, in variances, below which a step is not worth taking."""

_NOISE = 1.2
"""Largest squared difference of the halves that is noise, over what is foreseen.

In right fits of 13 records of a benchmark it is 0.2 to 1.04."""

_LARGEST_CHANGE = 0.5
_LEAST_COMMON = 0.01
_RISES = 1
"""Upward steps that a fit at a held lag may take between two points lower than all before.

Where a stem sticks or breaks away the sum of squares has kinks, which stop a fit that only falls.
"""

_UNSEEN = 1e-15
"""Least curvature over the largest: what the record does not see at all is unknown, not certain."""

_PINNED = 1e-4
"""Deviation, s, of a lag from the value at which a fit pins it."""

_BLOCK = 512
_MOVED = ("coulomb_friction", "viscous_friction", "spring_constant", "spring_preload", "slip_force")


@dataclass(frozen=True, eq=False)
class PosteriorFit:
    """The end of a fit of the free coordinates, `names`, at a place of all coordinates.

    The covariance is that of the free coordinates, with the model linearised there; `misfit` is the
    sum of the squared residuals over their effective variances, not inflated, `penalty` that of the
    squared distances from the priors over their variances, and `steps` the number of points passed.
    The `inflation` is that of the residual, `precision` one over the variance of each prior (0
    without one), `remaining` the step that the linear model would still take, and `residual`
    measured minus simulated readings, m, the mean of both halves. Coordinates that are `kept` stay
    where their priors are centred, and only widen the intervals. No valley leads from the best fit
    to one that `is_apart`.
    """

    model: BroadModel
    names: tuple[str, ...]
    at: Coordinates = field(repr=False)
    covariance: NDArray[np.float64] = field(repr=False)
    misfit: float
    penalty: float
    steps: int
    inflation: float
    precision: NDArray[np.float64] = field(repr=False)
    remaining: NDArray[np.float64] = field(repr=False)
    residual: NDArray[np.float64] = field(repr=False)
    kept: tuple[str, ...] = ()
    is_apart: bool = False

    @property
    def objective(self) -> float:
        """Sum of the squares of residuals and of distances from the priors."""
        return self.misfit + self.penalty

    def cost(self, inflation: float) -> float:
        """Return the objective with the squares of residuals divided by an inflation."""
        return self.misfit / inflation + self.penalty

    def deviation(self, name: str) -> float:
        """Return the deviation of a coordinate by the linear model at the end; 0 if it is held."""
        if name not in self.names:
            return 0.0
        index = self.names.index(name)
        return math.sqrt(max(float(self.covariance[index, index]), 0.0))

    @property
    def plain_misfit(self) -> float:
        """Sum of the squared residuals, including the noise of the pressure."""
        return float(np.sum((self.residual * self.model.weights) ** 2))

    @property
    def lag(self) -> float:
        """Total time by which the stem is seen late, s."""
        return lag_of(self.at)

    @property
    def lags(self) -> NDArray[np.float64]:
        """One for each free coordinate that is part of the lag, shape (p,), else zero."""
        return np.array([float(name in TIMING) for name in self.names])

    @property
    def lag_variance(self) -> float:
        """Variance of the lag by the linear model at the end, s²."""
        return max(float(self.lags @ self.covariance @ self.lags), 0.0)

    @property
    def along_lag(self) -> NDArray[np.float64]:
        """Change of each free coordinate per second of lag, by the same model, shape (p,)."""
        along = self.covariance @ self.lags
        return np.asarray(along / max(float(self.lags @ along), float_info.min))


def lag_of(at: Coordinates) -> float:
    """Return the total time by which the stem is seen late, s."""
    return sum(at[name] for name in TIMING)


def _misfit(model: BroadModel, residual: NDArray[np.float64]) -> float:
    """Sum the products of both halves' residuals: noise of the pressure adds nothing to it.

    The product of two numbers is the square of their mean less that of half their difference. The
    difference is included as far as the noise of the pressure explains it: the simulated stems of
    both halves may go different ways.
    """
    even, odd = residual * model.weights
    mean, apart = float(np.sum((even + odd) ** 2)), float(np.sum((even - odd) ** 2))
    return 0.25 * mean - min(0.25 * apart, _NOISE * model.foreseen_difference)


def _common(own: NDArray[np.float64], cross: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the information that both halves share.

    Noise of the pressure in the derivatives does not enter their products `cross`. Where chance
    leaves less than `_LEAST_COMMON` of the information of one half alone, that share is kept.
    """
    values, vectors = np.linalg.eigh(own)
    root = np.sqrt(np.maximum(values, max(1e-15 * float(values[-1]), float_info.min)))
    shares, turned = np.linalg.eigh((vectors / root).T @ cross @ (vectors / root))
    back = (vectors * root) @ turned
    return np.asarray((back * np.clip(shares, _LEAST_COMMON, 1.0)) @ back.T, dtype=np.float64)


def _information(
    slopes: NDArray[np.float64], scaled: NDArray[np.float64], weights: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Multiply derivatives, (2, p, c), by themselves and by the `scaled` residuals, (2, c).

    Return the products of each half with itself and of one with the other, (p, p), and those of the
    derivatives of one half with the residual of the other, (p,). They are added up block by block:
    for larger blocks NumPy's library starts threads, which wait for one another on a busy machine.
    """
    size, cells = slopes.shape[1:]
    same, apart, gradient = np.zeros((size, size)), np.zeros((size, size)), np.zeros(size)
    for begin in range(0, cells, _BLOCK):
        block = slice(begin, begin + _BLOCK)
        even, odd = slopes[:, :, block] * weights[block]
        total, difference = even + odd, even - odd
        same += total @ total.T
        apart += difference @ difference.T
        gradient += even @ scaled[1, block] + odd @ scaled[0, block]
    return 0.25 * (same + apart), 0.25 * (same - apart), 0.5 * gradient


class _Problem:
    """The linear problem at one place, in straight coordinates scaled to unit curvature."""

    def __init__(
        self,
        model: BroadModel,
        at: Coordinates,
        names: tuple[str, ...],
        deviations: Mapping[str, float],
        centre: Coordinates,
        readings: NDArray[np.float64],
        pinned: float | None,
    ) -> None:
        record = model.record
        self.model, self.at, self.names = model, at, names
        self.centre, self.deviations, self.pinned = centre, deviations, pinned
        self.residual = record.position - readings
        scaled = self.residual * model.weights
        self.inflation = inflation(scaled.mean(axis=0), stroke_cells(record))
        self.precision = np.array(
            [1.0 / deviations[name] ** 2 if name in deviations else 0.0 for name in names]
        )
        self.distance = np.array([at[name] - centre.get(name, 0.0) for name in names])
        self.jacobian = jacobian(at, names)
        size = np.abs(np.diag(self.jacobian))
        slopes = model.sensitivity(at, names, readings)
        own, cross, gradient = _information(slopes, scaled, model.weights)
        precision = np.diag(self.precision * size**2)
        pull = -self.precision * size * self.distance
        if pinned is not None:
            lags = np.array([float(name in TIMING) for name in names])
            precision += np.outer(lags, lags) / _PINNED**2
            pull -= lags * (lag_of(at) - pinned) / _PINNED**2
        diagonal = np.diag(own) / self.inflation + np.diag(precision)
        self.scale = np.where(diagonal > 0, np.sqrt(np.abs(diagonal)), 1.0)
        outer = np.outer(self.scale, self.scale) * self.inflation
        information = _common(own / outer, cross / outer)
        self.curvature = information + precision / np.outer(self.scale, self.scale)
        self.slope = (gradient / self.inflation + pull) / self.scale
        self.straight = straight(at, names)
        lowest = [BOUNDS.get(name, -np.inf) - self.straight[name] for name in names]
        self.lowest = np.minimum(np.array(lowest) * self.scale, 0.0)

    def covariance(self) -> NDArray[np.float64]:
        """Posterior covariance of the free coordinates, with the model linearised here."""
        values, vectors = np.linalg.eigh(self.curvature)
        seen = np.maximum(values, _UNSEEN * max(float(values[-1]), 1.0))
        inverse = (vectors / seen) @ vectors.T / np.outer(self.scale, self.scale)
        return np.asarray(self.jacobian @ inverse @ self.jacobian.T)

    def step(self, damping: float) -> NDArray[np.float64]:
        damped = self.curvature + damping * np.eye(self.scale.size)
        return np.asarray(bounded_minimum(damped, self.slope, self.lowest) / self.scale)

    def gain(self, step: NDArray[np.float64]) -> float:
        scaled = step * self.scale
        return float(2.0 * self.slope @ scaled - scaled @ self.curvature @ scaled)

    @property
    def here(self) -> float:
        """The objective at the place itself."""
        return self.objective(self.at, self.model.record.position - self.residual)

    def objective(self, at: Coordinates, readings: NDArray[np.float64]) -> float:
        misfit = _misfit(self.model, self.model.record.position - readings)
        away = 0.0 if self.pinned is None else (lag_of(at) - self.pinned) / _PINNED
        return misfit / self.inflation + self.penalty(at) + away**2

    def penalty(self, at: Coordinates) -> float:
        """Squared distances from the priors, including those of coordinates that are not free."""
        return sum(
            ((at[name] - self.centre.get(name, 0.0)) / deviation) ** 2
            for name, deviation in self.deviations.items()
        )

    def moved(self, step: NDArray[np.float64]) -> dict[str, float]:
        there = dict(self.straight)
        for name, change in zip(self.names, step.tolist(), strict=True):
            there[name] = max(there[name] + change, BOUNDS.get(name, -np.inf))
        return physical(there, self.names)

    def largest_share(self, step: NDArray[np.float64]) -> float:
        """Share of a step that changes no force by more than half of its size."""
        share = 1.0
        for name, change in zip(self.names, step.tolist(), strict=True):
            if name in _MOVED and change != 0:
                size = 1e5 * self.model.step(self.at, name) / self.model.coarseness
                if name == "slip_force":
                    size = self.straight["coulomb_friction"] + 1e-12
                share = min(share, _LARGEST_CHANGE * size / abs(change))
        return share


class _Move(NamedTuple):
    """A step of a fit: where it leads, the readings there, and how far the objective falls."""

    at: dict[str, float]
    readings: NDArray[np.float64]
    fall: float


def _descended(problem: _Problem) -> _Move:
    """Take the first step that leads down, or the step that leads up the least."""
    now, moves = problem.here, []
    for damping in _DAMPINGS:
        step = problem.step(damping)
        share = problem.largest_share(step)
        for shorter in _SHORTER if damping == 0 else (1.0,):
            there = problem.moved(share * shorter * step)
            readings = problem.model.readings(there)
            move = _Move(there, readings, now - problem.objective(there, readings))
            if move.fall > 0.0:
                return move
            moves.append(move)
    return max(moves, key=lambda one: one.fall)


def fit(
    model: BroadModel,
    start: Coordinates,
    names: tuple[str, ...],
    deviations: Mapping[str, float],
    centre: Coordinates,
    steps: int,
    pinned: float | None = None,
) -> PosteriorFit:
    """Descend from `start` to the most probable coordinates, by the Gauss–Newton method.

    With the readings y, those of the model h(θ), the weights W and the priors N(c, Λ⁻¹), the sum

        |W·(y − h(θ))|²/κ + (θ − c)ᵀ·Λ·(θ − c)

    is minimised; κ is the `inflation` of the residual. The posterior covariance is

        (HᵀW²H/κ + Λ)⁻¹ .

    The simulated stem carries noise of the pressure, and less of it the more the model damps; a
    plain sum of squares would take that for information. In each product one factor is therefore
    from the even samples of the pressure, the other from the odd samples, whose noise is
    independent.

    The coordinates `names` are free. Those without one of the `deviations` have no prior; a prior
    without a `centre` is about 0. With 0 `steps` the posterior at `start` is returned. A fit that
    is `pinned` keeps this total lag, s.
    """
    at = dict(start)
    problem = _Problem(model, at, names, deviations, centre, model.readings(at), pinned)
    best, passed, risen, rises = problem, 1, 0, 0 if pinned is None else _RISES
    for _ in range(steps):
        if problem.gain(problem.step(0.0)) < _WORTH:
            break
        move = _descended(problem)
        risen = 0 if best.objective(move.at, move.readings) < best.here else risen + 1
        if risen > rises:
            break
        problem = _Problem(model, move.at, names, deviations, centre, move.readings, pinned)
        if not risen:
            best, passed = problem, passed + 1
        if abs(move.fall) < _WORTH:
            break
    problem = best
    remaining = problem.jacobian @ problem.step(0.0)
    return PosteriorFit(
        model,
        names,
        problem.at,
        problem.covariance(),
        _misfit(model, problem.residual),
        problem.penalty(problem.at),
        passed,
        problem.inflation,
        problem.precision,
        remaining,
        problem.residual.mean(axis=0),
    )
