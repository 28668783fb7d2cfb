"""Run the benchmark: python -m benchmark.reality, or `make reality`."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from benchmark.reality.answers import Outcome, read_outcomes
from benchmark.reality.bounds import bounds
from benchmark.reality.counts import by_class, ideals_of, judged, tally
from benchmark.reality.excitations import Kind
from benchmark.reality.report import bounds_table, counts_table, numbers_table, violations
from benchmark.reality.runner import run
from benchmark.reality.suite import cases
from valve_friction_ros.identification import DEFAULT_METHOD, METHODS

__all__ = ["main"]

_WIDTH_OF_A_FILE = 160
_PROCESSES = 2
_SLOWEST = 2.0
_ADAPTER = f"{__package__}.package"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="reality", description=__doc__)
    parser.add_argument("--seeds", type=int, default=5, help="records of each combination")
    parser.add_argument("--classes", nargs="+", default=(), help="of imperfections; default: all")
    parser.add_argument(
        "--drives",
        nargs="+",
        default=(),
        choices=[kind.value for kind in Kind],
        help="default: all",
    )
    parser.add_argument(
        "--held-out", action="store_true", help="magnitudes and seeds not developed with"
    )
    parser.add_argument(
        "--no-growth", action="store_true", help="leave out friction that has grown"
    )
    parser.add_argument("--brief", action="store_true", help="one imperfection of each class")
    parser.add_argument(
        "--limit", type=float, default=60.0, help="processor time for one record, s"
    )
    parser.add_argument(
        "--jobs", type=int, default=min(_PROCESSES, os.cpu_count() or 1), help="processes"
    )
    parser.add_argument(
        "--method",
        choices=[*METHODS],
        default=DEFAULT_METHOD,
        help="method of the package (%(default)s)",
    )
    parser.add_argument(
        "--identification", help="another module that identifies, in place of the package"
    )
    parser.add_argument("--out", type=Path, default=Path("reality.jsonl"), help="the outcomes")
    parser.add_argument(
        "--read", action="store_true", help="show the outcomes of --out, and run nothing"
    )
    return parser


def _run(options: argparse.Namespace, console: Console) -> list[Outcome]:
    """Run the suite and write each outcome as it comes."""
    suite = cases(
        options.seeds,
        options.held_out,
        options.classes,
        [Kind(drive) for drive in options.drives],
        grown=not options.no_growth,
        brief=options.brief,
    )
    identification = options.identification or f"{_ADAPTER}:{options.method}"
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    outcomes = []
    with (
        options.out.open("w", encoding="utf-8") as file,
        Progress(*columns, console=console) as progress,
    ):
        answers = run(suite, identification, options.jobs, options.limit)
        for outcome in progress.track(answers, total=len(suite), description="reality"):
            outcomes.append(outcome)
            file.write(outcome.as_line() + "\n")
            file.flush()
    places = {case.name: place for place, case in enumerate(suite)}
    return sorted(outcomes, key=lambda one: places[one.name])


def _show(outcomes: Sequence[Outcome], console: Console) -> bool:
    """Print the tables; return whether all bounds are met."""
    every = bounds(outcomes)
    whole = tally(outcomes, ideals_of(outcomes))
    for line in violations(outcomes, whole, _SLOWEST):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    console.print(counts_table("by imperfection", by_class(outcomes) | {"all": whole}))
    groups = by_class(outcomes, lambda one: f"{one.packing}, {one.drive}")
    console.print(counts_table("by packing and drive", groups))
    console.print(numbers_table([one for outcome in outcomes for one in judged(outcome)]))
    console.print(bounds_table(every))
    return all(bound.met for bound in every)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what was asked for; return 1 if a bound is missed."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if not options.out.parent.is_dir():
        parser.error(f"{options.out}: there is no folder {options.out.parent}")
    console = Console(width=None if sys.stdout.isatty() else _WIDTH_OF_A_FILE)
    try:
        outcomes = read_outcomes(options.out) if options.read else _run(options, console)
    except ValueError as error:
        parser.error(str(error))
    return 0 if _show(outcomes, console) else 1


if __name__ == "__main__":
    sys.exit(main())
