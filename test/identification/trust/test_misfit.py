# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""How far a model is from its record: numbers, limits and words."""

import pytest

from valve_friction_ros.identification.trust.misfit import Misfit, stem_distance
from valve_friction_ros.model import Valve
from valve_friction_ros.wording import percentage


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
