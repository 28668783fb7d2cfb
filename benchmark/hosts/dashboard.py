"""The dashboard's node without its pages: prints what a page would show of the plant, as JSON.

A line every 0.2 s: the time, and for each first part of the valves' names how many valves are
shown as heard and as silent, and the fewest samples that one of its identifiers holds.
"""

import json
import sys
import time
from collections import defaultdict

import rclpy

from valve_friction_ros.nodes.dashboard.node import Dashboard
from valve_friction_ros.nodes.plumbing.polled_node import TurnExecutor
from valve_friction_ros.nodes.plumbing.stop_request import StopRequest

__all__ = ["main"]

_TURN = 0.05
_EVERY = 0.2


def _picture(node: Dashboard) -> dict[str, dict[str, int]]:
    groups: dict[str, dict[str, int]] = defaultdict(lambda: {"heard": 0, "silent": 0})
    for valve in node.plant.valves(time.monotonic()):
        group = groups[valve.view.node.strip("/").partition("_")[0]]
        group["silent" if valve.is_silent else "heard"] += 1
        held = int(valve.view.values.get("buffered_samples", "0"))
        group["fewest"] = min(group.get("fewest", held), held)
    return dict(groups)


def main() -> int:
    """Listen and print until the process is told to end."""
    rclpy.init(args=sys.argv, signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    node, executor, due = Dashboard(), TurnExecutor(), 0.0
    executor.add_node(node)
    with StopRequest() as stop:
        while not stop.has_come:
            executor.turn()
            node.poll_guarded()
            if time.monotonic() >= due:
                due = time.monotonic() + _EVERY
                print(json.dumps({"time": time.time(), "groups": _picture(node)}), flush=True)  # noqa: T201
            time.sleep(_TURN)
        stop.is_followed = True
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
