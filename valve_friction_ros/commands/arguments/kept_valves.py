"""Valves of a history, chosen by what people call them."""

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from valve_friction_ros.history import KeptValve

__all__ = ["add_valve_argument", "chosen_valves"]


def add_valve_argument(parser: argparse.ArgumentParser) -> None:
    """Declare ``--valve``, which chooses some."""
    parser.add_argument(
        "--valve",
        action="append",
        metavar="NAME",
        help="only this valve: its tag, its namespace, or the name of its identifier; "
        "may be repeated",
    )


def _is_called(valve: "KeptValve", name: str) -> bool:
    namespace = valve.name.rpartition("/")[0]
    return name == valve.tag or f"/{name.strip('/')}" in (valve.name, namespace)


def chosen_valves(
    valves: "Sequence[KeptValve]", names: Sequence[str] | None, option: str
) -> "tuple[KeptValve, ...]":
    """Return the valves of these names: tag, namespace or identifier; all without names.

    Raises ValueError, which names `option` and the valves, if there is no such valve.
    """
    if names is None:
        return tuple(valves)
    for name in names:
        if not any(_is_called(valve, name) for valve in valves):
            known = ", ".join(valve.name for valve in valves) or "none"
            raise ValueError(f"{option} {name}: there is no such valve; there are {known}")
    return tuple(valve for valve in valves if any(_is_called(valve, name) for name in names))
