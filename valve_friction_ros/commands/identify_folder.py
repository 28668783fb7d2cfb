"""Sub-command `identify-folder`: identify all recordings of a folder, on all cores."""

import argparse
import sys
from collections.abc import Mapping, Sequence

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from valve_friction_ros.commands.arguments.fail_on import has_failed
from valve_friction_ros.commands.arguments.identification import (
    identification_settings,
)
from valve_friction_ros.commands.arguments.recording import reading_options
from valve_friction_ros.commands.folder.plan import Plan, forget_stale, make_plan
from valve_friction_ros.commands.folder.sharing import (
    ShareOut,
    finished,
    workers,
)
from valve_friction_ros.commands.folder.stop_signals import StopSignals
from valve_friction_ros.commands.folder.summary import print_alarms, print_tally
from valve_friction_ros.commands.output.errors import ExitCode, complain
from valve_friction_ros.commands.output.formatting import OutputConsole
from valve_friction_ros.fleet import (
    REFUSED,
    Baselines,
    Job,
    ResultsFile,
    database_of,
    find_recordings,
    is_page,
    key_cells,
    read_baselines,
    reports_of,
    tally,
    writer_of,
)
from valve_friction_ros.health import Level
from valve_friction_ros.identification import FIXABLE
from valve_friction_ros.model import Valve
from valve_friction_ros.model.frozen import frozen
from valve_friction_ros.records.stores import place
from valve_friction_ros.records.valve_file import ValveFile, read_valve_file

__all__ = ["REFUSALS", "run"]

REFUSALS = ()
_SHOWN_SKIPPED = 10


def _require_sense(options: argparse.Namespace) -> None:
    """Refuse at once what would be refused of every recording."""
    if options.jobs is not None and options.scheduler is not None:
        raise ValueError("--jobs is of this machine: with --scheduler the cluster has its workers")
    if options.jobs is not None and options.jobs < 1:
        raise ValueError(f"--jobs must be at least 1, got {options.jobs}")
    for output in options.output:
        writer_of(output)
        if not output.parent.is_dir():
            raise ValueError(f"{output}: there is no folder {output.parent}")
        if output.resolve().parent != options.output[0].resolve().parent:
            raise ValueError(f"{output}: all outputs must lie in the folder of the first")
    reading_options(options)
    identification_settings(options, ValveFile(Valve(), frozen(dict.fromkeys(FIXABLE, 1.0))))
    if options.valve is not None:
        read_valve_file(options.valve)


def _baselines(options: argparse.Namespace, names: Sequence[str]) -> Baselines:
    """Read the baselines, and say how many of the recordings have one."""
    if options.baselines is None:
        return Baselines({})
    baselines = read_baselines(options.baselines)
    count = baselines.count(names)
    if count == 0:
        raise ValueError(
            f"{options.baselines}: no recording of {options.folder} has a baseline in it: its "
            f"column recording must hold names such as {names[0]}"
        )
    print(f"baselines: {count} of {len(names)} recordings have one", file=sys.stderr)
    return baselines


def _planned(options: argparse.Namespace) -> dict[str, Plan]:
    database, reports = database_of(options.output[0]), reports_of(options.output[0])
    folder = place(options.folder)
    if options.scheduler is not None:
        folder = folder.absolute()
    findings = find_recordings(folder, *options.output, database, reports)
    if findings.skipped:
        shown = ", ".join(findings.skipped[:_SHOWN_SKIPPED])
        more = len(findings.skipped) - _SHOWN_SKIPPED
        rest = f" and {more} more" if more > 0 else ""
        print(f"skipped, no recordings: {shown}{rest}", file=sys.stderr)
    if not findings.recordings:
        raise ValueError(
            f"{options.folder}: there are no tables (CSV, xlsx, Parquet) and no bags in it"
        )
    baselines = _baselines(options, [found.name for found in findings.recordings])
    wanted = any(map(is_page, options.output)) and not options.no_reports
    plans = make_plan(findings, options, baselines, reports if wanted else None)
    return {plan.name: plan for plan in plans}


def _identify(
    plans: Sequence[Plan], results: ResultsFile, share_out: ShareOut, stop: StopSignals
) -> None:
    """Identify the recordings, write their rows, and show the progress."""
    console = OutputConsole(stderr=True, highlight=False, markup=False, soft_wrap=True)
    columns = (
        TextColumn("identifying"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as progress:
        task = progress.add_task("", total=len(plans))
        for plan, rows in finished(plans, share_out, stop):
            keys = key_cells(plan.name, plan.content, plan.settings, len(rows))
            results.append([{**row, **keys} for row in rows])
            progress.advance(task)
            for row in rows:
                if row.get("error"):
                    label = ", ".join(filter(None, (plan.name, str(row["valve"]))))
                    console.print(f"{label}: {row['error']}")


def run(options: argparse.Namespace) -> int:
    """Identify what is left to do, and print a tally."""
    _require_sense(options)
    with workers(options) as share_out:
        return _run(options, _planned(options), share_out)


def _run(options: argparse.Namespace, plans: Mapping[str, Plan], share_out: ShareOut) -> int:
    with StopSignals() as stop, ResultsFile(*options.output) as results:
        left, dropped = forget_stale(results, plans, options)
        print(
            f"{len(plans)} recordings: {len(plans) - len(left)} done before, {len(left)} to do"
            + (f", {dropped} of them again" if dropped else ""),
            file=sys.stderr,
        )
        for plan in left[:1]:
            if isinstance(plan.job, Job) and plan.job.reports is not None:
                plan.job.reports.mkdir(exist_ok=True)
        _identify(left, results, share_out, stop)
        mine = [entry for entry in results.entries() if entry.recording in plans]
        if stop.wanted():
            complain(
                options.command,
                f"interrupted with {len(mine)} of {len(plans)} recordings in "
                f"{options.output[0]}: the same command goes on from there",
            )
            return stop.exit_code
    counted, rows = tally(mine), [row for entry in mine for row in entry.rows]
    print_tally(counted)
    print_alarms(rows)
    refused = counted.outcomes[REFUSED]
    if refused == counted.outcomes.total():
        return ExitCode.REFUSED
    if has_failed(options, (Level[str(row["level"])] for row in rows if row["level"])):
        return ExitCode.ALARM
    return ExitCode.PARTLY if refused else ExitCode.DONE
