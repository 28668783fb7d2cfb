"""Limits that all methods share."""

import math

import pytest

from valve_friction_ros.identification import IdentificationSettings
from valve_friction_ros.identification.trust.limits import (
    FALL_SPEED,
    finest_half_share,
    too_few_strokes,
)


@pytest.mark.parametrize("strokes", [0, 2])
def test_too_few_strokes_say_how_many_are_needed(strokes):
    assert too_few_strokes(strokes) == f"only {strokes} strokes: record at least 3, up and down"


def test_three_strokes_are_enough():
    assert too_few_strokes(3) == too_few_strokes(4) == ""


@pytest.mark.parametrize(
    ("name", "bias", "share"),
    [
        ("coulomb_friction", None, 5e-4),
        ("coulomb_friction", 1e-3, 5e-4),
        ("spring_constant", None, 2e-4),
        ("spring_preload", None, 5e-4),
        ("spring_preload", 1e-3, 2e-4),  # the spring constant, times the bias
    ],
)
def test_no_interval_is_finer(name, bias, share):
    assert finest_half_share(name, IdentificationSettings(position_bias=bias)) == share


def test_friction_may_fall_up_to_twice_the_stribeck_velocity_of_graphite():
    """v_s = 3.26 mm/s; exp(−(v/v_s)²) has fallen to e⁻⁴ at twice that."""
    assert math.isclose(FALL_SPEED, 2 * 3.26e-3, rel_tol=0.01)
