"""Who identifies the recordings of `identify-folder`: processes of this machine, or a cluster."""

import argparse
import contextlib
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

from valve_friction_ros.commands.folder.plan import Plan
from valve_friction_ros.commands.folder.stop_signals import StopSignals
from valve_friction_ros.fleet import (
    DeadWorker,
    Job,
    cluster_at,
    error_cells,
    identify_job,
    identify_job_elsewhere,
    in_cluster,
    in_processes,
    usable_cores,
    with_reports_written,
)
from valve_friction_ros.fleet.row import Cell

__all__ = ["Rows", "ShareOut", "finished", "workers"]

Rows = list[Mapping[str, Cell]]
"""The cells of all valves of a recording."""

ShareOut = Callable[[Iterable[Job], Callable[[], bool]], Iterator[tuple[Job, Rows | DeadWorker]]]
"""Identifies recordings until it is to stop: yields each with its rows as it finishes."""


@contextlib.contextmanager
def workers(options: argparse.Namespace) -> Iterator[ShareOut]:
    """Have those at hand that identify.

    Raises ValueError if a cluster was asked for that is not there, or cannot do the work.
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
    """Yield each recording with its rows as it finishes; their reports are written."""
    by_job: dict[Path, Plan] = {}
    possible: list[Job] = []
    for plan in plans:
        if isinstance(plan.job, Job):
            by_job[plan.job.path] = plan
            possible.append(plan.job)
        else:
            yield plan, [error_cells("", plan.job, Path(plan.name))]
    for job, answer in share_out(possible, stop.wanted):
        if isinstance(answer, DeadWorker):
            yield by_job[job.path], [error_cells("", str(answer), job.path)]
        elif job.reports is None:
            yield by_job[job.path], answer
        else:
            yield by_job[job.path], with_reports_written(answer, job.reports.parent)
