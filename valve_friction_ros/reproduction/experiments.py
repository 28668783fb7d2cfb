"""The paper's experiments on a simulated bench."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model import (
    Excitation,
    IsaSteps,
    KarnoppParameters,
    Recording,
    SineWave,
    StemState,
    TriangleWave,
    converter_response,
    simulate,
)
from valve_friction_ros.model.excitations import pressure_at
from valve_friction_ros.reproduction.bench import Bench

__all__ = [
    "ISA",
    "SINE",
    "TRIANGLE",
    "Experiment",
    "Experiments",
    "Plan",
    "rms",
    "run",
    "run_all",
    "stem_error",
]

TRIANGLE = TriangleWave(pressure_at(0.1), pressure_at(0.8), 42.0)
"""Triangle of the signature: the slope of the whole range in 60 s a period, without travel
stops."""

SINE = SineWave()
"""The paper's validation signal: 63.95 to 160.44 kPa in 35.5 s."""

ISA = IsaSteps()
"""The ISA sequence: 0.1 to 50 % of the input range around its middle."""


@dataclass(frozen=True)
class Plan:
    """Periods of each wave, and the step sequence, which is recorded completely."""

    square_periods: float = 6.0
    triangle_periods: float = 3.5
    sine_periods: float = 2.0
    isa: IsaSteps = ISA


@dataclass(frozen=True, eq=False)
class Experiment:
    """Commanded pressure (Pa, shape (n,)), the true motion, and the motion with sensor noise."""

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
    """Return the stem of a model minus the true stem, both under the true pressure, m."""
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
