# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What others see of the usage while the renewal of a packing is written."""

import asyncio
from types import SimpleNamespace

import numpy as np

from valve_friction_ros.health import FrictionMonitor, MonitorSettings
from valve_friction_ros.history import KeptValve
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.nodes.identifier.usage_watch import UsageWatch
from valve_friction_ros.streams import Arrivals, Kind

SECOND = 1_000_000_000
START = 1_790_000_000 * SECOND
PARAMETERS = {
    "counting_dead_band": 1e-4,
    "air_to": "open",
    "travel_limit": 1e-3,
    "reversal_limit": 0.0,
}


class HeldHistory:
    """A history whose file another program holds: a diagnosis comes while a change waits."""

    path = None
    reservation = ""
    valve = KeptValve("/fv_101/identifier", "FV-101")

    def usage(self):
        return None

    def keep_soon(self, change):
        pass

    async def keep_change(self, change):
        self.waiting = change
        self.seen = self.watch.limits(), self.watch.findings()


def watch_of(history):
    """A watch without a graph."""
    node = SimpleNamespace(
        get_parameter=lambda name: SimpleNamespace(value=PARAMETERS[name]),
        get_clock=lambda: SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=START)),
        get_logger=lambda: SimpleNamespace(info=str),
    )
    history.watch = UsageWatch(node, FrictionMonitor(MonitorSettings(BENCH_VALVE)), history)
    return history.watch


def test_a_diagnosis_meanwhile_sees_the_new_packing():
    history = HeldHistory()
    watch = watch_of(history)
    position = np.linspace(0.0, BENCH_VALVE.travel, 64)
    stamps = START + 10 * SECOND * np.arange(position.size)
    watch.take(Arrivals(np.full(64, Kind.POSITION, np.uint8), stamps, position))
    answer = asyncio.run(watch.reset())
    assert "0.02" in answer
    ((state,), findings) = history.seen
    assert (state.used, findings) == (0.0, [])
    assert watch.findings() == []
