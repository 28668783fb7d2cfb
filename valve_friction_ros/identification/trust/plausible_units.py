"""Quantities that no control valve has, and the unit in which they would be ordinary.

Only a diaphragm with a spring is judged. The wide ranges refuse; they hold every actuator of the
catalogues (Fisher 657/667 and 585C, SAMSON 3271/3277, Masoneilan 87/88, with margin): diaphragm
areas from 30 cm² to two of 2800 cm² in tandem, travel from 5 mm to the 610 mm of long pistons,
supply up to 10 bar. The ordinary ranges only choose the unit that is named.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.verdict import Parameter
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.signals.measured_record import measured

__all__ = ["position_unit", "require_plausible_units", "require_valve_units", "time_remarks"]


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
and a stem moves only beyond; the supply is at most 10 bar, absolute or with margin 16."""

_REFERENCE = _Quantity("Pa", (2e3, 1.6e6), (3e4, 1.2e5), _PRESSURE.units)
"""Pressure reference other than 0: that of the air for an absolute sensor, as a rule."""

_AREA = _Quantity("m²", (1e-3, 1.0), (3e-3, 0.6), {"cm²": 1e-4, "in²": 6.4516e-4, "mm²": 1e-6})
_TRAVEL = _Quantity("m", (2e-3, 0.7), (4e-3, 0.2), {"mm": 1e-3, "cm": 1e-2, "in": 0.0254})
_POSITION = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "µm": 1e-6}

_STIFFNESS = _Quantity("N/m", (1e3, 1e8), (5e3, 2e7), {"N/mm": 1e3, "kN/m": 1e3, "N/cm": 1e2})
"""Spring constant: 0.2 bar on 30 cm² over 60 mm to 4 bar on 2800 cm² over 15 mm, with margin."""

_SPEED = _Quantity("m/s", (0.0, 0.5), (1e-4, 0.3), {"min": 1 / 60, "s": 1e-3})
"""Top speed: the fastest valves (anti-surge, with boosters) take 0.3 s for 100 mm."""

_TIME_CONSTANT = _Quantity("s", (0.0, 5.0), (1e-3, 2.0), {"ms": 1e-3, "µs": 1e-6, "ns": 1e-9})
"""F_v/k, in which a stem follows a step of pressure: 0.02 to 0.4 s for the paper's packings."""

_PERCENT = (20.0, 105.0)
"""Highest value of a signal in percent. Chosen: lower ones have an ordinary unit too."""


def require_plausible_units(
    recording: Recording, valve: Valve, settings: IdentificationSettings
) -> None:
    """Refuse a record or a valve in which a quantity is beyond every control valve.

    A machine without a spring, or with a force as its drive, is not judged.

    Raises
    ------
    RefusalError
        With the quantity, and the unit in which it would be ordinary.
    """
    if (
        recording.driven_by is not Drive.PRESSURE
        or valve.driven_by is not Drive.PRESSURE
        or settings.fixed.get("spring_constant") == 0.0
    ):
        return
    try:
        require_valve_units(valve, settings.fixed)
    except ValueError as error:
        raise RefusalError(str(error)) from None
    pressure = float(np.abs(recording.drive).max())
    if problem := _beyond("the pressure reaches", pressure, _PRESSURE):
        raise RefusalError(problem)
    if not np.isfinite(valve.travel):
        place = float(np.abs(recording.position).max())
        if place > _TRAVEL.possible[1]:
            raise RefusalError(
                f"the stem position reaches {place:.4g} m, further than any valve: "
                + _question(position_unit(place, _TRAVEL.ordinary[1]), "m")
            )


def require_valve_units(valve: Valve, known: Mapping[str, float]) -> None:
    """Refuse the geometry and the spring of a valve that nobody builds.

    Raises
    ------
    ValueError
        With the quantity, and the unit in which it would be ordinary.
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


def position_unit(place: float, travel: float) -> tuple[str, ...]:
    """Name the units in which a position that reads `place` m lies within the travel, m."""
    units = [unit for unit, size in _POSITION.items() if 0.01 <= place * size / travel <= 1.05]
    return (*units, *_percent(place))


def time_remarks(recording: Recording, parameters: Mapping[str, Parameter]) -> tuple[str, ...]:
    """Question the unit of time where a stem is faster or slower than that of any valve.

    Parameters
    ----------
    recording : Recording
        Drive and position of a valve with a spring.
    parameters : mapping of str to Parameter
        Identified; a time constant is judged only where the whole interval of it is beyond.

    Returns
    -------
    tuple of str
        Warnings.
    """
    if recording.driven_by is not Drive.PRESSURE:
        return ()
    record = measured(recording)
    window = 31
    velocity = np.abs(record.derivatives(window, 3).velocity)
    remarks = [_beyond("the stem moves at", float(np.quantile(velocity, 0.999)), _SPEED)]
    friction, spring = (parameters[name] for name in ("viscous_friction", "spring_constant"))
    least = (friction.value - friction.half_width) / (spring.value + spring.half_width)
    if least > _TIME_CONSTANT.possible[1]:
        slow = friction.value / spring.value
        remarks.append(_beyond("the stem follows a step of pressure in", slow, _TIME_CONSTANT))
    return tuple(remark for remark in remarks if remark)


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
        units += _percent(value)
    return (
        f"{words} {value:.4g} {quantity.unit}, {'less' if value < low else 'more'} than in any "
        f"control valve ({low:.4g} to {high:.4g} {quantity.unit}): "
        + _question(units, "s" if quantity in (_SPEED, _TIME_CONSTANT) else quantity.unit)
    )


def _percent(value: float) -> tuple[str, ...]:
    return ("%",) if _PERCENT[0] <= value <= _PERCENT[1] else ()


def _question(units: Iterable[str], read_as: str) -> str:
    named = " or ".join(units)
    return f"{named} read as {read_as}?" if named else f"check its unit ({read_as})"
