# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What has changed on a valve beside its friction, for its diagnostics."""

from collections.abc import Sequence

from valve_friction_ros.health import Finding, FrictionMonitor
from valve_friction_ros.health.valve_changes import DIFFERENCES
from valve_friction_ros.streams import Arrivals


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
