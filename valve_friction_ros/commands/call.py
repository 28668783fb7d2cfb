"""Sub-command `call`: a service of a running identifier, without the command `ros2`."""

import argparse
import math
import sys

from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from valve_friction_ros.commands.arguments.fail_on import add_fail_on, has_failed
from valve_friction_ros.commands.folder.stop_signals import StopSignals
from valve_friction_ros.commands.output.errors import ExitCode, complain
from valve_friction_ros.commands.output.formatting import OutputConsole
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.records.spelling import nearest

__all__ = ["REFUSALS", "declare", "run"]

REFUSALS = (RefusalError,)
_SERVICES = {
    "identify": "identify the buffered samples, and say the diagnosis",
    "set_baseline": "take the last result as the friction of the healthy valve",
    "restore_baseline": "undo the last set_baseline",
    "save": "save the buffered samples as a bag",
    "report": "write a page about the last result",
    "clear": "empty the buffer",
    "reset_usage": "count the usage anew, as the packing is renewed",
}
_TIMEOUT = 300.0
_DISCOVERY = 5.0
"""Time for which an identifier is looked for, s. Chosen: nodes of a network meet in 1 to 3 s."""


def _service(name: str) -> str:
    if name not in _SERVICES:
        raise argparse.ArgumentTypeError(
            f"unknown service {name[:60]!r}; {nearest(name, _SERVICES)}"
        )
    return name


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments, and what the help says around them."""
    listed = "\n".join(f"  {name:<17} {text}" for name, text in _SERVICES.items())
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.description = f"Call a service of a running identifier, and wait:\n{listed}"
    parser.epilog = (
        "Exit code 2: the identifier is not there, refused, or did not answer in time; "
        "3: the diagnosis reached --fail-on."
    )
    parser.add_argument("valve", metavar="VALVE", help="its namespace, such as /fv_101")
    parser.add_argument("service", type=_service, metavar="SERVICE", help="one of the above")
    parser.add_argument(
        "--timeout",
        type=float,
        default=_TIMEOUT,
        metavar="S",
        help="how long to wait for the answer (%(default)g)",
    )
    add_fail_on(parser)


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
