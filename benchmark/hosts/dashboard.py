# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The dashboard's node without pages: prints the state of the plant as JSON.

Every 0.2 s it prints a line with the time and, per host, the numbers of valves shown as heard and
as silent, and the fewest samples in any of its identifiers. The first part of a valve's name is its
host.
"""

import json
import sys
import time
from collections import defaultdict

import rclpy

from valve_friction_ros.nodes.dashboard import Dashboard
from valve_friction_ros.nodes.plumbing.polled_node import TurnExecutor
from valve_friction_ros.nodes.plumbing.running import StopRequest

_TURN = 0.05
_EVERY, _COUNTED_EVERY = 0.2, 3.0
_Groups = dict[str, dict[str, int]]


def _group_of(identifier: str) -> str:
    return identifier.strip("/").partition("_")[0]


def _picture(node: Dashboard) -> _Groups:
    """Return the data of the plant page, at its refresh rate."""
    groups: _Groups = defaultdict(lambda: {"heard": 0, "silent": 0})
    for valve in node.plant.valves(time.monotonic()):
        groups[_group_of(valve.view.node)]["silent" if valve.is_silent else "heard"] += 1
    return groups


def _fewest(node: Dashboard) -> dict[str, int]:
    """Return the fewest samples per host, from the data of all valve pages, which takes longer."""
    now, fewest = time.monotonic(), dict[str, int]()
    for one in node.plant.valves(now):
        valve, group = node.plant.valve(one.view.node, now), _group_of(one.view.node)
        held = 0 if valve is None else int(valve.view.values.get("buffered_samples", "0"))
        fewest[group] = min(fewest.get(group, held), held)
    return fewest


def main() -> int:
    """Listen and print until a stop signal."""
    rclpy.init(args=sys.argv, signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    node, executor, due, counted = Dashboard(), TurnExecutor(), 0.0, 0.0
    fewest: dict[str, int] = {}
    executor.add_node(node)
    with StopRequest() as stop:
        while not stop.has_come:
            executor.turn()
            node.poll_guarded()
            if time.monotonic() >= due:
                due = time.monotonic() + _EVERY
                if due >= counted:
                    fewest, counted = _fewest(node), due + _COUNTED_EVERY
                shown = _picture(node)
                groups = {name: {**shown[name], "fewest": fewest.get(name, 0)} for name in shown}
                print(json.dumps({"time": time.time(), "groups": groups}), flush=True)
            time.sleep(_TURN)
        stop.is_followed = True
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
