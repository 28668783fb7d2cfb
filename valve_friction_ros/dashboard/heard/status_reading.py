"""A diagnostic status read as a valve; what is wrong in it is left out."""

import math
from collections.abc import Mapping
from datetime import datetime

from valve_friction_ros.dashboard.heard.status_keys import Quantity, number, quantity
from valve_friction_ros.dashboard.heard.valve_view import (
    Drift,
    Expected,
    Interval,
    Sources,
    Status,
    ValveView,
)
from valve_friction_ros.health import Level, StatusSignal
from valve_friction_ros.outside_text import printable

__all__ = ["ESSENTIAL_KEYS", "Essence", "essence_of", "identifier_in", "view_of"]

_SOURCES = ("pressure_topic", "stem_topic", "stem_joint")
_SUFFIX = ": friction"
_LONGEST = 2000


def identifier_in(name: str) -> str | None:
    """Return the identifier that a status of this name is of; None for another one's status."""
    node = name.removesuffix(_SUFFIX)
    return node if node != name and node.startswith("/") and len(node) < 256 else None


ESSENTIAL_KEYS = (
    "NE 107",
    "estimate_valid",
    "estimate_time",
    "reason",
    "friction_ratio",
    "friction_ratio low",
    "friction_ratio high",
    "dead_band [%]",
    "dead_band half width [%]",
    "friction_drift [N/month]",
    "friction_drift half width [N/month]",
    "limit_expected",
    "limit_expected [date]",
    "limit_expected earliest [date]",
    "limit_expected latest [date]",
    "baseline_coulomb_friction [N]",
    "baseline half width [N]",
    "baseline_sliding_friction [N]",
    *_SOURCES,
)
"""Keys of what tells two views of a valve apart, without their counters and ages."""

Essence = tuple[object, ...]
"""What tells two views of a valve apart, without their counters and ages."""


def essence_of(status: Status) -> Essence:
    """Return what a view is made from: the parameters are those of the estimate's time."""
    return (
        status.level,
        status.hardware_id,
        status.message,
        *map(status.values.get, ESSENTIAL_KEYS),
    )


def view_of(node: str, status: Status) -> ValveView:
    """Read the status of an identifier; what is wrong in it is left out."""
    values = status.values
    return ValveView(
        node=node,
        tag=printable(status.hardware_id or node.rpartition("/")[0].strip("/") or node, 80),
        level=Level(status.level) if status.level in Level._value2member_map_ else None,
        signal=_signal(values.get("NE 107", "")),
        sentence=printable(status.message, _LONGEST),
        is_valid=values.get("estimate_valid") == "true",
        reason=printable(values.get("reason", ""), _LONGEST),
        identified=_stamp(values.get("estimate_time", "")),
        ratio=_ratio(values),
        dead_band=quantity(values, "dead_band", "%"),
        parameters=_parameters(values),
        baseline=_baseline(values),
        drift=_drift(values),
        sources=Sources(*(values.get(key, "") for key in _SOURCES)),
        values=values,
    )


def _signal(letter: str) -> StatusSignal:
    try:
        return StatusSignal(letter)
    except ValueError:
        return StatusSignal.CHECK_FUNCTION


def _stamp(text: str) -> int | None:
    try:
        moment = datetime.strptime(text, "%Y-%m-%dT%H:%M:%S.%f%z")
    except ValueError:
        return None
    return round(moment.timestamp() * 1e3) * 1_000_000


def _ratio(values: Mapping[str, str]) -> Interval | None:
    value, low, high = (number(values.get(f"friction_ratio{end}")) for end in ("", " low", " high"))
    if not math.isfinite(value):
        return None
    return Interval(value, low, high, printable(values.get("friction_ratio of", ""), 80))


def _parameters(values: Mapping[str, str]) -> tuple[Quantity, ...]:
    units = {}
    for key in values:
        name, bracket, unit = key.partition(" half width [")
        if bracket and f"{name} verdict" in values and not name.startswith("evidence "):
            units[name] = unit.rstrip("]")
    return tuple(quantity(values, name, unit) for name, unit in units.items())


def _baseline(values: Mapping[str, str]) -> tuple[Quantity, ...]:
    coulomb = Quantity(
        "coulomb_friction",
        number(values.get("baseline_coulomb_friction [N]")),
        number(values.get("baseline half width [N]")),
        "N",
    )
    sliding = quantity(values, "baseline_sliding_friction", "N")._replace(name="sliding_friction")
    return tuple(one for one in (coulomb, sliding) if one.is_known)


def _drift(values: Mapping[str, str]) -> Drift | None:
    value = number(values.get("friction_drift [N/month]"))
    if not math.isfinite(value):
        return None
    expected = None
    if limit := values.get("limit_expected"):
        dates = (f"limit_expected{end} [date]" for end in ("", " earliest", " latest"))
        texts = (printable(values.get(one, ""), 40) for one in dates)
        expected = Expected(printable(limit, 40), *texts)
    width = number(values.get("friction_drift half width [N/month]"))
    return Drift(value, width, printable(values.get("friction_drift of", ""), 80), expected)
