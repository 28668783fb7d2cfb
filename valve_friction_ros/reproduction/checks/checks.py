"""All comparisons with the paper, in its order; their criteria were set beforehand."""

from collections.abc import Iterator

import numpy as np

from valve_friction_ros.reproduction import paper
from valve_friction_ros.reproduction.checks.check import Check, compared, within, written
from valve_friction_ros.reproduction.checks.parameter_checks import NOTATION, parameter_checks
from valve_friction_ros.reproduction.checks.truth_checks import (
    dead_band_checks,
    graphite_checks,
    noise_checks,
)
from valve_friction_ros.reproduction.checks.validation_checks import validation_checks
from valve_friction_ros.reproduction.experiments import SINE
from valve_friction_ros.reproduction.force_terms import force_terms
from valve_friction_ros.reproduction.programme import BenchResult, Programme

__all__ = ["all_checks"]


def all_checks(programme: Programme) -> tuple[Check, ...]:
    """Compare the whole programme with the paper."""
    low, high = (programme.results[name] for name in paper.PACKINGS)
    return (
        *_excitations(low),
        *_signature(low, high),
        *_bias(low, high),
        *_sweep(low),
        *_table(low),
        *_table(high),
        *_terms(high),
        *validation_checks(programme),
        *dead_band_checks(low, high),
        *noise_checks(programme),
        *graphite_checks(programme),
    )


def _excitations(low: BenchResult) -> Iterator[Check]:
    shown = low.identified.top_speed * 330 / 350
    yield compared(
        1,
        "Fig. 3, largest δv of the sweep, low",
        "above 0.012 m/s",
        f"{written(shown, 3)} m/s",
        "330/350 of |ẋ|max above 0.012 m/s",
        shown > paper.VARIANCE_THRESHOLD,
        "the stem of this bench is slower",
    )
    bottom = low.bench.valve.pressure_reference
    for which, share, pressure in (("lowest", "13.65", SINE.low), ("highest", "72", SINE.high)):
        ours = 100 * (pressure - bottom) / paper.PRESSURE_SPAN
        places = len(share.partition(".")[2])
        matched = f"{ours:.{places}f}" == share
        yield compared(
            1,
            f"section 5, {which} pressure of the sine",
            f"{share} %",
            f"{ours:.2f} %",
            "the digits of the paper",
            matched,
            f"the paper's own {pressure / 1e3:g} kPa is {ours:.2f} % of its range "
            "41.74 to 206.84 kPa; the pressure is what is commanded here",
        )


def _signature(low: BenchResult, high: BenchResult) -> Iterator[Check]:
    zones = [one.identified.signature.dead_zone for one in (low, high)]
    ratio = zones[1] / zones[0]
    yield compared(
        2,
        "Fig. 2, dead zone, high over low",
        "at least 3",
        f"{ratio:.2f}",
        "at least 3",
        ratio >= paper.DEAD_ZONE_RATIO,
        "the noise of this run hides it",
    )
    tops = [float(one.experiments.triangle.measured.position.max()) * 1e3 for one in (low, high)]
    yield compared(
        2,
        "Fig. 2, largest stroke",
        "smaller with high friction",
        f"low {tops[0]:.2f} mm, high {tops[1]:.2f} mm",
        "high below low",
        tops[1] < tops[0],
        "the noise of this run hides it",
    )
    for one in (low, high):
        found = one.identified.force_balance.values
        equal = found["static_friction"] == found["coulomb_friction"]
        yield compared(
            2,
            f"Fig. 2, slip jump, {one.bench.name}",
            "none",
            "none" if equal else "found",
            "none found",
            equal,
            "the noise of this run looks like one",
        )


def _bias(low: BenchResult, high: BenchResult) -> Iterator[Check]:
    for one in (low, high):
        name, signature = one.bench.name, one.identified.signature
        yield within(
            3,
            f"(16), k of (15), {name}",
            paper.SIGNATURE_SPRING[name],
            signature.spring_constant,
            0.01,
            "N/m",
            why="the simulated spring has the k of Table 1, model 1, which itself lies "
            f"{100 * (2.05e5 / paper.SIGNATURE_SPRING[name] - 1):.1f} % above the paper's (16)",
        )
    for one in (low, high):
        name, bias = one.bench.name, one.identified.signature.position_bias
        published = paper.SIGNATURE_BIAS[name]
        matched = abs(bias - published) <= 0.05e-3
        yield compared(
            3,
            f"(16), x̄ of (14), {name}",
            f"{published * 1e3:.2f} mm",
            f"{bias * 1e3:.4f} mm",
            "within 0.05 mm",
            matched,
            "the noise of this run hides the breakaway",
        )


def _sweep(low: BenchResult) -> Iterator[Check]:
    free = low.identified.free
    sweep = free.sweep
    bottom, top = free.region
    matched = bottom <= paper.CHOSEN_THRESHOLD <= top
    yield compared(
        4,
        "Fig. 4, δv of the least σ_s, low",
        "around 0.01 m/s",
        f"{bottom:.4f} to {top:.4f} m/s",
        "σ_s at 0.01 m/s within 5 % of the least",
        matched,
        "the simulated stem obeys (4) at every speed, so that only noise is in σ_s: it falls "
        "where a few samples of nearly one speed are left, and nothing else marks 0.01 m/s",
    )
    place = int(np.argmin(np.abs(sweep.thresholds - paper.CHOSEN_THRESHOLD)))
    yield compared(
        4,
        "Fig. 4, R²_s at 0.01 m/s, low",
        "maximal, close to 1",
        f"{sweep.r_squared[place]:.6f}",
        "within 0.001 of 1",
        bool(abs(sweep.r_squared[place] - 1) <= 1e-3),
        "the noise of this run hides it",
    )
    spreads = [
        float(np.nanstd(sweep.estimates["coulomb_friction"][inside]))
        for inside in (
            sweep.thresholds > paper.VARIANCE_THRESHOLD,
            np.abs(sweep.thresholds - paper.CHOSEN_THRESHOLD) < 1e-3,
        )
    ]
    yield compared(
        4,
        "Fig. 3, scatter of F_c above 0.012 m/s, low",
        "high",
        f"{written(spreads[0], 3)} N, around 0.01 m/s {written(spreads[1], 3)} N",
        "more than around 0.01 m/s",
        spreads[0] > spreads[1],
        "without noise nothing scatters",
    )


def _table(one: BenchResult) -> Iterator[Check]:
    name, found = one.bench.name, one.identified
    mass = {"mass": found.free.chosen_estimates["mass"]}
    sweep = {key: found.published.values[key] for key in NOTATION}
    yield from parameter_checks(
        5,
        f"Table 1, model 1, {name}",
        paper.MODEL_1[name],
        {**sweep, **mass},
        {
            "mass": "inertia is some 0.02 N of 5 kN: noise and the digits of x̄ decide what is "
            "regressed, which the conclusions of the paper say as well"
        },
    )
    balance = {key: found.force_balance.values[key] for key in NOTATION if key != "mass"}
    yield from parameter_checks(
        5,
        f"Table 1, model 2, {name}",
        paper.MODEL_2[name],
        balance,
        {
            "viscous_friction": "the simulated valve has the F_v of model 1, and (19), a small "
            "difference of large forces, comes nearer to that than to the paper's model 2",
            "coulomb_friction": "the simulated valve has the F_c of model 1, and points found "
            "automatically give it; the paper reads its points off a plot",
            "static_friction": "as for F_c",
        },
    )


def _terms(high: BenchResult) -> Iterator[Check]:
    peaks = {name: float(np.max(np.abs(term))) for name, term in force_terms(high).terms.items()}
    spring, coulomb, viscous, inertia = peaks.values()
    forces = f"{spring:.0f}, {coulomb:.0f}, {viscous:.0f}, {inertia:.2g} N"
    yield compared(
        6,
        "Fig. 5, order of the terms, high",
        "k·x, then F_c",
        forces,
        "largest k·x, F_c next",
        spring > coulomb > max(viscous, inertia),
        "the noise of this run hides it",
    )
    yield compared(
        6,
        "Fig. 5, F_v·ẋ and m·ẍ, high",
        "negligible",
        f"{100 * viscous / spring:.2g} % and {100 * inertia / spring:.1g} % of k·x",
        "each below 5 % of the largest term",
        max(viscous, inertia) < 0.05 * spring,
        "the noise of this run hides it",
    )
