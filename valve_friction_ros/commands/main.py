# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The command `valve_friction`: it runs the sub-command and reports errors."""

import argparse
import difflib
import importlib
import logging
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from valve_friction_ros import __version__
from valve_friction_ros.commands.process import (
    PROGRAM,
    ExitCode,
    OneLineParser,
    complain,
    flush_output,
    has_been_interrupted,
    let_interrupt_raise,
)
from valve_friction_ros.commands.start import end_at_once
from valve_friction_ros.history.place import HistoryError
from valve_friction_ros.identification.refusal import RefusalError

SUB_COMMANDS = {
    "identify": "identify the friction of a valve from a CSV file or a bag",
    "inspect": "show what would be read from a table: columns, units, rates, gaps, quality",
    "identify-folder": "identify all recordings of a folder, on all cores",
    "describe-valve": "ask for an actuator's data and write its valve file",
    "plan-test": "plan the stroke test that determines friction best, as a file to play",
    "validate": "simulate a recording with an identified model",
    "call": "have a running identifier identify, set its baseline, save, report or clear",
    "history": "list, export and draw what the nodes have identified",
    "history copy": "copy a history to another file, or to or from a server",
    "dashboard": "serve plant, valves, alarms and comparison of a history, without ROS",
    "dashboard-account": "make a dashboard account, with the hash of a password",
    "reproduce-paper": "run the paper's experiments and write a report",
    "demo": "tighten the packing of a monitored simulated valve",
}
"""Line in ``--help`` of each sub-command. ``identify-folder`` is `run` of the module
`identify_folder`, ``history copy`` is `copy` of `history`: they take the parsed options and return
the exit code."""


def _chosen(arguments: Sequence[str]) -> tuple[str, list[str]]:
    """Return the sub-command and its arguments; without a sub-command end the process."""
    listed = "\n".join(f"  {name:<17} {text}" for name, text in SUB_COMMANDS.items())
    parser = OneLineParser(
        prog=PROGRAM,
        usage=f"{PROGRAM} SUB-COMMAND ...",
        description="Identify the friction of control valves, and follow it over time.\n\n"
        f"sub-commands (`{PROGRAM} SUB-COMMAND --help` describes them):\n{listed}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    parser.add_argument("command", metavar="SUB-COMMAND", help=argparse.SUPPRESS)
    rest = parser.add_argument("arguments", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    rest.required = False
    chosen = parser.parse_args(arguments)
    if chosen.command not in SUB_COMMANDS:
        (nearest,) = difflib.get_close_matches(chosen.command, SUB_COMMANDS, 1, cutoff=0.0)
        parser.error(f"unknown sub-command {chosen.command!r}; the nearest is {nearest!r}")
    two_words = " ".join((chosen.command, *chosen.arguments[:1]))
    if two_words in SUB_COMMANDS:
        return two_words, chosen.arguments[1:]
    return chosen.command, chosen.arguments


def _run(name: str, arguments: Sequence[str]) -> int:
    from valve_friction_ros.commands.arguments.declared import DECLARATIONS  # noqa: PLC0415

    parser = OneLineParser(prog=f"{PROGRAM} {name}")
    DECLARATIONS[name](parser)
    options = parser.parse_args(arguments, argparse.Namespace(command=name))
    package, _, _ = __name__.rpartition(".")
    try:
        command, _, action = name.replace("-", "_").partition(" ")
        run_command = getattr(importlib.import_module(f"{package}.{command}"), action or "run")
        let_interrupt_raise()
        code: int = run_command(options)
    except ImportError as error:
        from valve_friction_ros.nodes.start import lack_of_ros  # noqa: PLC0415 - rarely

        complain(name, lack_of_ros(error))
        return ExitCode.REFUSED
    except (ValueError, RefusalError, HistoryError) as error:
        complain(name, error)
        return ExitCode.REFUSED
    return code


def run(arguments: Sequence[str]) -> int:
    """Run the sub-command named by `arguments`; return the exit code.

    An error is one line on stderr.
    """
    name = ""
    try:
        try:
            name, others = _chosen(arguments)
            return _run(name, others)
        finally:
            flush_output()
    except BrokenPipeError:  # the reader has enough output, such as `head`
        return ExitCode.OUTPUT_CLOSED
    except OSError as error:
        complain(name, error)
        return ExitCode.REFUSED


def main() -> int:
    """Run as a process; Ctrl-C also ends it with one line."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by the parent process
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115
    if sys.stderr.isatty():  # a person may wonder why nothing happens
        logging.basicConfig(format=f"{PROGRAM}: %(message)s")
        logging.getLogger("valve_friction_ros.model.compiled").setLevel(logging.INFO)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, end_at_once)
    try:
        return run(sys.argv[1:])
    except BaseException:  # numpy turns a KeyboardInterrupt during its import into an ImportError
        if not has_been_interrupted():
            raise
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        complain(" ".join(sys.argv[1:2]), "interrupted")
        return ExitCode.INTERRUPTED
    finally:  # only the end of the process is left
        signal.signal(signal.SIGINT, signal.SIG_IGN)
