# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Static friction (9) from given breakaways, and the warnings of an estimate, word by word."""

from dataclasses import replace

import numpy as np
import pytest

from valve_friction_ros.identification import IdentificationSettings, published_estimate
from valve_friction_ros.identification.published import identify
from valve_friction_ros.identification.published.identify import Breakaway
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, Recording, SineWave, SquareWave

VALUES = {"coulomb_friction": 3.0, "spring_constant": 10.0, "spring_preload": 1.0}


@pytest.fixture
def static_friction(monkeypatch):
    """Function of breakaways: F_s from a force of 10, 20, … N at 0, 1, … m, and the warnings."""

    def found(*breakaways, **values):
        monkeypatch.setattr(identify, "find_breakaways", lambda *_: list(breakaways))
        record = Recording(1.0, np.zeros(5), np.arange(5.0))
        force, warnings = np.array([10.0, 20.0, 30.0, 10.0, 90.0]), []
        settings = IdentificationSettings()
        value = identify._static_friction(record, force, settings, VALUES | values, warnings)
        return value, warnings

    return found


class TestStaticFriction:
    """Pulls less spring and preload: 9, 9, 9, −21 and 49 N."""

    def test_is_the_median(self, static_friction):
        assert static_friction(Breakaway(1, 1)) == (9.0, [])
        assert static_friction(Breakaway(1, 1), Breakaway(3, -1), Breakaway(4, 1)) == (21.0, [])

    def test_is_not_below_the_coulomb_friction(self, static_friction):
        assert static_friction(Breakaway(1, -1)) == (3.0, [])
        assert static_friction(Breakaway(1, 1), coulomb_friction=9.5) == (9.5, [])

    def test_without_a_breakaway_it_is_the_coulomb_friction(self, static_friction):
        value, (warning,) = static_friction()
        assert value == 3.0
        assert warning == (
            "the record shows no breakaway from rest: static_friction is set to coulomb_friction"
        )


def test_an_assumed_mass(bench_record):
    """The reason in brackets is tested with the mass."""
    settings = IdentificationSettings(assumed_mass=1 / 3)
    estimate = published_estimate(bench_record("low", SquareWave(), 20.8), BENCH_VALVE, settings)
    (warning,) = estimate.warnings
    assert warning.startswith("the record does not determine the mass (")
    assert warning.endswith("): 0.333333 kg is assumed")


def test_negative_values_but_for_a_preload(bench_record):
    """An inverted position; a viscous friction of zero is not negative."""
    record = bench_record("low", SineWave(), 71.0)
    settings = IdentificationSettings(
        fixed={"mass": 1.5, "viscous_friction": 0.0}, position_bias=1e-3
    )
    turned = replace(record, position=-record.position)
    estimate = published_estimate(turned, BENCH_VALVE, settings)
    values = estimate.values
    assert {name for name, value in values.items() if value < 0} == {
        "coulomb_friction",
        "spring_constant",
        "spring_preload",
        "static_friction",  # the larger of a negative pull and a negative F_c
    }
    expected = {
        f"{name} is negative ({values[name]:.4g}): the model does not fit this record"
        for name in ("coulomb_friction", "spring_constant")
    }
    assert {one for one in estimate.warnings if "negative" in one} == expected


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_given_static_friction_below_the_coulomb_friction(bench_record, share):
    given = share * LOW_FRICTION.coulomb_friction
    settings = IdentificationSettings(fixed={"static_friction": given})
    estimate = published_estimate(bench_record("low", SineWave(), 71.0), BENCH_VALVE, settings)
    assert estimate.static_friction == given
    expected = (
        "the fixed static_friction (137.4 N) lies below the identified coulomb_friction "
        f"({estimate.coulomb_friction:.4g} N)"
    )
    assert estimate.warnings == ((expected,) if share < 1 else ())


def test_a_static_friction_that_equals_the_coulomb_friction(bench_record):
    fixed = {"static_friction": 150.0, "coulomb_friction": 150.0}
    settings = IdentificationSettings(fixed=fixed)
    estimate = published_estimate(bench_record("low", SineWave(), 71.0), BENCH_VALVE, settings)
    assert not any("lies below" in warning for warning in estimate.warnings)
