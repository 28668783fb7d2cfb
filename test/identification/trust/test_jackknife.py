# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Standard errors that are known without leaving anything out."""

import math

import numpy as np
import pytest

from valve_friction_ros.identification.trust.uncertainty import jackknife

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
