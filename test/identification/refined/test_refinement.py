"""Refinement: back to the truth from a start that is far off, and without bias."""

import numpy as np
import pytest
from problems import FREE, perfect_problem, true_coordinates

from valve_friction_ros.identification.refined.output_error import SLIP, OutputError
from valve_friction_ros.identification.refined.refinement import (
    estimating_equation,
    least_squares_fit,
    refine,
)
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, Recording, SquareWave
from valve_friction_ros.signals.conditioned_record import ConditionedRecord
from valve_friction_ros.signals.smoothing import (
    independent_halves,
    smooth_between,
)

DURATION = 20.8


def clean_problem(bench_trajectory, benches, name):
    pressure, motion = bench_trajectory(name, SquareWave(), DURATION)
    valve, parameters = benches[name]
    problem = perfect_problem(valve, Recording(1e-3, pressure, motion.position))
    return problem, true_coordinates(parameters, motion.position[0])


def errors(coordinates, truth, names):
    return np.array([coordinates[name] / truth[name] - 1 for name in names])


@pytest.mark.parametrize("share", [0.7, 1.3])
@pytest.mark.parametrize("name", ["low", "high"])
def test_recovers_the_truth_from_a_start_that_is_off_by_30_percent(
    bench_trajectory, benches, name, share
):
    problem, truth = clean_problem(bench_trajectory, benches, name)
    start = {**truth, **{key: share * truth[key] for key in FREE[:4]}}
    found = refine(problem, start, FREE)
    assert np.abs(errors(found.coordinates, truth, FREE)).max() < 1e-4
    assert found.rms < 1e-9
    assert found.names == FREE


def test_recovers_a_slip_jump_with_the_rest(bench_trajectory, benches):
    problem, truth = clean_problem(bench_trajectory, benches, "graphite")
    names = (*FREE, SLIP)
    start = {**truth, **{key: 1.3 * truth[key] for key in (*FREE[:4], SLIP)}}
    found = refine(problem, start, names)
    assert np.abs(errors(found.coordinates, truth, names)).max() < 1e-4


def test_what_is_not_free_stays(bench_trajectory, benches):
    problem, truth = clean_problem(bench_trajectory, benches, "high")
    start = {**truth, "spring_constant": 1.01 * truth["spring_constant"]}
    found = refine(problem, start, ("coulomb_friction", "viscous_friction"))
    untouched = truth.keys() - {"coulomb_friction", "viscous_friction"}
    assert {name: found.coordinates[name] for name in untouched} == {
        name: start[name] for name in untouched
    }


def test_summary_of_the_residual(bench_trajectory, benches):
    problem, truth = clean_problem(bench_trajectory, benches, "high")
    shifted = OutputError(
        ConditionedRecord(
            1e-3,
            problem.record.pressure,
            problem.record.halves,
            problem.record.position - 3e-6,
            0.0,
            1,
            1,
        ),
        problem.valve,
    )
    found = refine(shifted, truth, ("mass",))
    np.testing.assert_allclose(found.residual, 3e-6, rtol=0, atol=1e-7)
    assert found.rms == pytest.approx(3e-6, rel=0.01)
    _, motion = bench_trajectory("high", SquareWave(), DURATION)
    assert found.top_speed == pytest.approx(np.abs(motion.velocity).max(), rel=0.01)


class TestInstruments:
    """1 kPa of noise, and so little smoothing that the simulated stem creeps."""

    CORNERS = np.array([5200, 10_400, 15_600])
    WINDOW, STRIDE, DEVIATION = 421, 5, 1000.0
    SEEDS = 16

    def problem(self, pressure, position, seed):
        generator = np.random.default_rng(seed)
        noisy = pressure + self.DEVIATION * generator.standard_normal(pressure.size)
        one, two = independent_halves(noisy, self.CORNERS, self.WINDOW)
        some = slice(None, None, self.STRIDE)
        whole = smooth_between(noisy, self.CORNERS, self.WINDOW)
        record = ConditionedRecord(
            5e-3, whole[some], (one[some], two[some]), position[some], 0.0, self.WINDOW, self.STRIDE
        )
        return OutputError(record, BENCH_VALVE)

    @pytest.fixture(scope="class")
    def fits(self, bench_trajectory):
        """Errors of F_v with and without instruments, where the instrumented equation is solved."""
        pressure, motion = bench_trajectory("low", SquareWave(), DURATION)
        truth = true_coordinates(LOW_FRICTION, motion.position[0])
        pairs = []
        for seed in range(self.SEEDS):
            problem = self.problem(pressure, motion.position, seed)
            plain = least_squares_fit(problem, truth, FREE)
            refined = refine(problem, truth, FREE).coordinates
            if refined != plain:
                pairs.append([errors(one, truth, FREE[1:2])[0] for one in (refined, plain)])
        return np.array(pairs)

    def test_they_remove_the_bias(self, fits):
        """Mean over seeds: beyond three standard errors without instruments, within two with."""
        assert len(fits) > self.SEEDS / 3
        mean, error = fits.mean(axis=0), fits.std(axis=0, ddof=1) / np.sqrt(len(fits))
        assert abs(mean[1]) > 3 * error[1]
        assert abs(mean[0]) < 2 * error[0]

    def test_equation_is_that_of_crossed_halves(self, bench_trajectory):
        pressure, motion = bench_trajectory("low", SquareWave(), DURATION)
        truth = true_coordinates(LOW_FRICTION, motion.position[0])
        problem = self.problem(pressure, motion.position, 0)
        units = problem.units(FREE, truth)
        found = estimating_equation(problem, truth, units)
        one, two = problem.record.halves
        slopes = [problem.sensitivity(truth, half, units) for half in (one, two)]
        residuals = [problem.residual(truth, half) for half in (one, two)]
        expected = slopes[0].T @ residuals[1] + slopes[1].T @ residuals[0]
        np.testing.assert_allclose(found.scores.sum(axis=0), expected, rtol=1e-9, atol=1e-12)
        mixed = slopes[0].T @ slopes[1]
        np.testing.assert_allclose(found.curvature, mixed + mixed.T, rtol=1e-12)


def test_equation_of_a_noiseless_record_is_least_squares(bench_trajectory, benches):
    """2·Sᵀr is the gradient of |r|², against its own differences."""
    problem, truth = clean_problem(bench_trajectory, benches, "high")
    at = {**truth, "coulomb_friction": 1.1 * truth["coulomb_friction"]}
    units = problem.units(FREE[:2], at)
    gradient = estimating_equation(problem, at, units).scores.sum(axis=0)
    pressure = problem.record.pressure
    for index, (name, unit) in enumerate(units.items()):
        costs = [
            np.sum(problem.residual({**at, name: at[name] + step * unit}, pressure) ** 2)
            for step in (1e-2, -1e-2)
        ]
        assert gradient[index] == pytest.approx((costs[0] - costs[1]) / 2e-2, rel=1e-3)
