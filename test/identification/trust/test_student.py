# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Student's t without scipy, beside scipy's."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import stdtrit

from valve_friction_ros.identification.trust.uncertainty import student_quantile


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
