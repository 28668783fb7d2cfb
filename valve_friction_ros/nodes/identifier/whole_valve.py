"""What has changed on a valve beside its friction, for its diagnostics."""

from collections.abc import Sequence

from valve_friction_ros.health import Finding, FrictionMonitor
from valve_friction_ros.health.valve_changes import DIFFERENCES
from valve_friction_ros.streams import Arrivals

__all__ = ["WholeValve"]


class WholeValve:
    """Shows the findings of the latest result, and each change with its interval (a `Watch`)."""

    def __init__(self, monitor: FrictionMonitor) -> None:
        self._monitor = monitor

    def take(self, _: Arrivals) -> None:
        """Take no samples: the identification has them."""

    def findings(self) -> Sequence[Finding]:
        """Return what has changed since the baseline."""
        return self._monitor.findings

    def values(self) -> dict[str, str]:
        """Return the changes: of a ratio in percent, else in the number's unit."""
        values = {}
        for name, change in self._monitor.changes.items():
            unit = DIFFERENCES.get(name, "%")
            for end in ("value", "low", "high"):
                number = getattr(change, end)
                key = f"{name} change {end}".removesuffix(" value")
                values[f"{key} [{unit}]"] = f"{100 * (number - 1) if unit == '%' else number:.6g}"
        return values
