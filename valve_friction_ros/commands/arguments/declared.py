# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What each sub-command takes, and what its help says around it.

Nothing slow is imported here, so that a help text is there at once; what runs a sub-command is
imported when its arguments have been read.
"""

import argparse
import math
from collections.abc import Callable, Mapping
from datetime import datetime, timedelta, timezone
from pathlib import Path
from types import MappingProxyType

from valve_friction_ros.commands.arguments.actuator_questions import QUESTIONS
from valve_friction_ros.commands.arguments.fail_on import add_fail_on
from valve_friction_ros.commands.arguments.identification import add_identification_arguments
from valve_friction_ros.commands.arguments.kept_valves import (
    PLACE,
    add_valve_argument,
    history_place,
    usual_history,
)
from valve_friction_ros.commands.arguments.planning import add_planning_arguments
from valve_friction_ros.commands.arguments.recording import (
    add_reading_arguments,
    add_recording_arguments,
    add_table_arguments,
)
from valve_friction_ros.dashboard.accounts import Role
from valve_friction_ros.history import URL_VARIABLE
from valve_friction_ros.identification import LEAST_FIT
from valve_friction_ros.records.data_folder import history_file
from valve_friction_ros.records.spelling import nearest


def _add_files(parser: argparse.ArgumentParser) -> None:
    """Declare the picture, the report, and the baseline that friction is compared with."""
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="draw the identification")
    parser.add_argument(
        "--report",
        type=Path,
        metavar="FILE.html",
        help="write a page for people, one file: diagnosis, parameters, pictures, settings",
    )
    parser.add_argument(
        "--baseline-coulomb-friction",
        type=float,
        metavar="N",
        help="F_c of this valve when it was healthy; its diagnosis compares with it",
    )
    parser.add_argument(
        "--baseline-half-width",
        type=float,
        metavar="N",
        help="half width of the 95 %% interval of the baseline (0: exact)",
    )
    parser.add_argument(
        "--baseline-recording",
        type=Path,
        metavar="FILE",
        help="recording of this valve when it was healthy, read and identified with the same "
        "options; its friction is the baseline, and --report draws its signature",
    )


def _add_sharing(parser: argparse.ArgumentParser) -> None:
    """Declare the number of processes, or the cluster."""
    parser.add_argument(
        "--jobs",
        type=int,
        metavar="N",
        help="number of recordings identified in parallel, one process each (one per core)",
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="use the workers of a Dask cluster, which must see DIR under the same path, instead "
        "of local processes; tcp://host:8786 or tls://host:8786 (extra `cluster`)",
    )


def _identify(parser: argparse.ArgumentParser) -> None:
    parser.description = "Identify the Karnopp friction model from a recorded CSV file or bag."
    parser.epilog = (
        "All results are in SI units. Exit code 1: some valves were refused; 2: the file, the "
        "record or all valves of a bag were refused, or a file could not be written; 3: a "
        "diagnosis reached --fail-on. Without a baseline no friction is compared: a line on stderr "
        "says so, and the exit code stays 0 unless the signals or the model are in doubt."
    )
    add_recording_arguments(parser)
    add_identification_arguments(parser)
    _add_files(parser)
    add_fail_on(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def _inspect(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Show how a table would be read: format, columns, units, sampling rates, gaps, bad values "
        "and a sketch of each signal."
    )
    parser.epilog = (
        "Exit code 2: the file cannot be read or is ambiguous; stderr names every option that "
        "settles it."
    )
    add_recording_arguments(parser)
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="draw the recording")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def _identify_folder(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Identify all recordings in a folder and its subfolders, on all cores or on the workers of "
        "a Dask cluster. Write a table with one row per valve, and a page that ranks the valves. "
        "After an interruption, the same command resumes."
    )
    parser.epilog = (
        "Exit code 0: all were identified; 1: some were refused; 2: all recordings or an option "
        "were refused; 3: a diagnosis reached --fail-on; 130, 143: interrupted."
    )
    parser.add_argument(
        "folder",
        metavar="DIR",
        help="folder of the recordings, or s3://bucket/folder and other stores named as in fsspec "
        "(extra `stores`)",
    )
    parser.add_argument(
        "--output",
        type=Path,
        action="append",
        required=True,
        metavar="FILE",
        help="FILE.csv, FILE.jsonl (JSON lines) or FILE.html (a page that ranks the valves), "
        "written at the end and on interruption; may be repeated; until then FILE.sqlite holds the "
        "rows in the order in which they were finished",
    )
    parser.add_argument(
        "--no-reports",
        action="store_true",
        help="with FILE.html: write no page per valve in the folder FILE_reports, which takes a "
        "second and half a megabyte each",
    )
    parser.add_argument(
        "--baselines",
        type=Path,
        metavar="FILE.csv",
        help="friction of the healthy valves, with which the diagnosis compares: an earlier output "
        "of this command for a folder with the same names, or a table with the columns recording "
        "(empty: any), valve and coulomb_friction_n",
    )
    add_fail_on(parser)
    parser.add_argument(
        "--valve",
        type=Path,
        metavar="FILE.yaml",
        help="valve file for recordings that have neither NAME.valve.yaml beside them nor "
        "valve.yaml in their bag or beside them",
    )
    parser.add_argument(
        "--plant",
        type=Path,
        metavar="FILE.csv",
        help="table of the valves: tag, area, travel, spring, range; a recording belongs to the "
        "valve whose tag appears in its file name or above its values",
    )
    parser.add_argument(
        "--history",
        type=Path,
        metavar="FILE.sqlite",
        help="with --plant: store each result under its tag and the time of its recording, and "
        "compare it with the baseline stored there; `history` and the dashboard read it",
    )
    parser.add_argument(
        "--first-is-baseline",
        action="store_true",
        help="with --history: take the first result of a valve without a baseline as its baseline",
    )
    _add_sharing(parser)
    parser.add_argument(
        "--retry-failed",
        action="store_true",
        help="identify again the recordings that were refused before",
    )
    parser.add_argument(
        "--redo", action="store_true", help="replace rows that were computed with other options"
    )
    add_identification_arguments(parser)
    add_reading_arguments(parser)


def _describe_valve(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Write the valve file of an actuator. Ask for what the options leave open; with --yes only "
        "for what is required."
    )
    parser.epilog = "Exit code 2: an answer is missing or impossible, or the file was not written."
    parser.add_argument(
        "--output", type=Path, metavar="FILE.yaml", help="valve file (standard output)"
    )
    parser.add_argument("--replace", action="store_true", help="overwrite an existing file")
    parser.add_argument("--yes", action="store_true", help="take the defaults instead of asking")
    for each in QUESTIONS:
        parser.add_argument(
            f"--{each.name.replace('_', '-')}",
            dest=f"answer_{each.name}",
            metavar="ANSWER",
            help=f"{each.words}: {each.example}" + (f" ({each.default})" if each.default else ""),
        )
    add_table_arguments(parser, "format of its tables, stored in the section `columns:`")


def _plan_test(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Plan the stroke test with the smallest predicted intervals, by the Fisher information of "
        "simulated tests, and write it as a file that `pressure_source` plays. This moves no valve."
    )
    parser.epilog = (
        "All values are in SI units unless an option says otherwise. Exit code 2: a file or an "
        "option was refused, no test within the limits determines the friction, or a file could "
        "not be written."
    )
    parser.add_argument(
        "--valve", type=Path, required=True, metavar="VALVE.yaml", help="the valve file"
    )
    parser.add_argument(
        "--valve-name",
        metavar="NAME",
        help="which of several valves in the valve file or in --history",
    )
    add_planning_arguments(parser)
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("stroke_test.csv"),
        metavar="FILE.csv",
        help="corners of the pressure signal: time_s and pressure_pa (%(default)s)",
    )
    parser.add_argument(
        "--table",
        type=Path,
        metavar="FILE.csv",
        help="set points with their times in %%, mA, kPa and bar, abort positions, and what each "
        "step determines: for a control system without ROS",
    )
    parser.add_argument(
        "--form",
        type=Path,
        metavar="FILE.txt",
        help="the same as a partial-stroke test form, for a person with a stopwatch",
    )
    parser.add_argument(
        "--signal-range",
        metavar="RANGE",
        help="pressures at 0 and 100 %% signal, such as '0.2..1.0 bar' (the spring range)",
    )
    parser.add_argument("--replace", action="store_true", help="overwrite an existing file")
    parser.add_argument(
        "--figure", type=Path, metavar="FILE.png", help="draw pressure and expected stem"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def _percent(text: str) -> float:
    """Read a percentage of at most 100; return the share."""
    try:
        share = float(text.rstrip(" %")) / 100
    except ValueError:
        share = math.nan
    if not share <= 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a percentage, such as 90")
    return share


def _validate(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Simulate a recording with an identified model, and compare the stem positions. Use a "
        "different recording from the one that was identified."
    )
    parser.epilog = (
        "All values are in SI units. Exit code 2: a file or the record was refused, or the figure "
        "could not be written; 3: the fit is below --fail-below."
    )
    add_recording_arguments(parser)
    parser.add_argument(
        "--estimate",
        type=Path,
        required=True,
        metavar="ESTIMATE.json",
        help="the model, as `valve_friction identify --json` prints it",
    )
    parser.add_argument(
        "--fail-below",
        type=_percent,
        metavar="PERCENT",
        help="exit with code 3 if the fit is below this; a fit below "
        f"{100 * LEAST_FIT:g} is always called poor",
    )
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="plot both stem positions")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


SERVICES = {
    "identify": "identify the buffered samples and return the diagnosis",
    "set_baseline": "take the last result as the friction of the healthy valve",
    "restore_baseline": "undo the last set_baseline",
    "save": "save the buffered samples as a bag",
    "report": "write a report of the last result",
    "clear": "empty the buffer",
    "reset_usage": "reset the usage counters, after the packing was replaced",
}


_ANSWER_TIMEOUT = 300.0


def _service(name: str) -> str:
    if name not in SERVICES:
        raise argparse.ArgumentTypeError(
            f"unknown service {name[:60]!r}; {nearest(name, SERVICES)}"
        )
    return name


def _call(parser: argparse.ArgumentParser) -> None:
    listed = "\n".join(f"  {name:<17} {text}" for name, text in SERVICES.items())
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.description = (
        f"Call a service of a running identifier and wait for its answer:\n{listed}"
    )
    parser.epilog = (
        "Exit code 2: the identifier is not running, refused, or did not answer in time; "
        "3: the diagnosis reached --fail-on."
    )
    parser.add_argument("valve", metavar="VALVE", help="namespace of the valve, such as /fv_101")
    parser.add_argument("service", type=_service, metavar="SERVICE", help="one of the above")
    parser.add_argument(
        "--timeout",
        type=float,
        default=_ANSWER_TIMEOUT,
        metavar="S",
        help="time to wait for the answer (%(default)g)",
    )
    add_fail_on(parser)


EARLIEST = datetime(1970, 1, 1, tzinfo=timezone.utc)


LATEST = datetime(2262, 1, 1, tzinfo=timezone.utc)
"""Nanoseconds since 1970 of a later year may not fit a signed 64-bit integer."""


def _time(text: str) -> datetime:
    """Read a date, or a date and a time, in UTC unless it says otherwise."""
    try:
        time = datetime.fromisoformat(text.replace("Z", "+00:00"))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a time: write it as 2026-11-21 or 2026-11-21T18:30"
        ) from None
    time = time if time.tzinfo else time.replace(tzinfo=timezone.utc)
    if not EARLIEST <= time <= LATEST:
        raise argparse.ArgumentTypeError(f"{text!r} is not between 1970 and 2262")
    return time


def _until(text: str) -> datetime:
    """Read the end of a period; a date includes its whole day."""
    is_date = "T" not in text and " " not in text
    return min(_time(text) + timedelta(days=is_date), LATEST)


def _add_history(parser: argparse.ArgumentParser, words: str) -> None:
    parser.add_argument(
        "file",
        type=history_place,
        nargs="?",
        default=usual_history(),
        metavar=PLACE,
        help=f"{words} (that of {URL_VARIABLE}, else {history_file()})",
    )


def _history(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "List what the identifiers have stored: identifications, refusals, baselines, trend, "
        "usage, response to the command, and alarms."
    )
    parser.epilog = (
        "Times are in UTC. Exit code 2: the file or an option was refused, or the table or the "
        "figure could not be written; 3: the latest diagnosis of a valve reached --fail-on."
    )
    _add_history(parser, "the identifiers' history_file, or the server of their history_url")
    add_valve_argument(parser)
    parser.add_argument(
        "--since", type=_time, default=EARLIEST, metavar="TIME", help="only from this time on"
    )
    parser.add_argument(
        "--until",
        type=_until,
        default=LATEST,
        metavar="TIME",
        help="only before this time; a date includes its whole day",
    )
    parser.add_argument("--csv", type=Path, metavar="FILE.csv", help="write the list as a table")
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="plot friction over time")
    parser.add_argument(
        "--usage",
        action="store_true",
        help="list distance, reversals, breakaways and times per day instead of identifications",
    )
    add_fail_on(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def _history_copy(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Copy a history from a file to a PostgreSQL server, from a server to a file, or between "
        "two of a kind. Only rows that the target lacks or holds differently are written, so an "
        "interrupted copy can be run again. Then all rows are compared by count and checksum."
    )
    parser.epilog = (
        "The address of a server is postgresql://user@host/database; put its password in "
        "~/.pgpass or PGPASSWORD. Exit code 1: rows differ, because the target holds other values "
        "for them; 2: the source or the target cannot be read or written."
    )
    parser.add_argument(
        "source", type=history_place, metavar="FROM", help=f"the history to copy, {PLACE}"
    )
    parser.add_argument(
        "target", type=history_place, metavar="TO", help="the target; created if it does not exist"
    )
    add_valve_argument(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def _dashboard(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Serve the pages of a history: plant, valve, alarms and comparison. It needs no ROS and "
        "shows no live values; alarms in a history file can be answered. The node `dashboard` also "
        "shows what the identifiers report now."
    )
    parser.epilog = (
        "Stop it with Ctrl-C. Exit code 2: the history cannot be read, or the address is in use or "
        "not allowed."
    )
    _add_history(parser, "the history of `identify-folder --history` or of the identifiers")
    parser.add_argument(
        "--time-zone",
        default="UTC",
        metavar="ZONE",
        help="time zone, such as Europe/Berlin (%(default)s)",
    )
    parser.add_argument(
        "--reports",
        type=Path,
        metavar="DIR",
        help="folder of reports that `identify-folder --output FILE.html` wrote: each valve page "
        "links to its own",
    )
    parser.add_argument(
        "--port", type=int, default=8080, metavar="N", help="port to listen on (%(default)s)"
    )
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        metavar="ADDRESS",
        help="address to listen on; any other than loopback needs accounts (%(default)s)",
    )
    parser.add_argument(
        "--accounts",
        type=Path,
        metavar="FILE",
        help="accounts file made with `valve_friction dashboard-account`; empty: from the "
        "environment",
    )


def _dashboard_account(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Print an account line for the dashboard: name, role and the hash of a password. The "
        "password is asked for twice on a terminal, or read from the first line of standard input."
    )
    parser.epilog = (
        "`valve_friction dashboard-account anna --role operate >> accounts; chmod 600 accounts` "
        "adds it to a file that the dashboard reads at start. Exit code 2: the name or the "
        "password was refused."
    )
    parser.add_argument("name", metavar="NAME", help="letters, digits and _.@+-")
    parser.add_argument(
        "--role",
        choices=[role.value for role in Role],
        default=Role.VIEW.value,
        help="view: read only; operate: may also call services of identifiers (%(default)s)",
    )


PAGE = "reproduction.html"


def _reproduce_paper(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Run the paper's experiments, identification and validation on the simulated bench, and "
        f"write {PAGE} with every figure next to the paper's numbers. The last line counts the "
        "matches and names what does not match."
    )
    parser.epilog = "Exit code 0: the report is written, whatever matched; 2: it is not."
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("reproduction"),
        metavar="FOLDER",
        help="output folder (%(default)s)",
    )
    parser.add_argument(
        "--config",
        type=Path,
        metavar="FOLDER",
        help="folder with bench_low.yaml, bench_high.yaml and bench_graphite.yaml (those of the "
        "package)",
    )
    parser.add_argument(
        "--position-noise-um",
        type=float,
        metavar="UM",
        help="standard deviation of the stem sensor, µm, instead of the configured one",
    )
    parser.add_argument(
        "--pressure-noise-pa",
        type=float,
        metavar="PA",
        help="standard deviation of the pressure sensor, Pa, instead of the configured one",
    )
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="seed of the noise (%(default)s)"
    )


def _demo(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Start a simulated valve and its monitor as processes, identify the friction, tighten the "
        "packing while it runs, and identify again."
    )
    parser.epilog = (
        "Exit code 0: all numbers are within tolerance, and the excess friction was diagnosed; 1: "
        "they are not, or it was not; 2: the bench did not run, or the figure could not be written."
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("valve_friction_demo.png"),
        metavar="FILE.png",
        help="figure of the result (%(default)s)",
    )
    parser.add_argument(
        "--dashboard",
        action="store_true",
        help="show three valves, healthy, tightening and leaking, on the dashboard until Ctrl-C",
    )


DECLARATIONS: Mapping[str, Callable[[argparse.ArgumentParser], None]] = MappingProxyType(
    {
        "identify": _identify,
        "inspect": _inspect,
        "identify-folder": _identify_folder,
        "describe-valve": _describe_valve,
        "plan-test": _plan_test,
        "validate": _validate,
        "call": _call,
        "history": _history,
        "history copy": _history_copy,
        "dashboard": _dashboard,
        "dashboard-account": _dashboard_account,
        "reproduce-paper": _reproduce_paper,
        "demo": _demo,
    }
)
"""Function that declares the arguments of each sub-command."""
