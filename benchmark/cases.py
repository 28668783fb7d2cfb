# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Valves and their records: true friction, excitation, noise, sampling and quantisation."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

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
    TriangleWave,
    Valve,
    converter_response,
    simulate,
)
from valve_friction_ros.model.compiled import compiled
from valve_friction_ros.model.excitations import pressure_at

Motion = Callable[["Plant", NDArray[np.float64], float], NDArray[np.float64]]

BRISTLE_STIFFNESS = 942.4 / 20e-6
"""σ_0 of the LuGre valve, N/m: the stem creeps 20 µm before breakaway."""

_SUBSTEPS = 100


def _karnopp(plant: "Plant", pressure: NDArray[np.float64], period: float) -> NDArray[np.float64]:
    return simulate(plant.valve, plant.parameters, pressure, period).position


def _lugre(plant: "Plant", pressure: NDArray[np.float64], period: float) -> NDArray[np.float64]:
    p = plant.parameters
    forces = plant.valve.actuator_force(pressure) - p.spring_preload
    bristle_damping = float(np.sqrt(BRISTLE_STIFFNESS * p.mass))
    return _step_lugre(
        forces,
        period / _SUBSTEPS,
        p.mass,
        p.spring_constant,
        p.coulomb_friction,
        p.static_friction,
        p.stribeck_velocity,
        p.viscous_friction,
        BRISTLE_STIFFNESS,
        bristle_damping,
        plant.valve.travel,
    )


@compiled
def _step_lugre(
    forces: NDArray[np.float64],
    step: float,
    mass: float,
    spring: float,
    coulomb: float,
    static: float,
    stribeck: float,
    viscous: float,
    stiffness: float,
    damping: float,
    travel: float,
) -> NDArray[np.float64]:
    """Step LuGre friction, ż = v − σ_0·|v|/g(v)·z, linearly implicitly (Canudas de Wit, 1995).

    Impact on a travel stop is perfectly inelastic.
    """
    positions = np.empty_like(forces)
    position, velocity, bristle = min(max(forces[0] / spring, 0.0), travel), 0.0, 0.0
    positions[0] = position
    for sample in range(1, forces.size):
        before, change = forces[sample - 1], forces[sample] - forces[sample - 1]
        for substep in range(1, _SUBSTEPS + 1):
            force = before + change * substep / _SUBSTEPS
            level = coulomb + (static - coulomb) * np.exp(-((velocity / stribeck) ** 2))
            side = 1.0 if velocity >= 0 else -1.0
            grip = 1.0 - side * stiffness * bristle / level
            resisting = viscous + damping * grip + step * (spring + stiffness * grip)
            pull = force - spring * position - stiffness * bristle
            velocity = (mass * velocity + step * pull) / (mass + step * resisting)
            position += step * velocity
            rate = stiffness * abs(velocity) / level
            bristle = (bristle + step * velocity) / (1.0 + step * rate)
            if position < 0.0 or position > travel:
                position, velocity = min(max(position, 0.0), travel), 0.0
        positions[sample] = position
    return positions


@dataclass(frozen=True)
class Plant:
    """A simulated valve and the truth about it.

    Attributes
    ----------
    name : str
        Short name.
    valve : Valve
        Geometry.
    parameters : KarnoppParameters
        Its true friction, spring and mass.
    motion : callable
        Function of plant, pressure (Pa) and sample period (s) that returns the stem position, m.
    is_karnopp : bool
        Whether the friction follows the published model.
    """

    name: str
    valve: Valve
    parameters: KarnoppParameters
    motion: Motion = _karnopp
    is_karnopp: bool = True

    def respond(self, pressure: NDArray[np.float64], period: float) -> NDArray[np.float64]:
        """Return the stem position, m, under `pressure`, Pa, sampled every `period`, s."""
        return self.motion(self, pressure, period)


_FALLING = replace(GRAPHITE_PACKING, stribeck_velocity=3.26e-3)

PLANTS = {
    plant.name: plant
    for plant in (
        Plant("low", BENCH_VALVE, LOW_FRICTION),
        Plant("high", BENCH_VALVE, HIGH_FRICTION),
        Plant("graphite", GRAPHITE_VALVE, GRAPHITE_PACKING),
        Plant("stribeck", GRAPHITE_VALVE, _FALLING, is_karnopp=False),
        Plant("lugre", GRAPHITE_VALVE, _FALLING, _lugre, is_karnopp=False),
    )
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


@dataclass(frozen=True)
class Condition:
    """Sampling of the sensors: every `stride` ms, with 12 bits or unquantised."""

    name: str
    stride: int
    quantised: bool

    def sampled(self, recording: Recording) -> Recording:
        """Return every `stride`-th sample, quantised over 0–30 mm and 0–250 kPa."""
        pressure = recording.pressure[:: self.stride]
        position = recording.position[:: self.stride]
        if self.quantised:
            pressure, position = _quantised(pressure, 250e3), _quantised(position, 30e-3)
        return Recording(self.stride * recording.sample_period, pressure, position)


def _quantised(values: NDArray[np.float64], span: float) -> NDArray[np.float64]:
    """Round to the codes of a 12-bit converter with the range 0 to `span`."""
    unit = span / 2**12
    rounded: NDArray[np.float64] = np.round(values / unit) * unit
    return rounded


CONDITIONS = {
    "1 kHz": Condition("1 kHz", 1, quantised=False),
    "100 Hz": Condition("100 Hz", 10, quantised=True),
}
"""Sampling by name; the slow sampling has 12 bits."""


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
        return CONDITIONS[self.condition].sampled(noisy)
