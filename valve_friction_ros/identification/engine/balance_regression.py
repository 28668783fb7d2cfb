# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Regression of the force balance of the sliding stem, about a lag and with a Stribeck speed."""

import math
from collections.abc import Mapping
from functools import cached_property
from sys import float_info
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.engine.coordinates import (
    IMPERFECTIONS,
    MASS_PER_AREA,
    sensor_span,
    zero_drift,
)
from valve_friction_ros.identification.engine.intervals import RECTANGLE
from valve_friction_ros.identification.engine.lags import LagPrior
from valve_friction_ros.identification.engine.sliding_averages import (
    FEWEST_EACH_WAY,
    Averages,
    Work,
    averaged_twice,
)
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.identification.trust.uncertainty import MEDIAN_MAGNITUDE, SPEED_EXPONENT
from valve_friction_ros.model.valve import Valve

_Array = NDArray[np.float64]

SECOND_ORDER = 0.025
"""Time τ, s, for which k·τ²/2 bounds the effect of a lag beyond a shift."""

_CONSERVATIVE = ("spring_constant", "spring_preload", "curvature", "cubic", "drift", "mass")
"""Terms of the force that are not friction."""

_OUTLIER = 5.0
_LEAST_MISFIT, _LEAST_WITHOUT_SPRING = 5e-3, 3e-4
"""Deviations beyond which an average is left out, and the share of the friction below which no
force balance is trusted: less of a packing is mistaken for a stiffer spring, or a friction that
changes; without a spring there is nothing to mistake it for."""

_CHANCE, _OVERLAP, _LEAST_SHARED = 3.0, 3.0, 1e-9
"""Deviations of chance that the share of information common to both halves must exceed; overlapping
averages that are worth one independent average; and a share that stands for zero."""

_BINS = 12
"""Bins of the friction curve in each direction."""

_BLOCKS = (6, 60)
"""Least and largest number of strokes whose scatter widens the covariance."""


class Solved(NamedTuple):
    """The regression about one `lag`, s, at one Stribeck speed, in columns of the sizes `scale`.

    The coefficients are those of `Regression.names`, the lag unless it is known, and the slip force
    last, where friction falls with speed: `estimate` and `covariance`, with the `precision` and the
    `expected` value of their priors. Residual force, N, and columns are of both halves of the
    samples; the `weight` is 1 for each average that is used, else 0. `information` and `right` are
    the normal equations of the record alone, without the priors.
    """

    lag: float
    estimate: _Array
    covariance: _Array
    residual: list[_Array]
    weight: _Array
    columns: list[_Array]
    precision: _Array
    expected: _Array
    scale: _Array
    information: _Array
    right: _Array

    @property
    def misfit(self) -> float:
        """Deviation of the residual, N, from its median magnitude."""
        return float(np.median(np.abs(self.residual[0] + self.residual[1]))) / (
            2.0 * MEDIAN_MAGNITUDE
        )


def inverse(information: _Array) -> _Array:
    """Invert the information about coefficients of very different sizes, of one or more fits."""
    unit = 1.0 / np.sqrt(np.diagonal(information, axis1=-2, axis2=-1))
    units = unit[..., :, None] * unit[..., None, :]
    return np.asarray(np.linalg.pinv(information * units, rcond=1e-13, hermitian=True) * units)


class Regression:
    """The force balance of one record at one averaging time."""

    def __init__(
        self,
        averages: Averages,
        work: Work,
        valve: Valve,
        lag: LagPrior,
        fixed: Mapping[str, float],
    ) -> None:
        self.averages, self.lag, self.fixed = averages, lag, fixed
        taken, velocity = averages.taken, averages.mean_velocity
        position = 0.5 * (averages.position[0] + averages.position[1])
        force = 0.5 * (averages.force[0] + averages.force[1])
        side = np.sign(velocity)
        low, range_ = float(position.min()), float(np.ptp(position))
        self.range, self.middle = range_, low + 0.5 * range_
        age: _Array = np.linspace(-1.0, 1.0, position.size, dtype=np.float64)
        plain = np.column_stack([side, velocity, position, np.ones_like(velocity)])[taken]
        size = np.abs(plain).max(axis=0)
        first = np.linalg.lstsq(plain / size, force[taken], rcond=1e-9)[0] / size
        span = float(np.ptp(force))
        usual = float(np.mean(np.abs(velocity[taken])))
        self.friction = max(abs(first[0] + first[1] * usual), 1e-4 * span)
        self.spring = 0.0 if fixed.get("spring_constant") == 0.0 else abs(float(first[2]))
        places = [(2.0 * half - 2.0 * low) / range_ - 1.0 for half in averages.position]
        accelerations = [np.gradient(half, averages.time) for half in averages.velocity]
        if self.spring > 0.0:
            calm = 2 * averages.length + 1
            accelerations = [averaged_twice(one, calm) for one in accelerations]
        self.inertia = MASS_PER_AREA * (valve.diaphragm_area or 0.0)
        if valve.diaphragm_area is None:
            fastest = float(np.quantile(np.abs(accelerations[0][taken]), 0.98))
            self.inertia = span / max(fastest, float_info.min)
        stiff = self.spring * range_
        minutes = float(averages.time[-1] - averages.time[0]) / 60.0
        shares = {name: one.deviation for name, one in IMPERFECTIONS.items()}
        both = [np.ones_like(velocity)] * 2
        terms: dict[str, tuple[list[_Array], float]] = {
            "coulomb_friction": ([side, side], math.inf),
            "viscous_friction": (averages.velocity, math.inf),
            "spring_preload": (both, math.inf),
            "spring_constant": (averages.position, math.inf),
            "curvature": ([one**2 - 1.0 / 3.0 for one in places], shares["curvature"] * stiff),
            "cubic": ([one * (one * one - 0.6) for one in places], shares["cubic"] * stiff),
            "drift": ([age, age], zero_drift(sensor_span(force), minutes)),
            "along_travel": (
                [side * one for one in places],
                shares["along_travel"] * self.friction,
            ),
            "in_record": ([side * age] * 2, shares["in_record"] * self.friction),
            "viscous_asymmetry": (
                [np.abs(half) - usual for half in averages.velocity],
                shares["viscous_asymmetry"] * self.friction / averages.speed,
            ),
            "mass": (accelerations, math.inf),
        }
        if self.spring == 0.0:
            for name in ("spring_constant", "curvature", "cubic"):
                del terms[name]
        known = [(value, terms[name][0]) for name, value in fixed.items() if name in terms]
        self.known = [
            sum((value * term[half] for value, term in known), np.zeros_like(side))
            for half in (0, 1)
        ]
        for name in fixed.keys() & (terms.keys() - {"mass"}):
            del terms[name]
        self.names = tuple(terms)
        self.columns = [
            np.column_stack([column[half][taken] for column, _ in terms.values()])
            for half in (0, 1)
        ]
        self.precision = np.array([deviation**-2.0 for _, deviation in terms.values()])
        self.work, self.strokes, self.velocity = work, work.strokes, velocity
        place = 2.0 * (work.position - low) / range_ - 1.0
        self.kept = _kept_by(work, place, np.interp(work.time, averages.time, age))
        self.sliding_speed = work.speed
        self.independent = max(taken.size / _OVERLAP, 1.0)
        self.slopes = [np.gradient(half, averages.time) for half in averages.force]

        self.slips: dict[float, _Array] = {}

    @property
    def dry(self) -> int:
        """Place of F_c among the coefficients; -1 where it is known."""
        return self.names.index("coulomb_friction") if "coulomb_friction" in self.names else -1

    @cached_property
    def blocks(self) -> list[NDArray[np.intp]]:
        """Averages that are taken, in stretches of a stroke or so."""
        taken = np.arange(self.averages.taken.size)
        return np.array_split(taken, int(np.clip(self.strokes, *_BLOCKS)))

    def slip(self, stribeck: float) -> _Array:
        """Regressor of the slip force at the averages that are taken."""
        if stribeck not in self.slips:
            velocity = self.velocity[self.averages.taken]
            self.slips[stribeck] = np.sign(velocity) * np.exp(-((velocity / stribeck) ** 2))
        return self.slips[stribeck]

    def solve(
        self, lag: float, stribeck: float, variance: float, weight: _Array | None = None
    ) -> Solved:
        """Solve the linear part, about a lag (s); `variance` (N²) is that of an average."""
        averages, taken = self.averages, self.averages.taken
        at = averages.time[taken] - lag
        forces = [
            np.interp(at, averages.time, averages.force[half]) - self.known[half][taken]
            for half in (0, 1)
        ]
        columns, precision = self.columns, self.precision.copy()
        second = self.spring * (SECOND_ORDER**2 + lag**2) / 2.0
        precision[self.names.index("mass")] = 1.0 / max(self.inertia + second, 1e-9) ** 2
        if not self.lag.is_known:
            slopes = [np.interp(at, averages.time, slope) for slope in self.slopes]
            columns = [np.column_stack(pair) for pair in zip(columns, slopes, strict=True)]
            precision = np.append(precision, self.lag.precision(lag))
        if stribeck > 0:
            columns = [np.column_stack([one, self.slip(stribeck)]) for one in columns]
            precision = np.append(precision, (1.5 * self.friction) ** -2.0)
        scale = np.abs(columns[0]).max(axis=0)
        scale[scale <= 1e-12 * scale.max()] = 1.0
        columns = [one / scale for one in columns]
        precision = precision / scale**2
        expected = np.zeros(scale.size)
        if not self.lag.is_known:
            expected[len(self.names)] = -lag * scale[len(self.names)]
        weight = np.ones(taken.size) if weight is None else weight
        information, right = self.normal_equations(forces, columns, weight, variance)
        covariance = inverse(information + np.diag(precision))
        estimate = covariance @ (right + precision * expected)
        residual = [force - one @ estimate for force, one in zip(forces, columns, strict=True)]
        return Solved(
            lag,
            estimate,
            covariance,
            residual,
            weight,
            columns,
            precision,
            expected,
            scale,
            information,
            right,
        )

    def normal_equations(
        self, forces: list[_Array], columns: list[_Array], weight: _Array, variance: float
    ) -> tuple[_Array, _Array]:
        """Return the information about the coefficients and the right-hand side of both halves."""
        even, odd = columns
        cross = even.T @ (odd * weight[:, None])
        own = 0.5 * (even.T @ (even * weight[:, None]) + odd.T @ (odd * weight[:, None]))
        right = 0.5 * (even.T @ (weight * forces[1]) + odd.T @ (weight * forces[0]))
        shared, right = _shared(own, 0.5 * (cross + cross.T), right, self.independent)
        return shared / variance, right / variance

    @property
    def least_variance(self) -> float:
        """Least variance of an average, N²: the balance is trusted no further."""
        share = _LEAST_MISFIT if self.spring > 0.0 else _LEAST_WITHOUT_SPRING
        return float(share * self.friction) ** 2

    def noise_variance(self, solved: Solved) -> float:
        """Variance of an average that the sensors explain, N²."""
        noise, values = self.averages.noise, self.values(solved)
        viscous = values.get("viscous_friction", self.fixed.get("viscous_friction", 0.0))
        return float(
            noise["force"] ** 2
            + (viscous * noise["velocity"]) ** 2
            + (self.spring * noise["position"]) ** 2
        )

    def values(self, solved: Solved) -> dict[str, float]:
        """Return the coefficients by name, SI units."""
        return dict(zip(self.names, (solved.estimate / solved.scale).tolist(), strict=False))

    def later(self, solved: Solved) -> float:
        """Return the lag of the solution, s."""
        if self.lag.is_known:
            return 0.0
        index = len(self.names)
        change = float(solved.estimate[index] / solved.scale[index])
        return float(np.clip(solved.lag + change, -self.lag.reach, self.lag.reach))

    def descended(self, stribeck: float) -> tuple[Solved, float]:
        """Iterate until lag and variance agree, without outliers; return the variance too.

        Where a record has no noise, half of it may be solved exactly. All averages of a direction
        are no outliers, even then.
        """
        lag, variance = 0.0, (3e-2 * self.friction) ** 2
        weight: _Array = np.ones(self.averages.taken.size)
        is_up = self.averages.mean_velocity[self.averages.taken] > 0.0
        for _ in range(4):
            solved = self.solve(lag, stribeck, 3.0 * variance, weight)
            total, misfit = np.abs(solved.residual[0] + solved.residual[1]), solved.misfit
            usual = 2.0 * MEDIAN_MAGNITUDE * _OUTLIER * misfit + 1e-9 * self.friction
            weight = (total <= usual).astype(np.float64)
            for way in (is_up, ~is_up):
                if np.sum(weight[way]) < FEWEST_EACH_WAY:
                    weight[way] = 1.0
            variance = max(misfit**2, 0.5 * self.noise_variance(solved), self.least_variance)
            lag = self.later(solved)
        return solved._replace(weight=weight), variance

    def definition(self, name: str, solved: Solved) -> float:
        """Deviation of a number due to its definition, as in `reported_numbers`.

        A friction that changes by ±a along the travel or during the record lies anywhere within
        ±a, and so does the slope of a curved spring, or a zero that drifts.
        """
        values = self.values(solved)
        if name in ("coulomb_friction", "static_friction"):
            return RECTANGLE * math.hypot(values["along_travel"], values["in_record"])
        if name not in ("spring_constant", "spring_preload"):
            return 0.0
        bow = abs(values.get("curvature", 0.0)) + abs(values.get("cubic", 0.0))
        stiffness = 4.0 * bow / self.range
        if name == "spring_constant":
            return RECTANGLE * stiffness
        return RECTANGLE * math.hypot(bow, stiffness * abs(self.middle), values["drift"])

    def beside(self, name: str, lags: _Array) -> _Array:
        """Return the part of a number without coefficients at each lag: the work of the force."""
        if name != SLIDING:
            return np.zeros(lags.size)
        known = sum(
            value * self.kept[name] for name, value in self.fixed.items() if name in self.kept
        )
        return np.asarray(np.interp(lags, self.work.lags, self.work.by_lag) - known)

    def rounding(self, name: str) -> float:
        """Return the deviation of a number due to the converter of the force (`Work.rounding`).

        A number that is extrapolated from two speeds is off by twice as much as at one speed.
        """
        off = self.work.rounding
        if name in (SLIDING, "spring_preload"):
            return off
        if name in ("coulomb_friction", "static_friction"):
            return 2.0 * off
        if name == "viscous_friction":
            return 2.0 * off / (self.sliding_speed or self.averages.speed)
        return 0.0

    def beyond_shift(self, lag: float) -> float:
        """Return the deviation of the work, N, due to the effect of a lag beyond a shift.

        A volume or a filter of the time τ also takes ω²·τ²/2 of a swing. Half the curvature of the
        work over the lag, ∫F″·ẋ·dt, is that share of it.
        """
        if self.lag.is_known:
            return 0.0
        lags = lag + SECOND_ORDER * np.array([-1.0, 0.0, 1.0])
        before, here, after = np.interp(lags, self.work.lags, self.work.by_lag)
        return 0.5 * abs(float(before - 2.0 * here + after))

    def gradients(self, stribeck: float, solved: Solved) -> dict[str, _Array]:
        """Return how each number depends on the coefficients.

        The sliding friction is the work of the measured force less what spring, preload and mass
        keep, per distance: it involves no law of friction and no speed.
        """
        axes = np.eye(solved.scale.size)
        at = {name: axes[index] for index, name in enumerate(self.names)}
        wanted = ["coulomb_friction", "viscous_friction", "spring_constant", "spring_preload"]
        if self.spring == 0.0:
            wanted.append("mass")
        result = {name: at[name] for name in wanted if name in at}
        if stribeck > 0 and "coulomb_friction" in at:
            result["static_friction"] = at["coulomb_friction"] + axes[-1]
        sliding = -sum(
            (self.kept[name] * at[name] for name in self.kept if name in at), 0.0 * axes[0]
        )
        result[SLIDING] = sliding
        if {"coulomb_friction", "viscous_friction"} <= at.keys():
            result[SPEED_EXPONENT] = self._exponent(stribeck, solved)
        return result

    def _exponent(self, stribeck: float, solved: Solved) -> _Array:
        """Return how d ln F / d ln v at the sliding speed depends on the coefficients.

        The friction F itself is taken as known: it is known to a few per cent, the slope is not.
        """
        speed, values = self.sliding_speed, self.values(solved)
        slope = np.zeros(solved.scale.size)
        slope[self.names.index("viscous_friction")] = speed
        friction = values["coulomb_friction"] + values["viscous_friction"] * speed
        if stribeck > 0:
            left = math.exp(-((speed / stribeck) ** 2))
            slope[-1] = -2.0 * (speed / stribeck) ** 2 * left
            friction += left * float(solved.estimate[-1] / solved.scale[-1])
        return np.asarray(slope / max(friction, 0.1 * self.friction))

    def bins(self, solved: Solved) -> tuple[_Array, _Array, _Array]:
        """Return friction over speed: the force without spring and preload."""
        averages, taken = self.averages, self.averages.taken
        keep = np.array([name in _CONSERVATIVE for name in self.names])
        rest = [
            residual
            + columns @ solved.estimate
            - columns[:, : keep.size][:, keep] @ solved.estimate[: keep.size][keep]
            for residual, columns in zip(solved.residual, solved.columns, strict=True)
        ]
        velocity, friction = averages.mean_velocity[taken], 0.5 * (rest[0] + rest[1])
        order = np.argsort(velocity)
        order = order[solved.weight[order] > 0]
        ways = (order[velocity[order] < 0], order[velocity[order] > 0])
        parts = [part for way in ways for part in np.array_split(way, _BINS) if part.size >= 2]
        return (
            np.array([float(np.mean(velocity[part])) for part in parts]),
            np.array([float(np.mean(friction[part])) for part in parts]),
            np.array([float(np.std(friction[part])) / math.sqrt(part.size) for part in parts]),
        )


def _kept_by(work: Work, place: _Array, age: _Array) -> dict[str, float]:
    """Return the work per distance that each term of a force of unit size keeps, by its name."""
    terms = {
        "spring_preload": np.ones_like(place),
        "spring_constant": work.position,
        "curvature": place**2 - 1.0 / 3.0,
        "cubic": place**3 - 0.6 * place,
        "drift": age,
    }
    return {name: float(work.along @ term) for name, term in terms.items()}


def _shared(own: _Array, cross: _Array, right: _Array, independent: float) -> tuple[_Array, _Array]:
    """Return the information that both halves share, and the matching right-hand side.

    Along each direction the halves share s of the information of each, which n averages determine
    to (1 − s)/√n. A share that may be chance is dropped: the prior alone remains.
    """
    values, vectors = np.linalg.eigh(own)
    root = np.sqrt(np.maximum(values, max(1e-13 * float(values[-1]), float_info.min)))
    shares, turned = np.linalg.eigh((vectors / root).T @ cross @ (vectors / root))
    back = (vectors * root) @ turned
    shares = np.clip(shares, _LEAST_SHARED, 1.0)
    chance = _CHANCE * (1.0 - shares) / math.sqrt(independent)
    sure = np.maximum(1.0 - (chance / shares) ** 2, 0.0)
    information = (back * np.maximum(sure * shares, _LEAST_SHARED)) @ back.T
    said = sure * (turned.T @ ((vectors / root).T @ right))
    return np.asarray(information), np.asarray(back @ said)
