# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Verdicts by the width of an interval, and what widths, misfits and limits are made of."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import stdtrit

from valve_friction_ros.identification import Parameter, Verdict
from valve_friction_ros.identification.trust.misfit import Misfit, stem_distance
from valve_friction_ros.identification.trust.uncertainty import jackknife, student_quantile
from valve_friction_ros.identification.trust.verdict import (
    FALL_SPEED,
    fixed,
    not_identifiable,
    with_verdict,
)
from valve_friction_ros.model import Valve
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


def test_weak_says_how_wide():
    assert with_verdict("mass", 100.0, 1.0, 12.0).reason == "its interval is ±12 % of its value"
    assert with_verdict("mass", 100.0, 1.0, 99.0).reason == "its interval is ±99 % of its value"


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


def test_a_wide_interval_says_so():
    assert with_verdict("mass", 1.0, 1.0, 1.0).reason == "its interval is wider than its value"


@pytest.mark.parametrize("width", [2.0, 20.0])
def test_a_verdict_passes_its_number_on(width):
    found = with_verdict("mass", 100.0, 1.0, width)
    assert (found.name, found.value, found.standard_error) == ("mass", 100.0, 1.0)
    assert found.interval == (100.0 - width, 100.0 + width)


def test_what_is_withheld_keeps_its_name():
    assert (
        not_identifiable("mass", "why").name == with_verdict("mass", 1.0, 1.0, 2.0).name == "mass"
    )


@given(
    st.one_of(st.integers(1, 2000), st.floats(1.0, 1e6)),
    st.floats(0.6, 1 - 1e-7),
)
def test_it_is_that_of_scipy(freedom, probability):
    assert student_quantile(probability, freedom) == pytest.approx(
        stdtrit(freedom, probability), rel=1e-7
    )


@pytest.mark.parametrize(
    ("freedom", "quantile"), [(1, 12.706), (2, 4.303), (5, 2.571), (30, 2.042), (120, 1.980)]
)
def test_the_printed_tables(freedom, quantile):
    assert student_quantile(0.975, freedom) == pytest.approx(quantile, abs=5e-4)


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
    assert stem_distance(28.6e-6, Valve(0.0445)) == "28.6 µm rms from the measured stem"
    short = Valve(0.0445, travel=0.0286)
    assert stem_distance(28.6e-6, short) == "28.6 µm rms from the measured stem, 0.1 % of travel"
    assert stem_distance(0.12345, Valve(0.0445)) == "1.23e+05 µm rms from the measured stem"


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
