# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `identify-folder`: identify all recordings in a folder, on all cores."""

import argparse
import contextlib
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

from valve_friction_ros.commands.arguments.identification import (
    has_failed,
    identification_settings,
    method_name,
    survey_limits,
)
from valve_friction_ros.commands.arguments.recording import described, reading_options
from valve_friction_ros.commands.console import OutputConsole, shown_progress
from valve_friction_ros.commands.process import ExitCode, StopSignals, complain
from valve_friction_ros.fleet.job import (
    FILING,
    Filing,
    Job,
    Options,
    baseline_kept,
    file_results,
    filed_before,
    identify_job,
    identify_job_elsewhere,
)
from valve_friction_ros.fleet.recordings import (
    Baselines,
    Findings,
    FoundRecording,
    find_recordings,
    read_baselines,
    read_plant,
    valves_of,
    with_parts_joined,
)
from valve_friction_ros.fleet.results_file import (
    REFUSED,
    RecordingRows,
    ResultsFile,
    Tally,
    database_of,
    is_page,
    reason_of,
    reports_of,
    tally,
    writer_of,
)
from valve_friction_ros.fleet.rows import (
    Cell,
    error_cells,
    level_of,
    ranked,
    reaches,
    with_reports_written,
)
from valve_friction_ros.fleet.workers import (
    DeadWorker,
    cluster_at,
    in_cluster,
    in_processes,
    usable_cores,
)
from valve_friction_ros.health.levels import Level
from valve_friction_ros.identification.settings import FIXABLE
from valve_friction_ros.model.checks import frozen
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.records.bags.topics import VALVE_FILE, is_bag
from valve_friction_ros.records.files import explained, on_disk, place
from valve_friction_ros.records.recordings import ReadingOptions
from valve_friction_ros.records.valve_file import ValveFile, read_valve_file
from valve_friction_ros.streams import utc_second
from valve_friction_ros.wording import numbered


@dataclass(frozen=True)
class Plan:
    """Plan for a recording: the job, or why it cannot be done.

    `content` and `settings` are fingerprints of the files and the options.
    """

    name: str
    content: str
    settings: str
    job: Job | str


def _valve_file(found: FoundRecording, common: Path | None) -> Path | None:
    """Choose the valve file closest to a recording."""
    beside = found.path.parent
    places = [beside / f"{found.stem}.{VALVE_FILE}", beside / VALVE_FILE]
    if found.path.is_dir():
        places.insert(1, found.path / VALVE_FILE)
    return next((place for place in places if place.exists()), common)


def make_plan(
    findings: Findings,
    options: argparse.Namespace,
    plant: Mapping[str, ValveFile],
    baselines: Baselines,
    reports: Path | None,
) -> Iterator[Plan]:
    """Plan each recording, in order of name; `reports` is the folder of the reports.

    A table with several valves of the plant becomes one recording per valve.
    """
    kept_baseline = cache(partial(baseline_kept, options.history))

    @cache
    def described_by(valve_file: Path) -> tuple[ValveFile, ReadingOptions]:
        with on_disk(valve_file) as file:
            return described(file, file, options)

    def valves(found: FoundRecording) -> Iterator[tuple[str, str, ValveFile, ReadingOptions]]:
        """Yield label, tag, description and options of each valve in a recording."""
        own = _valve_file(found, None if plant else options.valve)
        if own is not None:
            yield "", "", *described_by(own)
        elif not plant:
            yield "", "", *described(found.path, None, options)
        else:
            with on_disk(found.path) as path:
                is_table = not is_bag(path)
                chosen = valves_of(path, found.name, plant, is_table)
            for label, tag, description in chosen:
                reading = reading_options(options, description.columns)
                topics = replace(reading.topics, valve=label or reading.topics.valve)
                yield label, tag, description, replace(reading, topics=topics)

    def plans(found: FoundRecording) -> Iterator[Plan]:
        content = ""
        try:
            with explained(found.path):
                content = found.content()
                chosen = list(valves(found))
            for label, tag, description, reading in chosen:
                name = f"{found.name}, {label}" if label else found.name
                wanted = Options(
                    description.valve,
                    reading,
                    method_name(options, description.settings),
                    identification_settings(options, description),
                    baselines.of(found.name),
                    tag,
                    survey_limits(options, description),
                )
                job = Job(
                    found.path,
                    name,
                    wanted,
                    reports,
                    options.history is not None,
                    kept_baseline(tag),
                    found.beside,
                )
                yield Plan(name, content, wanted.fingerprint(), job)
        except (ValueError, OSError) as error:
            yield Plan(found.name, content, "", str(error).removeprefix(f"{found.path}: "))

    for found in findings.recordings:
        yield from plans(found)


def _filed(plans: Mapping[str, Plan], options: argparse.Namespace) -> set[tuple[str, str]] | None:
    """Return tag and time of each result in the history; None without a history."""
    if options.history is None:
        return None
    tags = {plan.job.options.tag for plan in plans.values() if isinstance(plan.job, Job)}
    return {
        (tag, utc_second(second * 1e9))
        for tag, second in filed_before(options.history, tags - {""})
    }


def _is_whole(entry: RecordingRows, plan: Plan, filed: set[tuple[str, str]] | None) -> bool:
    """Return whether an entry lacks no report, and no result with tag and date in the history."""
    good = [row for row in entry.rows if not row["error"]]
    if isinstance(plan.job, Job) and (reports := plan.job.reports) is not None:
        files = (row["report"] and reports.parent / str(row["report"]) for row in good)
        if not all(isinstance(file, Path) and file.is_file() for file in files):
            return False
    dated = ((str(row["valve"]), str(row["began"])) for row in good if row["began"])
    return filed is None or filed.issuperset(dated)


def forget_stale(
    results: ResultsFile, plans: Mapping[str, Plan], options: argparse.Namespace
) -> tuple[list[Plan], int]:
    """Drop outdated rows; return the plans left to do, and how many were dropped.

    With ``redo``, good rows made with other options may be dropped. With ``retry_failed``, refused
    recordings are retried. Recordings with missing reports are always retried.

    Raises ValueError if good rows were made with other options and must not be dropped.
    """
    done, others = set(), 0
    filed = _filed(plans, options)
    for entry in results.entries():
        plan = plans.get(entry.recording)
        if plan is None:
            continue
        if (entry.content, entry.settings) == (plan.content, plan.settings):
            is_again = options.retry_failed and any(row["error"] for row in entry.rows)
            if not is_again and _is_whole(entry, plan, filed):
                done.add(entry.recording)
        elif entry.content == plan.content and entry.settings != plan.settings:
            others += not entry.refused
    if others and not options.redo:
        raise ValueError(
            f"{results.path}: {others} recordings in it were identified with other options, "
            "another valve file, baseline or version: give another --output, or --redo to replace "
            "them"
        )
    dropped = results.keep(lambda entry: entry.recording not in plans or entry.recording in done)
    return [plan for plan in plans.values() if plan.name not in done], dropped


Rows = list[Mapping[str, Cell]]
"""The cells of all valves of a recording."""

ShareOut = Callable[[Iterable[Job], Callable[[], bool]], Iterator[tuple[Job, Rows | DeadWorker]]]
"""Identifies recordings until told to stop, and yields each with its rows when finished."""


@contextlib.contextmanager
def workers(options: argparse.Namespace) -> Iterator[ShareOut]:
    """Provide the workers that identify.

    Raises ValueError if a requested cluster is missing or cannot do the work.
    """
    if options.scheduler is None:
        processes = usable_cores() if options.jobs is None else options.jobs
        yield lambda jobs, stopped: in_processes(identify_job, jobs, processes, stopped)
        return
    with cluster_at(options.scheduler) as cluster:
        for note in cluster.compare():
            print(note, file=sys.stderr)
        yield partial(in_cluster, cluster, identify_job_elsewhere)


def finished(
    plans: Sequence[Plan], share_out: ShareOut, stop: StopSignals
) -> Iterator[tuple[Plan, Rows]]:
    """Yield each recording with its rows when finished, with its reports written."""
    by_job: dict[str, Plan] = {}
    possible: list[Job] = []
    for plan in plans:
        if isinstance(plan.job, Job):
            by_job[plan.job.name] = plan
            possible.append(plan.job)
        else:
            yield plan, [error_cells("", plan.job, Path(plan.name))]
    for job, answer in share_out(possible, stop.wanted):
        if isinstance(answer, DeadWorker):
            yield by_job[job.name], [error_cells(job.options.tag, str(answer), job.path)]
        elif job.reports is None:
            yield by_job[job.name], answer
        else:
            yield by_job[job.name], with_reports_written(answer, job.reports.parent)


_SHOWN_REASONS = _SHOWN_ALARMS = _SHOWN_SKIPPED = 10
_BAD = ("bad", "watch")
"""Verdicts of a first survey on valves that need attention."""


def print_tally(counted: Tally) -> None:
    """Print the numbers of identified and refused records, with the reasons."""
    console = OutputConsole(highlight=False, markup=False)
    table = Table("friction", "records", box=None, header_style="bold")
    table.columns[1].justify = "right"
    for outcome, count in sorted(counted.outcomes.items(), key=lambda one: one[0] == REFUSED):
        table.add_row(outcome, str(count))
    console.print(table)
    for reason, names in [*counted.reasons.items()][:_SHOWN_REASONS]:
        told = f"{len(names):>6} refused: {reason} (for example {names[0]})"
        console.print(told, soft_wrap=True)
    if len(counted.reasons) > _SHOWN_REASONS:
        console.print(f"       and for {len(counted.reasons) - _SHOWN_REASONS} more reasons")


def print_alarms(rows: Iterable[Mapping[str, Cell]]) -> None:
    """Print the valves that need attention, most urgent first, and what to do.

    Records of a tag with the same message, as undated ones may be, are one line.
    """
    console = OutputConsole(highlight=False, markup=False)
    alike: dict[tuple[Cell, ...], list[Mapping[str, Cell]]] = {}
    for row in ranked(rows):
        if reaches(row, Level.WARN) or row.get("survey") in _BAD:
            key = (row["valve"], row["message"]) if row["valve"] else (row["recording"],)
            alike.setdefault(key, []).append(row)
    alarms = [*alike.values()]
    for row, *others in alarms[:_SHOWN_ALARMS]:
        name = " ".join(filter(None, (str(row["recording"]), str(row["valve"]))))
        name += f" and {numbered(len(others), 'more record')}" if others else ""
        level = row["level"] if reaches(row, Level.WARN) else row["survey"]
        console.print(f"{level:>6} {name}: {row['message']}", soft_wrap=True)
        if row.get("what_to_do"):
            console.print(f"       {row['what_to_do']}", soft_wrap=True)
    if len(alarms) > _SHOWN_ALARMS:
        console.print(f"       and {len(alarms) - _SHOWN_ALARMS} more")


def _newest(rows: Sequence[Mapping[str, Cell]]) -> list[Mapping[str, Cell]]:
    """Return the diagnosed records that no later one of the same tag has overtaken.

    A later record without a diagnosis, such as a refused one, overtakes nothing.
    """
    diagnosed = [row for row in rows if row["level"]]
    last: dict[str, str] = {}
    for row in diagnosed:
        tag = str(row["valve"])
        last[tag] = max(last.get(tag, ""), str(row["began"] or ""))
    return [row for row in diagnosed if not row["began"] or row["began"] == last[str(row["valve"])]]


def _require_sense(options: argparse.Namespace) -> None:
    """Refuse at once options that every recording would refuse."""
    jobs, history, plant, first = options.jobs, options.history, options.plant, options.output[0]
    for is_refused, why in (
        (
            jobs is not None and options.scheduler is not None,
            "--jobs applies to this machine only: with --scheduler the cluster uses its own "
            "workers",
        ),
        (jobs is not None and jobs < 1, f"--jobs must be at least 1, got {jobs}"),
        (
            plant is not None and options.valve is not None,
            "--plant: its table already describes the valves: omit --valve",
        ),
        (
            history is not None and plant is None,
            "--history stores results by tag: give the table of tags with --plant",
        ),
        (
            options.first_is_baseline and history is None,
            "--first-is-baseline: the baseline is stored in a history: give --history",
        ),
        (
            isinstance(history, Path) and history.resolve() == database_of(first),
            f"--history {history}: --output {first} keeps its rows in a file of this name: give "
            "one of the two another name",
        ),
    ):
        if is_refused:
            raise ValueError(why)
    for output in options.output:
        writer_of(output)
        if not output.parent.is_dir():
            raise ValueError(f"{output}: there is no folder {output.parent}")
        if output.resolve().parent != first.resolve().parent:
            raise ValueError(f"{output}: all outputs must lie in the folder of the first")
    reading_options(options)
    anything = ValveFile(Valve(), frozen(dict.fromkeys(FIXABLE, 1.0)))
    identification_settings(options, anything)
    survey_limits(options, anything)
    if options.valve is not None:
        read_valve_file(options.valve)


def _baselines(options: argparse.Namespace, names: Sequence[str]) -> Baselines:
    """Read the baselines, and print how many of the recordings have one."""
    if options.baselines is None:
        return Baselines({})
    baselines = read_baselines(options.baselines)
    count = sum(bool(baselines.of(name)) for name in names)
    if count == 0:
        raise ValueError(
            f"{options.baselines}: no recording of {options.folder} has a baseline in it: its "
            f"column recording must contain names such as {names[0]}"
        )
    print(f"baselines: {count} of {len(names)} recordings have one", file=sys.stderr)
    return baselines


def _planned(options: argparse.Namespace) -> dict[str, Plan]:
    database, reports = database_of(options.output[0]), reports_of(options.output[0])
    folder = place(options.folder)
    if options.scheduler is not None:
        folder = folder.absolute()
    others = [one for one in (options.plant, options.history) if one is not None]
    findings = find_recordings(folder, *options.output, database, reports, *others)
    if findings.skipped:
        shown = ", ".join(findings.skipped[:_SHOWN_SKIPPED])
        more = len(findings.skipped) - _SHOWN_SKIPPED
        rest = f" and {more} more" if more > 0 else ""
        print(f"skipped, not recordings: {shown}{rest}", file=sys.stderr)
    if not findings.recordings:
        raise ValueError(f"{options.folder}: contains no tables (CSV, xlsx, Parquet) and no bags")
    plant = {} if options.plant is None else read_plant(options.plant)
    joined = tuple(with_parts_joined(findings.recordings, plant))
    findings = replace(findings, recordings=joined)
    baselines = _baselines(options, [found.name for found in findings.recordings])
    wanted = any(map(is_page, options.output)) and not options.no_reports
    plans = make_plan(findings, options, plant, baselines, reports if wanted else None)
    return {plan.name: plan for plan in plans}


def _identify(
    plans: Sequence[Plan], results: ResultsFile, share_out: ShareOut, stop: StopSignals
) -> list[Filing]:
    """Identify the recordings, write their rows and show the progress; return what to file."""
    filings: list[Filing] = []
    shown: set[str] = set()
    columns = (TextColumn("identifying"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with shown_progress(*columns) as progress:
        task = progress.add_task("", total=len(plans))
        for plan, rows in finished(plans, share_out, stop):
            # A later run recognizes finished recordings by these keys.
            keys = {"recording": plan.name, "content": plan.content, "settings": plan.settings}
            results.append([{**row, **keys, "valves": len(rows)} for row in rows])
            progress.advance(task)
            for row in rows:
                filing: Any = row.get(FILING)
                filings += [filing] if isinstance(filing, Filing) else []
                if (error := row.get("error")) and reason_of(str(error)) not in shown:
                    shown.add(reason_of(str(error)))
                    label = ", ".join(filter(None, (plan.name, str(row["valve"]))))
                    progress.console.print(f"{label}: {error}")
    return filings


def _file(filings: Sequence[Filing], results: ResultsFile, options: argparse.Namespace) -> None:
    """File results in the history, and compare each with the baseline in force there."""
    filed = file_results(options.history, filings, options.first_is_baseline)
    changed = {recording for recording, _ in filed.cells}
    stale = [entry for entry in results.entries() if entry.recording in changed]
    results.keep(lambda entry: entry.recording not in changed)
    for entry in stale:
        cells = (filed.cells.get((entry.recording, str(row["valve"])), {}) for row in entry.rows)
        results.append([{**row, **own} for row, own in zip(entry.rows, cells, strict=True)])
    told = [f"{numbered(filed.filed, 'result')} filed in {options.history}"]
    told += [f"{filed.known} already there"] if filed.known else []
    if filed.baselines:
        told.append(
            f"the first result is the baseline of {numbered(len(filed.baselines), 'valve')}"
        )
    print("; ".join(told), file=sys.stderr)


def _tell_undated(rows: Sequence[Mapping[str, Cell]]) -> None:
    """Print which results are missing in the history, because their times have no date."""
    names = [str(row["recording"]) for row in rows if not (row["began"] or row["error"])]
    if names:
        more = f" and {len(names) - _SHOWN_SKIPPED} more" if len(names) > _SHOWN_SKIPPED else ""
        print(
            f"{numbered(len(names), 'result')} not filed, because the times have no date: "
            f"{', '.join(names[:_SHOWN_SKIPPED])}{more}: export them with dates",
            file=sys.stderr,
        )


def run(options: argparse.Namespace) -> int:
    """Identify the remaining recordings, and print a tally."""
    _require_sense(options)
    with workers(options) as share_out:
        return _run(options, _planned(options), share_out)


def _run(options: argparse.Namespace, plans: Mapping[str, Plan], share_out: ShareOut) -> int:
    with (
        StopSignals() as stop,
        ResultsFile(*options.output, zone=options.time_zone or "") as results,
    ):
        left, dropped = forget_stale(results, plans, options)
        of_them = f", {dropped} of them again" if dropped else ""
        print(
            f"{numbered(len(plans), 'recording')}: {len(plans) - len(left)} done before, "
            f"{len(left)} to do{of_them}",
            file=sys.stderr,
        )
        for plan in left[:1]:
            if isinstance(plan.job, Job) and plan.job.reports is not None:
                plan.job.reports.mkdir(exist_ok=True)
        filings = _identify(left, results, share_out, stop)
        if options.history is not None:
            _file(filings, results, options)
        mine = [entry for entry in results.entries() if entry.recording in plans]
        if stop.wanted():
            complain(
                options.command,
                f"interrupted with {len(mine)} of {len(plans)} recordings in {options.output[0]}: "
                "run the same command to continue",
            )
            return stop.exit_code
    counted, rows = tally(mine), [row for entry in mine for row in entry.rows]
    if options.history is not None:
        _tell_undated(rows)
    print_tally(counted)
    present = rows if options.plant is None else _newest(rows)
    print_alarms(present)
    refused = counted.outcomes[REFUSED]
    if refused == counted.outcomes.total():
        return ExitCode.REFUSED
    if has_failed(options, filter(None, map(level_of, present))):
        return ExitCode.ALARM
    return ExitCode.PARTLY if refused else ExitCode.DONE
