"""The published programme on the simulated bench, beside the numbers of the paper; no ROS."""

from valve_friction_ros.reproduction.bench import BENCH_NAMES, Bench, find_bench_folder, read_bench
from valve_friction_ros.reproduction.checks.check import Check, summary
from valve_friction_ros.reproduction.checks.checks import all_checks
from valve_friction_ros.reproduction.experiments import Experiment, Experiments, Plan, run, run_all
from valve_friction_ros.reproduction.figures.figures import draw_figures
from valve_friction_ros.reproduction.programme import (
    BenchResult,
    Comparison,
    Identified,
    Programme,
    progress_steps,
    run_programme,
)
from valve_friction_ros.reproduction.report import report_page

__all__ = [
    "BENCH_NAMES",
    "Bench",
    "BenchResult",
    "Check",
    "Comparison",
    "Experiment",
    "Experiments",
    "Identified",
    "Plan",
    "Programme",
    "all_checks",
    "draw_figures",
    "find_bench_folder",
    "progress_steps",
    "read_bench",
    "report_page",
    "run",
    "run_all",
    "run_programme",
    "summary",
]
