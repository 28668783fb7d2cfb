# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What relative uncertainties of diaphragm area and sensor scales add to an interval."""

import math

import pytest

from valve_friction_ros.identification import (
    CALIBRATION,
    PARAMETER_UNITS,
    IdentificationSettings,
    Parameter,
    Verdict,
)
from valve_friction_ros.identification.trust.calibration import (
    calibrated,
    calibration_share,
    with_calibration,
)
from valve_friction_ros.identification.trust.verdict import fixed, not_identifiable, with_verdict
from valve_friction_ros.model import Drive

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
        assert one.reason == "with the calibration its interval is ±6.1 % of its value"
        assert one.without_calibration.verdict is Verdict.IDENTIFIED

    def test_a_doubt_stays(self):
        one = calibrated(with_verdict("coulomb_friction", 100.0, 0.5, 1.0, "few"), 0.03)
        told = "few; with the calibration its interval is ±6.1 % of its value"
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
