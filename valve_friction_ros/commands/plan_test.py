"""Sub-command `plan-test`: the stroke test that tells the friction of a valve best, as a file."""

import argparse
import json
import sys
from pathlib import Path

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from valve_friction_ros.commands.arguments.planning import (
    frictions_from,
    planned_conditions,
    planned_limits,
    planned_settings,
)
from valve_friction_ros.commands.output.errors import ExitCode
from valve_friction_ros.commands.output.formatting import OutputConsole
from valve_friction_ros.commands.output.plan_output import as_json, print_plan, write_test
from valve_friction_ros.history import HistoryError
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.planning import StrokePlan, plan_test
from valve_friction_ros.records.valve_file import read_valve_file

__all__ = ["REFUSALS", "run"]

REFUSALS = (RefusalError, HistoryError)


def _require_files(options: argparse.Namespace) -> None:
    """Refuse files that cannot be written, before the work begins."""
    output: Path = options.output
    if output.exists() and not options.replace:
        raise ValueError(f"{output}: it is there: give another name, or --replace")
    if not output.parent.is_dir():
        raise ValueError(f"{output}: there is no folder {output.parent}")
    if options.figure is not None:
        from valve_friction_ros import figures  # noqa: PLC0415 - slow to import

        figures.require_picture_file(options.figure)


def _planned(options: argparse.Namespace) -> StrokePlan:
    """Read the files, and search with a bar on a terminal."""
    described = read_valve_file(options.valve, options.valve_name)
    frictions = frictions_from(options, described)
    with Progress(
        TextColumn("comparing stroke tests"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        console=OutputConsole(stderr=True),
        transient=True,
        disable=not sys.stderr.isatty(),
    ) as bar:
        task = bar.add_task("", total=1.0)
        return plan_test(
            described.valve,
            frictions,
            planned_limits(options),
            planned_conditions(options),
            planned_settings(options, described),
            options.aim,
            lambda share: bar.update(task, completed=share),
        )


def run(options: argparse.Namespace) -> int:
    """Plan, write the files, and print what to expect."""
    _require_files(options)
    plan = _planned(options)
    write_test(options.output, plan)
    if options.figure is not None:
        from valve_friction_ros import figures  # noqa: PLC0415 - slow to import

        figures.save_picture(figures.plan_figure(plan), options.figure)
    if options.json:
        print(json.dumps(as_json(plan, options.output), ensure_ascii=False, allow_nan=False))
    else:
        print_plan(plan, options.output)
    return ExitCode.DONE
