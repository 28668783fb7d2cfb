"""Run the benchmark: python -m benchmark.reality, or `make reality`."""

import argparse
import multiprocessing
import os
import secrets
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from benchmark.reality.motions import Kind
from benchmark.reality.records import Case
from benchmark.reality.report import bounds, report
from benchmark.reality.trial import Row, Task, rows_of, tried

__all__ = ["main"]

_PROCESSES = 2
_RECORDS, _BRIEF = 40, 4
_ALARM_MOTIONS = (Kind.SQUARE, Kind.RAMP, Kind.LEVELS, Kind.MULTISINE, Kind.LOOP, Kind.FROM_MIDDLE)
_SLIP_MOTIONS = (Kind.SQUARE, Kind.RAMP, Kind.LEVELS, Kind.MULTISINE, Kind.HUNTING)
_PARTS = ("plain", "alarms", "stickslip")
_RESERVE = 2.2
"""Factor by which the friction of a valve of the alarms may grow: it is doubled."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="reality", description=__doc__)
    kinds = [kind.value for kind in Kind]
    parser.add_argument("--records", type=int, metavar="N", help=f"of each motion ({_RECORDS})")
    parser.add_argument("--motions", nargs="+", default=kinds, choices=kinds, help="default: all")
    parser.add_argument("--only", nargs="+", default=_PARTS, choices=_PARTS, help="default: all")
    parser.add_argument("--brief", action="store_true", help=f"{_BRIEF} records of each motion")
    parser.add_argument("--entropy", type=int, help="repeat a run; drawn by default")
    parser.add_argument(
        "--jobs", type=int, default=min(_PROCESSES, os.cpu_count() or 1), help="processes"
    )
    parser.add_argument(
        "--limit", type=float, default=60.0, help="processor time for one record, s"
    )
    parser.add_argument("--save", type=Path, metavar="FOLDER", help="keep the records as .npz")
    parser.add_argument("--out", type=Path, default=Path("reality.jsonl"), help="the rows")
    parser.add_argument("--read", action="store_true", help="show the rows of --out; run nothing")
    return parser


def _tasks(options: argparse.Namespace, entropy: int) -> Iterator[Task]:
    count = options.records or (_BRIEF if options.brief else _RECORDS)
    motions = [Kind(motion) for motion in options.motions]
    few = max(count // 5, 1)
    for number in range(count):
        for motion in motions:
            if "plain" in options.only:
                yield Task("plain", Case(entropy, motion, number), options.limit, options.save)
            if "stickslip" in options.only and motion in _SLIP_MOTIONS and number < 2 * few:
                case = Case(entropy + 1, motion, number, slips=True)
                yield Task("stickslip", case, options.limit, options.save)
            if "alarms" in options.only and motion in _ALARM_MOTIONS and number < few:
                case = Case(entropy + 2, motion, number, reserve=_RESERVE)
                yield Task("alarms", case, options.limit, options.save)


def _run(options: argparse.Namespace, console: Console) -> list[Row]:
    """Run all tasks, and write each row as it comes."""
    entropy = secrets.randbits(32) if options.entropy is None else options.entropy
    console.print(f"--entropy {entropy}")
    if options.save is not None:
        options.save.mkdir(parents=True, exist_ok=True)
    tasks = list(_tasks(options, entropy))
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    rows = []
    with (
        options.out.open("w", encoding="utf-8") as file,
        multiprocessing.get_context("spawn").Pool(options.jobs) as pool,
        Progress(*columns, console=Console(stderr=True)) as progress,
    ):
        answers = pool.imap_unordered(tried, tasks)
        for some in progress.track(answers, total=len(tasks), description="reality"):
            rows += some
            file.writelines(row.as_line() + "\n" for row in some)
            file.flush()
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what was asked for; return 1 if a bound is missed."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if not options.out.parent.is_dir():
        parser.error(f"{options.out}: there is no folder {options.out.parent}")
    console = Console(soft_wrap=True, highlight=False, markup=False)
    rows = rows_of(options.out) if options.read else _run(options, console)
    order = {(part, motion): place for place, (part, motion) in enumerate(
        (part, kind.value) for part in _PARTS for kind in Kind)}
    rows.sort(key=lambda row: order[row.part, row.motion])
    for line in report(rows):
        console.print(line)
    return 0 if all(one.met for one in bounds(rows)) else 1


if __name__ == "__main__":
    sys.exit(main())
