"""The identifier's last estimate, reported as a page on request."""

from collections.abc import Callable
from datetime import datetime, timezone
from itertools import count
from pathlib import Path
from typing import NamedTuple

from rclpy.node import Node

from valve_friction_ros.health import FrictionMonitor
from valve_friction_ros.identification import RefusalError, Result
from valve_friction_ros.nodes.identifier.keeping import Job
from valve_friction_ros.nodes.plumbing.parameters import ParameterSpec
from valve_friction_ros.records.data_folder import data_folder

__all__ = ["REPORT_FOLDER", "Reporting"]

REPORT_FOLDER = ParameterSpec(
    "report_folder",
    "",
    "Folder that ~/report writes pages into [-]; empty: valve_friction_ros/reports under ROS_HOME, "
    "or under ~/.ros",
)


class _Estimate(NamedTuple):
    """The last estimate, what it was identified from and how, and when (ns)."""

    job: Job
    result: Result
    stamp: int


class Reporting:
    """Keeps the record of the last estimate, to draw it when the buffer has moved on.

    Parameters
    ----------
    node : Node
        The identifier, with the parameter above.
    monitor : FrictionMonitor
        Tells the baseline, the limits, and whether anything was refused since.
    """

    def __init__(self, node: Node, monitor: FrictionMonitor) -> None:
        self._node = node
        self._monitor = monitor
        self._last: _Estimate | None = None

    def remember(self, job: Job, result: Result, stamp: int) -> None:
        """Keep an estimate accepted at `stamp` (ns), in place of the one before."""
        self._last = _Estimate(job, result, stamp)

    def writing(self) -> Callable[[], Path]:
        """Return what writes the report of the last estimate, in any thread.

        What is returned raises RefusalError with the reason if it cannot be written.

        Raises
        ------
        RefusalError
            If there is no estimate.
        """
        if self._last is None:
            raise RefusalError("there is no estimate to report: identify first")
        last, node = self._last, self._node
        told = node.get_parameter(REPORT_FOLDER.name).value
        namespace, node_name = node.get_namespace().strip("/"), node.get_fully_qualified_name()
        valve = node.get_parameter("valve_tag").value or namespace or node.get_name()
        baseline, limits = self._monitor.baseline, self._monitor.settings.limits
        refusal = self._monitor.refusal
        time = datetime.fromtimestamp(last.stamp / 1e9, timezone.utc)
        name = f"{(namespace or node.get_name()).replace('/', '_')}_{time:%Y%m%dT%H%M%SZ}"

        def write() -> Path:
            # Costs memory and time at the start, and most nodes never report.
            from valve_friction_ros import reports  # noqa: PLC0415

            try:
                folder = Path(told).expanduser() if told else data_folder() / "reports"
                folder.mkdir(parents=True, exist_ok=True)
                path = _free_name(folder, name)
                record = reports.IdentifiedRecord(
                    name=valve,
                    source=f"node {node_name}, identified {time:%Y-%m-%d %H:%M:%S} UTC",
                    result=last.result,
                    baseline=baseline,
                    limits=limits,
                    notes=() if refusal is None else (f"a later record was refused: {refusal}",),
                )
                reports.write_report(reports.identification_report(record), path)
            except OSError as error:
                cause = error.strerror or error
                raise RefusalError(f"cannot write a report into {folder}: {cause}") from None
            except RuntimeError as error:  # a home that cannot be found
                where = told or "~/.ros"
                raise RefusalError(f"cannot write a report into {where}: {error}") from None
            return path

        return write


def _free_name(folder: Path, name: str) -> Path:
    """Return the first file of this name, or with a number after it, that is not there."""
    names = (f"{name}.html" if number == 1 else f"{name}_{number}.html" for number in count(1))
    return next(path for path in map(folder.joinpath, names) if not path.exists())
