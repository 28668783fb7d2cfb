# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A history of many valves, as a year of weekly identifications leaves it."""

import math
import random
import time
from pathlib import Path

from benchmark.load.plant import identifier_of, ratio_of, tag_of
from valve_friction_ros.health import (
    AlarmKind,
    Baseline,
    Condition,
    Diagnosis,
    FrictionLimits,
    Level,
    MonitorSettings,
    StatusSignal,
    compared,
)
from valve_friction_ros.history import HistoryEntry, HistoryFile, KeptValve, follow_alarms
from valve_friction_ros.history.database import writing
from valve_friction_ros.history.entry import Fit, Span, settings_text
from valve_friction_ros.history.rows import insert_entry, valve_id
from valve_friction_ros.identification import Parameter, Verdict
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.streams import DAY
from valve_friction_ros.wording import quoted

_EVERY = 7 * DAY
_GROWN = Condition(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown")
_SETTINGS = settings_text(MonitorSettings(BENCH_VALVE))


def _parameter(name: str, value: float, share: float = 0.02) -> Parameter:
    half_width = share * value
    return Parameter(name, value, half_width / 2, half_width, Verdict.IDENTIFIED, "")


def _entry(
    valve: KeptValve, baseline: Baseline | None, friction: float, stamp: int
) -> HistoryEntry:
    parameters = {
        "mass": Parameter("mass", 1.6, 0.0, 0.0, Verdict.FIXED, "assumed"),
        "viscous_friction": _parameter("viscous_friction", 5300.0),
        "coulomb_friction": _parameter("coulomb_friction", friction),
        "spring_constant": _parameter("spring_constant", 2.05e5),
        "spring_preload": _parameter("spring_preload", 231.0),
    }
    found = None if baseline is None else compared(parameters, math.nan, baseline)
    words = "friction normal: the stem ignores reversals smaller than 9 % of its travel"
    return HistoryEntry(
        time=stamp,
        valve=valve,
        span=Span(stamp - 60_000_000_000, stamp),
        method="plant",
        diagnosis=Diagnosis(Level.OK, StatusSignal.GOOD, quoted(words), found and found.ratio),
        limits=FrictionLimits(),
        baseline=baseline,
        settings=_SETTINGS,
        parameters=parameters,
        fit=Fit(0.99, 1e-5, 1e-6),
    )


def write_history(path: Path, valves: int, weeks: int = 52) -> None:
    """Write a file of histories of valves, an identification a week and an alarm each."""
    now = time.time_ns()
    with writing(path) as connection:
        for index in range(valves):
            chance = random.Random(index)
            valve = KeptValve(identifier_of(index), tag_of(index))
            number, healthy = valve_id(connection, valve), chance.uniform(150, 900)
            ratio = ratio_of(index)
            baseline = None if ratio is None else Baseline(healthy, 0.02 * healthy)
            change = (ratio or 1.0) - 1
            for week in range(weeks):
                share = max(0.0, 2 * week / weeks - 1)
                friction = healthy * (1 + change * share) * chance.gauss(1.0, 0.01)
                stamp = now - (weeks - week) * _EVERY
                insert_entry(connection, number, _entry(valve, baseline, friction, stamp))
    for index in range(valves):
        valve = KeptValve(identifier_of(index), tag_of(index))
        follow_alarms(HistoryFile(path), valve, {AlarmKind.FRICTION_HIGH: _GROWN}, now)
