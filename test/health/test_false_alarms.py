# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Noisy records of an unchanged valve and of a tightened one, against a noisy baseline."""

from dataclasses import replace

import pytest

from valve_friction_ros.health import Baseline, FrictionLimits, Level, diagnose
from valve_friction_ros.identification import IdentificationSettings, identify_bench
from valve_friction_ros.model import BENCH_VALVE, SensorNoise

SETTINGS = IdentificationSettings(assumed_mass=1.6)
SEEDS = range(40)


def assessed(record, seed):
    noise = SensorNoise(28.6e-6, 165.0, seed)
    return identify_bench(noise.applied_to(record), BENCH_VALVE, SETTINGS)


@pytest.fixture(scope="module")
def unchanged(loose_record):
    return [assessed(loose_record, seed) for seed in SEEDS]


@pytest.fixture(scope="module")
def pairs(unchanged):
    """Each result with the baseline that the one before it makes."""
    return [
        (now, Baseline.of(before))
        for now, before in zip(unchanged, unchanged[-1:] + unchanged, strict=False)
    ]


def test_an_unchanged_valve_raises_none(pairs):
    levels = [diagnose(now, BENCH_VALVE, baseline).level for now, baseline in pairs]
    assert levels == [Level.OK] * len(SEEDS)


def test_nor_where_the_limits_are_as_narrow_as_the_scatter(pairs):
    """The ratios of F_c alone would pass these limits again and again: intervals hold them back.

    At one standard deviation of the ratio, an unchanged valve passes with its whole interval,
    beyond 1 + 1.96 of them, once in 300 times.
    """
    limits = FrictionLimits(warn_ratio=1.006, error_ratio=1.02, low_ratio=1 / 1.006)
    found = [
        diagnose(now, BENCH_VALVE, replace(baseline, sliding=None), limits)
        for now, baseline in pairs
    ]
    beyond = [
        one for one in found if not limits.low_warn_ratio < one.ratio.value < limits.warn_ratio
    ]
    assert len(beyond) > len(SEEDS) / 5
    assert [one.state.side for one in found] == [None] * len(SEEDS)
    assert all(one.state.is_uncertain for one in beyond)


def test_the_intervals_are_no_wider_than_they_must_be(pairs):
    """A limit 5 % away would be seen: no interval hides a change of that size."""
    for now, baseline in pairs:
        ratio = diagnose(now, BENCH_VALVE, baseline).ratio
        assert 0.95 < ratio.low < ratio.high < 1.05


def test_friction_grown_by_half_is_always_seen(tight_record, unchanged):
    for seed, before in zip(range(100, 108), unchanged, strict=False):
        found = diagnose(assessed(tight_record, seed), BENCH_VALVE, Baseline.of(before))
        assert found.level == Level.WARN
        assert found.message.startswith("friction has grown: ")
