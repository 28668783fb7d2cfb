# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Where a history is, a file or a server; and its valves, chosen by what people call them."""

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from valve_friction_ros.history import URL_VARIABLE, HistoryServer, is_url
from valve_friction_ros.records.data_folder import history_file

if TYPE_CHECKING:
    from valve_friction_ros.history import KeptValve

PLACE = "FILE.sqlite|URL"
"""How the help calls it."""


def history_place(text: str) -> Path | HistoryServer:
    """Read a path, or the address of a server."""
    if not is_url(text):
        return Path(text)
    try:
        return HistoryServer(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def usual_history() -> str:
    """Return the address of the server that the environment names, else the file of the nodes."""
    return os.environ.get(URL_VARIABLE, "").strip() or str(history_file())


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
