# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The published method: its threshold, its mass, its warnings, and what it states of each."""

import math
from dataclasses import replace

import numpy as np
import pytest

from valve_friction_ros.identification import (
    UNITS,
    IdentificationSettings,
    Parameter,
    RefusalError,
    Verdict,
    published_estimate,
    sweep_thresholds,
)
from valve_friction_ros.identification.published import identify
from valve_friction_ros.identification.published.estimate import possible_model
from valve_friction_ros.identification.published.identify import (
    Breakaway,
    _mass_by_shorter_window,
    _why_mass_is_unknown,
    choose_threshold,
)
from valve_friction_ros.identification.published.method import (
    identify_published,
    sweep_evidence,
    sweep_finding,
    with_published,
)
from valve_friction_ros.identification.published.sweep import Sweep, force_balance_regression
from valve_friction_ros.model import (
    BENCH_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    KarnoppParameters,
    Recording,
    SensorNoise,
    SineWave,
    SquareWave,
)
from valve_friction_ros.signals import differentiate, measured

SPRING = HIGH_FRICTION.spring_constant
SETTINGS = IdentificationSettings(
    derivative_window=33, fixed={"spring_constant": SPRING}, assumed_mass=1.6
)


@pytest.fixture(scope="module")
def record(bench_record):
    """Noise hides the inertia, so that the mass is assumed."""
    return bench_record("high", SquareWave(), 20.8, SensorNoise(10e-6, 100.0, seed=0))


@pytest.fixture(scope="module")
def estimate(record):
    return published_estimate(record, BENCH_VALVE, SETTINGS)


@pytest.fixture
def result(record):
    return identify_published(record, BENCH_VALVE, SETTINGS)


def test_no_parameter_has_an_interval(result, estimate):
    """A given spring, an assumed mass, and what is identified without an interval."""
    assert list(result.parameters) == [*UNITS, "sliding_friction"]
    for name in UNITS:
        one, value = result.parameters[name], estimate.values[name]
        assert (one.name, one.value, one.published) == (name, value, value)
        if name in ("mass", "spring_constant"):
            assert (one.verdict, one.half_width) == (Verdict.FIXED, 0.0)
        else:
            assert (one.verdict, one.reason) == (
                Verdict.WEAK,
                "the published method gives no interval",
            )
            assert math.isnan(one.standard_error)
            assert math.isnan(one.half_width)
    assert result.parameters["mass"].value == 1.6
    assert result.parameters["mass"].reason == "assumed: the record does not determine it"
    assert result.parameters["spring_constant"].value == SPRING
    assert result.parameters["spring_constant"].reason == "given"


def test_what_the_result_keeps(result, record, estimate):
    assert result.method == "published"
    assert result.recording is record
    assert (result.valve, result.settings) == (BENCH_VALVE, SETTINGS)
    assert math.isnan(result.rms)
    assert result.misfit is None
    assert result.derivative_window == 33
    assert result.warnings == estimate.warnings != ()
    assert result.evidence == sweep_evidence(estimate)
    assert result.findings == (sweep_finding(estimate),)
    assert result.model == KarnoppParameters(**estimate.values)
    assert result.estimate.values == estimate.values


def test_fit_is_the_share_of_the_force(result, record, estimate):
    """1 − |residual|/|force − mean| of the force less mass and spring, above the threshold."""
    velocity, acceleration, margin = differentiate(record.position, 1e-3, 33)
    force = BENCH_VALVE.actuator_force(record.pressure)[margin:-margin]
    left = force - 1.6 * acceleration - SPRING * record.position[margin:-margin]
    moving = np.abs(velocity) > estimate.threshold
    columns = np.column_stack([np.sign(velocity), velocity, np.ones(velocity.size)])[moving]
    left = left[moving]
    residual = left - columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
    unfit = np.linalg.norm(residual) / np.linalg.norm(left - left.mean())
    assert 0 < unfit < 0.1
    assert result.fit == pytest.approx(1 - unfit, abs=1e-4 * unfit)


def test_evidence(estimate):
    sample = replace(
        estimate, threshold=1.23456e-3, samples=789, sigma=0.123456, r_squared=0.98765432
    )
    assert sweep_evidence(sample) == {
        "threshold": 1.23456e-3,
        "samples": 789,
        "sigma": 0.123456,
        "r_squared": 0.98765432,
        "published_window": 33,
    }
    assert sweep_finding(sample) == (
        "published: threshold δv 0.001235 m/s, 789 samples above it, σ_s 0.1235 N, R² 0.987654, "
        "window 33 samples"
    )


def test_published_values_beside_those_of_another_method(estimate):
    """An extension has no published value, and a refused sweep leaves all without one."""
    mine = {
        name: Parameter(name, 2.0, 0.1, 0.2, Verdict.IDENTIFIED)
        for name in ("coulomb_friction", "stribeck_velocity")
    }
    friction, extension = with_published(mine, estimate).values()
    assert friction == replace(mine["coulomb_friction"], published=estimate.coulomb_friction)
    assert extension is mine["stribeck_velocity"]
    assert with_published(mine, None) == mine


def test_an_impossible_value_is_no_model(estimate):
    assert possible_model(estimate) == KarnoppParameters(**estimate.values)
    assert possible_model(replace(estimate, viscous_friction=-1.0)) is None


@pytest.mark.parametrize(
    ("mass", "other", "reason"),
    [
        (2.0, 2.0, None),
        (2.0, 2.5, None),  # a quarter of 2 kg is half a kilogram
        (2.0, 1.5, None),
        (2.0, 2.51, "2 kg becomes 2.51 kg with half the derivative window"),
        (2.0, 1.49, "2 kg becomes 1.49 kg with half the derivative window"),
        (2.0, np.nan, "2 kg becomes nan kg with half the derivative window"),
        (1 / 3, 1.0, "0.3333 kg becomes 1 kg with half the derivative window"),
        (0.5, 0.7, "0.5 kg becomes 0.7 kg with half the derivative window"),
        (0.0, 0.0, "its estimate is 0 kg"),
        (-1 / 3, -1 / 3, "its estimate is -0.3333 kg"),
    ],
)
def test_a_mass_keeps_within_a_quarter(mass, other, reason):
    assert _why_mass_is_unknown(mass, other) == reason


@pytest.mark.parametrize(
    ("window", "order", "half"), [(31, 3, 15), (33, 3, 17), (5, 3, 5), (7, 4, 7), (11, 4, 7)]
)
def test_mass_with_half_the_window(bench_record, window, order, half):
    """By `lstsq` above the threshold: half the window, odd, order + 2 samples at least."""
    record = measured(bench_record("high", SineWave(), 20.0, SensorNoise(10e-6, 100.0, 0)))
    settings = IdentificationSettings(derivative_window=window, order=order)
    force = BENCH_VALVE.actuator_force(record.pressure)
    threshold = 2e-3
    found = _mass_by_shorter_window(record, force, settings, threshold)
    velocity, acceleration, margin = differentiate(record.position, 1e-3, half, order)
    moving = np.abs(velocity) > threshold
    columns = [acceleration, np.sign(velocity), velocity, record.position[margin:-margin]]
    table = np.column_stack([*columns, np.ones(velocity.size)])[moving]
    lengths = np.linalg.norm(table, axis=0)
    solved = np.linalg.lstsq(table / lengths, force[margin:-margin][moving], rcond=None)[0]
    assert found == pytest.approx(solved[0] / lengths[0], rel=1e-6)


def test_no_mass_where_nothing_is_faster(bench_record):
    record = measured(bench_record("high", SineWave(), 20.0))
    force = BENCH_VALVE.actuator_force(record.pressure)
    assert np.isnan(_mass_by_shorter_window(record, force, IdentificationSettings(), 1.0))


VALUES = {"coulomb_friction": 3.0, "spring_constant": 10.0, "spring_preload": 1.0}


@pytest.fixture
def static_friction(monkeypatch):
    """Function of breakaways: F_s from a force of 10, 20, … N at 0, 1, … m, and the warnings."""

    def found(*breakaways, **values):
        monkeypatch.setattr(identify, "find_breakaways", lambda *_: list(breakaways))
        record = Recording(1.0, np.zeros(5), np.arange(5.0))
        force, warnings = np.array([10.0, 20.0, 30.0, 10.0, 90.0]), []
        settings = IdentificationSettings()
        value = identify._static_friction(record, force, settings, VALUES | values, warnings)
        return value, warnings

    return found


class TestStaticFriction:
    """Pulls less spring and preload: 9, 9, 9, −21 and 49 N."""

    def test_is_the_median(self, static_friction):
        assert static_friction(Breakaway(1, 1)) == (9.0, [])
        assert static_friction(Breakaway(1, 1), Breakaway(3, -1), Breakaway(4, 1)) == (21.0, [])

    def test_is_not_below_the_coulomb_friction(self, static_friction):
        assert static_friction(Breakaway(1, -1)) == (3.0, [])
        assert static_friction(Breakaway(1, 1), coulomb_friction=9.5) == (9.5, [])

    def test_without_a_breakaway_it_is_the_coulomb_friction(self, static_friction):
        value, (warning,) = static_friction()
        assert value == 3.0
        assert warning == (
            "the record contains no breakaway from rest: static_friction is set to coulomb_friction"
        )


def test_negative_values_but_for_a_preload(bench_record):
    """An inverted position; a viscous friction of zero is not negative."""
    record = bench_record("low", SineWave(), 71.0)
    settings = IdentificationSettings(
        fixed={"mass": 1.5, "viscous_friction": 0.0}, position_bias=1e-3
    )
    turned = replace(record, position=-record.position)
    estimate = published_estimate(turned, BENCH_VALVE, settings)
    values = estimate.values
    assert {name for name, value in values.items() if value < 0} == {
        "coulomb_friction",
        "spring_constant",
        "spring_preload",
        "static_friction",  # the larger of a negative pull and a negative F_c
    }
    expected = {
        f"{name} is negative ({values[name]:.4g}): the model does not fit this record"
        for name in ("coulomb_friction", "spring_constant")
    }
    assert {one for one in estimate.warnings if "negative" in one} == expected


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_given_static_friction_below_the_coulomb_friction(bench_record, share):
    given = share * LOW_FRICTION.coulomb_friction
    settings = IdentificationSettings(fixed={"static_friction": given})
    estimate = published_estimate(bench_record("low", SineWave(), 71.0), BENCH_VALVE, settings)
    assert estimate.static_friction == given
    expected = (
        "the fixed static_friction (137.4 N) lies below the identified coulomb_friction "
        f"({estimate.coulomb_friction:.4g} N)"
    )
    assert estimate.warnings == ((expected,) if share < 1 else ())


def test_a_static_friction_that_equals_the_coulomb_friction(bench_record):
    fixed = {"static_friction": 150.0, "coulomb_friction": 150.0}
    settings = IdentificationSettings(fixed=fixed)
    estimate = published_estimate(bench_record("low", SineWave(), 71.0), BENCH_VALVE, settings)
    assert not any("lies below" in warning for warning in estimate.warnings)


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
        "no threshold leaves enough samples in motion to determine 5 parameters: record more "
        "strokes, or fix a parameter"
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
