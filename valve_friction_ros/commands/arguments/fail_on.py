# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The argument ``--fail-on``: a diagnosis that ends a command with an exit code of its own."""

import argparse
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from valve_friction_ros.health import Level

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
