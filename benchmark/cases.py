# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""Records of the accuracy benchmark, their truth, and one identification of each."""

import math
import time
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from benchmark.reality import plants as reality
from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    Result,
    Verdict,
    identify,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    KarnoppParameters,
    Recording,
    SensorNoise,
    SineWave,
    SquareWave,
    StemState,
    TriangleWave,
    Valve,
    converter_response,
    simulate,
)
from valve_friction_ros.model.excitations import pressure_at


@dataclass(frozen=True)
class Plant:
    """A simulated valve, with its true friction, spring and mass."""

    valve: Valve
    parameters: KarnoppParameters
    is_karnopp: bool = True  # whether the friction follows the published model
    has_bristles: bool = False

    def respond(self, pressure: NDArray[np.float64], period: float) -> NDArray[np.float64]:
        """Return the stem position, m, under `pressure`, Pa, sampled every `period`, s."""
        if self.has_bristles:
            return _with_bristles(self, pressure, period)
        return simulate(self.valve, self.parameters, pressure, period).position


def _with_bristles(
    plant: Plant, pressure: NDArray[np.float64], period: float
) -> NDArray[np.float64]:
    """Move the valve with a LuGre packing that creeps 20 µm before breakaway."""
    valve, known = plant.valve, plant.parameters
    forces = (known.coulomb_friction, known.static_friction, known.viscous_friction)
    friction = reality.Friction(
        *forces, known.stribeck_velocity, law=reality.Law.LUGRE, presliding=20e-6
    )
    body = reality.Body(
        known.mass,
        known.spring_constant,
        known.spring_preload,
        valve.diaphragm_area,
        valve.pressure_reference,
        valve.travel,
    )
    times = np.arange(pressure.size) * period
    fine = np.interp(np.arange(0.0, times[-1] + reality.GRID, reality.GRID), times, pressure)
    # The pressure follows its command within one step.
    loop = reality.open_loop(0.0, 1.0, reality.STEPS[reality.Law.LUGRE])
    moved = reality.move(reality.Plant(body, friction), loop, fine, np.zeros(fine.size), 0.0)
    return moved.position[:: round(period / reality.GRID)][: pressure.size]


_FALLING = replace(GRAPHITE_PACKING, stribeck_velocity=3.26e-3)

PLANTS = {
    "low": Plant(BENCH_VALVE, LOW_FRICTION),
    "high": Plant(BENCH_VALVE, HIGH_FRICTION),
    "graphite": Plant(GRAPHITE_VALVE, GRAPHITE_PACKING),
    "stribeck": Plant(GRAPHITE_VALVE, _FALLING, is_karnopp=False),
    "lugre": Plant(GRAPHITE_VALVE, _FALLING, is_karnopp=False, has_bristles=True),
}
"""Plants by name: the paper's valve in two states, graphite with slip jump, two beyond Karnopp."""


PERIOD = 1e-3
"""Sample period of the simulation and of the fast sensors, s."""

NOISES = {
    "clean": SensorNoise(),
    "10 µm": SensorNoise(10e-6, 100.0),
    "28.6 µm": SensorNoise(28.6e-6, 165.0),
    "60 µm": SensorNoise(60e-6, 400.0),
}
"""White noise of stem and pressure sensor."""


CONDITIONS = {"1 kHz": 1, "100 Hz": 10}
"""Milliseconds from sample to sample; the slow sampling has 12 bits."""


def _quantised(values: NDArray[np.float64], span: float) -> NDArray[np.float64]:
    """Round to the codes of a 12-bit converter with the range 0 to `span`."""
    unit = span / 2**12
    return np.round(values / unit) * unit


def _in_service(time: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return steps of ±3 % of the range every 4 s around mid-range, like those of a controller.

    The steps are a random walk. In most such walks the stem of a tight packing moves in one
    direction only, and the record is refused. This seed moves the graphite valve 4 mm up and 5 mm
    down.
    """
    steps = np.random.default_rng(138).choice([-0.03, 0.03], int(time[-1] / 4) + 1)
    levels = 0.5 + np.clip(np.cumsum(steps), -0.3, 0.3)
    return np.array([pressure_at(level) for level in levels])[(time / 4).astype(int)]


EXCITATIONS = {
    "square": (lambda time: SquareWave().sample(time), 52.0),
    "triangle": (lambda time: TriangleWave().sample(time), 120.0),
    "sine": (lambda time: SineWave().sample(time), 71.0),
    "in service": (_in_service, 120.0),
}
"""Commanded pressure as a function of time, and the duration of the record, s."""


@cache
def clean_record(plant_name: str, excitation: str) -> Recording:
    """Return the record from perfect sensors at 1 kHz."""
    command, duration = EXCITATIONS[excitation]
    time = np.arange(round(duration / PERIOD)) * PERIOD
    pressure = converter_response(command(time), PERIOD)
    return Recording(PERIOD, pressure, PLANTS[plant_name].respond(pressure, PERIOD))


@dataclass(frozen=True)
class Case:
    """One combination of plant, excitation, noise and sampling, by name."""

    plant_name: str
    excitation: str
    noise: str
    condition: str

    @property
    def plant(self) -> Plant:
        """The valve and the truth about it."""
        return PLANTS[self.plant_name]

    def record(self, seed: int) -> Recording:
        """Return the measured record, reproducible by its seed."""
        noise = NOISES[self.noise]
        seeded = SensorNoise(noise.position, noise.pressure, seed)
        noisy = seeded.applied_to(clean_record(self.plant_name, self.excitation))
        stride = CONDITIONS[self.condition]
        pressure, position = noisy.pressure[::stride], noisy.position[::stride]
        if stride > 1:
            pressure, position = _quantised(pressure, 250e3), _quantised(position, 30e-3)
        return Recording(stride * PERIOD, pressure, position)


_FREE = ("coulomb_friction", "viscous_friction", "spring_constant", "spring_preload")
_SLIP, _START = "static_friction", "start"
_STEP = 1e-4
"""Step of the numerical derivatives: relative for a parameter, over the travel for the start."""

_SLOWEST = 1e-5
"""Speed, m/s, below which the stem is at rest, so that noise of the pressure does not matter."""


@dataclass(frozen=True)
class Information:
    """Smallest standard errors of a Karnopp valve on the square wave (Cramér and Rao)."""

    # valve and sensor noise
    plant_name: str
    noise: str
    pressure_known: dict[str, float]  # relative standard errors if the pressure is known exactly
    # relative standard errors if the pressure is known only from its noisy samples
    pressure_measured: dict[str, float]


def _stem(
    plant: Plant, pressure: NDArray[np.float64], start: float, name: str, step: float
) -> NDArray[np.float64]:
    """Simulate with one parameter changed by a relative step; F_s − F_c stays constant."""
    parameters = plant.parameters
    if name == _START:
        start += step * plant.valve.travel
    else:
        changes = {name: (1 + step) * getattr(parameters, name)}
        if name == "coulomb_friction":
            slip = parameters.static_friction - parameters.coulomb_friction
            changes["static_friction"] = changes[name] + slip
        parameters = replace(parameters, **changes)
    return simulate(plant.valve, parameters, pressure, PERIOD, StemState(start, 0.0)).position


def information(plant_name: str, noise: str) -> Information:
    """Compute the Cramér–Rao bound of a Karnopp valve on the square wave at 1 kHz.

    The Fisher information is SᵀW⁻¹S with the sensitivities S of the true model's stem. White noise
    of the stem sensor alone gives W = σ_x². Noise of the pressure sensor moves the predicted stem
    of a sliding valve by the factor S_a/k (the valve's own lag is negligible at the slow rates of
    the sensitivities). This adds (σ_P·S_a/k)² wherever the stem slides. A method that knows the
    pressure to be smooth, for example behind a lag, may lie between the two.
    """
    plant, sensors = PLANTS[plant_name], NOISES[noise]
    recording, parameters = clean_record(plant_name, "square"), plant.parameters
    pressure, start = recording.pressure, float(recording.position[0])
    names = (*_FREE, _START)
    if parameters.static_friction > parameters.coulomb_friction:
        names = (*names, _SLIP)
    higher, lower = (
        np.column_stack([_stem(plant, pressure, start, name, step) for name in names])
        for step in (_STEP, -_STEP)
    )
    sensitivity = (higher - lower) / (2 * _STEP)
    slides = np.abs(np.gradient(recording.position, PERIOD)) > _SLOWEST
    stem = np.full(pressure.size, sensors.position**2)
    lever = plant.valve.diaphragm_area / parameters.spring_constant
    both = stem + np.where(slides, (sensors.pressure * lever) ** 2, 0.0)

    def errors(variance: NDArray[np.float64]) -> dict[str, float]:
        covariance = np.linalg.inv(sensitivity.T @ (sensitivity / variance[:, None]))
        scatter = np.sqrt(np.diag(covariance)).tolist()
        return {name: error for name, error in zip(names, scatter, strict=True) if name in _FREE}

    return Information(plant_name, noise, errors(stem), errors(both))


SETTINGS = IdentificationSettings(assumed_mass=1.6)
"""Settings from the configuration of the bench valves."""

TRUE_NAMES = (
    "coulomb_friction",
    "viscous_friction",
    "static_friction",
    "spring_constant",
    "spring_preload",
    "stribeck_velocity",
)
"""Parameters to compare with the truth."""

_MOVING = 0.01
_LARGEST_CLAIM = 0.05
_LARGEST_INTERVALS = 3.0


@dataclass(frozen=True)
class Outcome:
    """The outcome of one record."""

    case: Case  # the combination that was run
    seed: int  # seed of the noise
    seconds: float  # time of the identification, s
    refusal: str = ""  # reason of a refusal; else empty
    # errors and half widths relative to the true value, by parameter; nan without a value
    errors: dict[str, float] = field(default_factory=dict)
    half_widths: dict[str, float] = field(default_factory=dict)
    verdicts: dict[str, str] = field(default_factory=dict)  # verdicts by parameter
    # worst relative error of the friction force over the speeds of the record
    force_error: float = math.nan
    # systematic misfit and its tolerated size, m
    misfit: float = math.nan
    tolerated: float = math.nan


@cache
def run_speeds(plant_name: str, excitation: str) -> NDArray[np.float64]:
    """Return speeds, m/s, from the 5th to the 95th percentile of the speeds of the moving stem."""
    position = clean_record(plant_name, excitation).position
    speed = np.abs(np.diff(position)) / PERIOD
    lowest, highest = np.quantile(speed[speed > _MOVING * speed.max()], (0.05, 0.95))
    return np.linspace(lowest, highest, 50)


def force_error(case: Case, result: Result) -> float:
    """Return the worst relative error of the friction force in both directions."""
    speeds = run_speeds(case.plant_name, case.excitation)
    velocities = np.concatenate([-speeds, speeds])
    truth = case.plant.parameters.sliding_friction(velocities)
    found = result.model.sliding_friction(velocities)
    return float(np.max(np.abs(found / truth - 1)))


def run(case: Case, seed: int) -> Outcome:
    """Identify one record by `bench`, and compare the result with the truth."""
    recording = case.record(seed)
    begin = time.perf_counter()
    try:
        result = identify(recording, case.plant.valve, SETTINGS, "bench")
    except RefusalError as refusal:
        return Outcome(case, seed, time.perf_counter() - begin, str(refusal))
    seconds = time.perf_counter() - begin
    truth = vars(PLANTS[case.plant_name].parameters)
    known = [name for name in TRUE_NAMES if name in result.parameters and truth[name]]
    parameters = result.parameters
    misfit = result.misfit
    return Outcome(
        case,
        seed,
        seconds,
        "",
        {name: parameters[name].value / truth[name] - 1 for name in known},
        {name: parameters[name].half_width / abs(truth[name]) for name in known},
        {name: one.verdict.value for name, one in parameters.items()},
        force_error(case, result),
        math.nan if misfit is None else misfit.systematic,
        math.nan if misfit is None else misfit.tolerated,
    )


def wrong_claims(outcome: Outcome) -> list[str]:
    """Return identified parameters with errors above 5 % or three half widths."""
    wrong = []
    for name, error in outcome.errors.items():
        allowed = min(_LARGEST_CLAIM, _LARGEST_INTERVALS * outcome.half_widths[name])
        if outcome.verdicts[name] == Verdict.IDENTIFIED.value and not abs(error) <= allowed:
            wrong.append(name)
    return wrong
