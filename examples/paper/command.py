# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The programme on the simulated bench, and its report: `valve_friction reproduce-paper`."""

import argparse
import math
from collections.abc import Callable
from pathlib import Path

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from paper.bench import BENCH_NAMES, Bench, read_bench
from paper.checks import all_checks, summary
from paper.experiments import Plan
from paper.figures import draw_figures
from paper.programme import progress_steps, run_programme
from paper.report import report_page
from valve_friction_ros.commands.arguments.declared import PAGE
from valve_friction_ros.commands.console import OutputConsole
from valve_friction_ros.commands.process import ExitCode
from valve_friction_ros.model import SensorNoise
from valve_friction_ros.records.files import write_whole
from valve_friction_ros.reports import write_report

_PLAN = Plan()
_SEEDS = 5
_DRAWINGS = 2
"""Steps after the programme: the figures, and the page."""


def _noise(bench: Bench, options: argparse.Namespace) -> SensorNoise:
    """Return the configured noise, unless options replace it."""
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
    folder = options.config or Path(__file__).resolve().parents[2] / "config"
    benches = {name: read_bench(folder, name) for name in BENCH_NAMES}
    return {name: bench.with_noise(_noise(bench, options)) for name, bench in benches.items()}


def _reproduce(benches: dict[str, Bench], output: Path, progress: Callable[[str], object]) -> str:
    """Run, draw and write; return a summary of the matches."""
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
    """Run the programme and write the report."""
    benches = _benches(options)
    if options.output.exists() and not options.output.is_dir():
        raise ValueError(f"{options.output}: not a folder: give --output another name")
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
