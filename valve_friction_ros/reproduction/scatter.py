"""Scatter of the estimates and the validation by sensor noise: the programme with other seeds."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from valve_friction_ros.identification import (
    IdentificationSettings,
    identify_signature,
    published_estimate,
)
from valve_friction_ros.model import SensorNoise
from valve_friction_ros.reproduction.bench import Bench
from valve_friction_ros.reproduction.experiments import SINE, TRIANGLE, Plan, rms, run, stem_error
from valve_friction_ros.reproduction.found import model_of, signature_of
from valve_friction_ros.reproduction.free_sweep import free_sweep

__all__ = ["NOISE_LEVELS", "Level", "Rivals", "Scatter", "measure_scatter"]

NOISE_LEVELS = (
    SensorNoise(0.3e-6, 1.0),
    SensorNoise(1e-6, 5.0),
    SensorNoise(10e-6, 100.0),
    SensorNoise(28.6e-6, 165.0),
)
"""Noise to compare; the last is 0.1 % of the travel and of the pressure range."""

_SCATTERED = ("mass", "viscous_friction", "coulomb_friction", "spring_constant")
_SEED_STEP = 1000
"""Distance of the seeds of two repetitions: larger than the number of experiments on a bench."""


class Level(NamedTuple):
    """Mean and standard deviation over the seeds of what model 1 estimates, by parameter.

    All as regressed at the chosen δv; so is the mass, even where the record does not determine it.
    """

    packing: str
    noise: SensorNoise
    mean: Mapping[str, float]
    deviation: Mapping[str, float]


class Rivals(NamedTuple):
    """rms errors against the stem without noise, m, one a seed, of model 1 and of model 2."""

    packing: str
    excitation: str
    model_1: tuple[float, ...]
    model_2: tuple[float, ...]

    @property
    def wins(self) -> int:
        """Count the seeds in which model 1 came closer."""
        return sum(one < two for one, two in zip(self.model_1, self.model_2, strict=True))


@dataclass(frozen=True)
class Scatter:
    """Scatter of the estimates by level of noise, and the two models by seed."""

    levels: tuple[Level, ...]
    rivals: tuple[Rivals, ...]

    def level(self, packing: str, noise: SensorNoise) -> Level:
        """Return the level with this noise, whatever its seed."""
        wanted = (packing, noise.position, noise.pressure)
        return next(
            one
            for one in self.levels
            if (one.packing, one.noise.position, one.noise.pressure) == wanted
        )

    def of(self, packing: str, excitation: str) -> Rivals:
        """Return the two models of one packing on one excitation."""
        return next(one for one in self.rivals if one[:2] == (packing, excitation))


def _seeded(bench: Bench, noise: SensorNoise, number: int) -> Bench:
    """Return the bench with other random numbers than its own experiments."""
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
        MappingProxyType(dict(zip(_SCATTERED, map(float, mean), strict=True))),
        MappingProxyType(dict(zip(_SCATTERED, map(float, deviation), strict=True))),
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
    """Return the levels to compare, with the bench's own among them, in increasing order."""
    levels = {(one.position, one.pressure) for one in (*NOISE_LEVELS, own)}
    return [SensorNoise(*level) for level in sorted(levels)]


def measure_scatter(
    benches: Sequence[Bench], plan: Plan, seeds: int, progress: Callable[[str], object]
) -> Scatter:
    """Repeat the identification with other noise, at several levels and at the bench's own."""
    levels, rivals = [], []
    for bench in benches:
        progress(f"{bench.name}: scatter by noise")
        levels += [_level(bench, noise, plan, seeds) for noise in _levels_with(bench.noise)]
        progress(f"{bench.name}: both models, seed by seed")
        rivals += _rivals(bench, plan, seeds)
    return Scatter(tuple(levels), tuple(rivals))
