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
from scipy.special import stdtrit

from valve_friction_ros.identification import (
    CALIBRATION,
    PARAMETER_UNITS,
    IdentificationSettings,
    Parameter,
    Verdict,
)
from valve_friction_ros.identification.trust.uncertainty import (
    half_width,
    jackknife,
    student_quantile,
)
from valve_friction_ros.identification.trust.verdict import (
    FALL_SPEED,
    Misfit,
    calibrated,
    calibration_share,
    fixed,
    not_identifiable,
    stem_distance,
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


@given(
    st.one_of(st.integers(1, 2000), st.floats(1.0, 1e6)),
    st.floats(0.6, 1 - 1e-7),
)
def test_it_is_that_of_scipy(freedom, probability):
    assert student_quantile(probability, freedom) == pytest.approx(
        stdtrit(freedom, probability), rel=1e-7
    )


def test_independent_groups_add_in_squares():
    def difference(groups):
        return {"difference": float(np.mean(groups[1]) - np.mean(groups[0]))}

    found = jackknife([[1.0, 2.0, 6.0], [10.0, 14.0]], difference)
    assert found.values["difference"] == 9.0
    assert found.standard_errors["difference"] == pytest.approx(math.sqrt(7 / 3 + 8 / 2))
    assert found.freedom == 3


def test_one_alone_has_no_scatter():
    found = jackknife([[1.0, 2.0], [3.0]], lambda groups: {"sum": sum(map(sum, groups))})
    assert found.values["sum"] == 6.0
    assert math.isnan(found.standard_errors["sum"])


def misfit(fit=1.0, systematic=5.0):
    return Misfit(fit, rms=9.0, systematic=systematic, tolerated=4.0)


@pytest.mark.parametrize(
    ("fit", "systematic", "gross"),
    [(0.9, 5.0, False), (0.899, 5.0, True), (0.899, 4.0, False), (0.95, 4.0, False)],
)
def test_gross_is_a_tenth_of_the_movement_that_noise_does_not_explain(fit, systematic, gross):
    assert misfit(fit, systematic).is_gross is gross
    assert misfit(fit, systematic).describes is (systematic <= 4.0)


def test_distance_of_the_stem_in_words():
    assert stem_distance(28.6e-6, Valve(0.0445)) == "29 µm rms"
    short = Valve(0.0445, travel=0.0286)
    assert stem_distance(28.6e-6, short) == "29 µm rms, 0.1 % of travel"
    assert stem_distance(0.12345, Valve(0.0445)) == "123450 µm rms"


def test_percentages_for_people():
    shares = (0.00123, 0.0567, 0.994, 0.995, 1.0, 2.34)
    words = ("0.12 %", "5.7 %", "99 %", "100 %", "100 %", "234 %")
    assert (*map(percentage, shares),) == words


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

    negative = with_verdict("spring_preload", -100.0, 0.0, 0.0)
    assert calibrated(negative, 0.02).half_width == 4.0


@pytest.mark.parametrize("doubt", ["", "few"])
def test_the_verdict_follows_from_the_wider_interval_and_a_doubt_stays(doubt):
    narrow = with_verdict("coulomb_friction", 100.0, 0.5, 1.0, doubt)
    one = calibrated(narrow, 0.03)
    told = "with the calibration uncertainty its interval is ±6.1 % of its value"
    assert one.verdict is Verdict.WEAK
    assert one.reason == "; ".join(filter(None, [doubt, told]))
    assert one.without_calibration == narrow
    assert calibrated(narrow, 0.02).reason == doubt


def test_what_the_record_determines_is_not_withheld():
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

    def test_a_method_without_one_gets_one(self):
        assert self.told({"sigma": 1.0}, **AREA) == {
            "coulomb_friction": {"record": 0.5, "calibration": 2.0}
        }


@pytest.mark.parametrize("name", [*CALIBRATION])
@pytest.mark.parametrize("impossible", [-0.01, 0.5, 2.0, float("nan"), float("inf")])
def test_impossible(name, impossible):
    with pytest.raises(ValueError, match=rf"^{name} must be .* a share, 0.02 for 2 %$"):
        IdentificationSettings(**{name: impossible})


def test_half_width_is_students():
    """Tabulated quantiles at 97.5 %."""
    for freedom, quantile in ((1, 12.7062), (5, 2.57058), (10, 2.22814), (10**7, 1.95996)):
        assert half_width(2.0, freedom) == pytest.approx(2 * quantile, rel=1e-5)
