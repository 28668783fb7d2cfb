# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The benchmark of valves in service: its simulation, and what its tables count."""

import io
import math
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from benchmark.service.course import Task
from benchmark.service.plants import PLANTS, Duty, valve_of
from benchmark.service.report import bounds_met, tables
from benchmark.service.service import stretches
from benchmark.service.trial import Number, Told, tried


def told(course="steady", **changes):
    numbers = [
        Number(name, 100.0, 104.0, 5.0)
        for name in ("sliding_friction", "static_friction", "dead_band")
    ]
    task = Task("high", 12, 0, course)
    return replace(
        Told(task, numbers, declared=0.5, alarmed=0.8, alarmed_by_reference=0.8, late=numbers),
        **changes,
    )


def judged(*some):
    out = io.StringIO()
    met = bounds_met(some, Console(file=out, width=150))
    return met, out.getvalue()


def test_a_good_outcome_meets_the_bounds():
    met, text = judged(told(), told("step"))
    assert met, text
    assert all(table.row_count for table in tables([told(), told("step"), told("slow")]))


@pytest.mark.parametrize(
    ("outcome", "words"),
    [
        (told(changes=1), "no false declaration"),
        (told(alarms=1), "no false declaration"),
        (told("step", declared=1.17), "declared within one hour"),
        (told("step", declared=math.nan), "declared within one hour"),
        (told("step", alarmed=math.nan), "alarmed within one hour"),
        (told("slow", alarmed_by_reference=math.nan), "slowly alarmed within one hour"),
        (told("weeks", alarmed_by_reference=math.nan), "slowly alarmed within one hour"),
        (told(numbers=[Number("sliding_friction", 100.0, 111.0, 20.0)]), "friction within 10 %"),
        (told(numbers=[Number("sliding_friction", 100.0, math.nan, 1.0)]), "friction within 10 %"),
        (told(numbers=[Number("dead_band", 100.0, 88.0, 20.0)]), "dead band within 10 %"),
        (told(numbers=[Number("static_friction", 100.0, 105.0, 4.0)]), "inside their intervals"),
    ],
)
def test_a_bad_one_misses_its_bound(outcome, words):
    met, text = judged(told(), told("step"), outcome)
    assert not met
    assert any(line.startswith("MISSED") and words in line for line in text.splitlines())


def test_coverage_is_bound_for_each_valve():
    """Four hours of one valve outside, among a hundred of another inside."""
    outside = [Number("static_friction", 100.0, 105.0, 4.0)] * 4
    inside = [Number("static_friction", 100.0, 104.0, 5.0)] * 100
    poor = replace(told(), task=Task("low", 12, 0, "steady"), numbers=[*told().numbers, *outside])
    met, text = judged(told(), told("step"), told(numbers=[*told().numbers, *inside]), poor)
    assert not met
    assert "MISSED at least 95 % inside their intervals, of each valve" in text
    assert "met    at least 95 % inside their intervals, of each number" in text


@pytest.mark.slow
def test_an_hour_of_one_valve():
    found = tried(Task("high", 1, 5, "steady"))
    assert (found.changes, found.alarms) == (0, 0)
    assert math.isnan(found.alarmed_by_reference)
    sliding = found.numbers[0]
    assert abs(sliding.value - sliding.truth) <= sliding.half_width < 0.2 * sliding.truth


def test_the_stem_follows_its_set_points_and_friction_is_that_of_the_plant():
    valve = PLANTS["high"]
    duty = Duty()
    (first, second) = stretches(valve, 1 / 3, 1, lambda _: 1.0, lambda _: 0.0, lambda _: duty)
    friction = valve.plant.friction
    for stretch in (first, second):
        mean = stretch.work / stretch.distance
        assert friction.coulomb < mean < friction.coulomb + 5e-3 * friction.viscous
        assert stretch.stamps[0].size == stretch.position.size == 24_000
        assert np.ptp(stretch.position) > 2 * duty.step * valve.plant.body.travel
    assert second.stamps[0][0] - first.stamps[0][-1] == pytest.approx(25e6, abs=1)


def test_a_stem_at_rest_moves_as_in_small_steps():
    """The rest is passed over at once; a step that is never longer than the rest must agree."""
    valve = replace(PLANTS["high"], step=2e-4)
    constant = (lambda _: 1.0, lambda _: 0.0, lambda _: Duty())
    (first,) = stretches(valve, 1 / 6, 1, *constant)
    (fine,) = stretches(replace(valve, step=2e-5), 1 / 6, 1, *constant)
    assert first.work / first.distance == pytest.approx(fine.work / fine.distance, rel=1e-3)
    assert np.percentile(np.abs(first.position - fine.position), 99) < 100e-6


def test_a_drawn_valve_is_that_of_its_number():
    assert valve_of("drawn 3") == valve_of("drawn 3") != valve_of("drawn 4")
    assert valve_of("high") is PLANTS["high"]
