"""One valve as it is shown."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from valve_friction_ros.dashboard.heard.status_keys import Entry, Quantity
from valve_friction_ros.dashboard.heard.value_groups import groups_of
from valve_friction_ros.health import Level, StatusSignal

__all__ = ["Drift", "Expected", "Interval", "Sources", "Status", "Unread", "ValveView"]

_NO_DEAD_BAND = Quantity("dead_band", math.nan, unit="%")


class Status(NamedTuple):
    """A diagnostic status as it was heard: the fields of diagnostic_msgs/DiagnosticStatus."""

    name: str
    level: int
    hardware_id: str
    message: str
    values: Mapping[str, str]


class Unread(NamedTuple):
    """A status that is read when somebody looks.

    Attributes
    ----------
    name : str
        Its name.
    read : callable
        Returns the status; raises ValueError if it is none.
    mark : callable or None
        Returns what is the same as long as nothing but ages and counters changes; raises ValueError
        if the bytes are no status. None: it has to be read.
    """

    name: str
    read: Callable[[], Status]
    mark: Callable[[], object] | None = None


class Interval(NamedTuple):
    """A ratio of frictions and its 95 % interval, and the words for which friction it is."""

    value: float
    low: float
    high: float
    of: str = ""


class Expected(NamedTuple):
    """The limit that a drift is expected to cross, and the dates of that (ISO 8601)."""

    limit: str
    date: str
    earliest: str
    latest: str


class Sources(NamedTuple):
    """Where the samples of a valve come from; empty names where that is unknown."""

    pressure_topic: str = ""
    stem_topic: str = ""
    joint: str = ""


class Drift(NamedTuple):
    """Drift of the friction, N a month, half its interval's width, and the limit ahead, if any."""

    value: float
    half_width: float
    of: str
    expected: Expected | None


_NO_SOURCES = Sources()


@dataclass(frozen=True)
class ValveView:
    """What a dashboard shows of one valve.

    Attributes
    ----------
    node : str
        The fully qualified name of its identifier, which tells valves apart.
    tag : str
        Its tag in the plant.
    level : Level or None
        Severity; None where nothing is known.
    signal : StatusSignal
        The severity by NAMUR NE 107.
    sentence : str
        The diagnosis in words.
    is_valid, reason : bool, str
        Whether there is an estimate, and why not.
    identified : int or None
        When the estimate was made, ns since 1970 (UTC).
    ratio : Interval or None
        Friction over that of the baseline.
    dead_band : Quantity
        Dead band of the stem, % of the travel.
    parameters : tuple of Quantity
        The identified parameters.
    baseline : tuple of Quantity
        Frictions of the baseline; empty without one.
    drift : Drift or None
        A significant drift.
    sources : Sources
        Topics of its samples.
    values : mapping of str to str
        All values, as they were heard.
    """

    node: str
    tag: str
    level: Level | None = None
    signal: StatusSignal = StatusSignal.GOOD
    sentence: str = ""
    is_valid: bool = False
    reason: str = ""
    identified: int | None = None
    ratio: Interval | None = None
    dead_band: Quantity = _NO_DEAD_BAND
    parameters: tuple[Quantity, ...] = ()
    baseline: tuple[Quantity, ...] = ()
    drift: Drift | None = None
    sources: Sources = _NO_SOURCES
    values: Mapping[str, str] = field(default_factory=dict, repr=False, compare=False)

    @property
    def namespace(self) -> str:
        """The namespace of the valve."""
        return self.node.rpartition("/")[0] or "/"

    def groups(self) -> dict[str, tuple[Entry, ...]]:
        """Return the values that have no place of their own, by what they are about.

        The groups are ``changes``, ``fit``, ``evidence``, ``usage``, ``command`` and
        ``counters``.
        """
        return groups_of(self.values, {one.name for one in self.parameters})

    def parameter(self, name: str) -> Quantity:
        """Return a parameter, without a value where it is not there."""
        found = (one for one in self.parameters if one.name == name)
        return next(found, Quantity(name, math.nan))

    @property
    def friction(self) -> Quantity:
        """The Coulomb friction; the sliding friction where the record determines that alone."""
        coulomb = self.parameter("coulomb_friction").if_determined
        sliding = self.parameter("sliding_friction").if_determined
        return sliding if sliding.is_known and not coulomb.is_known else coulomb
