# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A stem that stands still while its pressure changes, watched in service."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from valve_friction_ros.health import (
    Finding,
    FrictionMonitor,
    Standstill,
    StandstillCounter,
    standstill_finding,
)
from valve_friction_ros.history.status_values import number_text
from valve_friction_ros.streams import Arrivals, Kind, Samples, utc_second


class StandstillWatch:
    """Finds a seized stem without a ``stem_command``; satisfies `Watch`."""

    def __init__(self, monitor: FrictionMonitor) -> None:
        self._monitor = monitor
        self._travel = math.nan
        self._counter: StandstillCounter | None = None

    def take(self, arrivals: Arrivals) -> None:
        """Follow pressure and stem, where the travel is known."""
        valve = self._monitor.settings.valve
        if valve.travel != self._travel:
            self._travel = valve.travel
            self._counter = StandstillCounter(valve.travel) if math.isfinite(valve.travel) else None
        if self._counter is None:
            return
        pressure, position = arrivals.samples(Kind.PRESSURE), arrivals.samples(Kind.POSITION)
        in_range = np.isfinite(pressure.values) & valve.sensor_reads(pressure.values)
        known = np.isfinite(position.values)
        self._counter.add(
            Samples(pressure.stamps[in_range], pressure.values[in_range]),
            Samples(position.stamps[known], position.values[known]),
        )

    def findings(self) -> Sequence[Finding]:
        """Return that the stem is held, if it is, in service or in the latest test."""
        still, baseline = self._standstill(), self._monitor.baseline
        settings, found = self._monitor.settings, None
        if still is not None and baseline is not None:
            factor = settings.limits.error_ratio
            found = standstill_finding(still, settings.valve, baseline, factor)
        found = found or self._monitor.held
        return [] if found is None else [found]

    def values(self) -> Mapping[str, str]:
        """Return since when the stem rests, and the static friction that this needs."""
        still = self._standstill()
        if still is None:
            return {}
        return {
            "standstill since [time]": utc_second(still.since),
            "standstill static_friction at least [N]": number_text(
                still.least_friction(self._monitor.settings.valve)
            ),
        }

    def _standstill(self) -> Standstill | None:
        return None if self._counter is None else self._counter.standstill
