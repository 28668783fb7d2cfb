"""Command `reproduce_paper`: the published programme on the simulated bench, and a report of it."""

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from valve_friction_ros.commands.output.formatting import OneLineParser, complain
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import SensorNoise
from valve_friction_ros.reports import render
from valve_friction_ros.reproduction import (
    BENCH_NAMES,
    Bench,
    Plan,
    all_checks,
    draw_figures,
    find_bench_folder,
    progress_steps,
    read_bench,
    report_page,
    run_programme,
    summary,
)

__all__ = ["main"]

_EXIT_REFUSED = 2
_PAGE = "reproduction.html"
_PLAN = Plan()
_SEEDS = 5
_DRAWINGS = 2
"""Steps after the programme: the figures, and the page."""


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(
        prog="reproduce_paper",
        description="Run the paper's experiments, identification and validation on the simulated "
        f"bench, and write {_PAGE} and every figure, beside the paper's numbers. The last line "
        "says what matched.",
        epilog="Exit code 0: the report is written, whatever matched; 2: it is not.",
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("reproduction"),
        metavar="FOLDER",
        help="where the report goes (%(default)s)",
    )
    parser.add_argument(
        "--config",
        type=Path,
        metavar="FOLDER",
        help="folder of bench_low.yaml, bench_high.yaml and bench_graphite.yaml; by default the "
        "package's own",
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
    parser.add_argument("--seed", type=int, default=0, help="of the noise (%(default)s)")
    return parser


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
        (output / f"{name}.png").write_bytes(picture.png)
    progress("report")
    text = render(report_page(programme, checks, pictures))
    (output / _PAGE).write_text(text, encoding="utf-8")
    return summary(checks)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    options = _parser().parse_args(arguments)
    console = Console(stderr=True)
    try:
        benches = _benches(options)
        if options.output.exists() and not options.output.is_dir():
            raise ValueError(f"{options.output}: is no folder: give --output another name")
        options.output.mkdir(parents=True, exist_ok=True)
        with Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            console=console,
        ) as bar:
            task = bar.add_task("", total=progress_steps(benches) + _DRAWINGS, completed=-1)
            matched = _reproduce(
                benches,
                options.output,
                lambda what: bar.update(task, description=what, advance=1),
            )
            bar.update(task, description="done", advance=1)
    except (ValueError, RefusalError, OSError) as error:
        complain("reproduce_paper", error)
        return _EXIT_REFUSED
    print(f"{options.output / _PAGE} is written.")
    print(matched)
    return 0


if __name__ == "__main__":
    sys.exit(main())
