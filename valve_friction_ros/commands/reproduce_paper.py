"""Sub-command `reproduce-paper`: the published programme on the simulated bench, and its report."""

import argparse
import math
from collections.abc import Callable
from pathlib import Path

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from valve_friction_ros.commands.arguments.declared import PAGE
from valve_friction_ros.commands.output.errors import ExitCode
from valve_friction_ros.commands.output.formatting import OutputConsole
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import SensorNoise
from valve_friction_ros.records.whole_file import write_whole
from valve_friction_ros.reports import write_report
from valve_friction_ros.reproduction.bench import BENCH_NAMES, Bench, find_bench_folder, read_bench
from valve_friction_ros.reproduction.checks.check import summary
from valve_friction_ros.reproduction.checks.checks import all_checks
from valve_friction_ros.reproduction.experiments import Plan
from valve_friction_ros.reproduction.figures.figures import draw_figures
from valve_friction_ros.reproduction.programme import progress_steps, run_programme
from valve_friction_ros.reproduction.report import report_page

__all__ = ["REFUSALS", "run"]

REFUSALS = (RefusalError,)
_PLAN = Plan()
_SEEDS = 5
_DRAWINGS = 2
"""Steps after the programme: the figures, and the page."""


def _noise(bench: Bench, options: argparse.Namespace) -> SensorNoise:
    """Return the configured noise, or what the options say instead."""
    if options.seed < 0:
        raise ValueError(f"--seed must not be negative, got {options.seed}")
    given = {
        "--position-noise-um": options.position_noise_um,
        "--pressure-noise-pa": options.pressure_noise_pa,
    }
    for name, value in given.items():
        if value is not None and not 0 <= value < math.inf:
            raise ValueError(f"{name} must be finite and not negative, got {value:g}")
    position, pressure = bench.noise.position, bench.noise.pressure
    if options.position_noise_um is not None:
        position = 1e-6 * options.position_noise_um
    if options.pressure_noise_pa is not None:
        pressure = options.pressure_noise_pa
    return SensorNoise(position, pressure, options.seed)


def _benches(options: argparse.Namespace) -> dict[str, Bench]:
    folder = options.config or find_bench_folder()
    benches = {name: read_bench(folder, name) for name in BENCH_NAMES}
    return {name: bench.with_noise(_noise(bench, options)) for name, bench in benches.items()}


def _reproduce(benches: dict[str, Bench], output: Path, progress: Callable[[str], object]) -> str:
    """Run, draw and write; return what matched."""
    programme = run_programme(benches, _PLAN, _SEEDS, progress)
    checks = all_checks(programme)
    progress("figures")
    pictures = draw_figures(programme)
    for name, picture in pictures.items():
        write_whole(output / f"{name}.png", picture.png)
    progress("report")
    write_report(report_page(programme, checks, pictures), output / PAGE)
    return summary(checks)


def run(options: argparse.Namespace) -> int:
    """Run the programme, and write the report."""
    benches = _benches(options)
    if options.output.exists() and not options.output.is_dir():
        raise ValueError(f"{options.output}: is no folder: give --output another name")
    options.output.mkdir(parents=True, exist_ok=True)
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=OutputConsole(stderr=True),
    ) as bar:
        task = bar.add_task("", total=progress_steps(benches) + _DRAWINGS, completed=-1)
        matched = _reproduce(
            benches,
            options.output,
            lambda what: bar.update(task, description=what, advance=1),
        )
        bar.update(task, description="done", advance=1)
    print(f"{options.output / PAGE} is written.")
    print(matched)
    return ExitCode.DONE
