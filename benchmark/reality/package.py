"""A method of the package behind the two functions that the benchmark calls.

The only file here that knows the package.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from benchmark.reality.answers import Answer, Number
from benchmark.reality.records import Nominal, Record
from valve_friction_ros.health import Baseline, StatusSignal, diagnose
from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    method_named,
)
from valve_friction_ros.model import Valve
from valve_friction_ros.streams import Arrivals, Kind, RecordBuffer

__all__ = ["PackageMethod", "identification"]

_SETTINGS = IdentificationSettings(assumed_mass=1.6)
"""Those of the bench valves' configuration."""

_WINDOW = 1e4
"""Longer than any record, s."""

_SIDES = {
    StatusSignal.FAILURE: "high",
    StatusSignal.MAINTENANCE_REQUIRED: "high",
    StatusSignal.OUT_OF_SPECIFICATION: "low",
}


@cache
def _valve(nominal: Nominal) -> Valve:
    return Valve(
        nominal.diaphragm_area,
        nominal.pressure_reference,
        nominal.travel,
        nominal.pressure_minimum,
        nominal.pressure_maximum,
    )


def _arrivals(record: Record) -> Arrivals:
    """Return both signals in the order of their stamps; of a repeated stamp only the first."""
    kinds, stamps, values = [], [], []
    for kind, signal in ((Kind.PRESSURE, record.pressure), (Kind.POSITION, record.position)):
        new = np.diff(signal.stamps, prepend=signal.stamps[:1] - 1) > 0
        kinds.append(np.full(int(new.sum()), kind, np.uint8))
        stamps.append(signal.stamps[new])
        values.append(signal.values[new])
    order = np.argsort(np.concatenate(stamps), kind="stable")
    return Arrivals(
        np.concatenate(kinds)[order], np.concatenate(stamps)[order], np.concatenate(values)[order]
    )


@dataclass(frozen=True)
class PackageMethod:
    """A method of the package, called as a node calls it.

    Attributes
    ----------
    name : str
        Name of the method, as in `METHODS`.
    """

    name: str

    def identify(self, record: Record) -> Answer:
        """Identify a record through the buffer, with the stamps as they are."""
        valve = _valve(record.nominal)
        buffer = RecordBuffer(valve, _WINDOW)
        buffer.add_arrivals(_arrivals(record))
        try:
            result = method_named(self.name)(buffer.snapshot().recording(), valve, _SETTINGS)
        except RefusalError as refusal:
            return Answer({}, (str(refusal),), refused=True)
        parameters = result.parameters
        numbers = {
            name: Number(one.value, one.half_width, one.verdict.value)
            for name, one in parameters.items()
        }
        reasons = (f"{name}: {one.reason}" for name, one in parameters.items() if one.reason)
        return Answer(numbers, (*reasons, *result.warnings), native=result)

    def alarm(self, record: Record, answer: Answer, baseline: Answer) -> str:
        """Compare with the result of the healthy valve, as the monitor does."""
        if answer.native is None or baseline.native is None:
            return ""
        try:
            healthy = Baseline.of(baseline.native)
        except RefusalError:
            return ""
        diagnosis = diagnose(answer.native, _valve(record.nominal), healthy)
        return _SIDES.get(diagnosis.status_signal, "")


def identification(method: str) -> PackageMethod:
    """Return the identification by a method of the package."""
    method_named(method)
    return PackageMethod(method)
