# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Quantities that no control valve has, and the unit in which they would be ordinary.

Only a diaphragm with a spring is judged. The wide ranges refuse; they hold every actuator of the
catalogues (Fisher 657/667 and 585C, SAMSON 3271/3277, Masoneilan 87/88, with margin): diaphragm
areas from 30 cm² to two of 2800 cm² in tandem, travel from 5 mm to the 610 mm of long pistons,
supply up to 10 bar. The ordinary ranges only choose the unit that is named.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.uncertainty import half_width, jackknife
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals import measured, velocity_noise


class _Quantity(NamedTuple):
    """Ranges of a quantity, SI unit, and the sizes of the units that it is written in."""

    unit: str
    possible: tuple[float, float]
    ordinary: tuple[float, float]
    units: Mapping[str, float]


_PRESSURE = _Quantity(
    "Pa",
    (8e3, 1.6e6),
    (2e4, 7e5),
    {"bar": 1e5, "kPa": 1e3, "psi": 6894.76, "mbar": 100.0, "MPa": 1e6},
)
"""Highest pressure of a record. A spring range starts at 0.2 bar (3 psi), seldom at half of that,
and a stem moves only above it; the supply is at most 10 bar, absolute or with margin 16."""

_REFERENCE = _Quantity("Pa", (2e3, 1.6e6), (3e4, 1.2e5), _PRESSURE.units)
"""Pressure reference other than 0: as a rule the air pressure, for an absolute sensor."""

_AREA = _Quantity("m²", (1e-3, 1.0), (3e-3, 0.6), {"cm²": 1e-4, "in²": 6.4516e-4, "mm²": 1e-6})
_TRAVEL = _Quantity("m", (2e-3, 0.7), (4e-3, 0.2), {"mm": 1e-3, "cm": 1e-2, "in": 0.0254})
_POSITION = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "µm": 1e-6}

_STIFFNESS = _Quantity("N/m", (1e3, 1e8), (5e3, 2e7), {"N/mm": 1e3, "kN/m": 1e3, "N/cm": 1e2})
"""Spring constant: 0.2 bar on 30 cm² over 60 mm to 4 bar on 2800 cm² over 15 mm, with margin."""

_SPEED = _Quantity("m/s", (0.0, 0.5), (1e-4, 0.3), {"min read as s": 1 / 60, "s read as ms": 1e-3})
"""Top speed: the fastest valves (anti-surge, with boosters) take 0.3 s for 100 mm."""

_TRIP_SPEED = 5.0
"""Speed, m/s, that even a spring that slams a valve shut does not reach."""

_TIME_CONSTANT = _Quantity("s", (0.0, 10.0), (1e-3, 2.0), {"ms": 1e-3, "µs": 1e-6, "ns": 1e-9})
"""F_v/k, with which a stem follows a step of pressure: 0.02 to 0.4 s for the paper's packings."""

_DATED = 1e9
"""Start of a record, s, above which it is a date, in 2001 or later, whose unit is known: the same
date in ms or less would lie beyond the year 33,000. Friction may then hold the stem for minutes."""

_SHORTEST = 5.0
"""Least duration of a record, s. Chosen: a small valve takes two seconds each way. A shorter record
in the smaller unit has the right unit, however slowly its stem creeps."""

_ORDER, _WINDOW = 3, 11
"""Order of the derivatives, and their window where the unit of time itself is in doubt, samples."""

_MOVING_SHARE, _MOVING_NOISE = 0.05, 4.0
"""Speed above which the stem is moving: as a share of the top speed, chosen as in the other checks
of a record; and in standard deviations of the velocity noise, which in a record of slow moves would
pass for viscous friction."""

_BLOCKS = (8, 60)
"""Fewest and most blocks of a record that show its scatter. Chosen: 7 degrees of freedom make an
interval 2.4 standard errors; noise can feign any number of strokes."""

_OUTSIDE = 0.05
"""Distance beyond the travel, as a share of it, up to which a record is judged; `require_travel`
refuses a larger distance, such as that of swapped signals."""

_LEAST_SAMPLES = 100
"""Samples below which the time is not judged. Chosen: other checks refuse such a record."""

_PERCENT = (20.0, 105.0)
"""Highest value of a signal in percent. Chosen: lower values have an ordinary unit too."""


def require_plausible_units(
    recording: Recording, valve: Valve, settings: IdentificationSettings
) -> None:
    """Refuse a record or a valve with a quantity that no control valve has.

    A machine without a spring, a machine driven by a force, and a dead sensor are not judged. The
    RefusalError names the quantity, and the unit in which it would be ordinary.
    """
    if (
        not _is_valve(recording, valve)
        or settings.fixed.get("spring_constant") == 0.0
        or np.ptp(recording.drive) == 0
    ):
        return
    try:
        require_valve_units(valve, settings.fixed)
    except ValueError as error:
        raise RefusalError(str(error)) from None
    place = float(np.abs(recording.position).max())
    if place > (1 + _OUTSIDE) * valve.travel:
        return
    pressure = float(np.abs(recording.drive).max())
    if problem := _beyond("the pressure reaches", pressure, _PRESSURE):
        raise RefusalError(problem)
    if not np.isfinite(valve.travel) and place > _TRAVEL.possible[1]:
        raise RefusalError(
            f"the stem position reaches {place:.4g} m, more than the travel of any control valve: "
            + position_question(place, _TRAVEL.ordinary[1])
        )
    if len(recording) > _LEAST_SAMPLES:
        speed = _SPEED._replace(possible=(0.0, _TRIP_SPEED))
        problem = _beyond("the stem moves at", _top_speed(recording), speed)
        may_be_ms = recording.duration * _TIME_CONSTANT.units["ms"] >= _SHORTEST
        if not problem and may_be_ms and recording.start_time <= _DATED:
            late = _least_time_constant(recording)
            problem = _beyond("the stem lags behind the pressure by", late, _TIME_CONSTANT)
        if problem:
            raise RefusalError(problem)


def require_valve_units(valve: Valve, known: Mapping[str, float]) -> None:
    """Refuse the geometry and the spring of a valve that nobody builds.

    Raises
    ------
    ValueError
        The message names the quantity, and the unit in which it would be ordinary.
    """
    judged = [("diaphragm_area is", valve.diaphragm_area, _AREA)]
    if np.isfinite(valve.travel):
        judged.append(("travel is", valve.travel, _TRAVEL))
    if valve.pressure_reference > 0:
        judged.append(("pressure_reference is", valve.pressure_reference, _REFERENCE))
    if np.isfinite(valve.pressure_maximum) and valve.pressure_maximum > 0:
        # A sensor reaches further than its valve.
        widened = _PRESSURE._replace(possible=(_PRESSURE.possible[0], 1e8))
        judged.append(("pressure_maximum is", valve.pressure_maximum, widened))
    if known.get("spring_constant"):
        judged.append(("spring_constant is", known["spring_constant"], _STIFFNESS))
    for words, value, quantity in judged:
        if value is not None and (problem := _beyond(words, value, quantity)):
            raise ValueError(problem)


def position_question(place: float, travel: float) -> str:
    """Ask for the unit in which a position that reads `place` m lies within the travel, m.

    Empty if there is none.
    """
    units = [unit for unit, size in _POSITION.items() if 0.1 <= place * size / travel <= 1.05]
    units.extend(_percent(place))
    return _question(units, "m") if units else ""


def time_remarks(recording: Recording, valve: Valve) -> tuple[str, ...]:
    """Question the unit of time of a stem that is faster than most valves can be."""
    if not _is_valve(recording, valve):
        return ()
    return tuple(filter(None, [_beyond("the stem moves at", _top_speed(recording), _SPEED)]))


def _is_valve(recording: Recording, valve: Valve) -> bool:
    return recording.driven_by is Drive.PRESSURE and valve.driven_by is Drive.PRESSURE


def _top_speed(recording: Recording) -> float:
    record = measured(recording)
    velocity = record.derivatives(record.fitting_window(_ORDER), _ORDER).velocity
    return float(np.quantile(np.abs(velocity), 0.999))


def _least_time_constant(recording: Recording) -> float:
    """Low end of the interval of F_v/k, s, from pressure = k·x + F_v·ẋ ± F_c; 0 without one."""
    record = measured(recording)
    derivatives = record.derivatives(_WINDOW, _ORDER)
    velocity, place, pressure = (
        derivatives.velocity,
        derivatives.inner(record.position),
        derivatives.inner(record.drive),
    )
    noise = velocity_noise(record.position_noise, record.sample_period, _WINDOW, _ORDER)
    speed = np.abs(velocity)
    moving = speed > max(_MOVING_SHARE * float(speed.max()), _MOVING_NOISE * noise)
    columns = np.column_stack(
        [velocity, place - place.mean(), np.sign(velocity), np.ones_like(velocity)]
    )
    lengths = np.linalg.norm(columns, axis=0)
    if not lengths.all():
        return 0.0
    columns /= lengths[None, :]
    sizes = np.linalg.norm(velocity), np.linalg.norm(place - place.mean())
    columns *= moving[:, None]
    if np.linalg.matrix_rank(columns.T @ columns) < columns.shape[1]:
        return 0.0
    strokes = np.count_nonzero(np.diff(np.sign(velocity[moving]))) + 1
    parts = (np.array_split(one, np.clip(strokes, *_BLOCKS)) for one in (columns, pressure))
    blocks = [(part.T @ part, part.T @ force) for part, force in zip(*parts, strict=True)]
    found = jackknife([blocks], _solved)
    low, spring, high = (
        found.values[name] + sign * half_width(found.standard_errors[name], found.freedom)
        for name, sign in (("viscous", -1), ("spring", 0), ("spring", 1))
    )
    return float(low / sizes[0] / high * sizes[1]) if low > 0 and spring > 0 and high > 0 else 0.0


def _solved(groups: Sequence[Sequence[Any]]) -> dict[str, float]:
    """Solve the normal equations that the blocks add up to."""
    information, right = (sum(terms) for terms in zip(*groups[0], strict=True))
    viscous, spring, *_ = np.linalg.lstsq(information, right, rcond=None)[0].tolist()
    return {"viscous": viscous, "spring": spring}


def _beyond(words: str, value: float, quantity: _Quantity) -> str:
    """Say that no valve has this value, and name the likely units; empty if a valve has it."""
    low, high = quantity.possible
    if low <= value <= high:
        return ""
    units = [
        unit
        for unit, size in quantity.units.items()
        if quantity.ordinary[0] <= value * size <= quantity.ordinary[1]
    ]
    if quantity is _PRESSURE:
        units.extend(_percent(value))
    return (
        f"{words} {value:.4g} {quantity.unit}, {'less' if value < low else 'more'} than in any "
        f"control valve ({low:.4g} to {high:.4g} {quantity.unit}): "
        + _question(units, "" if quantity.unit == "m/s" else quantity.unit)
    )


def _percent(value: float) -> tuple[str, ...]:
    return ("%",) if _PERCENT[0] <= value <= _PERCENT[1] else ()


def _question(units: Iterable[str], read_as: str) -> str:
    named = " or ".join(units)
    if not named:
        return "check the unit"
    return f"{named} read as {read_as}?" if read_as else f"{named}?"
