# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Comparison of the data sheet of a valve with a record."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from valve_friction_ros.identification.settings import PARAMETER_UNITS
from valve_friction_ros.identification.trust.verdict import OF_FORCE, Parameter, Verdict
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve

CONTRADICTED = "contradicted_data"
"""Name of the evidence that holds the contradictions by parameter name."""

_NARROW = 0.1
"""Half width, as a share of the value, up to which a number is compared."""

_WIDTHS = 2.0
_DIFFERENT = 0.15
"""Difference, in half widths and as a share of the stated value, beyond which numbers contradict.

Both are exceeded then. Chosen: springs of a catalogue are made to ±10 %."""

_UNITS = {"diaphragm_area": "m²", "travel": "m"}
_UNITS |= dict.fromkeys(("pressure_reference", "pressure_minimum", "pressure_maximum"), "Pa")

_ATMOSPHERE = 101325.0
_ALTITUDE = 0.1
"""Pressure of the air, Pa, and its relative range: weather, and sites up to 900 m."""

_SLIPS: Mapping[float, tuple[str, str]] = MappingProxyType(
    {
        2.0: ("doubled", "halved"),
        4.0: ("the diameter taken for the radius", "the radius taken for the diameter"),
        6.4516: ("cm² read as in², or kPa as psi", "in² read as cm², or psi as kPa"),
        10.0: ("a decimal place", "a decimal place"),
        100.0: ("another unit", "another unit"),
        1e3: ("another unit", "another unit"),
        1e4: ("another unit", "another unit"),
    }
)
"""Factors of common entry errors in an area or a pressure: why it is too large, too small."""


class Cause(Enum):
    """Likely cause of a contradiction between a stated and a found number."""

    AREA_SCALE = "area scale"
    OTHER_SPRING = "other spring"
    ZERO_OF_PRESSURE = "zero of pressure"
    OTHER_PRELOAD = "other preload"
    OTHER_MASS = "other mass"


class Contradiction(NamedTuple):
    """A stated number that the record contradicts, the found one, SI units, and the likely cause.

    `factor` is found over stated; nan for a preload, whose zero is arbitrary. `pressure`, Pa, makes
    up the difference of a preload; nan for others, and where a force drives the stem.
    """

    name: str
    stated: float
    found: float
    cause: Cause
    factor: float = math.nan
    pressure: float = math.nan


def _contradicts(found: Parameter, stated: float, size: float) -> bool:
    difference = abs(found.value - stated)
    return difference > _WIDTHS * found.half_width and difference > _DIFFERENT * size


def _compared(one: Parameter | None, size: float) -> Parameter | None:
    """Return an estimate that is narrow enough, for its size, to be compared."""
    if one is None or one.verdict is Verdict.FIXED or not one.half_width < _NARROW * size:
        return None
    return one


def _slip(factor: float) -> str:
    """Return the entry error that makes an area or a pressure wrong by a factor; empty if none."""
    size = max(factor, 1 / factor)
    nearest = min(_SLIPS, key=lambda slip: abs(math.log(size / slip)))
    return _SLIPS[nearest][factor < 1] if abs(size / nearest - 1) < _DIFFERENT else ""


def _of_scale(
    parameters: Mapping[str, Parameter], stated: Mapping[str, float], name: str
) -> tuple[Parameter | None, float]:
    """Return a parameter that can be compared, and found over stated; 1 where both agree."""
    value = stated.get(name, 0.0)
    one = parameters.get(name)
    one = _compared(one, 0.0 if one is None else abs(one.value))
    if one is None or not (value > 0 and one.value > 0):
        return None, 1.0
    return one, one.value / value if _contradicts(one, value, value) else 1.0


def contradictions(
    parameters: Mapping[str, Parameter], stated: Mapping[str, float], valve: Valve, span: float
) -> tuple[Contradiction, ...]:
    """Compare stated numbers with identified numbers that have a narrow interval.

    Spring constant and preload grow with the area and with the scale of the pressure. A wrong zero
    of the pressure adds a constant to the preload alone. The parameters have the calibration in
    their intervals; `span` is the travel, or the range of the position where there are no stops, m.
    """
    told = []
    spring, factor = _of_scale(parameters, stated, "spring_constant")
    mass, heavier = _of_scale(parameters, stated, "mass")
    is_area = bool(_slip(factor))
    if "spring_preload" in stated:
        expected = stated["spring_preload"]
        stiffness = stated.get("spring_constant", 0.0) if spring is None else spring.value
        size = max(abs(expected), stiffness * span)
        preload = _compared(parameters.get("spring_preload"), size)
        if preload is not None:
            by_area, as_stated = (
                not _contradicts(preload, scale * expected, max(abs(scale * expected), size))
                for scale in (factor, 1.0)
            )
            if by_area != as_stated:
                is_area = by_area
            if not (by_area or as_stated):
                told.append(_of_preload(preload, expected, factor if is_area else 1.0, valve))
    if spring is not None and factor != 1:
        cause = Cause.AREA_SCALE if is_area else Cause.OTHER_SPRING
        told.insert(0, Contradiction(spring.name, stated[spring.name], spring.value, cause, factor))
    if mass is not None and heavier != 1:
        told.append(
            Contradiction(mass.name, stated[mass.name], mass.value, Cause.OTHER_MASS, heavier)
        )
    return tuple(told)


def _of_preload(one: Parameter, stated: float, scale: float, valve: Valve) -> Contradiction:
    """Distinguish an offset of one atmosphere from another preload; `scale` scales all forces."""
    if valve.diaphragm_area is None:
        return Contradiction(one.name, stated, one.value, Cause.OTHER_PRELOAD)
    pressure = (one.value - scale * stated) / valve.diaphragm_area
    reference = _reference(pressure, valve)
    cause = Cause.OTHER_PRELOAD
    if is_atmosphere(pressure) and reference >= -_ALTITUDE * _ATMOSPHERE:
        cause = Cause.ZERO_OF_PRESSURE
    return Contradiction(one.name, stated, one.value, cause, pressure=pressure)


def is_atmosphere(pressure: float) -> bool:
    """Return whether a difference of pressures, Pa, is that of a gauge and an absolute one."""
    return abs(abs(pressure) / _ATMOSPHERE - 1) < _ALTITUDE


def _reference(pressure: float, valve: Valve) -> float:
    return valve.pressure_reference + math.copysign(_ATMOSPHERE, pressure)


def _scale_is_confirmed(parameters: Mapping[str, Parameter], stated: Mapping[str, float]) -> bool:
    """Return whether the stated spring constant was compared, and agrees."""
    spring, factor = _of_scale(parameters, stated, "spring_constant")
    return spring is not None and factor == 1


def _doubtful(one: Parameter, reason: str) -> Parameter:
    """Return an estimate as weak; its ratio to a baseline leaves the doubt out."""
    if one.verdict not in (Verdict.IDENTIFIED, Verdict.WEAK):
        return one
    told = f"{one.reason}; {reason}" if one.reason else reason
    return replace(one, verdict=Verdict.WEAK, reason=told, uncalibrated=one.without_calibration)


def _of_assumed(
    parameters: Mapping[str, Parameter],
    stated: Mapping[str, float],
    assumed: Sequence[str],
    valve: Valve,
) -> tuple[dict[str, str], list[str]]:
    """Return why numbers from assumed data are doubtful, and one sentence on the assumed data.

    A stated spring constant that the record confirms makes up for an assumed area.
    """
    if not assumed:
        return {}, []
    reasons: dict[str, str] = {}
    consequences = []
    if "pressure_reference" in assumed:
        reasons["spring_preload"] = "it depends on an assumed pressure_reference"
        consequences.append("spring_preload depends on an assumed pressure_reference")
    if "diaphragm_area" in assumed and not _scale_is_confirmed(parameters, stated):
        reasons |= dict.fromkeys(OF_FORCE, "it depends on an assumed area")
        consequences.insert(
            0, "values in newtons depend on an assumed area; percentages and ratios do not"
        )
    if "travel" in assumed:
        consequences.append("percentages of the travel depend on an assumed travel")
    taken = ", ".join(f"{name} {getattr(valve, name):g} {_UNITS[name]}" for name in assumed)
    told = "; ".join([f"not stated, and assumed: {taken}", *consequences])
    return reasons, [told]


def with_stated(
    parameters: Mapping[str, Parameter],
    stated: Mapping[str, float],
    assumed: Sequence[str],
    valve: Valve,
    recording: Recording,
) -> tuple[dict[str, Parameter], dict[str, Contradiction], tuple[str, ...]]:
    """Return parameters with doubtful data marked, the contradictions, and sentences on both.

    A number that depends on `assumed` data of the valve, or contradicts a stated number, is weak at
    most. Where the spring constant is contradicted, or a preload that no spring constant confirms,
    the scale of the forces is in doubt, and so are all numbers that grow with it. The ratio to a
    baseline of the same scale is unaffected.
    """
    span = valve.travel if math.isfinite(valve.travel) else float(np.ptp(recording.position))
    told = {one.name: one for one in contradictions(parameters, stated, valve, span)}
    found = dict(parameters)
    reasons, sentences = _of_assumed(parameters, stated, assumed, valve)
    reasons |= {name: f"it contradicts the stated {name}" for name in told}
    witness = next((name for name in ("spring_constant", "spring_preload") if name in told), "")
    if witness and not _scale_is_confirmed(parameters, stated):
        doubt = f"the scale of the forces is in doubt: the stated {witness} contradicts the record"
        reasons |= {name: doubt for name in OF_FORCE if name not in told}
    for name, reason in reasons.items():
        if name in found:
            found[name] = _doubtful(found[name], reason)
    return found, told, (*(_sentence(one, valve) for one in told.values()), *sentences)


def _sentence(one: Contradiction, valve: Valve) -> str:
    """Describe the contradiction and what to check."""
    unit = PARAMETER_UNITS[one.name]
    return (
        f"{one.name} is {one.found:.6g} {unit} from the record but stated as {one.stated:.6g} "
        f"{unit}: {_remedy(one, valve)}"
    )


def _remedy(one: Contradiction, valve: Valve) -> str:
    area = valve.diaphragm_area
    if one.cause is Cause.AREA_SCALE:
        how = f" ({slip})" if (slip := _slip(one.factor)) else ""
        if area is None:
            return f"check the unit of the force, which is off by a factor of {one.factor:.3g}"
        return (
            f"check diaphragm_area{how} and the unit of the pressure; {area / one.factor:.3g} m² "
            f"instead of {area:.3g} m² would agree with the stated spring"
        )
    if one.cause is Cause.OTHER_SPRING:
        scale = "the scale of a sensor" if area is None else "diaphragm_area or a sensor's scale"
        return f"another spring is installed, or {scale} is off by a factor of {one.factor:.3g}"
    if one.cause is Cause.ZERO_OF_PRESSURE:
        kinds = ("absolute", "gauge") if one.pressure > 0 else ("gauge", "absolute")
        return (
            f"{kinds[0]} pressure is being read as {kinds[1]} pressure: set pressure_reference to "
            f"{_reference(one.pressure, valve):g} instead of {valve.pressure_reference:g}"
        )
    if one.cause is Cause.OTHER_PRELOAD:
        zero = "force sensor is off"
        if not math.isnan(one.pressure):
            zero = f"pressure sensor is off by {one.pressure / 1e3:.3g} kPa"
        return f"the zero of the {zero}, the zero of the position differs, or the preload does"
    return "check the stated mass and the time stamps of both signals"
