"""What the people who play a stroke test must know: what may happen, and what will not be known."""

import math
from collections.abc import Iterator

from valve_friction_ros.identification import percentage
from valve_friction_ros.identification.trust.limits import FALL_SPEED
from valve_friction_ros.planning.conditions import AIMS
from valve_friction_ros.planning.forecast import Forecast
from valve_friction_ros.planning.pressure_band import (
    LEAST_STROKE,
    frictionless_reach,
    lowest_pressure,
    stroke,
)
from valve_friction_ros.planning.search import StrokePlan

__all__ = ["plan_remarks"]

_OVER = 5e-3
"""Share of the travel by which a simulated stem may leave its part before it is said."""

_FASTER = 1.05
_UNKNOWN = 0.5
"""Half width over the value from which on a number is called unknown."""


def _resting(plan: StrokePlan) -> Iterator[str]:
    """Yield the valves of the range that will not move."""
    for name, one, draw in zip(
        plan.frictions.names, plan.forecasts, plan.frictions.draws, strict=True
    ):
        if stroke(plan.valve, draw, plan.band) < LEAST_STROKE * plan.valve.travel:
            yield (
                f"a friction {name} (F_s {draw.static_friction:.4g} N) may hold the stem: if it "
                "does not move, friction has grown at least so far; widen its part of the travel"
            )
        elif one.refusal:
            yield f"friction {name}: the identification would refuse the record: {one.refusal}"


def _reaches(plan: StrokePlan) -> Iterator[str]:
    """Yield that the stem may leave its part of the travel."""
    valve, limits = plan.valve, plan.limits
    if plan.band.low <= lowest_pressure(valve):
        yield (
            f"the lower end is the atmosphere, {plan.band.low / 1e3:.4g} kPa (pressure_reference): "
            "the stem may not reach the lower end of its part of the travel"
        )
    low, high = frictionless_reach(valve, plan.frictions, plan.band)
    if low < limits.lowest * valve.travel or high > limits.highest * valve.travel:
        yield (
            f"with less friction than was assumed the stem goes further, at most from "
            f"{100 * max(low, 0.0) / valve.travel:.0f} to "
            f"{100 * min(high, valve.travel) / valve.travel:.0f} % of the travel"
        )
    if low <= 0 or high >= valve.travel:
        yield "the stem may reach seat or stop: there its pressure tells nothing of friction"
    lowest = min(one.reach[0] for one in plan.forecasts)
    highest = max(one.reach[1] for one in plan.forecasts)
    over = max(limits.lowest * valve.travel - lowest, highest - limits.highest * valve.travel)
    if over > _OVER * valve.travel:
        yield (
            f"after a breakaway the stem may overshoot its part of the travel by "
            f"{over * 1e3:.2g} mm"
        )


def _speeds(plan: StrokePlan) -> Iterator[str]:
    fastest = max(one.top_speed for one in plan.forecasts)
    if fastest > _FASTER * plan.limits.speed:
        yield (
            f"as it breaks away the stem may jump, at up to {fastest * 1e3:.2g} mm/s, whatever the "
            "pressure does"
        )
    if plan.likely.top_speed < FALL_SPEED:
        yield (
            f"the stem moves at {plan.likely.top_speed * 1e3:.2g} mm/s at most: what friction is "
            f"above that, up to {FALL_SPEED * 1e3:.2g} mm/s, remains unknown; allow more speed or "
            "travel"
        )


def _unknown(plan: StrokePlan) -> Iterator[str]:
    for name in AIMS[plan.aim]:
        share = plan.likely.relative(name)
        if share <= _UNKNOWN:
            continue
        why = f"is known to ±{percentage(share)} only" if math.isfinite(share) else "is not told"
        remedy = "allow more time, speed or travel"
        if name == "viscous_friction":
            remedy = "its delay F_v/k cannot be told from a lag of the signals: state a smaller "
            remedy += "timing_uncertainty if the clocks allow it"
        yield f"{name} {why}: {remedy}"


def _model(one: Forecast) -> Iterator[str]:
    if one.parameters.static_friction > one.parameters.coulomb_friction:
        yield (
            "if friction falls gradually with speed (Stribeck), the intervals of F_c, F_v and F_s "
            "will be several times wider than predicted"
        )


def plan_remarks(plan: StrokePlan) -> tuple[str, ...]:
    """Return a sentence for each thing to be known before a test is played."""
    return (
        *_resting(plan),
        *_reaches(plan),
        *_speeds(plan),
        *_unknown(plan),
        *_model(plan.likely),
    )
