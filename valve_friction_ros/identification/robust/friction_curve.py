"""Friction over speed as a record shows it, before any stem is simulated.

While the stem surely slides, the actuator force is

    F(t − τ) = F_c·sgn ẋ + (F_s − F_c)·exp(−(ẋ/v_s)²)·sgn ẋ + F_v·ẋ + k·x + F_0 + … ,

linear in all but the lag τ and the Stribeck speed v_s; the dots are the imperfections of a plant,
each with its prior. Force and stem are averaged with the same weights, so the averages obey the
same law. In each product of the normal equations one factor comes from the even samples and the
other from the odd ones: noise of the regressors then biases nothing.

A stick-slip valve, whose simulated stem jumps at other times than the measured one, is described
here as well as any other. The numbers are also where the simulation starts (`search`).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.robust.imperfections import IMPERFECTIONS
from valve_friction_ros.identification.robust.intervals import NOISE_LIKE, Budget, Estimated
from valve_friction_ros.identification.robust.numbers import RECTANGLE
from valve_friction_ros.identification.robust.weights import inflation
from valve_friction_ros.identification.trust.sliding import SLIDING
from valve_friction_ros.identification.trust.uncertainty import CONFIDENCE
from valve_friction_ros.model.stamped import StampedRecord, StampedSignal
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals.holds import without_repeats
from valve_friction_ros.signals.stamped_noise import stamped_noise

__all__ = [
    "FrictionCurve",
    "LagPrior",
    "checked_by_curve",
    "curve_evidence",
    "curve_numbers",
    "friction_curves",
]

_Array = NDArray[np.float64]

_AVERAGING_TIMES = (0.03, 0.06, 0.12, 0.24, 0.48, 0.96)
_SHORT_AVERAGING_TIMES = (0.015, 0.008, 0.004)
"""Times, s, over which the signals are averaged, twice; the short ones where no longer ones leave
samples of a stem that slides, as in the jumps of stick-slip."""

_MOST_CURVES = 4
_FEWEST_PERIODS = 2.9
"""Averaging times that are used, and sampling periods in each."""

_FEWEST, _FEWEST_EACH_WAY = 20, 6
_MOST = 4000
"""Averages that a regression needs, in all and of each direction, and takes at most."""

_SLIDES = 0.02
_SURELY = 3.0
_NOISE_OF_SPEED = 0.1
"""The stem slides above this share of twice the mean speed, and so many deviations of the speed's
noise, which may be at most this share of twice the mean speed."""

_OF_STOPS = 3e-3
"""Share of the travel next to a stop where nothing is taken: the stop carries force there."""

_SURE_MARGIN, _CLOSE = 2.0, 0.5
"""Distance of an average from a rest or a reversal, in its own lengths: that at which it surely is
of a sliding stem, and that at which it is taken where there is no other, for the sliding friction
alone."""

_LARGEST_LAG = 0.15
_LAGS: _Array = np.linspace(-_LARGEST_LAG, _LARGEST_LAG, 301, dtype=np.float64)
"""Lags over which the posterior is integrated, s; beyond, the signals are not one record."""

_USUAL_LAG = 10e-3
"""Scale, s, of the lag's prior, Student's t of two degrees of freedom, without a stated one.

Stamps of one controller agree to some milliseconds; transmitters with damping, tubing and clocks of
their own add up to tens. Half of the plants lie within 0.8 of it, 95 % within 43 ms."""

_SECOND_ORDER = 0.025
"""Time, s, whose square halved, times k, bounds what a lag does beyond a shift."""

_INERTIA = 50.0
"""Standard deviation of the moving mass per diaphragm area, kg/m²: 2 kg at 0.04 m²."""

_STRIBECK_SPEEDS = np.geomspace(0.04, 0.6, 8)
_STRIBECK_WORTH = 1.05
_STRIBECK_OPEN = 1.08
"""Stribeck speeds over twice the mean speed; by how much one must lower the residual to be taken;
and up to which residual others stay open."""

_OUTLIER = 5.0
_LEAST_MISFIT = 3e-4
"""Deviations beyond which an average is left out, and the share of the friction to which no force
balance is trusted further."""

_CHANCE, _OVERLAP, _LEAST_SHARED = 3.0, 3.0, 1e-9
"""Deviations of chance that the share of the information must exceed which both halves have in
common; averages that tell as much as one that does not overlap with others; a share of nothing."""

_BINS = 12
"""Bins of the friction curve in each direction."""

_LEAST_HALF_WIDTH, _LEAST_OF_MACHINE, _LEAST_ALONE = 0.015, 0.04, 0.06
"""Least half width over the value of any number, as no force balance of a plant is the whole truth
to more than that; the same without a spring, where the reversals that are left out hold more of the
friction; and where no second averaging time confirms it."""

_CONFIRMED = 2
"""Averaging times that confirm each other."""

_AS_WELL = 1.1
"""Half width over the least up to which an averaging time knows a number as well."""

_NEARLY = 5.0
_SCATTERS = 2.0
"""Half width over the least up to which an averaging time counts, and deviations of their scatter
that are added to the interval."""

_BLOCKS = (6, 60)
_LARGEST_SCATTER = 25.0
"""Least and largest number of strokes whose scatter widens the covariance, and the factor by which
it does so at most."""


@dataclass(frozen=True)
class LagPrior:
    """What is known of the time by which the stem is seen late, before the record is.

    Attributes
    ----------
    deviation : float or None
        Standard deviation of a Gaussian, s; None for the heavy-tailed prior of a plant whose timing
        nobody has stated.
    """

    deviation: float | None = None

    @property
    def is_known(self) -> bool:
        """Whether there certainly is no lag."""
        return self.deviation == 0.0

    def precision(self, lag: float) -> float:
        """Return the precision, 1/s², of a Gaussian that stands for the prior at `lag`."""
        if self.deviation is not None:
            return 1.0 / max(self.deviation, 1e-9) ** 2
        return 1.0 / (4.0 * _USUAL_LAG**2 + lag**2)

    def log_density(self, lags: _Array) -> _Array:
        """Return the logarithm of the density at each lag, s, but for a constant."""
        if self.deviation is not None:
            return np.asarray(-0.5 * (lags / max(self.deviation, 1e-9)) ** 2)
        return np.asarray(-1.5 * np.log1p((lags / _USUAL_LAG) ** 2 / 2.0))


def averaged_twice(signal: _Array, length: int) -> _Array:
    """Average over `length` samples, twice, centred; the ends are held."""
    if length <= 1:
        return signal
    for before in (length // 2, length - 1 - length // 2):
        padded = np.pad(signal, (before, length - 1 - before), mode="edge")
        sums = np.concatenate([[0.0], np.cumsum(padded)])
        signal = (sums[length:] - sums[:-length]) / length
    return signal


def _all_around(which: NDArray[np.bool_], reach: int) -> NDArray[np.bool_]:
    """Return where all samples up to `reach` before and after are set."""
    sums = np.concatenate([[0], np.cumsum(np.pad(which, reach, mode="edge"))])
    width = 2 * reach + 1
    return np.asarray(sums[width:] - sums[:-width] == width)


_DEVIATIONS: _Array = np.linspace(-9.0, 9.0, 3601, dtype=np.float64)
_PROBABILITIES: _Array = np.array([0.5 * math.erfc(-one / math.sqrt(2.0)) for one in _DEVIATIONS])


def _normal(deviations: _Array) -> _Array:
    """Return the normal distribution function, to 1e-6."""
    return np.interp(deviations, _DEVIATIONS, _PROBABILITIES)


class _Signal(NamedTuple):
    """A signal of a sensor, N or m, with the deviation of its noise."""

    time: _Array
    value: _Array
    noise: float

    @classmethod
    def of(cls, signal: StampedSignal, scale: float, zero: float) -> "_Signal":
        fresh = without_repeats(signal)
        return cls(fresh.time, scale * fresh.value - zero, abs(scale) * stamped_noise(fresh))

    @property
    def period(self) -> float:
        return float(np.median(np.diff(self.time)))

    def halves(self, grid: _Array) -> list[_Array]:
        """Return even and odd samples on a grid, averaged where it is coarser than they are."""
        length = int((grid[1] - grid[0]) / self.period)
        parts = [(self.time[part::2], self.value[part::2]) for part in (0, 1)]
        return [np.interp(grid, time, averaged_twice(value, length)) for time, value in parts]


class _Averages(NamedTuple):
    """What the regression takes of a record at one averaging time; two halves where there are two.

    `taken` are the indices of the averages of a stem that surely slides.
    """

    time: _Array
    force: list[_Array]
    position: list[_Array]
    velocity: list[_Array]
    length: int
    taken: NDArray[np.intp]
    speed: float
    noise: Mapping[str, float]
    is_sure: bool

    @property
    def mean_velocity(self) -> _Array:
        return 0.5 * (self.velocity[0] + self.velocity[1])


def _averages(
    force: _Signal, stem: _Signal, valve: Valve, averaging_time: float, margin: float
) -> _Averages | None:
    """Average a record; None where it leaves too little of a stem that surely slides.

    `margin` is how far from a stop, a rest or a reversal an average must be, in its own lengths.
    """
    begin, end = max(force.time[0], stem.time[0]), min(force.time[-1], stem.time[-1])
    step = max(min(force.period, stem.period), averaging_time / 24.0)
    time = np.arange(begin, end, step)
    length = max(round(averaging_time / step), 1)
    lost = round(_LARGEST_LAG / step) + 2 * length
    if time.size < 2 * lost + _FEWEST:
        return None
    position = [averaged_twice(half, length) for half in stem.halves(time)]
    velocity = [np.gradient(half, step) for half in position]
    mean = 0.5 * (velocity[0] + velocity[1])
    size = np.abs(mean)
    speed = 2.0 * float(np.sum(size**2) / max(np.sum(size), np.finfo(float).tiny))
    per_average = [max(averaging_time / one.period, 1.0) for one in (force, stem)]
    noise = {
        "force": force.noise * math.sqrt(2.0 / (3.0 * per_average[0])),
        "position": stem.noise * math.sqrt(2.0 / (3.0 * per_average[1])),
        "velocity": stem.noise * math.sqrt(2.0 / per_average[1]) / averaging_time,
    }
    side = np.sign(mean) * (size > max(_SLIDES * speed, _SURELY * noise["velocity"]))
    reach = int(margin * length)
    slides = _all_around(side > 0, reach) | _all_around(side < 0, reach)
    if math.isfinite(valve.travel):
        place = 0.5 * (position[0] + position[1])
        near = _OF_STOPS * valve.travel
        slides &= (place > near) & (place < valve.travel - near)
    slides[:lost] = slides[-lost:] = False
    taken = np.flatnonzero(slides)
    taken = taken[taken % max(length // 2, 1) == 0]
    taken = taken[:: taken.size // _MOST + 1]
    up = int(np.count_nonzero(mean[taken] > 0))
    if (
        noise["velocity"] > _NOISE_OF_SPEED * speed
        or taken.size < _FEWEST
        or min(up, taken.size - up) < _FEWEST_EACH_WAY
    ):
        return None
    averaged = [averaged_twice(half, length) for half in force.halves(time)]
    return _Averages(
        time, averaged, position, velocity, length, taken, speed, noise, margin >= _SURE_MARGIN
    )


class _Solved(NamedTuple):
    """The regression at one lag and one Stribeck speed, in columns scaled to one size."""

    lag: float
    estimate: _Array
    covariance: _Array
    residual: list[_Array]
    weight: _Array
    columns: list[_Array]
    precision: _Array
    expected: _Array
    scale: _Array

    @property
    def misfit(self) -> float:
        """Deviation of the residual, N, by its median."""
        return float(np.median(np.abs(self.residual[0] + self.residual[1]))) / 1.35


@dataclass(frozen=True, eq=False)
class FrictionCurve:
    """Friction over speed, and the force balance that it comes from, at one averaging time.

    Attributes
    ----------
    averaging_time : float
        Over which force and stem are averaged, twice, s.
    speed, friction, standard_error : ndarray of float, shape (b,)
        Mean velocity of each bin (m/s, negative downward), mean friction there (N), and how far
        chance moves it (N). No law is assumed but the spring.
    numbers : mapping of str to Estimated
        Parameters and sliding friction, SI units.
    sliding_speed : float
        Mean speed over the distance, m/s, at which the sliding friction is.
    stribeck_velocity : float
        v_s, m/s; 0 where friction does not surely fall with speed.
    lag : float
        Most probable time by which the stem is seen late, s.
    inflation : float
        Of the residual over what noise explains.
    is_sure : bool
        Whether each average is of a stem that surely slides all the time.
    fit, misfit : float
        Share of the force that the balance reproduces, and deviation of what it leaves, N.
    """

    averaging_time: float
    speed: _Array = field(repr=False)
    friction: _Array = field(repr=False)
    standard_error: _Array = field(repr=False)
    numbers: Mapping[str, Estimated]
    sliding_speed: float
    stribeck_velocity: float
    lag: float
    inflation: float
    is_sure: bool
    fit: float
    misfit: float


class _Regression:
    """The force balance of one record at one averaging time."""

    def __init__(
        self, averages: _Averages, valve: Valve, lag: LagPrior, fixed: Mapping[str, float]
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
        self.inertia = _INERTIA * (valve.diaphragm_area or 0.0)
        if valve.diaphragm_area is None:
            fastest = float(np.quantile(np.abs(accelerations[0][taken]), 0.98))
            self.inertia = span / max(fastest, np.finfo(float).tiny)
        stiff = self.spring * range_
        minutes = max(float(averages.time[-1] - averages.time[0]) / 60.0, 0.1)
        shares = {name: one.deviation for name, one in IMPERFECTIONS.items()}
        both = [np.ones_like(velocity)] * 2
        terms: dict[str, tuple[list[_Array], float]] = {
            "coulomb_friction": ([side, side], math.inf),
            "viscous_friction": (averages.velocity, math.inf),
            "spring_preload": (both, math.inf),
            "spring_constant": (averages.position, math.inf),
            "curvature": ([one**2 - 1.0 / 3.0 for one in places], shares["curvature"] * stiff),
            "cubic": ([one**3 - 0.6 * one for one in places], shares["cubic"] * stiff),
            "drift": ([age, age], shares["drift"] * span * minutes),
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
        self.known = [
            sum(value * terms[name][0][half] for name, value in fixed.items() if name in terms)
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
        weight = np.abs(velocity) * (
            np.abs(velocity) > max(0.05 * averages.speed, _SURELY * averages.noise["velocity"])
        )
        self.weight = weight / np.sum(weight)
        common = averages.velocity[0] * averages.velocity[1] * (weight > 0)
        shape = {
            "coulomb_friction": np.ones_like(side),
            "along_travel": 0.5 * (places[0] + places[1]),
            "in_record": age,
        }
        self.over_distance = {
            name: float(np.sum(self.weight * one)) for name, one in shape.items()
        } | {"viscous_friction": max(float(np.sum(common) / np.sum(weight)), 0.0)}
        turns = np.count_nonzero(np.diff(side[weight > 0]))
        self.strokes = int(turns) + 1
        self.independent = max(taken.size / _OVERLAP, 1.0)
        self.slopes = [np.gradient(half, averages.time) for half in averages.force]

    def falling(self, stribeck: float) -> _Array:
        """Share of the slip force that is left at each average."""
        return np.asarray(np.exp(-((self.averages.mean_velocity / stribeck) ** 2)))

    def solve(
        self, lag: float, stribeck: float, variance: float, weight: _Array | None = None
    ) -> _Solved:
        """Solve the linear part, about a lag (s); `variance` (N²) is that of an average."""
        averages, taken = self.averages, self.averages.taken
        at = averages.time[taken] - lag
        forces = [
            np.interp(at, averages.time, averages.force[half]) - _at(self.known[half], taken)
            for half in (0, 1)
        ]
        columns, precision = self.columns, self.precision.copy()
        second = self.spring * (_SECOND_ORDER**2 + lag**2) / 2.0
        precision[self.names.index("mass")] = 1.0 / max(self.inertia + second, 1e-9) ** 2
        if not self.lag.is_known:
            slopes = [np.interp(at, averages.time, slope) for slope in self.slopes]
            columns = [np.column_stack(pair) for pair in zip(columns, slopes, strict=True)]
            precision = np.append(precision, self.lag.precision(lag))
        if stribeck > 0:
            slip = (np.sign(averages.mean_velocity) * self.falling(stribeck))[taken]
            columns = [np.column_stack([one, slip]) for one in columns]
            precision = np.append(precision, (1.5 * self.friction) ** -2.0)
        scale = np.abs(columns[0]).max(axis=0)
        scale[scale <= 1e-12 * scale.max()] = 1.0
        columns = [one / scale for one in columns]
        precision = precision / scale**2
        expected = np.zeros(scale.size)
        if not self.lag.is_known:
            expected[len(self.names)] = -lag * scale[len(self.names)]
        weight = np.ones(taken.size) if weight is None else weight
        even, odd = columns
        cross = even.T @ (odd * weight[:, None])
        own = 0.5 * (even.T @ (even * weight[:, None]) + odd.T @ (odd * weight[:, None]))
        right = 0.5 * (even.T @ (weight * forces[1]) + odd.T @ (weight * forces[0]))
        shared, right = _shared(own, 0.5 * (cross + cross.T), right, self.independent)
        information = shared / variance + np.diag(precision)
        unit = 1.0 / np.sqrt(np.diag(information))
        covariance = np.linalg.pinv(
            information * np.outer(unit, unit), rcond=1e-13, hermitian=True
        ) * np.outer(unit, unit)
        estimate = covariance @ (right / variance + precision * expected)
        residual = [force - one @ estimate for force, one in zip(forces, columns, strict=True)]
        return _Solved(
            lag, estimate, covariance, residual, weight, columns, precision, expected, scale
        )

    def noise_variance(self, solved: _Solved) -> float:
        """Variance of an average that the sensors explain, N²."""
        noise, values = self.averages.noise, self.values(solved)
        viscous = values.get("viscous_friction", self.fixed.get("viscous_friction", 0.0))
        return float(
            noise["force"] ** 2
            + (viscous * noise["velocity"]) ** 2
            + (self.spring * noise["position"]) ** 2
        )

    def values(self, solved: _Solved) -> dict[str, float]:
        """Return the coefficients by name, SI units."""
        return dict(zip(self.names, (solved.estimate / solved.scale).tolist(), strict=False))

    def later(self, solved: _Solved) -> float:
        """Return the lag that the solution asks for, s."""
        if self.lag.is_known:
            return 0.0
        index = len(self.names)
        change = float(solved.estimate[index] / solved.scale[index])
        return float(np.clip(solved.lag + change, -_LARGEST_LAG, _LARGEST_LAG))

    def descended(self, stribeck: float) -> tuple[_Solved, float]:
        """Follow lag and variance to where they agree, outliers left out; the variance too."""
        lag, variance = 0.0, (3e-2 * self.friction) ** 2
        weight: _Array = np.ones(self.averages.taken.size)
        for _ in range(4):
            solved = self.solve(lag, stribeck, 3.0 * variance, weight)
            total = np.abs(solved.residual[0] + solved.residual[1])
            usual = 1.35 * _OUTLIER * solved.misfit + 1e-9 * self.friction
            weight = (total <= usual).astype(np.float64)
            floor = (_LEAST_MISFIT * self.friction) ** 2
            variance = max(solved.misfit**2, 0.5 * self.noise_variance(solved), floor)
            lag = self.later(solved)
        return solved._replace(weight=weight), variance

    def curve(self) -> FrictionCurve:
        """Solve for the best Stribeck speed, and say what the record leaves open."""
        found = {
            speed: self.descended(speed)[0]
            for speed in (0.0, *(self.averages.speed * _STRIBECK_SPEEDS).tolist())
        }
        dry = self.names.index("coulomb_friction") if "coulomb_friction" in self.names else -1
        falling = {
            speed: one
            for speed, one in found.items()
            if not speed or (one.estimate[-1] > 0 and one.estimate[dry] > 0)
        }
        best = min(falling, key=lambda speed: falling[speed].misfit)
        stribeck = 0.0 if found[0.0].misfit < _STRIBECK_WORTH * found[best].misfit else best
        solved = found[stribeck]
        near = [
            (speed, one)
            for speed, one in falling.items()
            if one.misfit < _STRIBECK_OPEN * found[stribeck].misfit
            and abs(one.lag - solved.lag) < _USUAL_LAG
        ]
        inflated = 3.0
        for _ in range(3):
            mean = 0.5 * (solved.residual[0] + solved.residual[1]) * solved.weight
            count = max(float(np.sum(solved.weight)), 1.0)
            lasting = float(np.sum(solved.weight * solved.residual[0] * solved.residual[1])) / count
            floor = (_LEAST_MISFIT * self.friction) ** 2
            variance = self.noise_variance(solved) + max(lasting, floor)
            power = float(mean @ mean) / count
            inflated = max(power / variance, 1.0) * inflation(
                mean / math.sqrt(max(power, np.finfo(float).tiny)),
                max(mean.size // self.strokes, 1),
            )
            solved = self.solve(self.later(solved), stribeck, variance * inflated, solved.weight)
        posterior = _Posterior(self, solved, variance * inflated)
        numbers = {}
        for name, gradient in self.gradients(stribeck, solved.scale.size).items():
            others = [
                float(self.gradients(speed, one.scale.size)[name] @ (one.estimate / one.scale))
                for speed, one in near
                if name in self.gradients(speed, one.scale.size)
            ]
            spread = math.hypot(float(np.std(others or [0.0])), self.definition(name, solved))
            numbers[name] = posterior.number(gradient / solved.scale, spread)
        known = sum(self.fixed.get(name, 0.0) * share for name, share in self.over_distance.items())
        numbers[SLIDING] = replace(numbers[SLIDING], value=numbers[SLIDING].value + known)
        return FrictionCurve(
            self.averages.length * float(self.averages.time[1] - self.averages.time[0]),
            *self.bins(solved),
            numbers,
            self.over_distance["viscous_friction"],
            stribeck,
            self.later(solved),
            inflated,
            self.averages.is_sure,
            1.0 - solved.misfit / float(np.std(self.averages.force[0][self.averages.taken])),
            solved.misfit,
        )

    def definition(self, name: str, solved: _Solved) -> float:
        """Deviation of a number by what it means where it is not one, as in `reported_numbers`.

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

    def gradients(self, stribeck: float, size: int) -> dict[str, _Array]:
        """Return how each number depends on the coefficients."""
        axes = np.eye(size)
        at = {name: axes[index] for index, name in enumerate(self.names)}
        wanted = ["coulomb_friction", "viscous_friction", "spring_constant", "spring_preload"]
        if self.spring == 0.0:
            wanted.append("mass")
        result = {name: at[name] for name in wanted if name in at}
        sliding = sum(share * at[name] for name, share in self.over_distance.items() if name in at)
        if stribeck > 0:
            left = float(np.sum(self.weight * self.falling(stribeck)))
            sliding = sliding + left * axes[-1]
            if "coulomb_friction" in at:
                result["static_friction"] = at["coulomb_friction"] + axes[-1]
        result[SLIDING] = np.asarray(sliding)
        return result

    def bins(self, solved: _Solved) -> tuple[_Array, _Array, _Array]:
        """Return friction over speed: what is left of the force without spring and preload."""
        averages, taken = self.averages, self.averages.taken
        conservative = ("spring_constant", "spring_preload", "curvature", "cubic", "drift", "mass")
        keep = np.array([name in conservative for name in self.names])
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


def _at(signal: "_Array | float", taken: NDArray[np.intp]) -> "_Array | float":
    return signal[taken] if isinstance(signal, np.ndarray) else signal


def _shared(own: _Array, cross: _Array, right: _Array, independent: float) -> tuple[_Array, _Array]:
    """Return the information that both halves share, and the right-hand side that goes with it.

    Along each direction the halves agree in a share s of what each of them holds, which n averages
    know to (1 − s)/√n. What chance may have made of noise says nothing: the prior is left alone.
    """
    values, vectors = np.linalg.eigh(own)
    root = np.sqrt(np.maximum(values, 1e-13 * values[-1]))
    shares, turned = np.linalg.eigh((vectors / root).T @ cross @ (vectors / root))
    back = (vectors * root) @ turned
    shares = np.clip(shares, _LEAST_SHARED, 1.0)
    chance = _CHANCE * (1.0 - shares) / math.sqrt(independent)
    sure = np.maximum(1.0 - (chance / shares) ** 2, 0.0)
    information = (back * np.maximum(sure * shares, _LEAST_SHARED)) @ back.T
    said = sure * (turned.T @ ((vectors / root).T @ right))
    return np.asarray(information), np.asarray(back @ said)


class _Posterior:
    """What a solved regression leaves open: Gaussian but for the lag, which is integrated.

    The likelihood of the lag times its prior, and times the probability that F_c and F_v are above
    zero at that lag, is its posterior. At each lag all else is Gaussian.
    """

    def __init__(self, regression: _Regression, solved: _Solved, variance: float) -> None:
        self.regression, self.solved = regression, solved
        covariance, count = solved.covariance, solved.weight.size
        blocks = np.array_split(np.arange(count), int(np.clip(regression.strokes, *_BLOCKS)))
        scores = np.stack(
            [
                0.5
                / variance
                * sum(
                    (solved.weight[block] * solved.residual[1 - half][block])
                    @ solved.columns[half][block]
                    for half in (0, 1)
                )
                for block in blocks
            ]
        )
        self.scatter = (
            covariance @ (scores.T @ scores) @ covariance * len(blocks) / (len(blocks) - 1)
        )
        self.lags: _Array = np.zeros(1)
        self.probability: _Array = np.ones(1)
        self.exchanged, self.less_viscous = 0.0, 0.0
        if not regression.lag.is_known:
            self._integrate()
            self._exchange()

    def _integrate(self) -> None:
        solved, index = self.solved, len(self.regression.names)
        variance = float(solved.covariance[index, index])
        prior = float(solved.precision[index])
        precision = max(1.0 / variance - prior, 1e-6 * prior)
        mean = (solved.estimate[index] / variance - prior * solved.expected[index]) / precision
        if precision > 0.05 * prior:
            precision /= max(float(self.scatter[index, index]) / variance, 1.0)
        unit = solved.scale[index]
        self.changes = (_LAGS - solved.lag) * unit
        log = self.regression.lag.log_density(_LAGS)
        log = log - 0.5 * precision * (self.changes - mean) ** 2
        for name in ("coulomb_friction", "viscous_friction"):
            if name in self.regression.names:
                gradient = np.eye(solved.scale.size)[self.regression.names.index(name)]
                centre, slope, width = self._given_lag(gradient)
                value = centre + slope * (self.changes - solved.estimate[index])
                log = log + np.log(np.maximum(_normal(value / width), 1e-10))
        probability = np.exp(log - log.max())
        self.lags, self.probability = _LAGS, probability / np.sum(probability)

    def _exchange(self) -> None:
        """Weigh the other order of two lags.

        A stem with the delay F_v/k behind a sensor or a volume with the lag τ looks, while it
        slides, as one with the delay τ behind a lag F_v/k. Only their priors tell them apart.
        """
        values = self.regression.values(self.solved)
        spring, viscous = values.get("spring_constant", 0.0), values.get("viscous_friction", 0.0)
        lag = float(self.probability @ self.lags)
        if not (spring > 0 and viscous > spring * max(lag, 0.0)):
            return
        both = self.regression.lag.log_density(np.array([max(lag, 0.0), viscous / spring]))
        self.exchanged = 1.0 / (1.0 + math.exp(min(float(both[0] - both[1]), 700.0)))
        self.less_viscous = viscous - spring * max(lag, 0.0)

    def _given_lag(self, gradient: _Array) -> tuple[float, float, float]:
        """Return a number, its slope over the lag's coefficient, and its deviation at that lag."""
        solved, index = self.solved, len(self.regression.names)
        value = float(gradient @ solved.estimate)
        variance = float(gradient @ solved.covariance @ gradient)
        widened = float(gradient @ self.scatter @ gradient) / max(variance, np.finfo(float).tiny)
        factor = float(np.clip(widened, 1.0, _LARGEST_SCATTER))
        if self.regression.lag.is_known:
            return value, 0.0, math.sqrt(max(factor * variance, np.finfo(float).tiny))
        own = float(solved.covariance[index, index])
        slope = float(gradient @ solved.covariance[:, index]) / own
        rest = max(variance - slope**2 * own, 1e-9 * variance)
        return value, slope, math.sqrt(max(factor * rest, np.finfo(float).tiny))

    def number(self, gradient: _Array, spread: float) -> Estimated:
        """Return a number with its interval; `spread` is that of other Stribeck speeds."""
        centre, slope, width = self._given_lag(gradient)
        values, weights = np.full(1, centre), self.probability
        if self.lags.size > 1:
            index = len(self.regression.names)
            values = centre + slope * (self.changes - self.solved.estimate[index])
        if self.exchanged > 0:
            viscous = self.regression.names.index("viscous_friction")
            less = gradient[viscous] * self.solved.scale[viscous] * self.less_viscous
            values = np.concatenate([values, values - less])
            weights = np.concatenate([(1.0 - self.exchanged) * weights, self.exchanged * weights])
        mean = float(weights @ values)
        timing = math.sqrt(float(weights @ (values - mean) ** 2))
        record = math.hypot(width, spread)
        low, high = 0.0, 20.0 * math.hypot(record, timing)
        for _ in range(30):
            middle = 0.5 * (low + high)
            inside = _normal((mean + middle - values) / record)
            inside = inside - _normal((mean - middle - values) / record)
            low, high = (middle, high) if weights @ inside < CONFIDENCE else (low, middle)
        # The tails of the lag are heavier than normal ones: its share is that of the interval.
        whole = high / NormalDist().inv_cdf(0.5 + CONFIDENCE / 2)
        timing = min(timing, math.sqrt(max(whole**2 - record**2, 0.0)))
        return Estimated(mean, high, Budget(record, timing, {}))


def friction_curves(
    record: StampedRecord,
    valve: Valve,
    lag: LagPrior | None = None,
    fixed: Mapping[str, float] | None = None,
) -> list[FrictionCurve]:
    """Regress friction over speed, for several averaging times.

    Parameters
    ----------
    record : StampedRecord
        Drive and stem position at their own stamps.
    valve : Valve
        Geometry.
    lag : LagPrior, optional
        What is known of the timing.
    fixed : mapping of str to float, optional
        Known parameters; a spring constant of 0 for a machine without a spring.

    Returns
    -------
    list of FrictionCurve
        The shortest averaging time first; empty where the stem nowhere surely slides both ways.
    """
    lag, fixed = lag or LagPrior(), fixed or {}
    scale = valve.force_per_drive
    zero = 0.0 if valve.diaphragm_area is None else scale * valve.pressure_reference
    force = _Signal.of(record.drive, scale, zero)
    stem = _Signal.of(record.position, 1.0, 0.0)
    least = _FEWEST_PERIODS * max(force.period, stem.period)
    longer = [time for time in _AVERAGING_TIMES if time >= least] or [least, 2.0 * least]
    shorter = [time for time in _SHORT_AVERAGING_TIMES if time >= least]
    curves: list[FrictionCurve] = []
    attempts = [(_SURE_MARGIN, longer, _MOST_CURVES), (_SURE_MARGIN, shorter, 1)]
    attempts.append((_CLOSE, [*reversed(shorter), *longer], 2))
    for margin, times, most in attempts:
        for time in times:
            if len(curves) < most:
                averages = _averages(force, stem, valve, time, margin)
                if averages is not None:
                    curves.append(_Regression(averages, valve, lag, fixed).curve())
        if curves:
            break
    return curves


def curve_numbers(curves: Sequence[FrictionCurve]) -> dict[str, Estimated]:
    """Return each number from the shortest averaging time that knows it as well as any.

    The interval holds the scatter of those averaging times that know it nearly as well, and at
    least `_LEAST_HALF_WIDTH`.
    """
    result: dict[str, Estimated] = {}
    has_spring = any("spring_constant" in curve.numbers for curve in curves)
    least = _LEAST_HALF_WIDTH if has_spring else _LEAST_OF_MACHINE
    if len(curves) < _CONFIRMED or not curves[0].is_sure:
        least = _LEAST_ALONE
    sure = [curve for curve in curves if curve.is_sure]
    for name in {SLIDING, *(name for curve in sure for name in curve.numbers)}:
        known = [curve.numbers[name] for curve in sure or curves if name in curve.numbers]
        if not known:
            continue
        least_width = min(one.half_width for one in known)
        best = next(one for one in known if one.half_width <= _AS_WELL * least_width)
        near = [one.value for one in known if one.half_width < _NEARLY * best.half_width]
        half_width = math.hypot(
            best.half_width,
            _SCATTERS * float(np.std(near)),
            least * best.value,
        )
        result[name] = replace(best, half_width=half_width)
    return result


def checked_by_curve(
    simulated: Mapping[str, Estimated], balanced: Mapping[str, Estimated], inflation: float
) -> dict[str, Estimated]:
    """Return the numbers of a simulation, checked and sharpened by those of the force balance.

    Where the simulated stem follows the record to within noise, spring, preload and sliding
    friction come from the one that knows them better, and from the simulation where both exclude
    each other: reversals and rests tell it a lag from a viscous friction. Where the stem does not,
    they come from the force balance, with an interval that reaches the simulation.
    """
    result = dict(simulated)
    for name in (SLIDING, "spring_constant", "spring_preload"):
        ours, theirs = simulated.get(name), balanced.get(name)
        if ours is None or theirs is None or not (theirs.value > 0 or name == "spring_preload"):
            continue
        apart = abs(ours.value - theirs.value)
        agree = apart <= math.hypot(ours.half_width, theirs.half_width)
        if inflation > NOISE_LIKE:
            wider = theirs.half_width if agree else max(theirs.half_width, apart)
            result[name] = replace(theirs, half_width=wider)
        elif agree and theirs.half_width < ours.half_width:
            result[name] = theirs
    return result


def curve_evidence(curves: Sequence[FrictionCurve]) -> dict[str, list[float]]:
    """Return the friction curve that knows the sliding friction best, as plain lists, SI units."""
    if not curves:
        return {}
    best = min(curves, key=lambda curve: curve.numbers[SLIDING].half_width)
    return {
        "speed": best.speed.tolist(),
        "friction": best.friction.tolist(),
        "standard_error": best.standard_error.tolist(),
    }
