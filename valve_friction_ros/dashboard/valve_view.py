"""One valve as it is shown: read from its diagnostic status."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import NamedTuple

from valve_friction_ros.dashboard.status_keys import (
    Entry,
    Quantity,
    entries_of,
    number,
    quantity,
)
from valve_friction_ros.health import Level, StatusSignal
from valve_friction_ros.outside_text import printable

__all__ = [
    "Drift",
    "Essence",
    "Expected",
    "Interval",
    "Sources",
    "Status",
    "ValveView",
    "essence_of",
    "identifier_in",
    "view_of",
]

_SOURCES = ("pressure_topic", "stem_topic", "stem_joint")
_SUFFIX = ": friction"
_LONGEST = 2000
_USAGE = (
    "packing_renewed",
    "travelled_distance",
    "reversals",
    "breakaways",
    "time_watched",
    "time_near_seat",
    "counting_dead_band",
    "usage",
)
_COMMAND = (
    "command ",
    "moves",
    "changes left",
    "largest ",
    "smallest ",
    "moved by ",
    "stem_command",
)


_NO_DEAD_BAND = Quantity("dead_band", math.nan, unit="%")


class Status(NamedTuple):
    """A diagnostic status as it was heard: the fields of diagnostic_msgs/DiagnosticStatus."""

    name: str
    level: int
    hardware_id: str
    message: str
    values: Mapping[str, str]


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

        The groups are ``fit``, ``evidence``, ``usage``, ``command`` and ``counters``.
        """
        return _groups(self.values, {one.name for one in self.parameters})

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


def identifier_in(name: str) -> str | None:
    """Return the identifier that a status of this name is of; None for another one's status."""
    node = name.removesuffix(_SUFFIX)
    return node if node != name and node.startswith("/") and len(node) < 256 else None


_ESSENTIAL = (
    "NE 107",
    "estimate_valid",
    "estimate_time",
    "reason",
    "friction_ratio",
    "friction_ratio low",
    "friction_ratio high",
    "dead_band [%]",
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

Essence = tuple[object, ...]
"""What tells two views of a valve apart, without their counters and ages."""


def essence_of(status: Status) -> Essence:
    """Return what a view is made from: the parameters are those of the estimate's time."""
    return (
        status.level,
        status.hardware_id,
        status.message,
        *map(status.values.get, _ESSENTIAL),
    )


def view_of(node: str, status: Status) -> ValveView:
    """Read the status of an identifier; what is wrong in it is left out."""
    values = status.values
    parameters = _parameters(values)
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
        dead_band=_dead_band(values, parameters),
        parameters=parameters,
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


def _dead_band(values: Mapping[str, str], parameters: tuple[Quantity, ...]) -> Quantity:
    """Return the dead band, (F_c + F_s)/k, with a half width from those of the three.

    Errors of F_c and F_s are taken as one, which is the widest; that of k is independent.
    """
    found = {one.name: one for one in parameters}
    unknown = Quantity("", math.nan)
    coulomb = found.get("coulomb_friction", unknown)
    static, spring = (found.get(n, unknown) for n in ("static_friction", "spring_constant"))
    if not static.is_known:
        static = coulomb
    value = number(values.get("dead_band [%]"))
    friction = (coulomb.half_width + static.half_width) / (coulomb.value + static.value or math.nan)
    stiffness = spring.half_width / (spring.value or math.nan)
    if spring.verdict == "fixed":
        stiffness = 0.0
    share = math.hypot(friction, stiffness)
    verdicts = [one.verdict for one in (coulomb, static, spring)]
    verdict = "not identifiable" if "not identifiable" in verdicts else coulomb.verdict
    return Quantity("dead_band", value, abs(value * share), "%", verdict)


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


def _groups(values: Mapping[str, str], parameters: set[str]) -> dict[str, tuple[Entry, ...]]:
    """Sort the values that have no place of their own by what they are about."""
    keys: dict[str, list[str]] = {
        name: [] for name in ("fit", "evidence", "usage", "command", "counters")
    }
    for key in values:
        if place := _group(key, parameters):
            keys[place].append(key)
    found = {name: entries_of(values, some) for name, some in keys.items()}
    bare = (one._replace(name=one.name.removeprefix("evidence ")) for one in found["evidence"])
    return {**found, "evidence": tuple(bare)}


_SHOWN = ("NE 107", "estimate_", "reason", "friction_ratio", "friction_drift", "limit_expected",
          "baseline", "dead_band", "travel_histogram", "preparing")  # fmt: skip
_FIT = ("fit", "rms", "systematic", "method", "derivative", "threshold", "samples", "sigma",
        "r_squared", "fixed", "warnings", "sliding_speed")  # fmt: skip


def _group(key: str, parameters: set[str]) -> str:
    """Return the group of a key; empty for one that is shown by itself."""
    if key.startswith(_SHOWN) or any(key.startswith(name) for name in parameters):
        return ""
    for group, starts in (
        ("evidence", ("evidence ",)),
        ("usage", _USAGE),
        ("command", _COMMAND),
        ("fit", _FIT),
    ):
        if key.startswith(starts):
            return group
    return "counters"
