# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The paper's programme: experiments, identification by each method, validation."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from paper import published_numbers as paper
from paper.bench import Bench
from paper.experiments import (
    Experiment,
    Experiments,
    FreeSweep,
    Plan,
    Scatter,
    free_sweep,
    measure_scatter,
    model_of,
    rms,
    run_all,
    signature_of,
    stem_error,
)
from valve_friction_ros.identification import (
    Estimate,
    IdentificationSettings,
    RefusalError,
    Result,
    StepTest,
    Validation,
    ValveSignature,
    identify_bench,
    identify_signature,
    published_estimate,
    step_test,
    validate,
)
from valve_friction_ros.model import KarnoppParameters, Recording

_ROUNDING = 5e-6
"""Half of the last digit of x̄ in (16), m."""


@dataclass(frozen=True, eq=False)
class Identified:
    """The result of each method for the records of one bench.

    Model 1 is the sweep of the square wave with x̄ = `position_bias` (m): `published`, and `free`
    with the regressed mass, for Figs. 3 and 4. Model 2 is the `force_balance` of the triangle.
    `simulated` is the result of the method ``bench``, which estimates F_0 in place of x̄, with the
    nominal mass fixed.
    """

    position_bias: float
    published: Estimate
    free: FreeSweep
    force_balance: Result
    simulated: Result

    @property
    def signature(self) -> ValveSignature:
        """The valve signature behind model 2."""
        return signature_of(self.force_balance)

    @property
    def top_speed(self) -> float:
        """|ẋ|max of (8), m/s, from the derivatives."""
        first = self.free.sweep.thresholds[0]
        return float(first * self.published.settings.resolution)

    def models(self) -> dict[str, KarnoppParameters]:
        """Return the models to simulate, by name, with DV = 0."""
        return {
            "model 1": self.published.parameters(),
            "model 2": model_of(self.force_balance),
            "bench": model_of(self.simulated),
        }


@dataclass(frozen=True, eq=False)
class Comparison:
    """A model compared with the measured stem and with the noise-free stem.

    `error` is the simulated minus the true stem position, both under the true pressure, m, shape
    (n,).
    """

    validation: Validation
    error: NDArray[np.float64] = field(repr=False)

    @property
    def true_rms(self) -> float:
        """Root mean square of `error`, m."""
        return rms(self.error)

    @property
    def true_maximum(self) -> float:
        """Largest magnitude of `error`, m."""
        return float(np.max(np.abs(self.error)))


@dataclass(frozen=True, eq=False)
class BenchResult:
    """All results for one bench.

    `sine` and `isa` are validations by model: the models of `Identified.models` and, for the
    paper's packings, also "model 1, DV 1 %" and "paper's model 2", the numbers of Table 1. `steps`
    has input and position in percent of their spans.
    """

    bench: Bench
    experiments: Experiments
    identified: Identified
    sine: Mapping[str, Comparison]
    isa: Mapping[str, Comparison]
    steps: StepTest


class MassByBias(NamedTuple):
    """The mass, kg, that the sweep regresses with a bias x̄, m."""

    position_bias: float
    mass: float


@dataclass(frozen=True, eq=False)
class Programme:
    """All results of the programme, by bench.

    `without_noise` is the noise-free model 1 of the paper's packings. `mass_by_bias` is the
    noise-free mass of the packing "low", with x̄ at both ends and in the middle of the range that
    rounds to the same 0.01 mm.
    """

    results: Mapping[str, BenchResult]
    without_noise: Mapping[str, Estimate]
    mass_by_bias: tuple[MassByBias, ...]
    scatter: Scatter


def rounded_bias(*biases: float) -> float:
    """Return the mean of x̄, m, each rounded to 0.01 mm as in (16) of the paper."""
    return round(sum(round(bias, 5) for bias in biases) / len(biases), 6)


def identified(
    bench: Bench,
    experiments: Experiments,
    force_balance: Result,
    position_bias: float,
) -> Identified:
    """Identify from the square wave: model 1 with x̄ from the triangle, and by simulation."""
    settings = IdentificationSettings(position_bias=position_bias, assumed_mass=bench.assumed_mass)
    square = experiments.square.measured
    return Identified(
        position_bias,
        published_estimate(square, bench.valve, settings),
        free_sweep(square, bench.valve, settings),
        force_balance,
        identify_bench(
            square, bench.valve, IdentificationSettings(fixed={"mass": bench.assumed_mass})
        ),
    )


def compared(bench: Bench, experiment: Experiment, model: KarnoppParameters) -> Comparison:
    """Simulate an experiment with a model, and compare the stems."""
    validation = validate(experiment.measured, bench.valve, model)
    return Comparison(validation, stem_error(bench, experiment, model))


def _steps(bench: Bench, isa: Experiment) -> StepTest:
    recording = isa.measured
    share = (recording.pressure - isa.command[0]) / paper.PRESSURE_SPAN
    starts = [int(start) for start in np.flatnonzero(np.diff(isa.command)) + 1]
    return step_test(
        100 * share,
        100 * recording.position / bench.valve.travel,
        recording.sample_period,
        starts,
    )


def _result(bench: Bench, experiments: Experiments, found: Identified) -> BenchResult:
    models = found.models()
    if bench.name in paper.PACKINGS:
        models["model 1, DV 1 %"] = replace(
            models["model 1"], limit_velocity=0.01 * found.top_speed
        )
        models["paper's model 2"] = paper.MODEL_2[bench.name]
    sine, isa = (
        {name: compared(bench, one, model) for name, model in models.items()}
        for one in (experiments.sine, experiments.isa)
    )
    return BenchResult(bench, experiments, found, sine, isa, _steps(bench, experiments.isa))


def progress_steps(benches: Mapping[str, Bench]) -> int:
    """Return the number of calls of `progress` in `run_programme`."""
    return 2 * len(benches) + 1 + 2 * len(paper.PACKINGS)


@contextmanager
def _named(bench: str) -> Iterator[None]:
    """Add the name of the bench to a refusal."""
    try:
        yield
    except RefusalError as refusal:
        raise RefusalError(f"packing {bench}: {refusal}") from None


def run_programme(
    benches: Mapping[str, Bench],
    plan: Plan,
    seeds: int,
    progress: Callable[[str], object] = lambda _: None,
) -> Programme:
    """Run the whole programme on the benches, which include the paper's two packings.

    These two share x̄, as in the paper. `seeds` repetitions with other noise give the scatter.
    `progress` is called with the name of the next step. Raises RefusalError or ValueError, with the
    name of the method, if noise hides a feature that the method needs.
    """
    experiments, balances = {}, {}
    for name, bench in benches.items():
        progress(f"{name}: experiments and valve signature")
        experiments[name] = run_all(bench, plan)
        settings = IdentificationSettings(assumed_mass=bench.assumed_mass)
        with _named(name):
            balances[name] = identify_signature(
                experiments[name].triangle.measured, bench.valve, settings
            )
    biases = {name: signature_of(each).position_bias for name, each in balances.items()}
    shared = rounded_bias(*(biases[name] for name in paper.PACKINGS))
    results = {}
    for name, bench in benches.items():
        progress(f"{name}: models and validation")
        bias = shared if name in paper.PACKINGS else rounded_bias(biases[name])
        with _named(name):
            found = identified(bench, experiments[name], balances[name], bias)
            results[name] = _result(bench, experiments[name], found)
    published = [benches[name] for name in paper.PACKINGS]
    progress("without noise")
    without_noise = {
        bench.name: published_estimate(
            experiments[bench.name].square.clean,
            bench.valve,
            IdentificationSettings(
                position_bias=rounded_bias(bench.position_bias), assumed_mass=bench.assumed_mass
            ),
        )
        for bench in published
    }
    low = experiments["low"].square.clean
    mass_by_bias = _mass_by_bias(benches["low"], low, without_noise["low"].threshold)
    scatter = measure_scatter(published, plan, seeds, progress)
    return Programme(results, without_noise, mass_by_bias, scatter)


def _mass_by_bias(bench: Bench, recording: Recording, threshold: float) -> tuple[MassByBias, ...]:
    middle = rounded_bias(bench.position_bias)
    found = []
    for bias in (middle - _ROUNDING, middle, middle + _ROUNDING):
        settings = IdentificationSettings(position_bias=bias, assumed_mass=bench.assumed_mass)
        sweep = free_sweep(recording, bench.valve, settings)
        found.append(MassByBias(bias, sweep.estimates_at(threshold)["mass"]))
    return tuple(found)
