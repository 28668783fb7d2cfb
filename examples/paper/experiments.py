# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Experiments on a bench: single runs, the free threshold sweep, and the scatter over seeds."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from paper.bench import Bench
from valve_friction_ros.identification import (
    IdentificationSettings,
    Result,
    Sweep,
    ValveSignature,
    identify_signature,
    published_estimate,
    sweep_thresholds,
)
from valve_friction_ros.identification.published.identify import choose_threshold
from valve_friction_ros.identification.published.sweep import force_balance_regression
from valve_friction_ros.model import (
    Excitation,
    IsaSteps,
    KarnoppParameters,
    Recording,
    SensorNoise,
    SineWave,
    StemState,
    TriangleWave,
    Valve,
    converter_response,
    simulate,
)
from valve_friction_ros.model.excitations import pressure_at
from valve_friction_ros.signals import differentiate


def model_of(result: Result) -> KarnoppParameters:
    """Return the identified model; raise ValueError if its values are impossible."""
    if result.model is None:
        raise ValueError(f"the values of method {result.method} are impossible for a model")
    return result.model


def signature_of(result: Result) -> ValveSignature:
    """Return the valve signature; raise ValueError if the method has none."""
    if result.signature is None:
        raise ValueError(f"the method {result.method} has no valve signature")
    return result.signature


_REGION = 1.05
"""Bound of the region of the paper's choice, over the least σ_s. Chosen: the paper gives no
number."""


class FreeSweep(NamedTuple):
    """A sweep of all four parameters of (3), and its chosen step.

    `published_estimate` repeats the regression with an assumed mass if the record does not
    determine the mass. This sweep keeps the regressed mass.
    """

    sweep: Sweep
    chosen: int
    window: int

    @property
    def threshold(self) -> float:
        """The chosen δv, m/s."""
        return float(self.sweep.thresholds[self.chosen])

    @property
    def chosen_estimates(self) -> dict[str, float]:
        """Estimates at the chosen δv, by name."""
        return self.estimates_at(self.threshold)

    def estimates_at(self, threshold: float) -> dict[str, float]:
        """Return the estimates at the δv, m/s, nearest to `threshold`, by name."""
        place = int(np.argmin(np.abs(self.sweep.thresholds - threshold)))
        return {name: float(one[place]) for name, one in self.sweep.estimates.items()}

    @property
    def region(self) -> tuple[float, float]:
        """Lowest and highest δv, m/s, with a σ_s within 5 % of the least.

        σ_s is ignored where the samples fill fewer than four derivative windows: too few samples
        are then independent.
        """
        sweep = self.sweep
        usable = np.isfinite(sweep.sigma) & (sweep.samples >= sweep.free * self.window)
        sigma = np.where(usable, sweep.sigma, np.inf)
        inside = sweep.thresholds[sigma <= _REGION * sigma.min()]
        return float(inside[0]), float(inside[-1])


def free_sweep(recording: Recording, valve: Valve, settings: IdentificationSettings) -> FreeSweep:
    """Sweep (3) to (8) with (17) and (18), without assumptions."""
    derivatives = differentiate(
        recording.position, recording.sample_period, settings.published_window, settings.order
    )
    force = valve.actuator_force(recording.drive)
    regression = force_balance_regression(force, recording.position, derivatives, settings)
    first = float(regression.speed.max()) / settings.resolution
    steps = np.arange(1, settings.steps + 1, dtype=np.float64)
    sweep = sweep_thresholds(regression, np.multiply(first, steps, dtype=np.float64))
    return FreeSweep(
        sweep, choose_threshold(sweep, settings.published_window), settings.published_window
    )


TRIANGLE = TriangleWave(pressure_at(0.1), pressure_at(0.8), 42.0)
"""Triangle of the signature: slope as for the whole range in periods of 60 s, clear of the travel
stops."""

SINE = SineWave()
"""The paper's validation signal: 63.95 to 160.44 kPa in 35.5 s."""

ISA = IsaSteps()
"""The ISA sequence: 0.1 to 50 % of the input range around its middle."""


@dataclass(frozen=True)
class Plan:
    """Number of periods per wave, and the step sequence, which is recorded completely."""

    square_periods: float = 6.0
    triangle_periods: float = 3.5
    sine_periods: float = 2.0
    isa: IsaSteps = ISA


@dataclass(frozen=True, eq=False)
class Experiment:
    """Commanded pressure, Pa, shape (n,), with the true motion and the noisy measurement."""

    command: NDArray[np.float64] = field(repr=False)
    clean: Recording
    measured: Recording


@dataclass(frozen=True, eq=False)
class Experiments:
    """The four experiments on one bench."""

    square: Experiment
    triangle: Experiment
    sine: Experiment
    isa: Experiment


def run(bench: Bench, excitation: Excitation, duration: float, number: int = 0) -> Experiment:
    """Run one experiment of `duration` seconds; its `number` selects the noise."""
    period = bench.sample_period
    command = excitation.sample(np.arange(round(duration / period) + 1) * period)
    pressure = converter_response(command, period, bench.converter_lag)
    stem = simulate(bench.valve, bench.truth, pressure, period)
    clean = Recording(period, pressure, stem.position)
    noise = replace(bench.noise, seed=bench.noise.seed + number)
    return Experiment(command, clean, noise.applied_to(clean))


def stem_error(
    bench: Bench, experiment: Experiment, model: KarnoppParameters
) -> NDArray[np.float64]:
    """Return the simulated minus the true stem position, m, both under the true pressure."""
    clean = experiment.clean
    start = StemState(float(clean.position[0]))
    stem = simulate(bench.valve, model, clean.pressure, clean.sample_period, start)
    return stem.position - clean.position


def rms(error: NDArray[np.float64]) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(error**2)))


def run_all(bench: Bench, plan: Plan) -> Experiments:
    """Run the paper's four experiments."""
    square, triangle, sine = bench.square, TRIANGLE, SINE
    return Experiments(
        run(bench, square, plan.square_periods * square.period, 0),
        run(bench, triangle, plan.triangle_periods * triangle.period, 1),
        run(bench, sine, plan.sine_periods * sine.period, 2),
        run(bench, plan.isa, plan.isa.duration, 3),
    )


NOISE_LEVELS = (
    SensorNoise(0.3e-6, 1.0),
    SensorNoise(1e-6, 5.0),
    SensorNoise(10e-6, 100.0),
    SensorNoise(28.6e-6, 165.0),
)
"""Noise to compare; the last is 0.1 % of the travel and of the pressure range."""

_SCATTERED = ("mass", "viscous_friction", "coulomb_friction", "spring_constant")
_SEED_STEP = 1000
"""Seed increment per repetition: larger than the number of experiments on a bench."""


class Level(NamedTuple):
    """Mean and standard deviation, over the seeds, of each parameter of model 1.

    All are regressed at the chosen δv, including a mass that the record does not determine.
    """

    packing: str
    noise: SensorNoise
    mean: Mapping[str, float]
    deviation: Mapping[str, float]


class Rivals(NamedTuple):
    """Rms errors of models 1 and 2 against the noise-free stem, m, one per seed."""

    packing: str
    excitation: str
    model_1: tuple[float, ...]
    model_2: tuple[float, ...]

    @property
    def wins(self) -> int:
        """Number of seeds in which model 1 is closer."""
        return sum(one < two for one, two in zip(self.model_1, self.model_2, strict=True))


@dataclass(frozen=True)
class Scatter:
    """Scatter of the estimates per noise level, and errors of the two models per seed."""

    levels: tuple[Level, ...]
    rivals: tuple[Rivals, ...]

    def level(self, packing: str, noise: SensorNoise) -> Level:
        """Return the level with this noise, for any seed."""
        wanted = (packing, noise.position, noise.pressure)
        return next(
            one
            for one in self.levels
            if (one.packing, one.noise.position, one.noise.pressure) == wanted
        )

    def of(self, packing: str, excitation: str) -> Rivals:
        """Return the errors of both models for a packing and an excitation."""
        return next(one for one in self.rivals if one[:2] == (packing, excitation))


def _seeded(bench: Bench, noise: SensorNoise, number: int) -> Bench:
    """Return the bench with random numbers that its own experiments do not use."""
    return bench.with_noise(replace(noise, seed=bench.noise.seed + _SEED_STEP * (number + 1)))


def _settings(bench: Bench) -> IdentificationSettings:
    return IdentificationSettings(
        position_bias=bench.position_bias, assumed_mass=bench.assumed_mass
    )


def _level(bench: Bench, noise: SensorNoise, plan: Plan, seeds: int) -> Level:
    rows = []
    for number in range(seeds):
        noisy = _seeded(bench, noise, number)
        experiment = run(noisy, noisy.square, plan.square_periods * noisy.square.period)
        found = free_sweep(experiment.measured, noisy.valve, _settings(noisy)).chosen_estimates
        rows.append([found[name] for name in _SCATTERED])
    mean, deviation = np.mean(rows, axis=0), np.std(rows, axis=0, ddof=1)
    return Level(
        bench.name,
        noise,
        dict(zip(_SCATTERED, map(float, mean), strict=True)),
        dict(zip(_SCATTERED, map(float, deviation), strict=True)),
    )


def _rivals(bench: Bench, plan: Plan, seeds: int) -> list[Rivals]:
    """Identify and validate both models with each seed."""
    validations = {
        "sine": run(bench, SINE, plan.sine_periods * SINE.period),
        "ISA steps": run(bench, plan.isa, plan.isa.duration),
    }
    errors: dict[str, list[tuple[float, ...]]] = {name: [] for name in validations}
    for number in range(seeds):
        noisy = _seeded(bench, bench.noise, number)
        square = run(noisy, noisy.square, plan.square_periods * noisy.square.period, 0)
        triangle = run(noisy, TRIANGLE, plan.triangle_periods * TRIANGLE.period, 1)
        balance = identify_signature(
            triangle.measured,
            noisy.valve,
            IdentificationSettings(assumed_mass=noisy.assumed_mass),
        )
        bias = round(signature_of(balance).position_bias, 5)
        settings = replace(_settings(noisy), position_bias=bias)
        sweep = published_estimate(square.measured, noisy.valve, settings)
        for name, experiment in validations.items():
            errors[name].append(
                tuple(
                    rms(stem_error(bench, experiment, model))
                    for model in (sweep.parameters(), model_of(balance))
                )
            )
    return [
        Rivals(bench.name, name, *(tuple(column) for column in zip(*pairs, strict=True)))
        for name, pairs in errors.items()
    ]


def _levels_with(own: SensorNoise) -> list[SensorNoise]:
    """Return the noise levels to compare, including the bench's own, in increasing order."""
    levels = {(one.position, one.pressure) for one in (*NOISE_LEVELS, own)}
    return [SensorNoise(*level) for level in sorted(levels)]


def measure_scatter(
    benches: Sequence[Bench], plan: Plan, seeds: int, progress: Callable[[str], object]
) -> Scatter:
    """Repeat the identification with other noise, at several levels including the bench's own."""
    levels, rivals = [], []
    for bench in benches:
        progress(f"{bench.name}: scatter by noise")
        levels += [_level(bench, noise, plan, seeds) for noise in _levels_with(bench.noise)]
        progress(f"{bench.name}: both models, seed by seed")
        rivals += _rivals(bench, plan, seeds)
    return Scatter(tuple(levels), tuple(rivals))
