"""Comparisons with the truth of the simulation, where the paper has no number."""

from collections.abc import Iterator

import numpy as np

from valve_friction_ros.reproduction import paper
from valve_friction_ros.reproduction.checks.check import Check, compared
from valve_friction_ros.reproduction.checks.parameter_checks import (
    NOTATION,
    TOLERANCES,
    parameter_checks,
)
from valve_friction_ros.reproduction.programme import BenchResult, Programme

__all__ = ["dead_band_checks", "graphite_checks", "noise_checks"]

_EXACT = 1e-4
"""Largest relative error without noise. Chosen: the error of derivatives over 31 samples is
smaller."""


def dead_band_checks(low: BenchResult, high: BenchResult) -> Iterator[Check]:
    """Compare the dead band of the ISA test with the friction of the valve."""
    for one in (low, high):
        truth = 2 * one.bench.truth.static_friction / one.bench.valve.force_per_drive
        share = 100 * truth / paper.PRESSURE_SPAN
        band = one.steps.dead_band
        yield compared(
            8,
            f"ISA dead band, {one.bench.name} (truth instead of paper)",
            f"{share:.2f} %",
            f"{band.ignored:.2f} to {band.answered:.2f} %",
            "2·F_s/S_a lies between",
            band.ignored <= share <= band.answered,
            "the noise of this run hides it",
        )


def noise_checks(programme: Programme) -> Iterator[Check]:
    """Compare model 1 without noise with the truth, and the mass's scatter with the paper's."""
    for name, estimate in programme.without_noise.items():
        truth, found = programme.results[name].bench.truth, estimate.values
        errors = {key: abs(found[key] / getattr(truth, key) - 1) for key in NOTATION}
        mass = errors.pop("mass")
        yield compared(
            9,
            f"model 1 without noise, {name} (truth instead of paper)",
            "k, F_v, F_c, F_s, m",
            f"off by {100 * max(errors.values()):.1g} %, m by {100 * mass:.1f} %",
            "k, F_v, F_c, F_s within 0.01 %, m within 10 %",
            max(errors.values()) <= _EXACT and mass <= TOLERANCES["mass"],
            "the configured bench differs from the bench of this criterion",
        )
    masses = np.array([paper.MODEL_1[name].mass for name in paper.PACKINGS])
    published = float(np.sqrt(np.mean((masses / paper.NOMINAL_MASS - 1) ** 2)))
    for name in paper.PACKINGS:
        bench = programme.results[name].bench
        level = programme.scatter.level(name, bench.noise)
        ours = level.deviation["mass"] / bench.truth.mass
        matched = 0.5 <= ours / published <= 2
        yield compared(
            9,
            f"Table 1, scatter of the regressed mass, {name}",
            f"{100 * published:.0f} % (rms, about the nominal mass)",
            f"{100 * ours:.2g} %",
            "within a factor of 2",
            matched,
            "no noise serves both packings: with ten times the viscous friction, noise of the "
            "velocity weighs ten times as much on the mass",
        )


def graphite_checks(programme: Programme) -> Iterator[Check]:
    """Compare every method on the graphite packing with the truth."""
    one = programme.results["graphite"]
    names = ("coulomb_friction", "static_friction", "spring_constant")
    for method, model in one.identified.models().items():
        found = {name: getattr(model, name) for name in names}
        yield from parameter_checks(
            10, f"graphite (truth instead of paper), {method}", one.bench.truth, found, {}
        )
