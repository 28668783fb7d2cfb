# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A history with rows in each of its tables, as a plant of two valves would have them."""

from dataclasses import fields
from pathlib import Path

import numpy as np
from histories import DAY, OTHER, SECOND, START, VALVE, refused, success

from valve_friction_ros import history as kept
from valve_friction_ros.evidence import FrictionChange, Move
from valve_friction_ros.health import (
    AlarmAction,
    AlarmKind,
    AlarmRequest,
    Baseline,
    Condition,
    Level,
    Measured,
    Reference,
    SlidingFriction,
    StatusSignal,
)
from valve_friction_ros.history import AlarmFilter, AlarmRecording, KeptBaseline
from valve_friction_ros.model import BENCH_VALVE, Recording, Valve
from valve_friction_ros.response import StepAnswer
from valve_friction_ros.usage import BINS, Usage, UsedDay

BUILT = Valve(diaphragm_area=0.0445, pressure_reference=41_740.0, travel=0.03)
SLIDING = SlidingFriction(205.5, 3.25, 9.5e-3)
NUMBERS = {"spring_constant": Measured(2.05e5, 40.0), "lag": Measured(-0.002, 0.003)}


def answer(place, dead_time=0.25, **changes):
    flags = {one.name: True for one in fields(StepAnswer) if one.type in (bool, "bool")}
    numbers = {one.name: 0.125 for one in fields(StepAnswer) if one.name not in flags}
    own = {"stamp": START + place * SECOND, "dead_time": dead_time}
    return StepAnswer(**{**numbers, **flags, **own, **changes})


def service_move(number):
    begin = START + 12 * SECOND * number
    onset = (500.0, 1e-3, 20.0) if number % 2 else ()
    return Move(begin, begin + SECOND, 1e-3, 2e-3, 500.0 + number, 10.0, 1e-3, *onset)


def usage(distance, reversals=4, breakaways=2, hours=1):
    return Usage(distance, reversals, breakaways, (hours * 3600 * 10**9, *[0] * (BINS - 1)))


def fill(history, valve=VALVE):
    """Write what an identifier may write of a valve, into each table."""
    drive = 1e5 + 100.0 * np.arange(100)
    record = Recording(0.01, drive, drive / 1e8)
    baseline = Baseline(140.0, 2.0, SLIDING, numbers=NUMBERS)
    kept.keep_renewal(history, valve, START - DAY)
    for one in (
        KeptBaseline(Baseline(150.0), START, START),
        KeptBaseline(baseline, START + 3, START, record, Baseline(150.0), level=Level.WARN),
    ):
        history.set_baseline(valve, one)
    for entry in (
        success(START, 150.123456789, 1 / 3, valve=valve, warnings=("one", "two")),
        success(START + 2, valve=valve, baseline=baseline, sliding=SLIDING, numbers=NUMBERS),
        refused(START + 4, valve=valve),
    ):
        history.add(entry)
    for run, day in (("run 1", 0), ("run 2", 0), ("run 2", 1)):
        kept.keep_usage(history, valve, run, [UsedDay(START // DAY + day, START - DAY, usage(1.5))])
    one = AlarmRecording(START, Level.ERROR, Path("/alarms/1"), "excess friction")
    kept.keep_alarm_recording(history, valve, one)
    kept.keep_told_level(history, valve, Level.ERROR)
    kept.keep_moves(history, valve, BUILT, [*map(service_move, range(4))])
    kept.keep_reference(history, valve, BUILT, Reference(SLIDING, START))
    kept.keep_change(history, valve, BUILT, FrictionChange(START, START + DAY, 1.5, 1.4, 1.6))
    grown = Condition(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown")
    kept.follow_alarms(history, valve, {AlarmKind.FRICTION_HIGH: grown}, START)
    shelving = AlarmRequest(AlarmAction.SHELVE, "A. Operator", "repack on Monday", 3600.0)
    kept.request_alarms(history, valve, None, shelving, START + SECOND)
    kept.keep_answers(history, valve, 0.02, [answer(1), answer(2, float("nan")), answer(0)])


def filled(folder):
    """The file of a plant of two valves."""
    history = kept.HistoryFile(folder / "history.sqlite")
    for valve in (VALVE, OTHER):
        fill(history, valve)
    return history


def all_of(history):
    """Everything that is read of a history, as text: nan is not itself."""
    found = [repr(history.valves()), repr(history.entries())]
    return [*found, *all_of_valve(history, VALVE), *all_of_valve(history, OTHER)]


def all_of_valve(history, valve):
    """Everything that is read of one valve, as text."""
    name = valve.name
    found = (
        history.baseline(name),
        history.baselines(name),
        history.last_success(name) if history.entries([name]) else None,
        history.known_numbers(name, BENCH_VALVE, 0),
        history.points(name, "bench"),
        kept.read_usage(history, name),
        kept.alarm_recordings(history, name),
        kept.read_told_level(history, name),
        kept.read_alarms(history, name),
        kept.alarm_events(history, AlarmFilter(valve=name)),
        kept.read_moves(history, name, BUILT),
        kept.read_reference(history, name, BUILT),
        kept.read_change(history, name, BUILT),
        kept.read_answers(history, name),
        kept.valve_histories(history, [valve], 0, 2**62),
    )
    return [repr(one) for one in found]
