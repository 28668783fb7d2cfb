# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `call`: call a service of a running identifier without the command `ros2`."""

import argparse
import math
import sys

from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

from valve_friction_ros.commands.arguments.identification import has_failed
from valve_friction_ros.commands.console import shown_progress
from valve_friction_ros.commands.process import ExitCode, StopSignals, complain
from valve_friction_ros.identification.refusal import RefusalError

_DISCOVERY = 5.0
"""Time to search for an identifier, s. Chosen: nodes on a network find each other in 1 to 3 s."""


def run(options: argparse.Namespace) -> int:
    """Call the service and print its answer."""
    if not 0 < options.timeout < math.inf:
        raise ValueError(f"--timeout must be above zero, got {options.timeout:g}")
    if options.fail_on and options.service != "identify":
        raise ValueError(f"--fail-on: {options.service} makes no diagnosis; identify does")
    from valve_friction_ros.nodes.service_call import caller  # noqa: PLC0415 - needs ROS

    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with (
        StopSignals() as stop,
        shown_progress(*columns) as bar,
        caller(lambda: not stop.wanted()) as client,
    ):
        task = bar.add_task(f"looking for {options.valve}")
        identifier = client.find(options.valve, min(_DISCOVERY, options.timeout))
        bar.update(task, description=f"{identifier}: {options.service}")
        answer = client.call(identifier, options.service, options.timeout)
    if answer is None:
        complain(options.command, "interrupted: the identifier continues the task it has started")
        return stop.exit_code
    if not answer.success:
        raise RefusalError(f"{identifier}: {answer.message}")
    print(f"{answer.level.name}: {answer.message}" if answer.level is not None else answer.message)
    sys.stdout.flush()
    if answer.level is None and options.fail_on:
        raise RefusalError(f"{identifier}: its diagnosis did not appear on /diagnostics")
    return ExitCode.ALARM if has_failed(options, filter(None, [answer.level])) else ExitCode.DONE
