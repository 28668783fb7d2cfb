# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Serve the dashboard of a history: plant, valve, alarms and comparison, without ROS."""

import argparse
import contextlib
import sys
from pathlib import Path

from valve_friction_ros.commands.process import ExitCode, requests_raise
from valve_friction_ros.dashboard import DashboardOptions, Plant
from valve_friction_ros.dashboard.accounts import Access, accounts_from
from valve_friction_ros.dashboard.context import INSTALL, DashboardContext
from valve_friction_ros.dashboard.history_cache import KeptValves


def _log(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def run(options: argparse.Namespace) -> int:
    """Serve the pages until Ctrl-C or SIGTERM."""
    place = options.file
    if isinstance(place, Path) and not place.is_file():
        raise ValueError(f"{place}: no such file: `identify-folder --history` creates it")
    access = Access(host=options.host, accounts=accounts_from(options.accounts))
    shown = DashboardOptions(
        access,
        options.port,
        place,
        reports=options.reports,
        time_zone=options.time_zone,
        silence=float("inf"),
    )
    try:
        from valve_friction_ros.dashboard.pages import server  # noqa: PLC0415 - slow to import
    except ModuleNotFoundError as error:
        if error.name and error.name.startswith("valve_friction_ros"):
            raise
        raise ValueError(f"the pages need NiceGUI, which is not installed: {INSTALL}") from None
    server.require_free(access.host, shown.port)
    plant = Plant(shown.silence)
    history = KeptValves(place, plant)
    history.valve("")  # refuses a file that is not a history
    visitors = server.guarded(access, _log)
    context = DashboardContext(shown, plant, history, visitors, _log)
    requests_raise()
    with contextlib.suppress(KeyboardInterrupt):
        server.serve(
            context, lambda: _log(f"ready: open {shown.address}"), _log, is_active=lambda: True
        )
    return ExitCode.DONE
