"""The argument ``--fail-on``: a diagnosis that ends a command with an exit code of its own."""

import argparse
from collections.abc import Iterable

from valve_friction_ros.health import Level

__all__ = ["add_fail_on", "has_failed"]

_LEVELS = {level.name.lower(): level for level in (Level.WARN, Level.ERROR)}


def add_fail_on(parser: argparse.ArgumentParser) -> None:
    """Declare the level from which a diagnosis fails the command."""
    parser.add_argument(
        "--fail-on",
        choices=[*_LEVELS],
        help="exit code 3 if a diagnosis is as severe as this, or more; without a baseline no "
        "friction is compared, which raises no alarm",
    )


def has_failed(options: argparse.Namespace, found: Iterable[Level]) -> bool:
    """Return whether ``--fail-on`` is given, and one of the levels reaches it."""
    return options.fail_on is not None and any(one >= _LEVELS[options.fail_on] for one in found)
