"""Which valves a page shows, and in which order; the address of the page holds it."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any
from urllib.parse import parse_qsl, urlencode, urlsplit

from valve_friction_ros.dashboard.heard.plant import Heard
from valve_friction_ros.health import Level, StatusSignal

__all__ = [
    "SIGNALS",
    "SORTS",
    "STATES",
    "Selection",
    "levels_in",
    "selected",
    "state_of",
    "worst_first",
]

STATES = ("error", "silent", "warn", "unknown", "ok", "unheard")
"""States of a valve, the worst first; ``unheard``: only the history knows it.

A silent valve may be anything, and comes after an error."""

SIGNALS = tuple(one.value for one in StatusSignal if one.value)
_LONGEST_SEARCH = 200


def state_of(valve: Heard) -> str:
    """Return the state of a valve: its level in small letters, or that it is silent.

    A valve is ``ok`` only where a comparison with a baseline found nothing.
    """
    if valve.is_silent:
        return "unheard" if valve.silent_for is None else "silent"
    level = valve.view.level
    if level is None or (level is Level.OK and valve.view.ratio is None):
        return "unknown"
    return level.name.lower()


def _said_last(valve: Heard) -> int:
    """Return the level that a silent valve has said last: it orders these."""
    return (valve.view.level or 0) if state_of(valve) == "silent" else 0


def _change(valve: Heard) -> float:
    """Return the change of friction: one that has halved has changed as much as one doubled."""
    ratio = valve.view.ratio
    return abs(math.log(ratio.value)) if ratio is not None and ratio.value > 0 else -1.0


def _or(value: float | None, missing: float = -math.inf) -> float:
    return missing if value is None or math.isnan(value) else value


def worst_first(valve: Heard) -> tuple[Any, ...]:
    """Return the key by which the valve that needs attention most comes first."""
    return (
        STATES.index(state_of(valve)),
        -_said_last(valve),
        -_change(valve),
        -_or(valve.view.dead_band.if_determined.value),
        valve.view.tag,
    )


def _by_number(value: Callable[[Heard], float | None]) -> Callable[[Heard], tuple[Any, ...]]:
    return lambda valve: (-_or(value(valve)), valve.view.tag)


SORTS: dict[str, Callable[[Heard], tuple[Any, ...]]] = {
    "worst": worst_first,
    "tag": lambda valve: (valve.view.tag, valve.view.node),
    "ratio": _by_number(lambda valve: valve.view.ratio and valve.view.ratio.value),
    "dead_band": _by_number(lambda valve: valve.view.dead_band.if_determined.value),
    "friction": _by_number(lambda valve: valve.view.friction.value),
    "drift": _by_number(lambda valve: valve.view.drift and abs(valve.view.drift.value)),
    "age": lambda valve: (valve.view.identified or 0, valve.view.tag),
}
"""Orders by name: the key of each puts the most urgent or the largest first."""


@dataclass(frozen=True)
class Selection:
    """What a page of the plant shows.

    Attributes
    ----------
    search : str
        Words; each must be in tag, name or diagnosis.
    states, signals : frozenset of str
        States and letters of NE 107 that are shown; empty: all.
    sort : str
        Name of the order (`SORTS`).
    is_reversed : bool
        Whether the order is turned round.
    is_tiled : bool
        Whether valves are tiles, and not rows.
    """

    search: str = ""
    states: frozenset[str] = frozenset()
    signals: frozenset[str] = frozenset()
    sort: str = "worst"
    is_reversed: bool = False
    is_tiled: bool = False

    @classmethod
    def from_query(cls, query: Mapping[str, str]) -> "Selection":
        """Read an address; what is unknown in it is left out."""
        order = query.get("sort", "worst")
        name = order.removeprefix("-")
        return cls(
            search=query.get("q", "")[:_LONGEST_SEARCH],
            states=frozenset(query.get("show", "").split(",")) & frozenset(STATES),
            signals=frozenset(query.get("ne", "").split(",")) & frozenset(SIGNALS),
            sort=name if name in SORTS else "worst",
            is_reversed=order.startswith("-"),
            is_tiled=query.get("view") == "tiles",
        )

    @classmethod
    def from_address(cls, address: str) -> "Selection":
        """Read the address of a page of the plant; what shows all for that of another page."""
        try:
            parts = urlsplit(address)
            return cls.from_query(dict(parse_qsl(parts.query)) if parts.path == "/" else {})
        except ValueError:
            return cls()

    def to_query(self) -> dict[str, str]:
        """Return what an address has to hold; nothing that is usual."""
        sign = "-" if self.is_reversed else ""
        parts = {
            "q": self.search,
            "show": ",".join(one for one in STATES if one in self.states),
            "ne": ",".join(one for one in SIGNALS if one in self.signals),
            "sort": "" if (self.sort, sign) == ("worst", "") else sign + self.sort,
            "view": "tiles" if self.is_tiled else "",
        }
        return {key: text for key, text in parts.items() if text}

    def address(self, more: Mapping[str, str]) -> str:
        """Return the address of this page, with further parts."""
        query = urlencode({**self.to_query(), **more})
        return f"/?{query}" if query else "/"

    def sorted_by(self, name: str) -> "Selection":
        """Sort by a column; a second time turns it round."""
        return replace(self, sort=name, is_reversed=self.sort == name and not self.is_reversed)

    def shows(self, valve: Heard) -> bool:
        """Return whether a valve is shown."""
        if self.states and state_of(valve) not in self.states:
            return False
        if self.signals and valve.view.signal.value not in self.signals:
            return False
        view = valve.view
        text = f"{view.tag} {view.node} {view.sentence}".casefold()
        return all(word in text for word in self.search.casefold().split())


def selected(valves: Iterable[Heard], selection: Selection) -> list[Heard]:
    """Return the valves that are shown, in order."""
    shown = filter(selection.shows, valves)
    return sorted(shown, key=SORTS[selection.sort], reverse=selection.is_reversed)


def levels_in(valves: Iterable[Heard]) -> dict[str, int]:
    """Count the valves of each state."""
    counts = dict.fromkeys(STATES, 0)
    for valve in valves:
        counts[state_of(valve)] += 1
    return counts
