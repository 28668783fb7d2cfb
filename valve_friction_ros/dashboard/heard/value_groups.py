"""Values of a status that have no place of their own, sorted by what they are about."""

from collections.abc import Mapping

from valve_friction_ros.dashboard.heard.status_keys import Entry, entries_of

__all__ = ["groups_of"]

_CHANGE = " change"
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
_SHOWN = ("NE 107", "estimate_", "reason", "friction_ratio", "friction_drift", "limit_expected",
          "baseline", "dead_band", "travel_histogram", "preparing")  # fmt: skip
_FIT = ("fit", "rms", "systematic", "method", "derivative", "threshold", "samples", "sigma",
        "r_squared", "fixed", "warnings", "sliding_speed")  # fmt: skip


def groups_of(values: Mapping[str, str], parameters: set[str]) -> dict[str, tuple[Entry, ...]]:
    """Return the values that no other part of a page shows, by what they are about.

    The groups are ``changes``, ``fit``, ``evidence``, ``usage``, ``command`` and ``counters``;
    `parameters` are the names of the parameters.
    """
    keys: dict[str, list[str]] = {
        name: [] for name in ("changes", "fit", "evidence", "usage", "command", "counters")
    }
    for key in values:
        if place := _group(key, parameters):
            keys[place].append(key)
    found = {name: entries_of(values, some) for name, some in keys.items()}
    bare = (one._replace(name=one.name.removeprefix("evidence ")) for one in found["evidence"])
    return {**found, "evidence": tuple(bare), "changes": _with_intervals(found["changes"])}


def _with_intervals(changes: tuple[Entry, ...]) -> tuple[Entry, ...]:
    """Write each change since the baseline with its interval, in one entry."""
    texts = {one.name: one.text for one in changes}
    return tuple(
        Entry(
            one.name.removesuffix(_CHANGE),
            f"{one.text} ({texts[f'{one.name} low']} to {texts[f'{one.name} high']})"
            if {f"{one.name} low", f"{one.name} high"} <= texts.keys()
            else one.text,
            one.unit,
        )
        for one in changes
        if not one.name.endswith((" low", " high"))
    )


def _group(key: str, parameters: set[str]) -> str:
    """Return the group of a key; empty for one that is shown by itself."""
    if f"{_CHANGE} " in key and not key.startswith("evidence "):
        return "changes"
    if key.startswith(_SHOWN) or any(key.startswith(name) for name in parameters):
        return ""
    for group, starts in (
        ("evidence", ("evidence ",)),
        ("usage", _USAGE),
        ("command", _COMMAND),
        ("counters", ("samples_",)),
        ("fit", _FIT),
    ):
        if key.startswith(starts):
            return group
    return "counters"
