# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A first survey says good, watch or bad where the interval does."""

import pytest
from records import quick_record

from valve_friction_ros.health import Survey, SurveyLimits, diagnose, surveyed
from valve_friction_ros.health.diagnosis import survey_of
from valve_friction_ros.health.survey import PACKING_LIMITS
from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION
from valve_friction_ros.settings import PACKINGS
from valve_friction_ros.wording import Code

NAN = float("nan")


@pytest.mark.parametrize(
    ("band", "half_width", "expected"),
    [
        (0.05, 0.01, Survey.GOOD),
        (0.05, 0.06, Survey.WATCH),
        (0.15, 0.01, Survey.WATCH),
        (0.21, 0.005, Survey.BAD),
        (0.21, 0.05, Survey.WATCH),
        (0.15, 0.10, Survey.UNKNOWN),
        (NAN, NAN, Survey.UNKNOWN),
    ],
)
def test_the_interval_decides(band, half_width, expected):
    assert surveyed(band, half_width) is expected


def test_a_packing_has_limits_which_may_be_stated():
    assert tuple(PACKING_LIMITS) == PACKINGS
    assert SurveyLimits.of_packing() == SurveyLimits() == SurveyLimits(0.10, 0.20)
    assert SurveyLimits.of_packing("graphite") == SurveyLimits(0.15, 0.30)
    assert SurveyLimits.of_packing("graphite", bad=0.5) == SurveyLimits(0.15, 0.5)
    with pytest.raises(ValueError, match="packing must be ptfe or graphite, got 'felt'"):
        SurveyLimits.of_packing("felt")
    with pytest.raises(ValueError, match=r"survey_bad, got survey_watch 0\.25, survey_bad 0\.2"):
        SurveyLimits.of_packing(watch=0.25)


def test_limits_are_in_order():
    with pytest.raises(ValueError, match="0 < survey_watch < survey_bad"):
        SurveyLimits(0.2, 0.1)


@pytest.mark.parametrize(
    ("packing", "expected", "words"),
    [((), Survey.GOOD, ": good, by"), ((HIGH_FRICTION,), Survey.BAD, ": bad, by")],
)
def test_the_packings_of_the_paper(packing, expected, words):
    """(F_c + F_s)/(k·travel): 2·152.7/5858 = 5.2 % of the one, 2·606/5858 = 20.7 % of the other."""
    result = identify(quick_record(*packing), BENCH_VALVE)
    assert survey_of(result, BENCH_VALVE) is expected
    found = diagnose(result, BENCH_VALVE)
    assert (found.survey, found.statement.code) == (expected, Code.NO_BASELINE)
    assert words in found.message
    assert found.to_dict()["survey"] == expected.value
