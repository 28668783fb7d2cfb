# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Verdicts and what makes them: the width of an interval, its covariance, and its calibration."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import sqrtm
from scipy.signal import lfilter
from scipy.special import stdtrit

from valve_friction_ros.identification import (
    CALIBRATION,
    PARAMETER_UNITS,
    IdentificationSettings,
    Parameter,
    Verdict,
)
from valve_friction_ros.identification.trust.misfit import Misfit, stem_distance
from valve_friction_ros.identification.trust.uncertainty import (
    block_covariance,
    half_width,
    jackknife,
    stroke_length,
    student_quantile,
)
from valve_friction_ros.identification.trust.verdict import (
    FALL_SPEED,
    calibrated,
    calibration_share,
    fixed,
    not_identifiable,
    with_calibration,
    with_verdict,
)
from valve_friction_ros.model import Drive, Valve
from valve_friction_ros.wording import percentage


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("width", "verdict"),
    [
        (0.0, Verdict.IDENTIFIED),
        (5.0, Verdict.IDENTIFIED),
        (5.001, Verdict.WEAK),
        (99.999, Verdict.WEAK),
        (100.0, Verdict.NOT_IDENTIFIABLE),
        (1e9, Verdict.NOT_IDENTIFIABLE),
        (math.nan, Verdict.NOT_IDENTIFIABLE),
        (math.inf, Verdict.NOT_IDENTIFIABLE),
    ],
)
def test_by_the_share_of_the_value(sign, width, verdict):
    found = with_verdict("mass", sign * 100.0, 1.0, width)
    assert found.verdict is verdict
    assert bool(found.reason) == (verdict is not Verdict.IDENTIFIED)


def test_a_zero_is_not_identifiable():
    assert with_verdict("viscous_friction", 0.0, 1.0, 2.0).verdict is Verdict.NOT_IDENTIFIABLE


def test_a_withheld_value_leaves_the_largest_that_it_can_be():
    """−3 ± 4 N is 7 N at the most; of what the record does not hold nothing is known."""
    withheld = with_verdict("coulomb_friction", -3.0, 2.0, 4.0)
    assert (withheld.withheld, withheld.magnitude_bound) == ((-3.0, 4.0), 7.0)
    assert math.isnan(with_verdict("coulomb_friction", 3.0, 0.1, 0.2).magnitude_bound)
    assert math.isnan(not_identifiable("coulomb_friction", "why").magnitude_bound)


def test_doubt_makes_a_narrow_interval_weak_and_explains_a_wide_one():
    narrow = with_verdict("mass", 100.0, 0.1, 0.2, "a doubt")
    assert (narrow.verdict, narrow.reason, narrow.value) == (Verdict.WEAK, "a doubt", 100.0)
    wide = with_verdict("mass", 100.0, 100.0, 200.0, "a doubt")
    assert (wide.verdict, wide.reason) == (Verdict.NOT_IDENTIFIABLE, "a doubt")


def test_a_withheld_value_is_nowhere():
    withheld = not_identifiable("mass", "why")
    numbers = (withheld.value, withheld.standard_error, withheld.half_width, *withheld.interval)
    assert all(math.isnan(number) for number in numbers)
    assert withheld.reason == "why"


def test_fixed_has_no_width():
    assert fixed("mass", 1.6) == Parameter("mass", 1.6, 0.0, 0.0, Verdict.FIXED, "given")
    assert fixed("mass", 1.6).interval == (1.6, 1.6)


@given(value=st.floats(-1e6, 1e6), width=st.floats(0, 1e6), doubt=st.sampled_from(["", "doubt"]))
def test_a_number_without_a_verdict_is_never_shown(value, width, doubt):
    """Either the interval is narrower than the value, or there is neither value nor interval."""
    found = with_verdict("mass", value, width / 2, width, doubt)
    if found.verdict is Verdict.NOT_IDENTIFIABLE:
        assert math.isnan(found.value)
        assert found.reason
    else:
        low, high = found.interval
        assert found.value == value
        assert low > 0 or high < 0


@pytest.mark.parametrize(
    ("name", "unit"), [("mass", "kg"), ("clock_offset", "s"), ("coulomb_asymmetry", "1")]
)
def test_units_for_people(name, unit):
    assert fixed(name, 1.0).unit == unit
    assert fixed("unheard_of", 1.0).unit == ""


@given(
    st.one_of(st.integers(1, 2000), st.floats(1.0, 1e6)),
    st.floats(0.6, 1 - 1e-7),
)
def test_it_is_that_of_scipy(freedom, probability):
    assert student_quantile(probability, freedom) == pytest.approx(
        stdtrit(freedom, probability), rel=1e-7
    )


GROUPS = [[1.0, 2.0, 6.0], [10.0, 14.0]]


def test_of_a_mean():
    found = jackknife([GROUPS[0]], lambda groups: {"mean": float(np.mean(groups[0]))})
    assert found.values["mean"] == 3.0
    assert found.standard_errors["mean"] == pytest.approx(np.std(GROUPS[0], ddof=1) / math.sqrt(3))
    assert found.freedom == 2


def test_independent_groups_add_in_squares():
    def difference(groups):
        return {"difference": float(np.mean(groups[1]) - np.mean(groups[0]))}

    found = jackknife(GROUPS, difference)
    assert found.values["difference"] == 9.0
    assert found.standard_errors["difference"] == pytest.approx(math.sqrt(7 / 3 + 8 / 2))
    assert found.freedom == 3


def test_one_alone_has_no_scatter():
    found = jackknife([[1.0, 2.0], [3.0]], lambda groups: {"sum": sum(map(sum, groups))})
    assert found.values["sum"] == 6.0
    assert math.isnan(found.standard_errors["sum"])


def test_each_group_keeps_its_place():
    """One group of three varies at a time: 1·mean + 10·mean + 100·mean."""

    def weighted(groups):
        assert len(groups) == 3
        return {"sum": sum(10**place * float(np.mean(one)) for place, one in enumerate(groups))}

    found = jackknife([*GROUPS, [5.0, 6.0]], weighted)
    expected = math.sqrt(7 / 3 + 100 * 8 / 2 + 10_000 * 0.5 / 2)
    assert found.standard_errors["sum"] == pytest.approx(expected)


def misfit(fit=1.0, systematic=5.0, tolerated=4.0):
    return Misfit(fit, rms=9.0, systematic=systematic, tolerated=tolerated)


def test_the_tolerated_misfit_is_still_described():
    assert misfit(systematic=4.0).describes
    assert not misfit(systematic=4.001).describes


@pytest.mark.parametrize(
    ("fit", "systematic", "gross"),
    [(0.9, 5.0, False), (0.899, 5.0, True), (0.899, 4.0, False), (0.95, 4.0, False)],
)
def test_gross_is_a_tenth_of_the_movement_that_noise_does_not_explain(fit, systematic, gross):
    assert misfit(fit, systematic).is_gross is gross


def test_distance_of_the_stem_in_words():
    assert stem_distance(28.6e-6, Valve(0.0445)) == "29 µm rms"
    short = Valve(0.0445, travel=0.0286)
    assert stem_distance(28.6e-6, short) == "29 µm rms, 0.1 % of travel"
    assert stem_distance(0.12345, Valve(0.0445)) == "123450 µm rms"


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.00123, "0.12 %"),
        (0.0567, "5.7 %"),
        (0.994, "99 %"),
        (0.995, "100 %"),
        (1.0, "100 %"),
        (2.34, "234 %"),
    ],
)
def test_percentages_for_people(share, text):
    assert percentage(share) == text


def test_friction_may_fall_up_to_twice_the_stribeck_velocity_of_graphite():
    """v_s = 3.26 mm/s; exp(−(v/v_s)²) has fallen to e⁻⁴ at twice that."""
    assert math.isclose(FALL_SPEED, 2 * 3.26e-3, rel_tol=0.01)


AREA, DRIVE, POSITION = ({name: 0.02} for name in CALIBRATION)
FORCES = {"coulomb_friction", "static_friction", "sliding_friction", "spring_preload"}
FORCES_BY_LENGTH = {"mass", "viscous_friction", "spring_constant"}
LENGTHS = {"stribeck_velocity", "limit_velocity"}


def share(name, driven_by=Drive.PRESSURE, **settings):
    return calibration_share(name, IdentificationSettings(**settings), driven_by)


@pytest.mark.parametrize("name", [*PARAMETER_UNITS, "limit_velocity"])
class TestScales:
    def test_of_a_force(self, name):
        expected = 0.02 if name in FORCES | FORCES_BY_LENGTH else 0.0
        assert share(name, **AREA) == share(name, **DRIVE) == expected

    def test_of_a_length(self, name):
        expected = 0.02 if name in FORCES_BY_LENGTH | LENGTHS else 0.0
        assert share(name, **POSITION) == expected

    def test_a_force_needs_no_area(self, name):
        assert share(name, Drive.FORCE, **AREA) == 0.0
        assert share(name, Drive.FORCE, **DRIVE) == share(name, **DRIVE)


def test_independent_scales_add_in_squares():
    """Also where one divides the other: 3 % and 4 % are 5 %, and equal ones do not cancel."""
    given = {"drive_scale_uncertainty": 0.03, "position_scale_uncertainty": 0.04}
    assert share("spring_constant", **given) == pytest.approx(0.05, rel=1e-15)
    assert share("coulomb_friction", **given) == 0.03
    given = {"area_uncertainty": 0.02, "position_scale_uncertainty": 0.02}
    assert share("spring_constant", **given) == pytest.approx(0.02 * math.sqrt(2), rel=1e-15)


def test_a_preload_by_a_known_bias_scales_as_the_spring():
    assert share("spring_preload", position_bias=1e-3, **POSITION) == 0.02


def test_it_adds_in_squares_to_the_interval():
    """A standard uncertainty of 2 % is a half width of 4 %: ±1 % become √(1² + 4²) %."""
    one = calibrated(with_verdict("coulomb_friction", 100.0, 0.5, 1.0), 0.02)
    assert one.half_width == pytest.approx(math.hypot(1.0, 4.0), rel=1e-15)
    assert one.standard_error == pytest.approx(math.hypot(0.5, 2.0), rel=1e-15)
    assert (one.value, one.verdict, one.reason) == (100.0, Verdict.IDENTIFIED, "")
    assert one.without_calibration == with_verdict("coulomb_friction", 100.0, 0.5, 1.0)


def test_a_negative_value_is_widened_too():
    assert calibrated(with_verdict("spring_preload", -100.0, 0.0, 0.0), 0.02).half_width == 4.0


class TestVerdict:
    def test_it_follows_from_the_wider_interval(self):
        one = calibrated(with_verdict("coulomb_friction", 100.0, 0.5, 1.0), 0.03)
        assert one.verdict is Verdict.WEAK
        assert one.reason == "with the calibration uncertainty its interval is ±6.1 % of its value"
        assert one.without_calibration.verdict is Verdict.IDENTIFIED

    def test_a_doubt_stays(self):
        one = calibrated(with_verdict("coulomb_friction", 100.0, 0.5, 1.0, "few"), 0.03)
        told = "few; with the calibration uncertainty its interval is ±6.1 % of its value"
        assert (one.verdict, one.reason) == (Verdict.WEAK, told)
        one = calibrated(with_verdict("coulomb_friction", 100.0, 0.5, 1.0, "few"), 0.02)
        assert (one.verdict, one.reason) == (Verdict.WEAK, "few")

    def test_what_the_record_determines_is_not_withheld(self):
        one = calibrated(with_verdict("mass", 100.0, 45.0, 90.0), 0.3)
        assert (one.value, one.verdict) == (100.0, Verdict.WEAK)
        assert one.half_width > 100.0


@pytest.mark.parametrize(
    "one",
    [
        fixed("mass", 1.6),
        not_identifiable("mass", "not seen"),
        with_verdict("mass", 300.0, 400.0, 800.0),
        Parameter("coulomb_friction", 0.0, 1.0, 2.0, Verdict.WEAK),
        Parameter("coulomb_friction", 1.0, math.nan, math.nan, Verdict.WEAK),
        calibrated(with_verdict("mass", 1.0, 0.01, 0.02), 0.1),
    ],
    ids=["given", "withheld", "bounded", "zero", "without", "widened before"],
)
def test_what_it_does_not_touch(one):
    assert calibrated(one, 0.02) is one


def test_nothing_of_nothing():
    one = with_verdict("mass", 1.0, 0.01, 0.02)
    assert calibrated(one, 0.0) is one
    found, told = with_calibration({"mass": one}, {}, IdentificationSettings(), Drive.PRESSURE)
    assert found["mass"] is one
    assert told == {}


PARAMETERS = {
    "coulomb_friction": with_verdict("coulomb_friction", 100.0, 0.5, 1.0),
    "mass": fixed("mass", 1.6),
    "static_friction": not_identifiable("static_friction", "no slip"),
}


class TestBudget:
    def told(self, evidence, **settings):
        given = IdentificationSettings(**settings)
        _, told = with_calibration(PARAMETERS, evidence, given, Drive.PRESSURE)
        return told["uncertainty_budget"]

    def test_it_joins_the_sources_of_the_method(self):
        budget = {name: {"record": 0.4, "timing": 0.3} for name in PARAMETERS}
        told = self.told({"uncertainty_budget": budget}, **AREA)
        assert told["coulomb_friction"] == {"record": 0.4, "timing": 0.3, "calibration": 2.0}
        for name in ("mass", "static_friction"):
            assert told[name]["calibration"] == 0.0

    def test_it_is_told_where_it_is_zero(self):
        budget = {"coulomb_friction": {"record": 0.4}}
        told = self.told({"uncertainty_budget": budget})
        assert told == {"coulomb_friction": {"record": 0.4, "calibration": 0.0}}

    def test_a_method_without_one_gets_one(self):
        assert self.told({"sigma": 1.0}, **AREA) == {
            "coulomb_friction": {"record": 0.5, "calibration": 2.0}
        }


@pytest.mark.parametrize("name", [*CALIBRATION])
@pytest.mark.parametrize("impossible", [-0.01, 0.5, 2.0, float("nan"), float("inf")])
def test_impossible(name, impossible):
    with pytest.raises(ValueError, match=rf"^{name} must be .* a share, 0.02 for 2 %$"):
        IdentificationSettings(**{name: impossible})


def of_mean(signal, block):
    """The covariance of θ in Σ (θ − y) = 0, whose root is the mean."""
    return block_covariance(np.ones((signal.size, 1)), signal.mean() - signal, block)


class TestBlocks:
    SIZE = 200_000
    BLOCK = 1000

    def variance_of_mean(self, signal):
        return float(of_mean(signal, self.BLOCK).matrix[0, 0])

    def noise(self):
        return np.random.default_rng(0).standard_normal(self.SIZE)

    @property
    def tolerance(self):
        """A variance from 200 blocks errs by √(2/200); three of these."""
        return 3 * math.sqrt(2 * self.BLOCK / self.SIZE)

    @pytest.mark.parametrize("memory", [0.0, 0.5, 0.9, 0.98])
    def test_mean_of_an_autoregression(self, memory):
        """Var = σ²/(n·(1 − φ)²); the textbook's σ_y²/n is 99 times too small at φ = 0.98."""
        signal = lfilter([1.0], [1.0, -memory], self.noise())
        expected = 1 / (self.SIZE * (1 - memory) ** 2)
        # A block forgets what came before it within 1/(1 − φ) samples.
        edges = 1 / (1 - memory) / self.BLOCK
        assert self.variance_of_mean(signal) == pytest.approx(expected, rel=self.tolerance + edges)

    @pytest.mark.parametrize("weight", [-0.5, 1.0])
    def test_mean_of_a_moving_average(self, weight):
        signal = lfilter([1.0, weight], [1.0], self.noise())
        expected = (1 + weight) ** 2 / self.SIZE
        assert self.variance_of_mean(signal) == pytest.approx(expected, rel=self.tolerance)


class TestBlocksOfLeastSquares:
    """A regression of unequal strokes, with the whole matrices written out."""

    SAMPLES, FREE, BLOCKS = 80, 3, 8
    LENGTH = SAMPLES // BLOCKS
    TREND = np.linspace(0.2, 2.0, SAMPLES)[:, None]
    SLOPE = TREND * np.random.default_rng(3).standard_normal((SAMPLES, FREE))
    INVERSE = np.linalg.inv(SLOPE.T @ SLOPE)
    RESIDUAL_OF = np.eye(SAMPLES) - SLOPE @ INVERSE @ SLOPE.T
    GRADIENT = np.array([1.0, -2.0, 0.5])

    def covariance(self, noise):
        return block_covariance(self.SLOPE, self.RESIDUAL_OF @ noise, self.LENGTH)

    def maps(self):
        """For each block the matrix that makes its contribution from the noise, (b, p, n)."""
        maps = []
        for block in range(self.BLOCKS):
            rows = slice(block * self.LENGTH, (block + 1) * self.LENGTH)
            left = self.RESIDUAL_OF[rows, rows]
            undone = np.linalg.inv(sqrtm(left))
            maps.append(self.INVERSE @ self.SLOPE[rows].T @ undone @ self.RESIDUAL_OF[rows])
        return np.array(maps)

    def test_contributions(self):
        noise = np.random.default_rng(4).standard_normal(self.SAMPLES)
        expected = self.maps() @ noise
        np.testing.assert_allclose(self.covariance(noise).contributions, expected, rtol=1e-9)

    def test_unbiased_where_the_noise_is_white(self):
        """The mean over all white noise, by its unit vectors, is σ²·(SᵀS)⁻¹."""
        mean = sum(self.covariance(unit).matrix for unit in np.eye(self.SAMPLES))
        np.testing.assert_allclose(mean, self.INVERSE, rtol=1e-9)

    def test_freedom_is_satterthwaite_s(self):
        """2·mean²/variance of the sum of squares Σ (gᵀL_b·e)² over white Gaussian e."""
        rows = np.einsum("p,bpn->bn", self.GRADIENT, self.maps())
        moments = rows @ rows.T
        expected = np.trace(moments) ** 2 / np.sum(moments**2)
        noise = np.random.default_rng(5).standard_normal(self.SAMPLES)
        assert self.covariance(noise).freedom(self.GRADIENT) == pytest.approx(expected, rel=1e-9)
        assert 1 < expected < self.BLOCKS - 1

    def test_standard_error_is_that_of_the_matrix(self):
        covariance = self.covariance(np.random.default_rng(6).standard_normal(self.SAMPLES))
        variance = self.GRADIENT @ covariance.matrix @ self.GRADIENT
        error = covariance.standard_error(self.GRADIENT)
        assert error == pytest.approx(math.sqrt(variance), rel=1e-12)
        expected = half_width(error, covariance.freedom(self.GRADIENT))
        assert covariance.half_width(self.GRADIENT) == expected

    def test_intervals_cover(self):
        """Of 2000 white noises 95 % are covered, within three standard deviations of that count."""
        generator = np.random.default_rng(7)
        covered = 0
        for _ in range(2000):
            noise = generator.standard_normal(self.SAMPLES)
            error = self.GRADIENT @ self.INVERSE @ self.SLOPE.T @ noise
            covered += abs(error) <= self.covariance(noise).half_width(self.GRADIENT)
        assert covered / 2000 == pytest.approx(0.95, abs=3 * math.sqrt(0.95 * 0.05 / 2000))


def test_equal_blocks_of_a_mean_have_one_freedom_less_than_there_are():
    signal = np.random.default_rng(8).standard_normal(240)
    for block, blocks in ((30, 8), (20, 12), (240, 8)):  # at least 8
        assert of_mean(signal, block).freedom(np.ones(1)) == pytest.approx(blocks - 1, rel=1e-9)


def test_a_record_of_few_samples_has_a_block_for_each():
    signal = np.array([1.0, 3.0, 2.0, 7.0, 5.0])
    covariance = of_mean(signal, 30)
    assert covariance.freedom(np.ones(1)) == pytest.approx(4.0, rel=1e-9)
    assert covariance.matrix[0, 0] == pytest.approx(np.var(signal, ddof=1) / 5, rel=1e-9)


def test_a_block_with_nearly_all_the_information_counts_as_if_with_95_percent():
    """By hand for one coordinate: g_b = s_b / (A·√(1 − min(H_b, 0.95)))."""
    slope = np.array([30.0, *[1.0] * 7])
    residual = np.array([0.1, 3.0, -1.0, -2.0, 4.0, -3.0, 0.0, -2.0])
    shares = np.minimum(slope**2 / (slope @ slope), 0.95)
    assert shares[0] == 0.95
    expected = slope * residual / (slope @ slope) / np.sqrt(1 - shares)
    found = block_covariance(slope[:, None], residual, 1)
    np.testing.assert_allclose(found.contributions[:, 0], expected, rtol=1e-9)


def random_regression(samples, free, seed):
    generator = np.random.default_rng(seed)
    return generator.standard_normal((samples, free)), generator.standard_normal(samples)


@given(scales=st.lists(st.floats(1e-6, 1e6), min_size=3, max_size=3))
def test_units_of_the_parameters_do_not_matter(scales):
    (slope, residual), units = random_regression(90, 3, 5), np.array(scales)
    plain = block_covariance(slope, residual, 9).matrix
    scaled = block_covariance(slope / units, residual, 9).matrix
    np.testing.assert_allclose(scaled / np.outer(units, units), plain, rtol=1e-9)


def test_unknown_where_the_regression_is_singular_or_the_record_too_short():
    slope, _ = random_regression(50, 2, 6)
    for singular in (slope[:, [0, 0]], slope * [1.0, 0.0], slope[:2]):
        covariance = block_covariance(singular, np.ones(len(singular)), 5)
        assert np.isnan(covariance.matrix).all()
        assert np.isnan(covariance.half_width(np.ones(2)))
        assert np.isnan(covariance.freedom(np.ones(2)))


def test_half_width_is_students():
    """Tabulated quantiles at 97.5 %."""
    for freedom, quantile in ((1, 12.7062), (5, 2.57058), (10, 2.22814), (10**7, 1.95996)):
        assert half_width(2.0, freedom) == pytest.approx(2 * quantile, rel=1e-5)


def test_stroke_length_between_reversals():
    """Up, rest, down, up: 4 stretches but 3 strokes; a rest is no reversal."""
    moves = np.concatenate([np.ones(30), np.zeros(30), np.ones(10), -np.ones(20), np.ones(29)])
    simulated = np.concatenate([[0.0], np.cumsum(moves)])
    assert stroke_length(simulated) == 120 // 3
    assert stroke_length(simulated[:-1]) == 119 // 3
    assert stroke_length(np.zeros(50)) == 50
