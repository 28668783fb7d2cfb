"""The package behind the few functions that the benchmark calls.

The only file here that knows the package.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmark.reality.records import Nominal, Record
from valve_friction_ros.health import Baseline, Level, StatusSignal, diagnose_valve
from valve_friction_ros.identification import (
    DEFAULT_METHOD,
    IdentificationSettings,
    RefusalError,
    method_named,
)
from valve_friction_ros.identification.robust.fitted_record import fitted_record
from valve_friction_ros.identification.robust.intervals import estimated
from valve_friction_ros.identification.robust.method import prior_of, stamped_record
from valve_friction_ros.identification.robust.search import posteriors_at, search
from valve_friction_ros.model import Recording, Valve
from valve_friction_ros.streams import Arrivals, Kind, RecordBuffer

__all__ = ["Answer", "Modes", "Number", "alarms", "identify", "is_baseline", "modes"]

_WINDOW = 1e4
"""Longer than any record, s."""


@dataclass(frozen=True)
class Number:
    """A number of an answer: value and half width (SI unit, nan where there is none), verdict."""

    value: float
    half_width: float
    verdict: str


@dataclass(frozen=True)
class Answer:
    """What the package says of a record.

    Attributes
    ----------
    numbers : mapping of str to Number
        By the names of `truth.NAMES`; others are not compared.
    refusal : str
        Why there is no result; empty if there is one.
    warnings : tuple of str
        What it warns of.
    native : object
        The result itself.
    """

    numbers: Mapping[str, Number] = field(default_factory=dict)
    refusal: str = ""
    warnings: tuple[str, ...] = ()
    native: Any = None


@dataclass(frozen=True)
class Modes:
    """Where the search ends, beside a fit that is begun at the truth.

    Attributes
    ----------
    found, begun : float
        Their sums of squares, over the inflation of the second.
    coulomb : tuple of Number
        F_c of both.
    half_widths : mapping of str to float
        Of the posterior begun at the truth.
    """

    found: float
    begun: float
    coulomb: tuple[Number, Number]
    half_widths: Mapping[str, float]


def valve_of(nominal: Nominal) -> Valve:
    """Return the valve as its user describes it."""
    return Valve(
        nominal.diaphragm_area,
        nominal.pressure_reference,
        nominal.travel,
        nominal.pressure_minimum,
        nominal.pressure_maximum,
    )


def _settings(nominal: Nominal) -> IdentificationSettings:
    """Return the defaults; that there is no spring is said, as a user has to."""
    return IdentificationSettings(fixed={} if nominal.has_spring else {"spring_constant": 0.0})


def _recording(record: Record) -> Recording:
    """Let both signals arrive in the order of their stamps; of a repeated one only the first."""
    kinds, stamps, values = [], [], []
    for kind, signal in ((Kind.PRESSURE, record.pressure), (Kind.POSITION, record.position)):
        new = np.diff(signal.stamps, prepend=signal.stamps[:1] - 1) > 0
        kinds.append(np.full(int(new.sum()), kind, np.uint8))
        stamps.append(signal.stamps[new])
        values.append(signal.values[new])
    order = np.argsort(np.concatenate(stamps), kind="stable")
    every = (np.concatenate(one)[order] for one in (kinds, stamps, values))
    buffer = RecordBuffer(valve_of(record.nominal), _WINDOW)
    buffer.add_arrivals(Arrivals(*every))
    return buffer.snapshot().recording()


def identify(record: Record, method: str = DEFAULT_METHOD) -> Answer:
    """Identify a record as a node does, through the buffer, with the stamps as they are."""
    try:
        recording = _recording(record)
        result = method_named(method)(
            recording, valve_of(record.nominal), _settings(record.nominal)
        )
    except RefusalError as refusal:
        return Answer(refusal=str(refusal))
    numbers = {
        name: Number(one.value, one.half_width, one.verdict.value)
        for name, one in result.parameters.items()
    }
    return Answer(numbers, warnings=tuple(result.warnings), native=result)


def is_baseline(answer: Answer) -> bool:
    """Return whether a result can be the baseline."""
    if answer.native is None:
        return False
    try:
        Baseline.of(answer.native)
    except RefusalError:
        return False
    return True


def alarms(answer: Answer, healthy: Answer | None) -> dict[str, str]:
    """Compare with the result of the healthy valve, as the monitor does.

    The keys are "high" and "low" for its friction, and "other" for all else that is more than OK
    or another status signal than good; the values are the sentences.
    """
    if answer.native is None:
        return {}
    baseline = Baseline.of(healthy.native) if healthy and is_baseline(healthy) else None
    diagnosis = diagnose_valve(answer.native, baseline)
    found = {}
    for one in (diagnosis.friction, *diagnosis.findings):
        if one.level is Level.OK and one.status_signal is StatusSignal.GOOD:
            continue
        ratio = getattr(one, "ratio", None)
        side = "other"
        if one is diagnosis.friction and one.status_signal is not StatusSignal.CHECK_FUNCTION:
            is_low = one.status_signal is StatusSignal.OUT_OF_SPECIFICATION
            side = "low" if is_low or (ratio is not None and ratio.value < 1.0) else "high"
        found[side] = f"{one.level.name} {one.status_signal.value}: {one.message}"
    return found


_AT_TRUTH = {
    "coulomb_friction": "coulomb_friction",
    "viscous_friction": "viscous_friction",
    "spring_constant": "spring_constant",
    "spring_preload": "spring_preload",
    "mass": "mass",
}


def modes(record: Record) -> Modes | None:
    """Search, and fit from the truth; None where the package does not simulate such a valve."""
    if not record.nominal.has_spring:
        return None
    settings, truth = _settings(record.nominal), record.truth
    at = {name: truth[other].value for name, other in _AT_TRUTH.items()}
    at["slip_force"] = truth["static_friction"].value - truth["coulomb_friction"].value
    at["delay"] = truth["clock_offset"].value
    at["start_position"] = record.start
    if math.isfinite(truth["stribeck_velocity"].value):
        at["stribeck_velocity"] = truth["stribeck_velocity"].value
    recording, valve = _recording(record), valve_of(record.nominal)
    try:
        fitted = fitted_record(stamped_record(recording), valve)
        prior = prior_of(settings)
        found = search(fitted, prior)
        begun = posteriors_at(fitted, prior, at, True)
    except RefusalError:
        return None
    ends = [estimated(found), estimated(begun)]
    scale = begun[0].inflation
    return Modes(
        found[0].objective / scale,
        begun[0].objective / scale,
        tuple(
            Number(one["coulomb_friction"].value, one["coulomb_friction"].half_width, "")
            for one in ends
        ),
        {name: one.half_width for name, one in ends[1].items()},
    )
