# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Arguments and help text of each sub-command.

Nothing slow is imported here, so that help appears at once. The module that runs a sub-command is
imported after its arguments have been parsed.
"""

import argparse
import os
from collections.abc import Callable, Mapping
from datetime import datetime, timedelta, timezone
from pathlib import Path
from types import MappingProxyType

from valve_friction_ros.commands.arguments import add_options, percent
from valve_friction_ros.commands.arguments.identification import (
    PLACE,
    add_fail_on,
    add_identification_arguments,
    history_place,
)
from valve_friction_ros.commands.arguments.planning import add_planning_arguments
from valve_friction_ros.commands.arguments.recording import (
    add_reading_arguments,
    add_recording_arguments,
    add_table_arguments,
)
from valve_friction_ros.dashboard.accounts import Role
from valve_friction_ros.history import URL_VARIABLE
from valve_friction_ros.identification.trust.verdict import LEAST_FIT
from valve_friction_ros.outside_text import nearest
from valve_friction_ros.records.files import history_file
from valve_friction_ros.records.units import POSITION_UNITS, PRESSURE_UNITS, unit_named
from valve_friction_ros.records.valve_description import QUESTIONS


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
    add_options(
        parser,
        """
        --plot FILE.png: plot the identification
        --report FILE.html: write a self-contained report page: diagnosis, parameters, pictures,
            settings
        --baseline-coulomb-friction N: F_c of this valve when it was healthy, with which the
            diagnosis compares
        --baseline-half-width N: half width of the 95 %% interval of the baseline (0: exact)
        --baseline-recording FILE: recording of this valve when it was healthy, read and identified
            with the same options; its friction is the baseline, and --report draws its signature
        """,
        baseline_coulomb_friction={"type": float},
        baseline_half_width={"type": float},
    )
    add_fail_on(parser)
    add_options(parser, "--json: print one JSON object")


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
    add_options(parser, "--plot FILE.png: plot the recording\n--json: print one JSON object")


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
    add_options(
        parser,
        """
        --output FILE: FILE.csv, FILE.jsonl (JSON lines) or FILE.html (a page that ranks the
            valves), written at the end and on interruption; may be repeated; until then FILE.sqlite
            holds the rows in the order in which they were finished
        --no-reports: with FILE.html: do not write a report per valve into FILE_reports (each
            takes a second and half a megabyte)
        --baselines FILE.csv: friction of the healthy valves, with which the diagnosis compares: an
            earlier output of this command for a folder with the same names, or a table with the
            columns recording (empty: any), valve and coulomb_friction_n
        """,
        output={"action": "append", "required": True},
    )
    add_fail_on(parser)
    add_options(
        parser,
        """
        --valve FILE.yaml: valve file for recordings that have neither NAME.valve.yaml beside them
            nor valve.yaml in their bag or beside them
        --plant FILE.csv: table of the valves: tag, area, travel, spring, range; a recording belongs
            to the valve whose tag appears in its file name or above its values
        --history FILE.sqlite: with --plant: store each result under its tag and the time of its
            recording, and compare it with the baseline stored there; `history` and the dashboard
            read it
        --first-is-baseline: with --history: take the first result of a valve without a baseline as
            its baseline
        --jobs N: number of recordings identified in parallel, one process each (one per core)
        --scheduler ADDRESS: use the workers of a Dask cluster, which must see DIR under the same
            path, instead of local processes; tcp://host:8786 or tls://host:8786 (extra `cluster`)
        --retry-failed: retry recordings that were refused before
        --redo: replace rows that were computed with other options
        """,
        jobs={"type": int},
    )
    add_identification_arguments(parser)
    add_reading_arguments(parser)


def _describe_valve(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Write the valve file of an actuator. Ask for what the options leave open; with --yes only "
        "for what is required."
    )
    parser.epilog = "Exit code 2: an answer is missing or impossible, or the file was not written."
    add_options(
        parser,
        """
        --output FILE.yaml: valve file (standard output)
        --replace: overwrite an existing file
        --yes: take the defaults instead of asking
        """,
    )
    for each in QUESTIONS:
        parser.add_argument(
            f"--{each.name.replace('_', '-')}",
            dest=f"answer_{each.name}",
            metavar="ANSWER",
            help=f"{each.words}: {each.example}" + (f" ({each.default})" if each.default else ""),
        )
    add_table_arguments(parser, "format of the valve's tables, stored in the section `columns:`")


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
    add_options(
        parser,
        """
        --valve VALVE.yaml: the valve file
        --valve-name NAME: valve to use if the valve file or --history holds several
        """,
        valve={"required": True},
    )
    add_planning_arguments(parser)
    add_options(
        parser,
        """
        --output FILE.csv: corners of the pressure signal: time_s and pressure_pa (%(default)s)
        --table FILE.csv: for a control system without ROS: set points with their times in %%, mA
            and pressure, abort positions, and what each step determines
        --form FILE.txt: the same as a partial-stroke test form, for an operator with a stopwatch
        --pressure-unit UNIT: pressure unit of --table and --form: kPa, bar, psi … (%(default)s)
        --position-unit UNIT: position unit of --table and --form: mm, in … (%(default)s)
        --signal-range RANGE: pressures at 0 and 100 %% signal, such as '0.2..1.0 bar' (the spring
            range)
        --replace: overwrite an existing file
        --figure FILE.png: plot pressure and expected stem
        --json: print one JSON object
        """,
        output={"default": Path("stroke_test.csv")},
        pressure_unit={"type": unit_named, "choices": [*PRESSURE_UNITS], "default": "kPa"},
        position_unit={"type": unit_named, "choices": [*POSITION_UNITS], "default": "mm"},
    )


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
    add_options(
        parser,
        f"""
        --estimate ESTIMATE.json: the model, as `valve_friction identify --json` prints it
        --fail-below PERCENT: exit with code 3 if the fit is below this; a fit below
            {100 * LEAST_FIT:g} is always called poor
        --plot FILE.png: plot both stem positions
        --json: print one JSON object
        """,
        estimate={"required": True},
        fail_below={"type": percent},
    )


SERVICES = {
    "identify": "identify the buffered samples and return the diagnosis",
    "set_baseline": "take the last result as the friction of the healthy valve",
    "restore_baseline": "undo the last set_baseline",
    "save": "save the buffered samples as a bag",
    "report": "write a report of the last result",
    "clear": "empty the buffer",
    "reset_usage": "reset the usage counters, after the packing was replaced",
}


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
    add_options(
        parser,
        "--timeout S: time to wait for the answer (%(default)g)",
        timeout={"type": float, "default": 300.0},
    )
    add_fail_on(parser)


EARLIEST = datetime(1970, 1, 1, tzinfo=timezone.utc)
LATEST = datetime(2262, 1, 1, tzinfo=timezone.utc)
"""Latest accepted time: later times in ns since 1970 may not fit a signed 64-bit integer."""


def _time(text: str) -> datetime:
    """Parse a date with or without a time, in UTC unless a zone is given."""
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
    """Parse the end of a period; a date includes its whole day."""
    is_date = "T" not in text and " " not in text
    return min(_time(text) + timedelta(days=is_date), LATEST)


def _add_valves(parser: argparse.ArgumentParser) -> None:
    add_options(
        parser,
        """
        --valve NAME: only this valve: its tag, its namespace, or the name of its identifier; may be
            repeated
        """,
        valve={"action": "append"},
    )


def _add_history(parser: argparse.ArgumentParser, words: str) -> None:
    parser.add_argument(
        "file",
        type=history_place,
        nargs="?",
        default=os.environ.get(URL_VARIABLE, "").strip() or str(history_file()),
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
    _add_valves(parser)
    add_options(
        parser,
        """
        --since TIME: only from this time on
        --until TIME: only before this time; a date includes its whole day
        --csv FILE.csv: write the list as a table
        --plot FILE.png: plot friction over time
        --usage: list distance, reversals, breakaways and times per day instead of identifications
        """,
        since={"type": _time, "default": EARLIEST},
        until={"type": _until, "default": LATEST},
    )
    add_fail_on(parser)
    add_options(parser, "--json: print one JSON object")


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
    _add_valves(parser)
    add_options(parser, "--json: print one JSON object")


def _dashboard(parser: argparse.ArgumentParser) -> None:
    parser.description = (
        "Serve the pages of a history: plant, valve, alarms and comparison. It needs no ROS and "
        "shows no live values; alarms can be answered. The node `dashboard` also "
        "shows what the identifiers report now."
    )
    parser.epilog = (
        "Stop it with Ctrl-C. Exit code 2: the history cannot be read, or the address is in use or "
        "not allowed."
    )
    _add_history(parser, "the history of `identify-folder --history` or of the identifiers")
    add_options(
        parser,
        """
        --time-zone ZONE: time zone, such as Europe/Berlin (%(default)s)
        --reports DIR: folder of reports that `identify-folder --output FILE.html` wrote: each valve
            page links to its own
        --port N: port to listen on (%(default)s)
        --host ADDRESS: address to listen on; any other than loopback needs accounts (%(default)s)
        --accounts FILE: accounts file made with `valve_friction dashboard-account`; empty: from the
            environment
        """,
        time_zone={"default": "UTC"},
        port={"type": int, "default": 8080},
        host={"default": "127.0.0.1"},
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
    add_options(
        parser,
        """
        --output FOLDER: output folder (%(default)s)
        --config FOLDER: folder with bench_low.yaml, bench_high.yaml and bench_graphite.yaml (those
            of the package)
        --position-noise-um UM: standard deviation of the stem sensor, µm, instead of the configured
            one
        --pressure-noise-pa PA: standard deviation of the pressure sensor, Pa, instead of the
            configured one
        --seed N: seed of the noise (%(default)s)
        """,
        output={"default": Path("reproduction")},
        position_noise_um={"type": float},
        pressure_noise_pa={"type": float},
        seed={"type": int, "default": 0},
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
    add_options(
        parser,
        """
        --output FILE.png: figure of the result (%(default)s)
        --dashboard: show three valves, healthy, tightening and leaking, on the dashboard until
            Ctrl-C
        """,
        output={"default": Path("valve_friction_demo.png")},
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
"""Functions that declare the arguments, by sub-command."""
