"""Uncertainty and verdicts of the regression, for a machine without a spring."""

import numpy as np
import pytest

from valve_friction_ros.identification import IdentificationSettings, Parameter, Verdict
from valve_friction_ros.identification.published.identify import published_fit
from valve_friction_ros.identification.published.regression_uncertainty import (
    RegressionUncertainty,
    regression_uncertainty,
)
from valve_friction_ros.identification.published.verdicts import regression_verdicts
from valve_friction_ros.identification.trust.estimating_equation import EstimatingEquation
from valve_friction_ros.identification.trust.limits import NO_SLIP
from valve_friction_ros.identification.trust.uncertainty import block_covariance
from valve_friction_ros.model import BENCH_VALVE, SensorNoise, SineWave
from valve_friction_ros.signals import differentiate
from valve_friction_ros.signals.measured_record import measured

SETTINGS = IdentificationSettings(
    derivative_window=33, order=4, fixed={"mass": 1.6, "limit_velocity": 1.5e-3}
)


@pytest.fixture(scope="module")
def record(bench_record):
    noise = SensorNoise(position=10e-6, pressure=100.0, seed=0)
    return measured(bench_record("high", SineWave(), 71.0, noise))


@pytest.fixture(scope="module")
def fit(record):
    return published_fit(record, BENCH_VALVE, SETTINGS)


@pytest.fixture
def uncertainty(record, fit):
    return regression_uncertainty(record, fit)


@pytest.fixture(scope="module")
def sliding(record):
    """Regressors and force above the threshold, zero at the other samples, and the velocity."""
    velocity, acceleration, margin = differentiate(record.position, 1e-3, 33, 4)
    moving = np.abs(velocity) > 1.5e-3
    place = record.position[margin:-margin]
    force = BENCH_VALVE.actuator_force(record.pressure)[margin:-margin] - 1.6 * acceleration
    columns = np.column_stack([np.sign(velocity), velocity, place, np.ones(place.size)])
    return columns * moving[:, None], force * moving, velocity[moving]


def strokes_of(velocity):
    return np.count_nonzero(np.diff(np.sign(velocity))) + 1


def test_scatter_between_strokes(uncertainty, sliding):
    """The covariance of least squares on the moving samples, with blocks of one stroke."""
    columns, force, velocity = sliding
    lengths = np.linalg.norm(columns, axis=0)
    solved = np.linalg.lstsq(columns / lengths, force, rcond=None)[0] / lengths
    equation = EstimatingEquation.of_least_squares(columns, columns @ solved - force)
    expected = block_covariance(equation, force.size // strokes_of(velocity)).matrix
    found = uncertainty.covariance.matrix
    scale = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(
        found / scale / scale[:, None], expected / scale / scale[:, None], rtol=0, atol=1e-5
    )


def test_strokes_and_names(uncertainty, sliding):
    assert uncertainty.strokes == strokes_of(sliding[2]) > 3
    assert uncertainty.names == (
        "coulomb_friction",
        "viscous_friction",
        "spring_constant",
        "spring_preload",
    )


def test_fit(uncertainty, sliding):
    """1 − |residual|/|force − mean| over the moving samples."""
    columns, force, _ = sliding
    moving = columns[:, 3] > 0
    lengths = np.linalg.norm(columns, axis=0)
    left = force - columns @ (np.linalg.lstsq(columns / lengths, force, rcond=None)[0] / lengths)
    unfit = np.linalg.norm(left) / np.linalg.norm(force[moving] - force[moving].mean())
    assert uncertainty.fit == pytest.approx(1 - unfit, abs=1e-6)


def covariance_of(scatter):
    """Four coordinates, of which the second scatters `scatter` times as much, the last little."""
    generator = np.random.default_rng(0)
    slope = generator.standard_normal((90, 4)) / [1.0, scatter, 1.0, 0.01]
    return block_covariance(
        EstimatingEquation.of_least_squares(slope, generator.standard_normal(90)), 9
    )


class TestVerdicts:
    NAMES = ("viscous_friction", "coulomb_friction", "spring_constant", "spring_preload")

    def of(self, fit, scatter=1.0, strokes=10, **fixed):
        covariance = covariance_of(scatter)
        uncertainty = RegressionUncertainty(self.NAMES, covariance, 0.9, strokes)
        settings = IdentificationSettings(fixed=fixed)
        return regression_verdicts(fit, uncertainty, settings), covariance

    def test_by_the_interval_of_each(self, fit):
        found, covariance = self.of(fit, scatter=1e3)
        assert list(found) == [*fit.estimate.values, "sliding_friction"]
        one, gradient = found["coulomb_friction"], np.array([0.0, 1.0, 0.0, 0.0])
        assert one.name == "coulomb_friction"
        assert one.value == fit.estimate.coulomb_friction
        assert one.standard_error == covariance.standard_error(gradient)
        assert one.half_width == covariance.half_width(gradient) > 0.05 * one.value
        assert one.verdict is Verdict.WEAK
        assert one.reason.startswith("its interval is ±")

    def test_no_interval_is_finer_than_the_smoothing(self, fit):
        """5·10⁻⁴ of a value, 2·10⁻⁴ of a spring constant."""
        found, covariance = self.of(fit)
        shares = {"viscous_friction": 5e-4, "spring_constant": 2e-4, "spring_preload": 5e-4}
        for name, share in shares.items():
            one, value = found[name], fit.estimate.values[name]
            assert (one.verdict, one.reason) == (Verdict.IDENTIFIED, "")
            assert one.half_width == share * value
            gradient = np.eye(4)[self.NAMES.index(name)]
            assert one.standard_error == covariance.standard_error(gradient)

    def test_the_sliding_friction_is_that_at_the_mean_speed(self, fit):
        """F_c + F_v·v: its gradient is 1 by F_c and v by F_v, and their errors may cancel."""
        found, covariance = self.of(fit, scatter=1e3)
        moving = fit.regression.speed[fit.regression.speed > fit.estimate.threshold]
        speed = np.sum(moving**2) / np.sum(moving)
        one = found["sliding_friction"]
        values = fit.estimate.values
        assert one.value == pytest.approx(
            values["coulomb_friction"] + values["viscous_friction"] * speed
        )
        gradient = np.array([speed, 1.0, 0.0, 0.0])
        assert one.standard_error == pytest.approx(covariance.standard_error(gradient))
        assert one.half_width == pytest.approx(
            max(covariance.half_width(gradient), 3e-3 * one.value)
        )

    def test_few_strokes_make_weak(self, fit):
        one = self.of(fit, strokes=2)[0]["viscous_friction"]
        assert (one.verdict, one.reason) == (
            Verdict.WEAK,
            "only 2 strokes: record at least 3, up and down",
        )

    def test_what_was_given_and_what_is_not_known(self, fit):
        found, _ = self.of(fit, viscous_friction=1.5, static_friction=2.5)
        assert found["viscous_friction"] == Parameter(
            "viscous_friction", 1.5, 0.0, 0.0, Verdict.FIXED, "given"
        )
        assert found["static_friction"].value == 2.5
        for name, reason in (
            ("static_friction", NO_SLIP),
            ("mass", "the record does not determine it"),
        ):
            one = self.of(fit)[0][name]
            assert (one.name, one.verdict, one.reason) == (name, Verdict.NOT_IDENTIFIABLE, reason)

    def test_a_negative_value_has_a_width(self, fit):
        """The finest share is one of the magnitude."""
        turned = fit.estimate.__class__(
            **{**vars(fit.estimate), "viscous_friction": -fit.estimate.viscous_friction}
        )
        uncertainty = RegressionUncertainty(self.NAMES, covariance_of(1.0), 0.9, 10)
        found = regression_verdicts(
            fit._replace(estimate=turned), uncertainty, IdentificationSettings()
        )
        assert found["viscous_friction"].half_width == 5e-4 * fit.estimate.viscous_friction
