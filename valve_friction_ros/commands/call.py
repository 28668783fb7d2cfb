"""Sub-command `call`: a service of a running identifier, without the command `ros2`."""

import argparse
import math
import sys

from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from valve_friction_ros.commands.arguments.fail_on import has_failed
from valve_friction_ros.commands.folder.stop_signals import StopSignals
from valve_friction_ros.commands.output.errors import ExitCode, complain
from valve_friction_ros.commands.output.formatting import OutputConsole
from valve_friction_ros.identification import RefusalError

__all__ = ["REFUSALS", "run"]

REFUSALS = (RefusalError,)
_DISCOVERY = 5.0
"""Time for which an identifier is looked for, s. Chosen: nodes of a network meet in 1 to 3 s."""


def run(options: argparse.Namespace) -> int:
    """Call the service, and print its answer."""
    if not 0 < options.timeout < math.inf:
        raise ValueError(f"--timeout must be above zero, got {options.timeout:g}")
    if options.fail_on and options.service != "identify":
        raise ValueError(f"--fail-on: {options.service} makes no diagnosis; identify does")
    try:
        from valve_friction_ros.nodes.service_call import caller  # noqa: PLC0415 - needs ROS
    except ImportError as error:
        raise ValueError(f"this command needs ROS 2: {error}") from None

    console = OutputConsole(stderr=True)
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with (
        StopSignals() as stop,
        Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar,
        caller(lambda: not stop.wanted()) as client,
    ):
        task = bar.add_task(f"looking for {options.valve}")
        identifier = client.find(options.valve, min(_DISCOVERY, options.timeout))
        bar.update(task, description=f"{identifier}: {options.service}")
        answer = client.call(identifier, options.service, options.timeout)
    if answer is None:
        complain(options.command, "interrupted: the identifier goes on with what it has begun")
        return stop.exit_code
    if not answer.success:
        raise RefusalError(f"{identifier}: {answer.message}")
    print(f"{answer.level.name}: {answer.message}" if answer.level is not None else answer.message)
    sys.stdout.flush()
    if answer.level is None and options.fail_on:
        raise RefusalError(f"{identifier}: its diagnosis did not come on /diagnostics")
    return ExitCode.ALARM if has_failed(options, filter(None, [answer.level])) else ExitCode.DONE
