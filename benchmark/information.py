"""How exactly any method could tell the friction: the information that a record holds."""

from dataclasses import dataclass

import numpy as np

from benchmark.cases import NOISES, PERIOD, clean_record
from benchmark.plants import PLANTS
from valve_friction_ros.identification.refined.output_error import SLIP, START, OutputError
from valve_friction_ros.identification.units import CLOCK_OFFSET
from valve_friction_ros.signals.conditioned_record import ConditionedRecord

__all__ = ["Information", "information"]

_FREE = ("coulomb_friction", "viscous_friction", "spring_constant", "spring_preload", START)
_SLOWEST = 1e-5
"""Speed below which the stem holds its place whatever the pressure sensor says, m/s."""


@dataclass(frozen=True)
class Information:
    """Smallest standard errors of a Karnopp valve on the square wave (Cramér and Rao).

    Attributes
    ----------
    plant_name, noise : str
        Valve and sensor noise.
    pressure_known : dict of str to float
        Relative standard errors where the pressure is known exactly.
    pressure_measured : dict of str to float
        The same where it is known by its noisy samples alone.
    """

    plant_name: str
    noise: str
    pressure_known: dict[str, float]
    pressure_measured: dict[str, float]


def information(plant_name: str, noise: str) -> Information:
    """Compute the Cramér–Rao bound of a Karnopp valve on the square wave at 1 kHz.

    The Fisher information is SᵀW⁻¹S with the sensitivities S of the true model's stem. White
    noise of the stem sensor alone gives W = σ_x². That of the pressure sensor moves the predicted
    stem of a sliding valve by S_a/k of it (the valve's own lag shifts none of it at the slow rates
    of the sensitivities), which adds (σ_P·S_a/k)² wherever the stem slides. A method that knows
    the pressure to be smooth, as behind a lag, may come between the two.
    """
    plant, sensors = PLANTS[plant_name], NOISES[noise]
    recording, parameters = clean_record(plant_name, "square"), plant.parameters
    pressure = recording.pressure
    record = ConditionedRecord(
        PERIOD, pressure, (pressure, pressure), recording.position, 0.0, 1, 1
    )
    slip_force = parameters.static_friction - parameters.coulomb_friction
    at = {
        "mass": parameters.mass,
        "coulomb_friction": parameters.coulomb_friction,
        "viscous_friction": parameters.viscous_friction,
        "spring_constant": parameters.spring_constant,
        "spring_preload": parameters.spring_preload,
        SLIP: slip_force,
        "stribeck_velocity": 0.0,
        "coulomb_asymmetry": 0.0,
        "viscous_asymmetry": 0.0,
        CLOCK_OFFSET: 0.0,
        START: float(recording.position[0]),
    }
    problem = OutputError(record, plant.valve)
    names = (*_FREE, SLIP) if slip_force > 0 else _FREE
    units = problem.units(names, at)
    sensitivity = problem.sensitivity(at, pressure, units)
    slides = np.abs(np.gradient(recording.position, PERIOD)) > _SLOWEST
    stem = np.full(pressure.size, sensors.position**2)
    lever = plant.valve.diaphragm_area / parameters.spring_constant
    both = stem + np.where(slides, (sensors.pressure * lever) ** 2, 0.0)

    def errors(variance: np.ndarray) -> dict[str, float]:
        covariance = np.linalg.inv(sensitivity.T @ (sensitivity / variance[:, None]))
        scatter = np.sqrt(np.diag(covariance))
        return {
            name: float(error * units[name] / abs(at[name]))
            for name, error in zip(names, scatter, strict=True)
            if name not in (START, SLIP)
        }

    return Information(plant_name, noise, errors(stem), errors(both))
