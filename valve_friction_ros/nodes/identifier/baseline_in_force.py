"""The baseline in force: parameter, service and history all set it here."""

import math
from collections.abc import Iterable
from datetime import datetime, timezone
from pathlib import Path

from rclpy.node import Node
from rclpy.parameter import Parameter

from valve_friction_ros.health import Baseline, FrictionMonitor
from valve_friction_ros.history import KeptBaseline
from valve_friction_ros.nodes.identifier.parameters import BASELINE, baseline_from
from valve_friction_ros.nodes.plumbing.parameters import values_of

__all__ = ["BaselineInForce"]


def _value(baseline: Baseline | None) -> float | None:
    return None if baseline is None else baseline.coulomb_friction


def _described_with_date(kept: KeptBaseline) -> str:
    date = datetime.fromtimestamp(kept.time / 1e9, timezone.utc)
    return f"baseline {kept.baseline}, set {date:%Y-%m-%d %H:%M} UTC"


class BaselineInForce:
    """Puts a baseline in force: that of the parameter, of ``~/set_baseline`` or of the history.

    The parameter shows F_c of the baseline in force, nan where that has only a sliding friction. A
    parameter that is set to another value stands for an exact F_c, and no sliding friction; nan
    leaves no baseline.
    """

    def __init__(self, node: Node, monitor: FrictionMonitor) -> None:
        self._node = node
        self._monitor = monitor

    def begin(self, kept: KeptBaseline | None, history: Path | None) -> None:
        """Take the baseline of the parameter, or else of the history, and log which."""
        self._monitor.baseline = baseline_from(values_of(self._node, (BASELINE,)))
        given, log = self._monitor.baseline, self._node.get_logger()
        if given is not None:
            source = f"from the parameter {BASELINE.name}"
            if kept is not None:
                source += f"; the history's is not used: {_described_with_date(kept)}"
            log.info(f"baseline {given}, {source}")
        elif kept is not None:
            self.put_in_force(kept.baseline)
            log.info(f"{_described_with_date(kept)}, from the history {history}")

    def put_in_force(self, baseline: Baseline) -> None:
        """Compare with this baseline from now on."""
        shown = math.nan if baseline.coulomb_friction is None else baseline.coulomb_friction
        self._node.set_parameters([Parameter(BASELINE.name, value=shown)])
        self._monitor.baseline = baseline  # after the node has followed the parameter

    def follow_parameter(self, changes: Iterable[Parameter]) -> None:
        """Follow a change of the parameter, unless its value is in force already."""
        if BASELINE.name not in {one.name for one in changes}:
            return
        given = baseline_from(values_of(self._node, (BASELINE,)))
        if given is None or _value(given) != _value(self._monitor.baseline):
            self._monitor.baseline = given
