"""What can be imperfect, and by how much: one set to develop with, and another held out."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from benchmark.reality.excitations import Kind
from benchmark.reality.plants import Plant
from benchmark.reality.sensors import Instruments
from benchmark.reality.stamps import Stamping

__all__ = ["DRIVES", "Imperfection", "body", "both", "clocks", "friction", "position", "pressure"]

DRIVES = (Kind.SQUARE, Kind.RANDOM, Kind.TRIANGLE, Kind.SERVICE)
"""Drives under which each imperfection is tried."""

_IDEAL = Instruments()
_Change = Callable[[Plant], Plant]


def _same(plant: Plant) -> Plant:
    return plant


@dataclass(frozen=True)
class Imperfection:
    """One imperfection of one size.

    Attributes
    ----------
    kind, label : str
        Its class, and which of that class.
    instruments : Instruments
        Sensors and clocks with it.
    change : callable
        From a plant to the plant with it.
    words : tuple of str
        Beginnings of words of which one at least names it.
    drives : tuple of Kind
        Under which it is tried.
    reaches_stops : bool
        Whether the drive presses the stem onto both stops.
    is_another_plant : bool
        Whether the baseline is of the changed plant: it is not a fault but another packing.
    """

    kind: str
    label: str
    instruments: Instruments = field(default_factory=Instruments)
    change: _Change = _same
    words: tuple[str, ...] = ()
    drives: tuple[Kind, ...] = DRIVES
    reaches_stops: bool = False
    is_another_plant: bool = False


def friction(**changes: Any) -> _Change:
    """Return the change of a plant whose friction differs in these fields."""
    return lambda plant: replace(plant, friction=replace(plant.friction, **changes))


def body(**changes: Any) -> _Change:
    """Return the change of a plant whose body differs in these fields."""
    return lambda plant: replace(plant, body=replace(plant.body, **changes))


def pressure(**changes: Any) -> Instruments:
    """Return instruments whose pressure sensor differs in these fields."""
    return replace(_IDEAL, pressure=replace(_IDEAL.pressure, **changes))


def position(**changes: Any) -> Instruments:
    """Return instruments whose position sensor differs in these fields."""
    return replace(_IDEAL, position=replace(_IDEAL.position, **changes))


def both(**changes: Any) -> Instruments:
    """Return instruments of which both sensors differ in these fields."""
    return replace(
        _IDEAL,
        pressure=replace(_IDEAL.pressure, **changes),
        position=replace(_IDEAL.position, **changes),
    )


def clocks(first: Stamping, second: Stamping | None = None) -> Instruments:
    """Return instruments with this clock for both; with a second one, each samples by its own."""
    return replace(
        _IDEAL,
        pressure_stamping=first,
        position_stamping=second or first,
        together=second is None,
    )
