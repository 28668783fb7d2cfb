"""Two identifications side by side."""

import math
from dataclasses import dataclass

from valve_friction_ros.dashboard.heard.status_keys import Quantity
from valve_friction_ros.dashboard.heard.valve_view import ValveView
from valve_friction_ros.dashboard.plant_rows import ratio_text
from valve_friction_ros.history import HistoryEntry
from valve_friction_ros.identification import SLIDING, UNITS
from valve_friction_ros.outside_text import printable

__all__ = ["Difference", "Side", "compared", "side_of_entry", "side_of_view"]


@dataclass(frozen=True)
class Side:
    """One identification: of which valve, when (ns since 1970), how, and what it found."""

    tag: str
    time: int | None
    method: str
    sentence: str
    parameters: tuple[Quantity, ...]


@dataclass(frozen=True)
class Difference:
    """A parameter on both sides.

    Attributes
    ----------
    name : str
        The parameter.
    one, other : Quantity
        It on either side, without a value where it is not there.
    ratio, half_width : float
        The other over the one, and half the width of its 95 % interval; nan where unknown.
    """

    name: str
    one: Quantity
    other: Quantity
    ratio: float
    half_width: float

    @property
    def verdict(self) -> str:
        """Whether the two differ by more than their intervals; empty where that is unknown."""
        if not math.isfinite(self.half_width):
            return ""
        change = self.other.value - self.one.value
        width = math.hypot(self.one.half_width, self.other.half_width)
        return "differs" if abs(change) > width else "no difference seen"

    @property
    def ratio_words(self) -> str:
        """The ratio with its interval."""
        if not math.isfinite(self.ratio):
            return "–"
        if not math.isfinite(self.half_width) or not 0.01 <= abs(self.ratio) < 1e4:
            return ratio_text(self.ratio)
        return f"{self.ratio:.2f} ± {self.half_width:.2f}"


def side_of_view(view: ValveView) -> Side:
    """Return what is known of a valve now."""
    method = printable(view.values.get("method", "–"), 80)
    return Side(view.tag, view.identified, method, view.sentence, view.parameters)


def side_of_entry(entry: HistoryEntry) -> Side:
    """Return what the history keeps of an identification."""
    units = {**UNITS, SLIDING: "N"}
    parameters = tuple(
        Quantity(
            name, one.value, one.half_width, units.get(name, ""), one.verdict.value, one.reason
        )
        for name, one in entry.parameters.items()
    )
    tag = printable(entry.valve.tag or entry.valve.name, 80)
    return Side(tag, entry.time, entry.method, printable(entry.diagnosis.message, 2000), parameters)


def compared(one: Side, other: Side) -> tuple[Difference, ...]:
    """Compare all parameters of either side, in the order of the first.

    The interval of a ratio adds the relative half widths of both sides as independent.
    """
    left = {each.name: each for each in one.parameters}
    right = {each.name: each for each in other.parameters}
    return tuple(
        _difference(
            name,
            left.get(name, Quantity(name, math.nan)),
            right.get(name, Quantity(name, math.nan)),
        )
        for name in dict.fromkeys((*left, *right))
    )


def _difference(name: str, one: Quantity, other: Quantity) -> Difference:
    is_open = any(each.verdict in ("fixed", "not identifiable") for each in (one, other))
    known, value = one.if_determined.value, other.if_determined.value
    ratio = value / known if known else math.nan
    shares = [each.half_width / each.value if each.value else math.nan for each in (one, other)]
    width = math.nan if is_open else abs(ratio) * math.hypot(*shares)
    return Difference(name, one, other, ratio, width)
