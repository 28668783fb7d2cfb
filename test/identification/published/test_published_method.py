# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The published method: what it identifies on bench records, what it states, and its refusals."""

import dataclasses
import math
from dataclasses import replace

import numpy as np
import pytest

from valve_friction_ros.identification import (
    FIXABLE,
    UNITS,
    IdentificationSettings,
    Parameter,
    RefusalError,
    Verdict,
    published_estimate,
    sweep_thresholds,
)
from valve_friction_ros.identification.published import identify
from valve_friction_ros.identification.published.identify import (
    Breakaway,
    _why_mass_is_unknown,
    choose_threshold,
    identify_published,
    sweep_evidence,
    sweep_finding,
    with_published,
)
from valve_friction_ros.identification.published.sweep import (
    Sweep,
    force_balance_regression,
    possible_model,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    IsaSteps,
    KarnoppParameters,
    Recording,
    SensorNoise,
    SineWave,
    SquareWave,
    Valve,
    converter_response,
    simulate,
)
from valve_friction_ros.signals import differentiate

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
    names = ("threshold", "samples", "sigma", "r_squared", "published_window")
    values = (1.23456e-3, 789, 0.123456, 0.98765432, 33)
    assert sweep_evidence(sample) == dict(zip(names, values, strict=True))
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


def test_static_friction_is_the_median_pull_and_not_below_the_coulomb_friction(static_friction):
    """Pulls less spring and preload: 9, 9, 9, −21 and 49 N."""
    assert static_friction(Breakaway(1, 1), Breakaway(3, -1), Breakaway(4, 1)) == (21.0, [])
    assert static_friction(Breakaway(1, -1)) == (3.0, [])
    assert static_friction(Breakaway(1, 1), coulomb_friction=9.5) == (9.5, [])


def test_without_a_breakaway_static_is_coulomb_friction(static_friction):
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


@pytest.mark.parametrize(("residual", "chosen"), [(0.8e-11, 0), (1.2e-11, 1)])
def test_a_residual_below_rounding_is_none(residual, chosen):
    """10⁻¹² of the largest, 10 N: what is smaller does not count, and the information decides."""
    unknown, sigma = np.full(3, np.nan), np.array([residual, 0.5e-11, 10.0])
    information = np.array([0.1, 0.0, 0.0])
    sweep = Sweep(np.arange(3.0), {"mass": unknown}, sigma, unknown, np.full(3, 40), information, 1)
    assert choose_threshold(sweep, 31) == chosen


FOUR_COLUMNS = IdentificationSettings(position_bias=1.13e-3)
NOISE = SensorNoise(position=10e-6, pressure=100.0, seed=0)


def assert_identified(estimate, true, tolerances):
    for name, tolerance in tolerances.items():
        value, expected = getattr(estimate, name), getattr(true, name)
        assert value == pytest.approx(expected, rel=tolerance), name


# What is asked of noise-free records. The mass is smoothed by the 31 ms window of the derivatives.
NOISE_FREE = {
    "viscous_friction": 1e-3,
    "coulomb_friction": 1e-3,
    "spring_constant": 1e-3,
    "mass": 0.1,
}


@pytest.mark.parametrize("name", ["low", "high"])
class TestNoiseFree:
    @pytest.mark.parametrize("duration", [20.8, 52.0])
    def test_square_wave_in_the_four_column_form(self, benches, bench_record, name, duration):
        """The paper's experiment: two periods and more, bias from (16)."""
        estimate = published_estimate(
            bench_record(name, SquareWave(), duration), BENCH_VALVE, FOUR_COLUMNS
        )
        assert_identified(estimate, benches[name].parameters, NOISE_FREE)
        assert estimate.spring_preload == estimate.spring_constant * 1.13e-3
        assert estimate.fixed == ()
        assert estimate.warnings == ()

    @pytest.mark.parametrize(
        ("excitation", "duration"), [(SineWave(), 71.0), (IsaSteps(), 370.0)], ids=["sine", "isa"]
    )
    def test_preload_as_a_regressor(self, benches, bench_record, name, excitation, duration):
        estimate = published_estimate(bench_record(name, excitation, duration), BENCH_VALVE)
        tolerances = NOISE_FREE | {"spring_preload": 1e-3}
        assert_identified(estimate, benches[name].parameters, tolerances)
        assert estimate.fixed == ()
        assert estimate.warnings == ()

    def test_square_wave_does_not_tell_the_mass(self, benches, bench_record, name):
        """Two exponentials and a level each way: four equations for five parameters."""
        record = bench_record(name, SquareWave(), 20.8)
        estimate = published_estimate(record, BENCH_VALVE, IdentificationSettings(assumed_mass=1.6))
        assert estimate.mass == 1.6
        assert estimate.fixed == ("mass",)
        assert estimate.settings.fixed == {"mass": 1.6}
        (warning,) = estimate.warnings
        assert warning.startswith("the record does not determine the mass")
        assert warning.endswith("1.6 kg is assumed")
        assert_identified(
            estimate,
            benches[name].parameters,
            {"coulomb_friction": 1e-3, "spring_constant": 1e-3, "viscous_friction": 2e-3},
        )


@pytest.mark.parametrize("seed", range(4))
def test_noise_does_not_pass_for_a_mass(bench_record, seed):
    """Noise in the acceleration gives a positive mass, but another one by another window."""
    noise = SensorNoise(position=10e-6, pressure=100.0, seed=seed)
    settings = dataclasses.replace(FOUR_COLUMNS, assumed_mass=1.6)
    estimate = published_estimate(
        bench_record("high", SquareWave(), 52.0, noise), BENCH_VALVE, settings
    )
    assert estimate.mass == 1.6
    assert estimate.fixed == ("mass",)
    assert any("with half the derivative window" in warning for warning in estimate.warnings)


class TestEstimate:
    def test_figures_are_those_of_the_chosen_step(self, bench_record):
        estimate = published_estimate(bench_record("high", SquareWave(), 20.8, NOISE), BENCH_VALVE)
        sweep = estimate.sweep
        (chosen,) = np.flatnonzero(sweep.thresholds == estimate.threshold)
        assert estimate.samples == sweep.samples[chosen]
        assert estimate.sigma == sweep.sigma[chosen]
        assert estimate.r_squared == sweep.r_squared[chosen]
        for name in sweep.estimates:
            assert getattr(estimate, name) == sweep.estimates[name][chosen]

    def test_thresholds_of_the_paper(self, bench_record):
        """(8) with S = 330 and Z = 350."""
        record = bench_record("low", SquareWave(), 20.8)
        estimate = published_estimate(record, BENCH_VALVE, FOUR_COLUMNS)
        thresholds = estimate.sweep.thresholds
        assert thresholds.size == 330
        np.testing.assert_allclose(thresholds, thresholds[0] * np.arange(1, 331), rtol=1e-14)
        speed = np.gradient(record.position, record.sample_period)
        assert 350 * thresholds[0] == pytest.approx(np.abs(speed).max(), rel=0.02)


class TestFixed:
    @pytest.mark.parametrize("name", [name for name in FIXABLE if name != "limit_velocity"])
    def test_it_is_returned_exactly_and_the_others_stay_true(self, bench_record, name):
        fixed = {name: getattr(LOW_FRICTION, name)}
        record = bench_record("low", SineWave(), 71.0)
        estimate = published_estimate(record, BENCH_VALVE, IdentificationSettings(fixed=fixed))
        assert getattr(estimate, name) == fixed[name]
        assert estimate.fixed == (name,)
        assert_identified(estimate, LOW_FRICTION, NOISE_FREE | {"spring_preload": 1e-3})

    def test_limit_velocity_sets_the_threshold(self, bench_record):
        record = bench_record("low", SineWave(), 71.0)
        settings = IdentificationSettings(fixed={"limit_velocity": 1e-3})
        estimate = published_estimate(record, BENCH_VALVE, settings)
        assert estimate.threshold == 1e-3
        assert estimate.sweep.thresholds.tolist() == [1e-3]
        assert_identified(estimate, LOW_FRICTION, NOISE_FREE)


class TestRefusals:
    def refused(self, record, settings=None):
        with pytest.raises(RefusalError) as refusal:
            published_estimate(record, BENCH_VALVE, settings)
        return str(refusal.value)

    def test_too_short(self, bench_record):
        record = bench_record("low", SquareWave(), 20.8)
        short = Recording(1e-3, record.pressure[:309], record.position[:309])
        message = self.refused(short)
        assert message.startswith("the record is too short: 309 samples (0.308 s)")
        assert "at least 310" in message

    @pytest.mark.parametrize("noise", [SensorNoise(), NOISE], ids=["clean", "noisy"])
    def test_stem_never_moved(self, noise):
        still = Recording(1e-3, np.linspace(4e4, 2e5, 20000), np.full(20000, 0.01))
        message = self.refused(noise.applied_to(still))
        assert message.startswith("the stem did not move: its position spans")

    @pytest.mark.parametrize("noise", [SensorNoise(), NOISE], ids=["clean", "noisy"])
    @pytest.mark.parametrize(("levels", "way"), [((6e4, 1.6e5), "up"), ((1.6e5, 6e4), "down")])
    def test_one_direction(self, levels, way, noise):
        """The noise of the resting stem is no motion the other way."""
        pressure = converter_response(np.repeat(levels, [2000, 8000]), 1e-3)
        position = simulate(BENCH_VALVE, LOW_FRICTION, pressure, 1e-3).position
        message = self.refused(noise.applied_to(Recording(1e-3, pressure, position)))
        assert message.startswith(f"the stem moved only {way}")

    @pytest.mark.parametrize("left", [4 * 301 - 1, 4 * 301])
    def test_too_few_moving_samples(self, bench_record, left):
        """Less than a window, here of 301 samples, for each of four parameters is not enough."""
        record = bench_record("low", SquareWave(), 20.8)
        speed = np.abs(differentiate(record.position, record.sample_period, 301).velocity)
        limit = np.partition(speed, -left - 1)[-left - 1]  # the speed that `left` are above
        settings = IdentificationSettings(
            derivative_window=301, position_bias=1.13e-3, fixed={"limit_velocity": limit}
        )
        if left < 4 * 301:
            message = self.refused(record, settings)
            assert message.startswith("no threshold leaves enough samples in motion")
            assert "4 parameters" in message
        else:
            assert published_estimate(record, BENCH_VALVE, settings).samples == left


class TestSettings:
    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            ({"order": 1}, r"^order must be at least 2"),
            ({"order": 2.5}, r"^order must be a whole number of at least 0, got 2.5"),
            ({"steps": None}, r"^steps must be a whole number of at least 0, got None"),
            ({"derivative_window": "31"}, r"^derivative_window must be a whole number of .* '31'"),
            ({"area_uncertainty": "2 %"}, r"^area_uncertainty must be .* got 2 %: give a share"),
            (
                {"derivative_window": 30},
                r"^derivative_window must be odd and at least order \+ 2 = 5, got 30",
            ),
            (
                {"derivative_window": 3},
                r"^derivative_window must be odd and at least order \+ 2 = 5, got 3",
            ),
            ({"steps": 0}, r"^steps \(0\) must be above zero"),
            ({"steps": 350}, r"^steps \(350\) .* below resolution \(350\)"),
            ({"assumed_mass": -1.0}, r"^assumed_mass must be above zero"),
            ({"position_bias": np.nan}, r"^position_bias must be finite"),
            *(
                ({"timing_uncertainty": one}, r"^timing_uncertainty must")
                for one in (-1e-3, np.nan, np.inf)
            ),
            ({"fixed": {"weight": 1.0}}, r"^'weight' is not a parameter .* mass, coulomb_friction"),
            ({"fixed": {"mass": -1.0}}, r"^mass must be above zero"),
            ({"fixed": {"spring_constant": "text"}}, r"^spring_constant must be a number"),
            ({"fixed": {"spring_preload": np.inf}}, r"^spring_preload must be finite"),
            ({"fixed": {"limit_velocity": 0.0}}, r"^limit_velocity must be above zero"),
            (
                {"position_bias": 1e-3, "fixed": {"spring_preload": 200.0}},
                r"^position_bias and a fixed spring_preload exclude each other",
            ),
        ],
    )
    def test_refusals(self, arguments, message):
        with pytest.raises(ValueError, match=message):
            IdentificationSettings(**arguments)

    def test_paper_defaults(self):
        settings = IdentificationSettings()
        assert (settings.published_window, settings.order) == (31, 3)
        assert (settings.steps, settings.resolution) == (330, 350)
        assert settings.fixed == {}
        assert settings.position_bias is None


def test_force_counts_from_the_reference(bench_record, benches):
    """An absolute sensor reads an atmosphere more, and its valve says so: the same numbers."""
    record = bench_record("low", SquareWave(), 20.8)
    shifted = Recording(record.sample_period, record.pressure + 101325.0, record.position)
    valve = Valve(0.0445, pressure_reference=BENCH_VALVE.pressure_reference + 101325.0)
    estimate = published_estimate(shifted, valve, FOUR_COLUMNS)
    assert_identified(estimate, benches["low"].parameters, NOISE_FREE)
