# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Functions through which the benchmark calls the package.

No other file here imports the package.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmark.reality.records import Nominal, Record
from valve_friction_ros.health import Baseline, FrictionLimits, Level, StatusSignal, diagnose_valve
from valve_friction_ros.health.diagnosis import FrictionState
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.standstill import held_finding, held_numbers
from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    Result,
    identify_plant,
)
from valve_friction_ros.identification.engine import method as engine
from valve_friction_ros.identification.engine.intervals import estimated
from valve_friction_ros.identification.engine.posterior_fit import PosteriorFit
from valve_friction_ros.identification.engine.search import _Search, search
from valve_friction_ros.identification.refusal import LittleMotionError
from valve_friction_ros.model import Recording, Valve
from valve_friction_ros.streams import Arrivals, Kind, RecordBuffer

_WINDOW = 1e4
"""Longer than any record, s."""

_PLAIN = ("mass", "coulomb_friction", "viscous_friction", "spring_constant", "spring_preload")
_STEPS = 25
"""Maximum number of steps of a fit that starts at the truth; it needs few."""


@dataclass(frozen=True)
class Number:
    """A number in an answer: value and half width (SI unit, nan if absent), and verdict."""

    value: float
    half_width: float
    verdict: str


@dataclass(frozen=True)
class Answer:
    """Answer of the package for a record: numbers, or the reason of a refusal.

    `native` is the package's own result, and `fits` are the fits behind it. `held` has the numbers
    of a stem that did not move in a refused record.
    """

    numbers: Mapping[str, Number] = field(default_factory=dict)
    refusal: str = ""
    warnings: tuple[str, ...] = ()
    native: Result | None = None
    fits: Sequence[PosteriorFit] = ()
    held: Mapping[str, Measured] = field(default_factory=dict)


def _valve(nominal: Nominal) -> Valve:
    return Valve(
        nominal.diaphragm_area,
        nominal.pressure_reference,
        nominal.travel,
        nominal.pressure_minimum,
        nominal.pressure_maximum,
    )


def _settings(has_spring: bool) -> IdentificationSettings:
    """Return default settings; like a user, state that there is no spring."""
    return IdentificationSettings(fixed={} if has_spring else {"spring_constant": 0.0})


def _recording(record: Record) -> Recording:
    """Let both signals arrive in order of stamps; keep the first sample of a repeated stamp."""
    kinds, stamps, values = [], [], []
    for kind, signal in ((Kind.PRESSURE, record.pressure), (Kind.POSITION, record.position)):
        new = np.diff(signal.stamps, prepend=signal.stamps[:1] - 1) > 0
        kinds.append(np.full(int(new.sum()), kind, np.uint8))
        stamps.append(signal.stamps[new])
        values.append(signal.values[new])
    order = np.argsort(np.concatenate(stamps), kind="stable")
    buffer = RecordBuffer(_valve(record.nominal), _WINDOW)
    arrivals = Arrivals(
        np.concatenate(kinds)[order], np.concatenate(stamps)[order], np.concatenate(values)[order]
    )
    buffer.add_arrivals(arrivals)
    return buffer.snapshot().recording()


@contextmanager
def _seen_fits() -> Iterator[list[PosteriorFit]]:
    """Collect the final fits of an identification; a second search would double the time."""
    seen: list[PosteriorFit] = []

    def collecting(*arguments: Any) -> list[PosteriorFit]:
        seen[:] = search(*arguments)
        return seen

    with patch.object(engine, "search", collecting):
        yield seen


def identify(record: Record) -> Answer:
    """Identify a record like a node, through the buffer and with unchanged stamps."""
    try:
        recording = _recording(record)
    except RefusalError as refusal:
        return Answer(refusal=str(refusal))
    valve = _valve(record.nominal)
    with _seen_fits() as fits:
        try:
            result = identify_plant(recording, valve, _settings(record.nominal.has_spring))
        except RefusalError as refusal:
            is_still = isinstance(refusal, LittleMotionError)
            held = held_numbers(recording, valve) if is_still else {}
            return Answer(refusal=str(refusal), fits=tuple(fits), held=held)
    numbers = {
        name: Number(one.value, one.half_width, one.verdict.value)
        for name, one in result.parameters.items()
    }
    return Answer(numbers, "", tuple(result.warnings), result, tuple(fits))


def is_baseline(answer: Answer) -> bool:
    """Return whether a result can be the baseline."""
    if answer.native is None:
        return False
    try:
        Baseline.of(answer.native)
    except RefusalError:
        return False
    return True


def alarms(answer: Answer, healthy: Answer) -> dict[str, str]:
    """Compare with the result of the healthy valve, like the monitor.

    The keys are "high" and "low" for friction, "perhaps" for uncertain friction, and "other" for
    any other finding that is not OK or not good. The values are the sentences.
    """
    baseline = Baseline.of(healthy.native) if healthy.native and is_baseline(healthy) else None
    if answer.native is None:
        if baseline is None or healthy.native is None:
            return {}
        held = held_finding(answer.held, baseline, healthy.native.valve, FrictionLimits())
        return {} if held is None else {"high": _words(held)}
    friction, findings = diagnose_valve(answer.native, baseline)
    found = {}
    if friction.status_signal is not StatusSignal.GOOD or friction.level is not Level.OK:
        state = friction.state
        unsure = "perhaps" if state is FrictionState.UNCLEAR else "other"
        found[unsure if state.side is None else state.side.value] = _words(friction)
    for finding in findings:
        if finding.status_signal is not StatusSignal.GOOD or finding.level is not Level.OK:
            found["other"] = _words(finding)
    return found


def _words(one: Any) -> str:
    return f"{one.level.name} {one.status_signal.value}: {one.message}"


def ends(record: Record, answer: Answer) -> dict[str, Any]:
    """Compare the search with a fit that starts at the truth; empty without a simulation.

    `found` and `begun` are the sums of squares of search and fit, in variances of the residual of
    the fit. `coulomb` is F_c of the search, N; `widths` are the half widths of the fit.
    """
    if not answer.fits:
        return {}
    found, truth = answer.fits[0], record.truth
    at = {name: truth[name].value for name in _PLAIN}
    at |= {**record.late, "start_position": record.start}
    at["slip_force"] = truth["static_friction"].value - truth["coulomb_friction"].value
    engine_at = _Search(found.model.record, engine.prior_of(_settings(True)))
    names = engine_at.all
    if math.isfinite(truth["stribeck_velocity"].value):
        at["stribeck_velocity"] = truth["stribeck_velocity"].value
        names = (*(name for name in names if name != "at_low_speed"), "stribeck_velocity")
    begun = engine_at.fit({**engine_at.base, **at}, names, _STEPS, engine_at.exact)
    widths = {name: one.half_width for name, one in estimated([begun]).items()}
    scale = begun.inflation
    return {
        "found": found.objective / scale,
        "begun": begun.objective / scale,
        "coulomb": estimated(answer.fits)["coulomb_friction"].value,
        "widths": widths,
    }
