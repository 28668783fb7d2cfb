"""Simulated positions and their sensitivities, against a motion with a closed form."""

from dataclasses import replace

import numpy as np
import pytest
from problems import FREE, perfect_problem, true_coordinates

from valve_friction_ros.identification.refined.output_error import SLIP, START
from valve_friction_ros.identification.units import CLOCK_OFFSET
from valve_friction_ros.model import (
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    KarnoppParameters,
    Recording,
    SquareWave,
    Valve,
    simulate,
)

# A stem drawn by a ramp: once its transient has died, x = (F(t) − F_c − F_v·v)/k with v = Ḟ/k.
AREA, SLOPE = 0.02, 4000.0
PARAMETERS = KarnoppParameters(1.0, 3000.0, 50.0, 50.0, 1.5e5, 120.0)
VALVE = Valve(AREA)
PERIOD = 1e-3
TIME = PERIOD * np.arange(8000)
PRESSURE = 20_000 + SLOPE * TIME
SETTLED = (TIME > 3.0) & (TIME < 7.9)  # a moved clock has no pressure at the end


@pytest.fixture(scope="module")
def problem():
    motion = simulate(VALVE, PARAMETERS, PRESSURE, PERIOD)
    return perfect_problem(VALVE, Recording(PERIOD, PRESSURE, motion.position))


@pytest.fixture(scope="module")
def at(problem):
    return true_coordinates(PARAMETERS, problem.record.position[0])


def test_ramp_has_its_closed_form(problem, at):
    p = PARAMETERS
    speed = AREA * SLOPE / p.spring_constant
    force = VALVE.actuator_force(PRESSURE) - p.spring_preload - p.coulomb_friction
    expected = (force - p.viscous_friction * speed) / p.spring_constant
    found = problem.simulated(at, PRESSURE)
    np.testing.assert_allclose(found[SETTLED], expected[SETTLED], rtol=0, atol=1e-12)


def analytic():
    """Derivatives of the closed form."""
    k, viscous = PARAMETERS.spring_constant, PARAMETERS.viscous_friction
    speed = AREA * SLOPE / k
    pull = VALVE.actuator_force(PRESSURE) - PARAMETERS.spring_preload - PARAMETERS.coulomb_friction
    return {
        "coulomb_friction": np.full(TIME.size, -1 / k),
        "viscous_friction": np.full(TIME.size, -speed / k),
        "spring_constant": -pull / k**2 + 2 * viscous * speed / k**2,
        "spring_preload": np.full(TIME.size, -1 / k),
        "mass": np.zeros(TIME.size),
        START: np.zeros(TIME.size),
        CLOCK_OFFSET: np.full(TIME.size, -speed),
    }


@pytest.mark.parametrize("name", analytic())
def test_sensitivity(problem, at, name):
    """Central differences of 1 % err by 1e-4 where the position depends on 1/k, else not."""
    units = problem.units((name,), at)
    found = problem.sensitivity(at, PRESSURE, units)[SETTLED, 0]
    expected = units[name] * analytic()[name][SETTLED]
    relative = 4e-4 if name == "spring_constant" else 1e-7
    largest = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=0, atol=relative * largest + 1e-12)


def test_no_sensitivity_to_what_a_moving_stem_has_left_behind(problem, at):
    """F_s acts at the breakaway alone."""
    found = problem.sensitivity(at, PRESSURE, {SLIP: 10.0})[SETTLED]
    np.testing.assert_allclose(found, 0.0, atol=1e-12)


def test_truth_leaves_no_residual(bench_trajectory):
    pressure, motion = bench_trajectory("graphite", SquareWave(), 20.8)
    problem = perfect_problem(GRAPHITE_VALVE, Recording(1e-3, pressure, motion.position))
    at = true_coordinates(GRAPHITE_PACKING, motion.position[0])
    assert np.abs(problem.residual(at, pressure)).max() < 1e-15


def test_late_stamps_are_an_early_pressure(problem, at):
    """x(t) of a clock that lags by 40 ms is x(t − 40 ms)."""
    moved = problem.simulated({**at, CLOCK_OFFSET: 0.04}, PRESSURE)
    here = problem.simulated(at, PRESSURE)
    np.testing.assert_allclose(moved[4000:], here[3960:-40], rtol=0, atol=1e-12)


class TestModel:
    RECORDING = Recording(PERIOD, PRESSURE, np.zeros(TIME.size))

    def problem(self, **settings):
        return perfect_problem(VALVE, self.RECORDING, **settings)

    def test_at_the_truth(self, at):
        assert self.problem().model(at) == PARAMETERS

    def test_bias_ties_the_preload_to_the_spring(self, at):
        model = self.problem(position_bias=2e-3).model({**at, "spring_constant": 1e5})
        assert model.spring_preload == 1e5 * 2e-3

    def test_bias_is_part_of_the_sensitivity_to_the_spring(self, at):
        """Another −x̄/k of the position, with F_0 = k·x̄; the closed form otherwise."""
        bias = PARAMETERS.spring_preload / PARAMETERS.spring_constant
        units = {"spring_constant": PARAMETERS.spring_constant}
        free, tied = (
            problem.sensitivity(at, PRESSURE, units)[SETTLED, 0]
            for problem in (self.problem(), self.problem(position_bias=bias))
        )
        # By central differences of 1 %: 1/(1 − 1e-4) is theirs.
        np.testing.assert_allclose(tied - free, -bias, rtol=2e-4)

    @pytest.mark.parametrize(("given", "expected"), [(80.0, 80.0), (20.0, 50.0)])
    def test_given_static_friction_takes_the_place_of_the_slip(self, at, given, expected):
        model = self.problem(static_friction=given).model({**at, SLIP: 1000.0})
        assert model.static_friction == expected

    def test_slip_is_what_static_friction_has_more(self, at):
        assert self.problem().model({**at, SLIP: 7.0}).static_friction == 57.0

    def test_the_impossible_is_moved_to_the_next_possible(self, at):
        names = ("coulomb_friction", "viscous_friction", "spring_constant", SLIP, "mass")
        model = self.problem().model({**at, **dict.fromkeys(names, -1.0), "viscous_asymmetry": 3.0})
        assert (model.coulomb_friction, model.static_friction) == (0.0, 0.0)
        assert (model.viscous_friction, model.spring_constant) == (0.0, 0.0)
        assert model.mass == 1e-3
        assert model.viscous_asymmetry == 0.95


def test_units_are_forces_for_forces_and_the_play_for_the_start(problem, at):
    units = problem.units((*FREE, SLIP, CLOCK_OFFSET), at)
    assert units == {
        "coulomb_friction": 50.0,
        "viscous_friction": 3000.0,
        "spring_constant": 1.5e5,
        "spring_preload": 50.0,
        START: 50.0 / 1.5e5,
        SLIP: 50.0,
        CLOCK_OFFSET: 1.0,
    }


@pytest.mark.parametrize("beyond", [0.0, 50e-6])
@pytest.mark.parametrize("stop", ["lower", "upper"])
def test_start_at_a_stop_is_seen_from_inside(stop, beyond):
    """A stem at rest stays where it started, and it starts no further than at the stop."""
    valve = replace(VALVE, travel=0.03)
    force = np.full(TIME.size, PARAMETERS.spring_preload)
    if stop == "upper":
        force = force + PARAMETERS.spring_constant * valve.travel
    pressure = valve.pressure_reference + force / valve.diaphragm_area
    place = valve.travel if stop == "upper" else 0.0
    resting = perfect_problem(valve, Recording(PERIOD, pressure, np.full(TIME.size, place)))
    start = place + beyond if stop == "upper" else place - beyond
    at = true_coordinates(PARAMETERS, start)
    (column,) = resting.sensitivity(at, pressure, {START: 1e-4}).T
    np.testing.assert_allclose(column, 1e-4, rtol=1e-9)
