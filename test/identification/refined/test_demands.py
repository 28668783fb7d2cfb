"""The limits from which on a part of the model is demanded, each from both sides.

Problems of a known solution, whose noise or size is chosen such that the part under test stands
just below its limit, or just above.
"""

from dataclasses import replace

import numpy as np
import pytest
from problems import FREE, perfect_record, true_coordinates

from valve_friction_ros.identification.refined import model_selection
from valve_friction_ros.identification.refined.model_selection import with_demanded
from valve_friction_ros.identification.refined.model_test import misfit_of
from valve_friction_ros.identification.refined.output_error import SLIP, OutputError
from valve_friction_ros.identification.refined.refinement import refine
from valve_friction_ros.identification.units import CLOCK_OFFSET
from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    HIGH_FRICTION,
    Recording,
    SquareWave,
    converter_response,
    simulate,
)

PERIOD = 5e-3
LATE = 10  # samples
SKEW = replace(HIGH_FRICTION, viscous_asymmetry=0.1)
JUMP = replace(HIGH_FRICTION, static_friction=1.1 * HIGH_FRICTION.coulomb_friction)


def simulated(parameters, valve=BENCH_VALVE, scale=1.0):
    """Pressure, its distance from the reference multiplied by `scale`, and the stem under it."""
    command = SquareWave().sample(PERIOD * np.arange(8321))
    pressure = converter_response(command, PERIOD)
    pressure = valve.pressure_reference + scale * (pressure - valve.pressure_reference)
    return pressure, simulate(valve, parameters, pressure, PERIOD).position


def problem_of(pressure, position, noise=0.0, valve=BENCH_VALVE):
    scatter = noise * np.random.default_rng(0).standard_normal(position.size)
    record = perfect_record(Recording(PERIOD, pressure, position + scatter))
    return OutputError(replace(record, noise=noise), valve)


def late(position):
    return np.concatenate([np.full(LATE, position[0]), position[:-LATE]])


def demanded(problem, truth, *candidates):
    """Names that are demanded beside those that are free in any case."""
    start = {**truth, **dict.fromkeys(candidates, 0.0)}
    return set(with_demanded(problem, start, FREE, candidates).names) - set(FREE)


@pytest.mark.parametrize("share", [0.95, 1.05])
@pytest.mark.parametrize(
    ("name", "parameters", "limit", "noise"),
    [
        ("viscous_asymmetry", SKEW, 5.5, 1e-3),
        (SLIP, JUMP, 5.5, 1e-4),
        (CLOCK_OFFSET, HIGH_FRICTION, 11.0, 3e-5),
    ],
)
def test_standard_errors_from_which_on_a_part_is_there(name, parameters, limit, noise, share):
    pressure, position = simulated(parameters)
    truth = true_coordinates(parameters, position[0])
    if name == CLOCK_OFFSET:
        truth, position = {**truth, name: LATE * PERIOD}, late(position)
    for _ in range(5):  # the standard error is proportional to the noise, nearly
        problem = problem_of(pressure, position, noise)
        free = refine(problem, truth, (*FREE, name))
        error = free.covariance.standard_error(np.eye(6)[5])
        deviation = free.coordinates[name] / error
        noise *= deviation / (share * limit)
    assert deviation == pytest.approx(share * limit, rel=0.02)
    assert demanded(problem, truth, name) == ({name} if share > 1 else set())


@pytest.mark.parametrize(("gain", "kept"), [(0.9e-6, False), (1.1e-6, True)])
def test_a_part_brings_the_stem_nearer_by_a_micrometre(gain, kept):
    """Without noise any part is sure; with all forces and distances smaller it stays as sure.

    The model is linear in them, so the misfit that the part removes is as much smaller.
    """
    pressure, position = simulated(SKEW)
    truth = true_coordinates(SKEW, position[0])
    plain = refine(problem_of(pressure, position), {**truth, "viscous_asymmetry": 0.0}, FREE)
    scale = gain / plain.rms
    forces = ("coulomb_friction", "static_friction", "spring_preload", "limit_velocity")
    small = replace(SKEW, **{name: scale * getattr(SKEW, name) for name in forces})
    valve = replace(BENCH_VALVE, travel=scale * BENCH_VALVE.travel)
    problem = problem_of(*simulated(small, valve, scale), valve=valve)
    found = demanded(problem, true_coordinates(small, scale * position[0]), "viscous_asymmetry")
    assert found == ({"viscous_asymmetry"} if kept else set())


@pytest.mark.parametrize("falls", [False, True])
def test_beside_a_falling_friction_neither_clock_nor_mass_is_looked_for(falls, monkeypatch):
    """A stem that creeps before it breaks away would pass for a late clock or a heavy stem."""
    candidates = (SLIP, CLOCK_OFFSET, "mass", "viscous_asymmetry")
    tried = []
    monkeypatch.setattr(
        model_selection, "_sure_trials", lambda _, candidates: tried.append(candidates) or []
    )
    packing = replace(GRAPHITE_PACKING, stribeck_velocity=3.26e-3 if falls else 0.0)
    pressure, position = simulated(packing, GRAPHITE_VALVE)
    problem = problem_of(pressure, position, 2e-5, GRAPHITE_VALVE)
    start = {**true_coordinates(packing, position[0]), SLIP: 0.0, "stribeck_velocity": 0.0}
    found = with_demanded(problem, start, FREE, candidates)
    assert misfit_of(found).describes
    assert ("stribeck_velocity" in found.names) is falls
    expected = ["viscous_asymmetry"] if falls else [CLOCK_OFFSET, "mass", "viscous_asymmetry"]
    assert tried == [expected]
