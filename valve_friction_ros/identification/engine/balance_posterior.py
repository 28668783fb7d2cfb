# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Posterior of the force balance: lag, fall of friction with speed, rare imperfections."""

import copy
import itertools
import math
from collections.abc import Mapping, Sequence
from sys import float_info
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.engine.balance_regression import (
    Regression,
    Solved,
    inverse,
)
from valve_friction_ros.identification.engine.fitted_record import inflation
from valve_friction_ros.identification.engine.intervals import ROUNDING, Estimated
from valve_friction_ros.identification.engine.lags import (
    USUAL_LAG,
    LagProfile,
    mixture_half_width,
    normal,
    share_of_timing,
)
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.trust.verdict import FALL_SPEED

_Array = NDArray[np.float64]

_USUAL_VISCOUS = 1.0
"""Scale of the prior of viscous over dry friction at the sliding speed, Student's t of two degrees
of freedom. The packings of the paper have 0.3 to 0.8."""

_FALLS = np.geomspace(3e-4, FALL_SPEED, 8)
_SLIPPING, _SLIP, _SLIP_SPREAD = 0.5, 0.35, 0.2
"""Stribeck speeds of packings, m/s, each as likely as the next; the share of packings that slip,
and mean and deviation of their slip force over the friction: F_s is 1.15 to 2 times F_c.

A slower record does not show how far friction falls: these values then apply to dry and viscous
friction."""

_STRIBECK_SPEEDS = np.geomspace(0.04, 0.6, 8)
_STRIBECK_WORTH = 1.05
_STRIBECK_OPEN = 1.08
"""Stribeck speeds over twice the mean speed; factor by which one must lower the residual to be
accepted; and factor of the residual up to which others stay open."""

_OF_NO_LAW = (SLIDING, "spring_constant", "spring_preload", "mass")
"""Numbers that do not depend on a law of friction over speed."""

_SPLIT = ("coulomb_friction", "viscous_friction")
"""Components of the friction once it has ceased to fall with speed."""

_RARE = ("along_travel", "in_record", "viscous_asymmetry", "curvature", "cubic", "drift")
_HOW_RARE, _ABSENT = 0.25, 0.1
_LEAST_PROBABLE = 1e-2
"""Imperfections that most plants do not have: the share of plants that have each; the deviation of
its prior in the other plants over that in these; and the least probability, over the likeliest, of
a choice of imperfections that is kept. Two that compensate each other are then less probable than
none.

Chosen: most plants have one or two of the six."""

_LARGEST_SCATTER = 25.0
"""Factor by which the scatter of the strokes widens the covariance at most."""


class _Choice(NamedTuple):
    """Probability of a choice of imperfections or of a fall, and the solution with it alone."""

    probability: float
    estimate: _Array
    covariance: _Array
    scores: _Array


def _choices(regression: Regression, solved: Solved, scores: _Array) -> list[_Choice]:
    """Return the solution for each probable choice of the imperfections that the plant has.

    Those of `_RARE` that it does not have keep a prior so narrow that they hardly matter.
    """
    rare = [index for index, name in enumerate(regression.names) if name in _RARE]
    chosen = np.array(list(itertools.product((0.0, 1.0), repeat=len(rare))))
    precision = np.tile(solved.precision, (len(chosen), 1))
    precision[:, rare] *= np.where(chosen > 0.0, 1.0, _ABSENT**-2.0)
    whole = solved.information + np.eye(precision.shape[1]) * precision[:, None, :]
    covariance = inverse(whole)
    drawn = solved.right + precision * solved.expected
    estimate = np.einsum("sij,sj->si", covariance, drawn)
    log_evidence = np.sum(drawn * estimate, axis=1) - np.linalg.slogdet(whole)[1]
    log_evidence += np.sum(np.log(precision[:, rare]), axis=1)
    log_odds = math.log(_HOW_RARE / (1.0 - _HOW_RARE)) * np.sum(chosen, axis=1)
    return [
        _Choice(share, estimate[at], covariance[at], scores)
        for at, share in _probable(0.5 * log_evidence + log_odds)
    ]


def _falls(regression: Regression, solved: Solved, variance: float) -> list[_Choice]:
    """Return the solution for each probable fall of the friction with speed, including no fall.

    What the record leaves open of the fall stays open in dry and viscous friction.
    """
    count = len(regression.names) + (not regression.lag.is_known)
    plain = [one[:, :count] for one in solved.columns]
    forces = [
        residual + columns @ solved.estimate
        for residual, columns in zip(solved.residual, solved.columns, strict=True)
    ]
    weight = solved.weight
    found, logs = [], []
    for stribeck in (0.0, *_FALLS.tolist()) if regression.dry >= 0 else (0.0,):
        columns, precision = plain, solved.precision[:count]
        expected = solved.expected[:count]
        if stribeck:
            slip = regression.slip(stribeck) * regression.friction
            columns = [np.column_stack([one, slip]) for one in plain]
            precision = np.append(precision, _SLIP_SPREAD**-2.0)
            expected = np.append(expected, _SLIP)
        information, right = regression.normal_equations(forces, columns, weight, variance)
        whole = information + np.diag(precision)
        covariance = inverse(whole)
        estimate = covariance @ (right + precision * expected)
        left = [force - one @ estimate for force, one in zip(forces, columns, strict=True)]
        log = -float(weight @ (0.5 * (left[0] + left[1])) ** 2) / variance
        log -= float(precision @ (estimate - expected) ** 2)
        log += np.sum(np.log(precision[count:])) - np.linalg.slogdet(whole)[1]
        frictions = [regression.dry, -1] if stribeck else [regression.dry]
        sure = estimate[frictions] / np.sqrt(np.diag(covariance)[frictions])
        positive = float(np.prod(normal(sure)))
        share = _SLIPPING / _FALLS.size if stribeck else 1.0 - _SLIPPING
        found.append((estimate, covariance, left, columns))
        logs.append(0.5 * log + math.log(share * max(positive, 1e-10)))
    return [
        _Choice(share, *found[at][:2], _scores(regression, *found[at][2:], weight, variance))
        for at, share in _probable(np.array(logs))
    ]


def _scores(
    regression: Regression,
    residual: list[_Array],
    columns: list[_Array],
    weight: _Array,
    variance: float,
) -> _Array:
    """Return the information from the scatter of the strokes."""
    blocks = regression.blocks
    scores = np.stack(
        [
            0.5
            / variance
            * sum(
                (weight[block] * residual[1 - half][block]) @ columns[half][block]
                for half in (0, 1)
            )
            for block in blocks
        ]
    )
    return np.asarray((scores.T @ scores) * len(blocks) / (len(blocks) - 1))


def _probable(logs: _Array) -> list[tuple[int, float]]:
    """Return which choices are probable, by the logarithms of their probabilities, and how much."""
    probability = np.exp(logs - np.max(logs))
    kept = np.flatnonzero(probability > _LEAST_PROBABLE)
    probability /= np.sum(probability[kept])
    return [(int(at), float(probability[at])) for at in kept]


def _median(values: _Array, shares: _Array) -> float:
    """Return the median weighted by the shares, which no improbable value moves."""
    order = np.argsort(values)
    return float(values[order[np.searchsorted(np.cumsum(shares[order]), 0.5 * np.sum(shares))]])


class Posterior:
    """Posterior of a solved regression: Gaussian except for the lag, which is integrated.

    The likelihood of the lag times its prior, and times the probability that F_c and F_v are above
    zero at that lag, is its posterior. At each lag all else is Gaussian.
    """

    def __init__(
        self,
        regression: Regression,
        solved: Solved,
        variance: float,
        inflation: float,
        stribeck: float,
        near: Sequence[Mapping[str, float]],
    ) -> None:
        self.regression, self.solved = regression, solved
        self.inflation, self.stribeck, self.near = inflation, stribeck, near
        covariance, blocks = solved.covariance, regression.blocks
        self.scores = _scores(regression, solved.residual, solved.columns, solved.weight, variance)
        self.scatter = covariance @ self.scores @ covariance
        self.all = [_Choice(1.0, solved.estimate, covariance, self.scores)]
        self.falls = _falls(regression, solved, variance)
        self.choices = _choices(regression, solved, self.scores)
        velocity = regression.averages.mean_velocity[regression.averages.taken]
        left = velocity * (solved.residual[0] + solved.residual[1]) / 2.0
        of_blocks = np.array([np.sum(left[block]) for block in blocks]) / np.sum(np.abs(velocity))
        self.work_scatter = float(np.std(of_blocks, ddof=1)) * math.sqrt(len(blocks))
        self.information = 0.0
        self.lags: _Array = np.zeros(1)
        self.probability: _Array = np.ones(1)
        self.exchanged, self.less_viscous = 0.0, 0.0
        self.log_likelihood = None if regression.lag.is_known else self._of_lags()
        if self.log_likelihood is not None:
            self.lags = regression.lag.lags
            self.probability = regression.lag.probability(self.log_likelihood)
            self._exchange()
        self.of_record = self.probability

    def _of_lags(self) -> _Array:
        """Return the logarithm of the likelihood of each lag, the most likely at 0."""
        solved, index = self.solved, len(self.regression.names)
        variance = float(solved.covariance[index, index])
        prior = float(solved.precision[index])
        precision = max(1.0 / variance - prior, 1e-6 * prior)
        mean = (solved.estimate[index] / variance - prior * solved.expected[index]) / precision
        if precision > 0.05 * prior:
            precision /= max(float(self.scatter[index, index]) / variance, 1.0)
        self.information = precision * float(solved.scale[index]) ** 2
        self.changes = (self.regression.lag.lags - solved.lag) * solved.scale[index]
        log = -0.5 * precision * (self.changes - mean) ** 2
        for name in ("coulomb_friction", "viscous_friction"):
            if name in self.regression.names:
                gradient = np.eye(solved.scale.size)[self.regression.names.index(name)]
                centre, slope, width = self._given_lag(gradient, self.all[0])
                value = centre + slope * (self.changes - solved.estimate[index])
                log = log + np.log(np.maximum(normal(value / width), 1e-10))
                if name == "viscous_friction":
                    log = log + self._of_viscous(value)
        return np.asarray(log - log.max())

    def timed(self, lags: LagProfile) -> "Posterior":
        """Return the posterior with the lags of simulated stems, which tell a lag from F_v/k."""
        other = copy.copy(self)
        other.log_likelihood = lags.log_likelihood
        other.probability = self.regression.lag.probability(lags.log_likelihood)
        other.of_record, other.information = other.probability, lags.spread**-2.0
        other.exchanged = 0.0
        return other

    def _of_viscous(self, viscous: _Array) -> _Array:
        """Return the logarithm of the prior density of each viscous friction, N·s/m."""
        dry = self.regression.values(self.solved).get("coulomb_friction", 0.0)
        if not dry > 0:
            return np.zeros_like(viscous)
        share = np.maximum(viscous, 0.0) * self.regression.sliding_speed / dry
        return np.asarray(-1.5 * np.log1p((share / _USUAL_VISCOUS) ** 2 / 2.0))

    def _exchange(self) -> None:
        """Weigh the other order of two lags.

        A stem with the delay F_v/k behind a sensor or a volume with the lag τ looks, while it
        slides, like one with the delay τ behind a lag F_v/k. Only their priors tell them apart.
        """
        values = self.regression.values(self.solved)
        spring, viscous = values.get("spring_constant", 0.0), values.get("viscous_friction", 0.0)
        lag = float(self.probability @ self.lags)
        if not (spring > 0 and viscous > spring * max(lag, 0.0)):
            return
        delays = np.array([max(lag, 0.0), viscous / spring])
        both = self.regression.lag.log_density(delays)
        both = both + self._of_viscous(spring * delays[::-1])
        self.exchanged = 1.0 / (1.0 + math.exp(min(float(both[0] - both[1]), 700.0)))
        self.less_viscous = viscous - spring * max(lag, 0.0)

    def _given_lag(self, gradient: _Array, choice: _Choice) -> tuple[float, float, float]:
        """Return a number, its slope over the lag's coefficient, and its deviation at that lag."""
        index, size = len(self.regression.names), choice.estimate.size
        # A slip comes last, and is left out of the number where only one of the two has it.
        gradient = np.pad(gradient[:size], (0, max(size - gradient.size, 0)))
        along = choice.covariance @ gradient
        value, variance = float(gradient @ choice.estimate), float(gradient @ along)
        widened = float(along @ choice.scores @ along) / max(variance, float_info.min)
        factor = float(np.clip(widened, 1.0, _LARGEST_SCATTER))
        if self.regression.lag.is_known:
            return value, 0.0, math.sqrt(max(factor * variance, float_info.min))
        own = float(choice.covariance[index, index])
        slope = float(along[index]) / own
        rest = max(variance - slope**2 * own, 1e-9 * variance)
        return value, slope, math.sqrt(max(factor * rest, float_info.min))

    def number(self, name: str, gradient: _Array, spread: float) -> Estimated:
        """Return a number with its interval; `spread` is its further deviation beside the lag.

        The law of friction over speed is never quite that of the model, and rare imperfections
        compensate for the rest: all of them stay open in dry and viscous friction.
        """
        rounding = self.regression.rounding(name)
        beside = self.regression.beside(name, self.lags)
        over_lags = self.of_record if name == SLIDING else self.probability
        choices = self.choices if name in _OF_NO_LAW else self.all
        if name in _SPLIT:
            choices = self.falls
        weights = np.outer([one.probability for one in choices], over_lags)
        values, record = np.empty_like(weights), np.empty_like(weights)
        for row, choice in enumerate(choices):
            centre, slope, width = self._given_lag(gradient, choice)
            values[row] = centre + beside
            if self.lags.size > 1:
                later = self.changes - choice.estimate[len(self.regression.names)]
                values[row] += slope * later
            record[row] = math.hypot(width, spread, rounding)
        rival = math.nan
        if self.exchanged > 0:
            viscous = self.regression.names.index("viscous_friction")
            less = gradient[viscous] * self.solved.scale[viscous] * self.less_viscous
            later = self.less_viscous / self.regression.values(self.solved)["spring_constant"]
            changed = np.interp(self.lags + later, self.lags, beside) - beside
            if later < self.regression.lag.reach:
                rival = float(np.sum(weights * (values - less + changed)))
            values = np.hstack([values, values - less + changed])
            weights = np.hstack([(1.0 - self.exchanged) * weights, self.exchanged * weights])
            record = np.hstack([record, record])
        shares = np.sum(weights, axis=1)
        means = np.sum(weights * values, axis=1) / shares
        value = _median(means, shares) if name in _SPLIT else float(shares @ means)
        timing = 0.0
        if self.lags.size > 1:
            timing = math.sqrt(float(np.sum(weights * (values - means[:, None]) ** 2)))
        open_ = float(np.sum(weights * record**2) + shares @ (means - value) ** 2)
        high = mixture_half_width(np.asarray(weights), values, record, value)
        timing = share_of_timing(high, math.sqrt(open_), timing)
        sources = {ROUNDING: rounding} if rounding > 0.0 else {}
        shared = timing * self._unsaid()
        return Estimated(value, high, math.sqrt(open_), timing, sources, shared, rival)

    def _unsaid(self) -> float:
        """Return the share of the lag's uncertainty that comes from its prior, not from noise.

        For a Gaussian, the other part of the variance is the remaining variance times the
        information of the record.
        """
        mean = float(self.probability @ self.lags)
        variance = float(self.probability @ (self.lags - mean) ** 2)
        return math.sqrt(max(1.0 - variance * self.information, 0.0))


def posterior_of(regression: Regression) -> Posterior:
    """Solve a regression for the best Stribeck speed; the variance is that of the residual."""
    found = {
        speed: regression.descended(speed)[0]
        for speed in (0.0, *(regression.averages.speed * _STRIBECK_SPEEDS).tolist())
    }
    dry = regression.dry
    falling = {
        speed: one
        for speed, one in found.items()
        if not speed or (one.estimate[-1] > 0 and one.estimate[dry] > 0)
    }
    misfits = {speed: one.misfit for speed, one in falling.items()}
    best = min(misfits, key=misfits.__getitem__)
    stribeck = 0.0 if misfits[0.0] < _STRIBECK_WORTH * misfits[best] else best
    solved = found[stribeck]
    near = [
        {
            name: float(gradient @ (one.estimate / one.scale))
            for name, gradient in regression.gradients(speed, one).items()
        }
        for speed, one in falling.items()
        if misfits[speed] < _STRIBECK_OPEN * misfits[stribeck]
        and abs(one.lag - solved.lag) < USUAL_LAG
    ]
    inflated = 3.0
    for _ in range(3):
        mean = 0.5 * (solved.residual[0] + solved.residual[1]) * solved.weight
        count = max(float(np.sum(solved.weight)), 1.0)
        lasting = float(np.sum(solved.weight * solved.residual[0] * solved.residual[1])) / count
        variance = regression.noise_variance(solved) + max(lasting, regression.least_variance)
        power = float(mean @ mean) / count
        inflated = max(power / variance, 1.0) * inflation(
            mean / math.sqrt(max(power, float_info.min)),
            max(mean.size // regression.strokes, 1),
        )
        solved = regression.solve(
            regression.later(solved), stribeck, variance * inflated, solved.weight
        )
    return Posterior(regression, solved, variance * inflated, inflated, stribeck, near)
