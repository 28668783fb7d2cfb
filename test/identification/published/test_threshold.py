# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The choice of the threshold on the plateau of the sweep."""

from dataclasses import replace

import numpy as np
import pytest

from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    sweep_thresholds,
)
from valve_friction_ros.identification.published.identify import choose_threshold
from valve_friction_ros.identification.published.regression import force_balance_regression
from valve_friction_ros.identification.published.sweep import Sweep
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
    with pytest.raises(RefusalError) as refusal:
        choose_threshold(sweep, longer)
    assert str(refusal.value) == (
        "no threshold leaves enough moving samples to determine 5 parameters: "
        "record more strokes, or fix a parameter"
    )
    choose_threshold(sweep, longer - 1)


def one_parameter(sigma, log_information):
    """A sweep of three thresholds with 40 samples each; the third is unknown."""
    steps, unknown = np.arange(1.0, 4.0), np.full(3, np.nan)
    return Sweep(
        steps,
        {"mass": unknown},
        np.array([*sigma, np.nan]),
        unknown,
        np.full(3, 40),
        np.array([*log_information, np.nan]),
        1,
    )


@pytest.mark.parametrize(
    ("sigma", "log_information", "chosen"),
    [
        ((1.0, 1.0), (0.0, 0.1), 1),
        ((1.0, 1.2), (0.0, 0.1), 0),  # 2·ln 1.2 is 0.36
        ((1.0, 1.2), (0.0, 0.4), 1),
        ((0.0, 0.0), (0.0, 0.1), 1),
        ((0.0, 0.0), (0.1, 0.0), 0),
    ],
)
def test_residual_against_information(sigma, log_information, chosen):
    assert choose_threshold(one_parameter(sigma, log_information), 31) == chosen


@pytest.mark.parametrize(("residual", "chosen"), [(0.8e-11, 0), (1.2e-11, 1)])
def test_a_residual_below_rounding_is_none(residual, chosen):
    """10⁻¹² of the largest, 10 N: what is smaller does not count, and the information decides."""
    sweep = replace(
        one_parameter((1.0, 1.0), (0.0, 0.0)),
        sigma=np.array([residual, 0.5e-11, 10.0]),
        log_information=np.array([0.1, 0.0, 0.0]),
    )
    assert choose_threshold(sweep, 31) == chosen
