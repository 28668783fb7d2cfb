"""Verdicts at their limits, and what they say."""

import dataclasses
import math

import pytest

from valve_friction_ros.model import BENCH_VALVE, Valve
from valve_friction_ros.monitoring import (
    FrictionLimits,
    Level,
    StatusSignal,
    dead_band,
    diagnose,
    percentage,
)

BASELINE = 128.0


def with_friction(estimate, coulomb, static=None, spring=2e5):
    return dataclasses.replace(
        estimate,
        coulomb_friction=coulomb,
        static_friction=coulomb if static is None else static,
        spring_constant=spring,
    )


class TestDeadBand:
    def test_is_the_smallest_answered_reversal_over_the_travel(self, estimate):
        """(100 + 156 N)/2048 N/m is 0.125 m, a quarter of 0.5 m: exact in binary."""
        assert (
            dead_band(with_friction(estimate, 100.0, 156.0, 2048.0), Valve(1.0, travel=0.5)) == 0.25
        )

    @pytest.mark.parametrize("spring", [0.0, -1.0])
    def test_there_is_none_without_a_spring(self, estimate, spring):
        assert math.isnan(dead_band(with_friction(estimate, 1.0, spring=spring), BENCH_VALVE))

    def test_there_is_no_share_without_stops(self, estimate):
        assert math.isnan(dead_band(with_friction(estimate, 1.0), Valve(1.0)))


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0, "0 %"),
        (0.00123, "0.12 %"),
        (0.052131, "5.2 %"),
        (0.2069, "21 %"),
        (0.994, "99 %"),
        (0.996, "100 %"),
        (1.25, "125 %"),
        (12.0, "1200 %"),
    ],
)
def test_percentage(share, text):
    assert percentage(share) == text


FAILURE = (Level.ERROR, StatusSignal.FAILURE, "excess friction")
MAINTENANCE = (Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown")
NORMAL = (Level.OK, StatusSignal.GOOD, "friction normal")
COLLAPSED = (
    Level.ERROR,
    StatusSignal.OUT_OF_SPECIFICATION,
    "friction collapsed, the packing may leak",
)


class TestLevels:
    @pytest.mark.parametrize(
        ("ratio", "verdict"),
        [
            (50.0, FAILURE),
            (2.0, FAILURE),
            (math.nextafter(2.0, 0), MAINTENANCE),
            (1.5, MAINTENANCE),
            (math.nextafter(1.5, 0), NORMAL),
            (1.0, NORMAL),
            (math.nextafter(0.5, 1), NORMAL),
            (0.5, COLLAPSED),
            (0.0, COLLAPSED),
        ],
    )
    def test_at_and_beside_the_limits(self, estimate, ratio, verdict):
        """The baseline is a power of two, so the ratio comes back as it was."""
        found = diagnose(with_friction(estimate, ratio * BASELINE), BENCH_VALVE, BASELINE)
        level, signal, words = verdict
        assert (found.level, found.status_signal) == (level, signal)
        assert found.ratio == ratio
        compared = f"{words}: coulomb friction is {ratio:.2f} times its baseline; "
        assert found.message.startswith(compared)

    def test_limits_of_the_user(self, estimate):
        limits = FrictionLimits(warn_ratio=1.125, error_ratio=1.25, low_ratio=0.875)
        found = [
            diagnose(with_friction(estimate, ratio * BASELINE), BENCH_VALVE, BASELINE, limits).level
            for ratio in (0.875, 1.0, 1.125, 1.25)
        ]
        assert found == [Level.ERROR, Level.OK, Level.WARN, Level.ERROR]

    def test_numbers_and_letters_of_the_standards(self):
        """diagnostic_msgs counts OK, WARN, ERROR from 0; NE 107 has F, C, S, M."""
        assert [level.value for level in (Level.OK, Level.WARN, Level.ERROR)] == [0, 1, 2]
        assert [signal.value for signal in StatusSignal] == ["", "F", "C", "S", "M"]

    @pytest.mark.parametrize("baseline", [0.0, -1.0, math.nan, math.inf])
    def test_impossible_baseline(self, estimate, baseline):
        with pytest.raises(ValueError, match=r"^baseline must be"):
            diagnose(estimate, BENCH_VALVE, baseline)


class TestWords:
    def test_the_consequence_is_the_dead_band(self, estimate):
        """2·606 N over 2.05e5 N/m and 28.575 mm is 20.69 %."""
        found = diagnose(with_friction(estimate, 606.0, spring=2.05e5), BENCH_VALVE, 152.7)
        assert found.message == (
            "excess friction: coulomb friction is 3.97 times its baseline; "
            "the stem ignores reversals smaller than 21 % of its travel"
        )

    def test_without_a_baseline(self, estimate):
        found = diagnose(with_friction(estimate, 152.7, spring=2.05e5), BENCH_VALVE)
        assert (found.level, found.status_signal, found.ratio) == (
            Level.OK,
            StatusSignal.GOOD,
            None,
        )
        assert found.message == (
            "no baseline yet; the stem ignores reversals smaller than 5.2 % of its travel"
        )

    def test_without_a_travel_the_friction_itself_is_told(self, estimate):
        found = diagnose(with_friction(estimate, 20.3935), Valve(1.0), 20.0)
        assert found.message == (
            "friction normal: coulomb friction is 1.02 times its baseline; coulomb friction 20.39 N"
        )


class TestLimits:
    def test_defaults(self):
        limits = FrictionLimits()
        assert (limits.warn_ratio, limits.error_ratio, limits.low_ratio) == (1.5, 2.0, 0.5)

    @pytest.mark.parametrize(
        "limits",
        [
            {"low_ratio": 0.0},
            {"low_ratio": 1.0},
            {"warn_ratio": 1.0},
            {"warn_ratio": 2.0},
            {"error_ratio": 1.5},
            {"warn_ratio": math.nan},
            {"error_ratio": math.nan},
            {"low_ratio": math.nan},
        ],
    )
    def test_out_of_order(self, limits):
        with pytest.raises(ValueError, match=r"^limits must obey 0 < low_ratio < 1 < warn_ratio <"):
            FrictionLimits(**limits)
