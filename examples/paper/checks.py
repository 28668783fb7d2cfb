# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""All comparisons with the paper, in the paper's order; the criteria were set beforehand."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from paper import published_numbers as paper
from paper.experiments import SINE
from paper.programme import BenchResult, Programme
from valve_friction_ros.model import KarnoppParameters
from valve_friction_ros.signals import differentiate


class Check(NamedTuple):
    """A comparison with the paper, in the paper's unit; the criterion was set before the values.

    `why` is the reason of a mismatch, and `item` the section of the report, from 1.
    """

    name: str
    paper: str
    ours: str
    criterion: str
    matched: bool
    why: str
    item: int = 0


def written(value: float, digits: int = 4) -> str:
    """Write a number with `digits` digits, without decimals if large; nan as a dash."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    places = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    return f"{value:.{min(places, 9)}f}"


def within(
    name: str,
    paper: float,
    ours: float,
    share: float,
    unit: str,
    why: str,
) -> Check:
    """Compare two numbers, which match within a share of the paper's number."""
    wanted, found = f"{written(paper)} {unit}", f"{written(ours)} {unit}"
    matched = abs(ours - paper) <= share * abs(paper)
    return Check(name, wanted, found, f"within {100 * share:g} %", matched, why)


def count(checks: Sequence[Check]) -> str:
    """Return the number of matches."""
    return f"{sum(check.matched for check in checks)} of {len(checks)} matched"


def summary(checks: Sequence[Check]) -> str:
    """Return one line with the number of matches and the names of the mismatches."""
    missed = [check.name for check in checks if not check.matched]
    told = count(checks)
    return f"{told}; not matched: {'; '.join(missed)}." if missed else f"{told}."


NOTATION = {
    "mass": ("m", "kg"),
    "spring_constant": ("k", "N/m"),
    "viscous_friction": ("F_v", "N·s/m"),
    "coulomb_friction": ("F_c", "N"),
    "static_friction": ("F_s", "N"),
}
"""Symbol and unit of each parameter in Table 1, in the order of the table."""

TOLERANCES = {
    "mass": 0.1,
    "spring_constant": 0.01,
    "viscous_friction": 0.05,
    "coulomb_friction": 0.05,
    "static_friction": 0.05,
}
"""Largest deviation of a reproduced parameter, as a share of the paper's value.

Chosen before the comparison: the scatter of Table 1 between its two packings, per parameter."""


def parameter_checks(
    place: str,
    wanted: KarnoppParameters,
    found: dict[str, float],
    reasons: dict[str, str],
) -> Iterator[Check]:
    """Compare identified and expected parameters, with reasons for mismatches."""
    for name, value in found.items():
        symbol, unit = NOTATION[name]
        yield within(
            f"{place}, {symbol}",
            getattr(wanted, name),
            value,
            TOLERANCES[name],
            unit,
            why=reasons.get(
                name, "the noise of this run biases the method by more than the tolerance"
            ),
        )


_EXACT = 1e-4
"""Largest relative error without noise. Chosen: derivatives over 31 samples have a smaller
error."""


def dead_band_checks(low: BenchResult, high: BenchResult) -> Iterator[Check]:
    """Compare the dead band of the ISA test with the friction of the valve."""
    for one in (low, high):
        truth = 2 * one.bench.truth.static_friction / one.bench.valve.force_per_drive
        share = 100 * truth / paper.PRESSURE_SPAN
        band = one.steps.dead_band
        yield Check(
            f"ISA dead band, {one.bench.name} (truth instead of paper)",
            f"{share:.2f} %",
            f"{band.ignored:.2f} to {band.answered:.2f} %",
            "2·F_s/S_a lies between",
            band.ignored <= share <= band.answered,
            "the noise of this run hides it",
        )


def noise_checks(programme: Programme) -> Iterator[Check]:
    """Compare noise-free model 1 with the truth, and the scatter of the mass with the paper's."""
    for name, estimate in programme.without_noise.items():
        truth, found = programme.results[name].bench.truth, estimate.values
        errors = {key: abs(found[key] / getattr(truth, key) - 1) for key in NOTATION}
        mass = errors.pop("mass")
        yield Check(
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
        yield Check(
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
            f"graphite (truth instead of paper), {method}", one.bench.truth, found, {}
        )


FIGURES = {
    ("low", "sine"): "Fig. 6",
    ("high", "sine"): "Fig. 7",
    ("low", "ISA steps"): "Fig. 8",
    ("high", "ISA steps"): "Fig. 9",
}
"""Figures of the paper by packing and excitation."""

_VISIBLE = 0.1e-3
"""Distance of two stems, m, visible in a figure of the whole travel: a line's width, 0.35 %."""

_NEGLIGIBLE = 1e-3
"""Negligible share of the travel. Chosen: less than the width of a line in a figure."""

_GOOD = 0.95
"""Fit of a model that describes the valve. Chosen: Figs. 6 to 9 show both models on the
measurement."""


def validation_checks(programme: Programme) -> Iterator[Check]:
    """Compare fit and errors of both models for sine and ISA steps."""
    for (name, excitation), figure in FIGURES.items():
        yield from _of_figure(programme, name, excitation, figure)
    low, high = (programme.results[name].sine for name in paper.PACKINGS)
    for model in ("model 1", "model 2"):
        fits = [100 * one[model].validation.fit for one in (low, high)]
        yield Check(
            f"section 5, sine, {model}",
            "slightly worse with high friction",
            f"fit {fits[0]:.4f} % (low), {fits[1]:.4f} % (high)",
            "fit of high below low",
            fits[1] < fits[0],
            "both errors are sensor noise, whatever the friction",
        )
    yield _limit_velocity(programme)


def _of_figure(programme: Programme, name: str, excitation: str, figure: str) -> Iterator[Check]:
    result = programme.results[name]
    models = result.sine if excitation == "sine" else result.isa
    fits = [models[model].validation.fit for model in ("model 1", "model 2")]
    yield Check(
        f"{figure}, both models describe the valve",
        "quite well",
        " and ".join(f"{100 * fit:.2f} %" for fit in fits),
        f"fit of both at least {100 * _GOOD:g} %",
        min(fits) >= _GOOD,
        "the noise of this run weighs more than the error of the models",
    )
    rivals = programme.scatter.of(name, excitation)
    errors = [1e6 * models[model].true_rms for model in ("model 1", "model 2")]
    better = errors[0] < errors[1] and rivals.wins == len(rivals.model_1)
    yield Check(
        f"{figure}, model 1 beats model 2",
        "yes",
        f"{errors[0]:.2g} against {errors[1]:.2g} µm rms; so in {rivals.wins} of "
        f"{len(rivals.model_1)} other seeds",
        "smaller rms against the stem without noise, in every seed",
        better,
        "the noise of this run decides which of them comes closer",
    )
    if (name, excitation) == ("low", "sine"):
        return  # the paper finds both models equal here
    visible = models["model 2"].true_rms >= _VISIBLE
    published = 1e6 * models["paper's model 2"].true_rms
    yield Check(
        f"{figure}, model 2 deviates visibly",
        "yes",
        f"{errors[1]:.2g} µm; with the paper's numbers of model 2 {published:.0f} µm",
        "at least 100 µm rms",
        visible,
        "with breakaway points found automatically the force balance is nearly as good here; "
        "the numbers that the paper read off its plot do deviate",
    )


def _limit_velocity(programme: Programme) -> Check:
    changes = [
        abs(one["model 1, DV 1 %"].true_rms - one["model 1"].true_rms)
        / programme.results[name].bench.valve.travel
        for name in paper.PACKINGS
        for one in (programme.results[name].sine, programme.results[name].isa)
    ]
    return Check(
        "section 3, effect of DV = 1 % of |ẋ|max",
        "negligible",
        f"rms changes by {100 * max(changes):.1g} % of the travel at most",
        f"less than {100 * _NEGLIGIBLE:g} % of the travel",
        max(changes) < _NEGLIGIBLE,
        "the models of this run have F_s above F_c, and stop early",
    )


def all_checks(programme: Programme) -> tuple[Check, ...]:
    """Compare the whole programme with the paper."""
    low, high = (programme.results[name] for name in paper.PACKINGS)
    sections = (
        _excitations(low),
        _signature(low, high),
        _bias(low, high),
        _sweep(low),
        (*_table(low), *_table(high)),
        _terms(high),
        validation_checks(programme),
        dead_band_checks(low, high),
        noise_checks(programme),
        graphite_checks(programme),
    )
    return tuple(
        check._replace(item=number)
        for number, checks in enumerate(sections, start=1)
        for check in checks
    )


def _excitations(low: BenchResult) -> Iterator[Check]:
    shown = low.identified.top_speed * 330 / 350
    yield Check(
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
        yield Check(
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
    yield Check(
        "Fig. 2, dead zone, high over low",
        "at least 3",
        f"{ratio:.2f}",
        "at least 3",
        ratio >= paper.DEAD_ZONE_RATIO,
        "the noise of this run hides it",
    )
    tops = [float(one.experiments.triangle.measured.position.max()) * 1e3 for one in (low, high)]
    yield Check(
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
        yield Check(
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
        yield Check(
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
    yield Check(
        "Fig. 4, δv of the least σ_s, low",
        "around 0.01 m/s",
        f"{bottom:.4f} to {top:.4f} m/s",
        "σ_s at 0.01 m/s within 5 % of the least",
        matched,
        "the simulated stem obeys (4) at every speed, so that only noise is in σ_s: it falls "
        "where a few samples of nearly one speed are left, and nothing else marks 0.01 m/s",
    )
    place = int(np.argmin(np.abs(sweep.thresholds - paper.CHOSEN_THRESHOLD)))
    yield Check(
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
    yield Check(
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
    yield Check(
        "Fig. 5, order of the terms, high",
        "k·x, then F_c",
        forces,
        "largest k·x, F_c next",
        spring > coulomb > max(viscous, inertia),
        "the noise of this run hides it",
    )
    yield Check(
        "Fig. 5, F_v·ẋ and m·ẍ, high",
        "negligible",
        f"{100 * viscous / spring:.2g} % and {100 * inertia / spring:.1g} % of k·x",
        "each below 5 % of the largest term",
        max(viscous, inertia) < 0.05 * spring,
        "the noise of this run hides it",
    )


_ORDER = 3


_WINDOW = 0.25
"""Order and length, s, of the derivative windows. Chosen: short compared with the 35.5 s of the
sine."""


_REST = 0.05
"""Share of the top speed below which the stem is at rest. Chosen: above its noise."""


class ForceTerms(NamedTuple):
    """Time since the first sample, s, and the terms of (4) by name, N, shape (n,) each.

    The terms are k·x, F_c·sgn ẋ, F_v·ẋ and m·ẍ, in this order. x is measured from the bias of (10),
    and the sign of a resting stem is 0.
    """

    time: NDArray[np.float64]
    terms: dict[str, NDArray[np.float64]]


def force_terms(result: BenchResult) -> ForceTerms:
    """Evaluate the terms for the measured sine with model 1.

    Derivative windows of a quarter of a second keep the remaining noise small.
    """
    recording, model = result.experiments.sine.measured, result.identified.published
    window = round(_WINDOW / recording.sample_period) | 1
    found = differentiate(recording.position, recording.sample_period, window, _ORDER)
    moving = np.abs(found.velocity) > _REST * np.max(np.abs(found.velocity))
    return ForceTerms(
        found.inner(recording.time),
        {
            "k·x": model.spring_constant * found.inner(recording.position) + model.spring_preload,
            "F_c·sgn ẋ": model.coulomb_friction * np.sign(found.velocity) * moving,
            "F_v·ẋ": model.viscous_friction * found.velocity,
            "m·ẍ": model.mass * found.acceleration,
        },
    )
