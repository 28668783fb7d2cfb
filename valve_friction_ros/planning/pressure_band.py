"""Between which pressures a stem stays within a part of its travel, whatever its friction."""

import math
from typing import NamedTuple

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model.karnopp_parameters import KarnoppParameters
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.planning.conditions import Limits
from valve_friction_ros.planning.friction_range import FrictionRange

__all__ = [
    "LEAST_STROKE",
    "PressureBand",
    "frictionless_reach",
    "lowest_pressure",
    "pressure_band",
    "stroke",
]

LEAST_STROKE = 0.03
"""Share of the travel that the stem must move over: three times what an identification needs."""


class PressureBand(NamedTuple):
    """Pressures of a test, and the rate that its speed allows.

    Attributes
    ----------
    low, high : float
        Pa.
    rate : float
        Pa/s.
    """

    low: float
    high: float
    rate: float


def _held(one: KarnoppParameters) -> float:
    """Return the force, N, that surely holds the stem back at the end of a stroke.

    A stem that swings, one with less than critical damping, may go on by the slip.
    """
    swings = one.viscous_friction < 2 * math.sqrt(one.spring_constant * one.mass)
    slip = one.static_friction - one.coulomb_friction
    return max(one.coulomb_friction - (slip if swings else 0.0), 0.0)


def stroke(valve: Valve, one: KarnoppParameters, band: PressureBand) -> float:
    """Return the distance, m, between the rests at both ends of a band; negative: no motion.

    A stroke is S_a·ΔP − 2·F_c over k. A stem that stands in the middle breaks away if
    S_a·ΔP/2 > F_s; it may do so where it stands elsewhere, but nobody knows where it stands.
    """
    span = valve.force_per_drive * (band.high - band.low)
    if span <= 2 * one.static_friction:
        return -1.0
    return (span - 2 * one.coulomb_friction) / one.spring_constant


def frictionless_reach(
    valve: Valve, frictions: FrictionRange, band: PressureBand
) -> tuple[float, float]:
    """Return where a stem without friction would stand at both ends of a band, m."""
    constant, preload = frictions.spring
    low, high = ((valve.actuator_force(one) - preload) / constant for one in (band.low, band.high))
    return low, high


def lowest_pressure(valve: Valve) -> float:
    """Return the lowest pressure that a converter can set, Pa: that of the atmosphere.

    There the actuator exerts no force. It is the reference of the valve: 0 for a gauge sensor,
    101325 Pa for one of absolute pressure.
    """
    return valve.pressure_reference


def pressure_band(valve: Valve, frictions: FrictionRange, limits: Limits) -> PressureBand:
    """Return the widest band that keeps to the limits.

    At the upper end a rising stem rests at k·x = S_a·(P − P_ref) − F_0 − F_c. The smallest F_c of
    the range must rest within the part of the travel, and no friction at all within the stops. No
    converter goes below the atmosphere.

    Raises
    ------
    RefusalError
        If the stem would not move there; the message names what to relax.
    ValueError
        If the valve has no diaphragm or no travel.
    """
    if valve.diaphragm_area is None or not math.isfinite(valve.travel):
        raise ValueError(
            "a stroke test is planned for a valve with a diaphragm and a travel: give "
            "diaphragm_area and travel in the valve file"
        )
    constant, preload = frictions.spring
    held = min(_held(one) for one in frictions.draws)
    lowest, highest = (share * valve.travel for share in (limits.lowest, limits.highest))
    low = valve.actuator_drive(constant * lowest + preload - held)
    high = valve.actuator_drive(constant * highest + preload + held)
    if not limits.allow_stops:
        margin = limits.stop_margin * valve.travel
        low = max(low, valve.actuator_drive(constant * margin + preload))
        high = min(high, valve.actuator_drive(constant * (valve.travel - margin) + preload))
    pressures = PressureBand(
        max(low, _lowest(valve, limits)),
        min(high, limits.pressure_maximum, valve.pressure_maximum),
        min(limits.pressure_rate, limits.speed * constant / valve.diaphragm_area),
    )
    if pressures.low >= pressures.high:
        raise RefusalError(
            f"the pressure limits leave no band: the stem needs {low / 1e3:.4g} to "
            f"{high / 1e3:.4g} kPa between {100 * limits.lowest:g} and {100 * limits.highest:g} % "
            f"of the travel, and {_lowest(valve, limits) / 1e3:.4g} kPa to "
            f"{_highest(valve, limits)} may be set: widen the range of the pressure (the "
            "atmosphere, pressure_reference, is its floor)"
        )
    _require_strokes(valve, frictions, limits, pressures, (low, high))
    return pressures


def _lowest(valve: Valve, limits: Limits) -> float:
    return max(limits.pressure_minimum, valve.pressure_minimum, lowest_pressure(valve))


def _highest(valve: Valve, limits: Limits) -> str:
    highest = min(limits.pressure_maximum, valve.pressure_maximum)
    return f"{highest / 1e3:.4g} kPa" if math.isfinite(highest) else "any pressure"


def _require_strokes(
    valve: Valve,
    frictions: FrictionRange,
    limits: Limits,
    band: PressureBand,
    wanted: tuple[float, float],
) -> None:
    """Refuse a band in which the most likely valve does not move far enough."""
    likely = frictions.draws[frictions.middle]
    least = LEAST_STROKE * valve.travel
    if stroke(valve, likely, band) >= least:
        return
    force = max(
        2 * likely.static_friction,
        2 * likely.coulomb_friction + likely.spring_constant * least,
    )
    needed = force / valve.force_per_drive
    where = (
        f"between {100 * limits.lowest:g} and {100 * limits.highest:g} % of the travel, at "
        f"{band.low / 1e3:.4g} to {band.high / 1e3:.4g} kPa"
    )
    remedy = "widen the part of the travel"
    if band.low > wanted[0] or band.high < wanted[1]:
        remedy += " or the range of the pressure"
    raise RefusalError(
        f"a reversal would not move the stem {where}: a friction of "
        f"{likely.static_friction:.4g} N needs {needed / 1e3:.4g} kPa to move the stem both "
        f"ways, and there are {(band.high - band.low) / 1e3:.4g}: {remedy}"
    )
