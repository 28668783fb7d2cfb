"""The argument ``--fail-on``: a diagnosis that ends a command with an exit code of its own."""

import argparse
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from valve_friction_ros.health import Level

__all__ = ["add_fail_on", "has_failed"]

_LEVELS = ("warn", "error")
"""Names of levels, in lower case."""


def add_fail_on(parser: argparse.ArgumentParser) -> None:
    """Declare the level from which a diagnosis fails the command."""
    parser.add_argument(
        "--fail-on",
        choices=_LEVELS,
        help="exit code 3 if a diagnosis is as severe as this, or more; without a baseline no "
        "friction is compared, which raises no alarm",
    )


def has_failed(options: argparse.Namespace, found: "Iterable[Level]") -> bool:
    """Return whether ``--fail-on`` is given, and one of the levels reaches it."""
    if options.fail_on is None:
        return False
    from valve_friction_ros.health import Level  # noqa: PLC0415 - slow to import

    return any(one >= Level[options.fail_on.upper()] for one in found)
