"""The threads of an identifier, which the identifiers of one process share."""

import contextlib
from collections.abc import Iterator
from typing import NamedTuple

from valve_friction_ros.alerts import AlertSender
from valve_friction_ros.identification.preparation import compile_methods
from valve_friction_ros.nodes.plumbing.worker import Worker

__all__ = ["Workers", "running_workers"]


class Workers(NamedTuple):
    """Threads that identify, write bags and reports, combine moves in service, and send alerts."""

    identify: Worker
    files: Worker
    evidence: Worker
    alerts: AlertSender


@contextlib.contextmanager
def running_workers() -> Iterator[Workers]:
    """Provide the threads; at the end, tasks that still wait are dropped."""
    workers = Workers(
        Worker("identify", compile_methods), Worker("files"), Worker("evidence"), AlertSender()
    )
    try:
        yield workers
    finally:
        workers.alerts.close()
        for worker in (workers.identify, workers.files, workers.evidence):
            worker.shutdown(wait=False, cancel_futures=True)
