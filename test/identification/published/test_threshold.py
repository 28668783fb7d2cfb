"""The choice of the threshold on the plateau of the sweep."""

import numpy as np
import pytest

from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    sweep_thresholds,
)
from valve_friction_ros.identification.published.regression import force_balance_regression
from valve_friction_ros.identification.published.threshold import choose_threshold
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION, SensorNoise, SquareWave
from valve_friction_ros.signals import differentiate

WINDOW = 31


def swept(record, **settings):
    derivatives = differentiate(record.position, record.sample_period)
    force = BENCH_VALVE.actuator_force(record.pressure)
    regression = force_balance_regression(
        force, record.position, derivatives, IdentificationSettings(**settings)
    )
    return sweep_thresholds(regression, regression.speed.max() / 350 * np.arange(1, 331))


def error(sweep, step, name):
    return abs(sweep.estimates[name][step] / getattr(HIGH_FRICTION, name) - 1)


@pytest.fixture(scope="module", params=range(4))
def noisy(request, bench_record):
    """High friction, 10 µm and 100 Pa of noise, the paper's form with the true bias."""
    noise = SensorNoise(position=10e-6, pressure=100.0, seed=request.param)
    return swept(bench_record("high", SquareWave(), 52.0, noise), position_bias=1.13e-3)


def test_smallest_sigma_is_far_off(noisy):
    """What the rule is there to avoid: 11 to 100 samples of one speed fit anything."""
    smallest = int(np.nanargmin(noisy.sigma))
    assert noisy.samples[smallest] < 0.01 * noisy.samples[0]
    assert error(noisy, smallest, "coulomb_friction") > 0.3
    assert error(noisy, smallest, "viscous_friction") > 0.5


def test_chosen_threshold_is_on_the_plateau(noisy):
    """The noise of the derivative sets the bounds.

    10 µm become 0.5 mm/s in the velocity, whose magnitude spreads by 2.3 mm/s about 5 mm/s in
    the moving samples: a regressor with that noise loses (0.5/2.3)² = 5 % of F_v. The Coulomb
    friction takes over what is lost at the mean speed: 0.05 · 44.8 kN·s/m · 5 mm/s = 11 N of
    606 N, 2 %. The position is known to 10 µm of 18 mm: 0.1 % of k.
    """
    chosen = choose_threshold(noisy, WINDOW)
    assert error(noisy, chosen, "viscous_friction") < 0.05
    assert error(noisy, chosen, "coulomb_friction") < 0.02
    assert error(noisy, chosen, "spring_constant") < 1e-3
    assert noisy.samples[chosen] > 0.25 * noisy.samples[0]


def test_smallest_generalised_variance(noisy):
    """ln det σ²(ΦᵀΦ)⁻¹ from its definition, over the steps of at least n_P windows."""
    usable = noisy.samples >= 4 * WINDOW
    criterion = 4 * np.log(noisy.sigma**2) - noisy.log_information
    assert choose_threshold(noisy, WINDOW) == np.argmin(np.where(usable, criterion, np.inf))


def test_the_unit_of_force_does_not_matter(bench_record):
    """Nor does that of length: the determinant changes by the same factor at each step."""
    noise = SensorNoise(position=10e-6, pressure=100.0, seed=0)
    record = bench_record("high", SquareWave(), 20.8, noise)
    derivatives = differentiate(record.position, record.sample_period)
    force = BENCH_VALVE.actuator_force(record.pressure)
    settings = IdentificationSettings()
    chosen = []
    for newton, metre in ((1.0, 1.0), (1e-3, 1.0), (1.0, 1e3)):
        scaled = derivatives._replace(
            velocity=derivatives.velocity * metre, acceleration=derivatives.acceleration * metre
        )
        regression = force_balance_regression(
            force * newton, record.position * metre, scaled, settings
        )
        thresholds = regression.speed.max() / 350 * np.arange(1, 331)
        chosen.append(choose_threshold(sweep_thresholds(regression, thresholds), WINDOW))
    assert chosen[0] == chosen[1] == chosen[2]


def test_refuses_where_no_step_has_enough_samples(bench_record):
    record = bench_record("high", SquareWave(), 20.8)
    sweep = swept(record)
    longer = int(sweep.samples[0]) // sweep.free + 1
    with pytest.raises(RefusalError, match="no threshold leaves enough moving samples") as refusal:
        choose_threshold(sweep, longer)
    assert "5 parameters" in str(refusal.value)
    choose_threshold(sweep, longer - 1)
