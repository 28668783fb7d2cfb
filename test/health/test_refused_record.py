# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a refused record shows of its valve, and what it does not."""

import math
from dataclasses import replace

import numpy as np
import pytest
from records import quick_record, stroked_record

from valve_friction_ros.health import (
    Baseline,
    KnownNumbers,
    MonitorSettings,
    RefusedRecordError,
    identify_snapshot,
    valve_numbers,
)
from valve_friction_ros.health.refused_record import numbers_of_refused
from valve_friction_ros.health.stem_reach import stem_reach
from valve_friction_ros.identification import IdentificationSettings, RefusalError, identify
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION, Recording, SensorNoise, simulate
from valve_friction_ros.streams import RecordBuffer, rows_arrived

TRAVEL = BENCH_VALVE.travel
NOISES = {"drive_noise", "stem_noise"}
ENDS = {"lowest_position", "highest_position"}


def numbers(record, valve=BENCH_VALVE):
    return numbers_of_refused(record, valve, IdentificationSettings())


@pytest.fixture(scope="module")
def healthy():
    record = stroked_record()
    return Baseline(150.0, numbers=valve_numbers(identify(record, BENCH_VALVE)))


@pytest.mark.parametrize("share", [0.09, 0.12, 0.16])
def test_lost_travel(healthy, share):
    record = stroked_record(share * TRAVEL)
    with pytest.raises(RefusalError, match="no friction model reproduces"):
        identify(record, BENCH_VALVE)
    known = KnownNumbers().followed_by(healthy.numbers, 0).followed_by(numbers(record), 1)
    (finding,) = known.findings(healthy, BENCH_VALVE)
    assert "travel is lost at its lower end" in finding.message
    assert known.numbers["lower_stop"].value == pytest.approx(share * TRAVEL, abs=5e-5)
    assert "measured" not in finding.message


@pytest.mark.parametrize(("low", "high"), [(0.1, 0.75), (0.4, 0.6), (0.1, 1.15)])
def test_a_stem_that_turned_before_a_stop_shows_none_there(healthy, low, high):
    found = numbers(stroked_record(low=low, high=high))
    assert "lower_stop" not in found
    assert ("upper_stop" in found) == (high > 1)
    known = KnownNumbers().followed_by(healthy.numbers, 0).followed_by(found, 1)
    assert known.findings(healthy, BENCH_VALVE) == ()


def test_a_noise_that_has_grown(healthy):
    record = SensorNoise(1e-4, 50.0, 2).applied_to(stroked_record(0.16 * TRAVEL))
    known = KnownNumbers().followed_by(healthy.numbers, 0).followed_by(numbers(record), 1)
    messages = [one.message for one in known.findings(healthy, BENCH_VALVE)]
    assert len(messages) == 2
    assert "the noise of the stem position has grown" in messages[1]


@pytest.mark.parametrize(
    ("change", "shown"),
    [
        (lambda one: one, NOISES | ENDS),
        (lambda one: replace(one, position=0.01 + 0 * one.position), NOISES),
        (lambda one: replace(one, position=0.02 - 0.5 * one.position), NOISES),
        (lambda one: replace(one, drive=8e4 + 0 * one.drive), NOISES),
        (lambda one: replace(one, position=1e3 * one.position), set()),
        (lambda one: replace(one, drive=1e3 * one.drive), set()),
        (lambda one: Recording(0.01, 1e6 * one.position, 1e-6 * one.drive), set()),
    ],
)
def test_signals_that_cannot_be_a_valves_show_nothing(change, shown):
    """Unchanged; still; inverted; a still drive; wrong units; swapped."""
    record = SensorNoise(5e-6, 50.0, 3).applied_to(quick_record())
    assert numbers(change(record)).keys() - {"lower_stop", "upper_stop"} == shown


@pytest.mark.parametrize("count", [2, 5, 30, 31, 300])
def test_a_few_samples_of_a_moving_stem_are_too_few(count):
    """As after `clear`, while the stem moves: a refusal, not an error within what it shows."""
    record = quick_record()
    few = Recording(0.01, record.drive[200 : 200 + count], record.position[200 : 200 + count])
    assert numbers(few).keys() <= NOISES
    buffer = RecordBuffer(BENCH_VALVE, 60.0)
    times = 0.01 * np.arange(count)
    buffer.add_arrivals(rows_arrived(np.column_stack((times, few.drive, few.position))))
    with pytest.raises(RefusedRecordError, match=f"too short: {count} samples"):
        identify_snapshot(buffer.snapshot(), MonitorSettings(BENCH_VALVE))


def test_a_stem_that_is_seen_late_meets_no_stop():
    """A lag of 0.3 s lets the pressure rise while the stem seems to rest at its end."""
    record = stroked_record(low=0.1, high=0.75)
    late = Recording(0.01, record.drive[30:], record.position[:-30])
    assert stem_reach(late, BENCH_VALVE, math.nan).keys() == ENDS


def test_a_sticky_stem_meets_no_stop():
    """Its rests show how long it waits: F_s is three times F_c, and each level stops it anew."""
    sticky = replace(HIGH_FRICTION, static_friction=3 * HIGH_FRICTION.coulomb_friction)
    time = np.arange(6000) / 100
    levels = np.random.default_rng(5).uniform(0.15, 0.85, 16)
    pressure = 41_740.0 + 165_100.0 * np.interp(time, 4 * np.arange(16), levels)
    position = simulate(BENCH_VALVE, sticky, pressure, 0.01).position
    found = stem_reach(Recording(0.01, pressure, position), BENCH_VALVE, math.nan)
    assert found.keys() == ENDS
