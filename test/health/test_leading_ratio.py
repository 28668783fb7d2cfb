# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The friction ratio that goes with a level is of what the level rests on."""

import math

import pytest

from valve_friction_ros.health import (
    Diagnosis,
    Finding,
    Level,
    Ratio,
    StatusSignal,
    leading_ratio,
)
from valve_friction_ros.wording import quoted

MOVES, IDENTIFIED = 2.4, 1.1


def by_moves(level, leads):
    return Finding(
        level, StatusSignal.FAILURE, quoted("by moves"), leads=leads, friction_ratio=MOVES
    )


SPRING = Finding(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, quoted("the spring"))


@pytest.mark.parametrize(
    ("diagnosed", "findings", "level", "ratio"),
    [
        (Level.OK, [by_moves(Level.ERROR, True)], Level.ERROR, MOVES),
        (Level.ERROR, [by_moves(Level.ERROR, True)], Level.ERROR, MOVES),
        (Level.ERROR, [by_moves(Level.ERROR, False)], Level.ERROR, IDENTIFIED),
        (Level.OK, [by_moves(Level.ERROR, False)], Level.ERROR, MOVES),
        (Level.WARN, [SPRING], Level.WARN, IDENTIFIED),
        (Level.OK, [SPRING], Level.WARN, math.nan),
        (Level.OK, [], Level.OK, IDENTIFIED),
        (Level.OK, [by_moves(Level.WARN, True)], Level.ERROR, math.nan),
    ],
)
def test_the_ratio_of_a_level(diagnosed, findings, level, ratio):
    diagnosis = Diagnosis(
        diagnosed, StatusSignal.GOOD, quoted(""), Ratio.between(IDENTIFIED, 1.0, 1.2)
    )
    assert leading_ratio(diagnosis, findings, level) == pytest.approx(ratio, nan_ok=True)
    without = Diagnosis(diagnosed, StatusSignal.GOOD, quoted(""), None)
    expected = math.nan if ratio == IDENTIFIED else ratio
    if not any(one.level == level and one.friction_ratio == MOVES for one in findings):
        assert leading_ratio(without, findings, level) == pytest.approx(expected, nan_ok=True)
