"""The threads of an identifier, which the identifiers of one process share."""

import contextlib
from collections.abc import Iterator
from typing import NamedTuple

from valve_friction_ros.alerts import AlertSender
from valve_friction_ros.identification.preparation import compile_methods
from valve_friction_ros.nodes.plumbing.worker import Worker

__all__ = ["Workers", "running_workers"]


class Workers(NamedTuple):
    """A thread that identifies, one that writes bags and reports, and one that sends alerts."""

    identify: Worker
    files: Worker
    alerts: AlertSender


@contextlib.contextmanager
def running_workers() -> Iterator[Workers]:
    """Provide the threads; at the end, tasks that still wait are dropped."""
    workers = Workers(Worker("identify", compile_methods), Worker("files"), AlertSender())
    try:
        yield workers
    finally:
        workers.alerts.close()
        for worker in (workers.identify, workers.files):
            worker.shutdown(wait=False, cancel_futures=True)
