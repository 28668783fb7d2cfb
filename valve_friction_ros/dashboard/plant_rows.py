"""Rows of the plant's table: texts and numbers ready for the browser, and what has changed."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from valve_friction_ros.dashboard.heard.plant import Heard
from valve_friction_ros.dashboard.heard.status_keys import Quantity
from valve_friction_ros.dashboard.heard.valve_view import Drift, Interval, ValveView
from valve_friction_ros.dashboard.selection import STATES, state_of
from valve_friction_ros.dashboard.sparkline import Sparkline

__all__ = [
    "SIGNAL_WORDS",
    "STATE_WORDS",
    "RowFeed",
    "drift_number",
    "interval_text",
    "number_and_width",
    "quantity_texts",
    "ratio_text",
    "row_of",
    "state_words",
    "summary",
]

_SAY = 240
_LOWEST, _HIGHEST = 0.25, 4.0
"""Ends of the bar of a ratio, a logarithmic axis."""

STATE_WORDS = {**{state: state for state in STATES}, "ok": "good", "unheard": "not heard"}

SIGNAL_WORDS = {
    "F": "failure",
    "C": "check function",
    "S": "out of specification",
    "M": "maintenance required",
    "": "good",
}
_SHORT = {"F": "failure", "C": "check", "S": "out of spec", "M": "maintenance"}
_FRICTIONS = {"coulomb_friction": "F_c", "sliding_friction": "sliding"}

Row = dict[str, Any]
"""A row under fixed keys: no key is ever a text from outside."""


def state_words(valve: Heard) -> str:
    """Return the state of a valve in a word or two."""
    state = state_of(valve)
    if state == "unknown":
        view = valve.view
        is_new = view.level is not None and view.friction.is_known and not view.baseline
        return "no baseline" if is_new else "unknown"
    if valve.is_silent or not valve.view.signal.value:
        return STATE_WORDS[state]
    return _SHORT[valve.view.signal.value]


def summary(counts: Mapping[str, int]) -> str:
    """Say how many valves there are, and how many of each state that is not good."""
    total = sum(counts.values())
    if not total:
        return "No valve yet"
    others = [
        f"{count} {STATE_WORDS[state]}"
        for state, count in counts.items()
        if count and state != "ok"
    ]
    valves = f"{total} valve{'s' if total > 1 else ''}"
    return f"{valves}: {', '.join(others)}" if others else f"{valves}, all good"


def number_and_width(value: float, half_width: float) -> tuple[str, str]:
    """Write a number and half the width of its interval, to four digits at most."""
    if not math.isfinite(value):
        return "–", ""
    is_plain = value == 0 or 1e-4 <= abs(value) < 1e6
    if not math.isfinite(half_width) or half_width <= 0:
        digits = f"{value:.3g}" if abs(value) < 1000 or not is_plain else f"{value:.0f}"
        return _minus(digits), ""
    if not is_plain or not 1e-6 <= half_width < 1e6:
        return _minus(f"{value:.4g}"), f"± {half_width:.2g}"
    of_width = 1 - math.floor(math.log10(half_width))
    of_value = 3 - math.floor(math.log10(abs(value))) if value else 3
    places = min(max(0, min(of_width, of_value)), 7)
    return _minus(f"{value:.{places}f}"), f"± {half_width:.{max(0, min(of_width, 7))}f}"


def ratio_text(ratio: float) -> str:
    """Write a ratio with two decimals, or with two digits where these would not show it."""
    return f"{ratio:.2f}" if ratio == 0 or 0.01 <= abs(ratio) < 1e4 else f"{ratio:.2g}"


def interval_text(ratio: Interval, between: str) -> str:
    """Write the interval of a ratio; empty where it has none."""
    ends = (ratio.low, ratio.high)
    return between.join(map(ratio_text, ends)) if all(map(math.isfinite, ends)) else ""


def _minus(number: str) -> str:
    return f"−{number[1:]}" if number.startswith("-") else number


def quantity_texts(one: Quantity) -> tuple[str, str]:
    """Write a quantity and half its interval; a dash where the record does not determine it."""
    known = one.if_determined
    return number_and_width(known.value, known.half_width)


def _place(ratio: float) -> float:
    span = math.log(_HIGHEST / _LOWEST)
    bounded = min(max(ratio, _LOWEST), _HIGHEST) if ratio > 0 else _LOWEST
    return round(100 * math.log(bounded / _LOWEST) / span, 1)


def _ratio(ratio: Interval | None) -> Row:
    if ratio is None:
        return {"ratio": "–", "between": "", "bar": None}
    bar = [_place(one) if math.isfinite(one) else _place(ratio.value) for one in ratio[:3]]
    return {"ratio": ratio_text(ratio.value), "between": interval_text(ratio, "–"), "bar": bar}


def drift_number(drift: Drift) -> str:
    """Write a drift with its sign and half its interval."""
    value, width = number_and_width(drift.value, drift.half_width)
    return f"{'+' if drift.value > 0 else ''}{value} {width}".strip()


def _drift(view: ValveView) -> Row:
    if view.drift is None:
        return {"drift": "–", "expected": ""}
    expected = view.drift.expected
    return {
        "drift": drift_number(view.drift),
        "expected": f"limit {expected.date}" if expected else "",
    }


def row_of(valve: Heard, spark: Sparkline | None, wall: float, href: str) -> Row:
    """Return the row of a valve; `wall` is the time of day, s since 1970."""
    view = valve.view
    dead, dead_width = quantity_texts(view.dead_band)
    friction = view.friction
    value, width = quantity_texts(friction)
    silent = valve.is_silent and valve.silent_for is not None
    return {
        "i": valve.number,
        "tag": view.tag,
        "place": view.namespace,
        "href": href,
        "state": state_of(valve),
        "ne": "" if valve.is_silent else view.signal.value,
        "word": state_words(valve),
        "say": view.sentence[:_SAY] or ("no message has been heard" if valve.is_silent else ""),
        **_ratio(view.ratio),
        "dead": dead,
        "deadw": dead_width,
        "fc": value,
        "fcw": width,
        "fcof": _FRICTIONS[friction.name] if friction.is_known else "",
        **_drift(view),
        "spark": spark.path if spark else "",
        "base": spark.base if spark else "",
        "days": spark.days if spark else 0,
        "made": None if view.identified is None else view.identified // 1_000_000_000,
        "last": round(wall - (valve.silent_for or 0.0)) if silent else None,
    }


class RowFeed:
    """What one browser has been sent, so that it is sent only what has changed.

    Parameters
    ----------
    href : callable
        Returns the address of a valve's page, from the name of its identifier.
    """

    def __init__(self, href: Callable[[str], str]) -> None:
        self._href = href
        self._sent: dict[int, tuple[object, ...]] = {}
        self._order: list[int] = []

    def news(
        self, shown: Iterable[Heard], sparks: Callable[[str], Sparkline | None], wall: float
    ) -> Row:
        """Return the clock, the rows that have changed, and the order if it has."""
        rows, order = [], []
        for valve in shown:
            order.append(valve.number)
            spark = sparks(valve.view.node)
            cause = (valve.revision, valve.is_silent, spark)
            if self._sent.get(valve.number) == cause:
                continue
            self._sent[valve.number] = cause
            rows.append(row_of(valve, spark, wall, self._href(valve.view.node)))
        news: Row = {"now": round(wall, 1)}
        if rows:
            news["rows"] = rows
        if order != self._order:
            news["order"] = self._order = order
        return news
