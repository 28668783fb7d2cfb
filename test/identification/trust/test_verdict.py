# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Verdicts by the width of an interval."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.identification import Parameter, Verdict
from valve_friction_ros.identification.trust.verdict import fixed, not_identifiable, with_verdict


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
