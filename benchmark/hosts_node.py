# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What runs on a host: its valves, a client that asks them to identify, or the dashboard.

`serve` prints the number of `identifiers`, then how many samples of a signal each valve was sent,
and ends with its input. `ask` asks the valves to identify, one after the other, and prints how many
answered; refusals are answers. Every 0.2 s `dashboard` prints the time and, per host, the numbers
of valves shown as heard and as silent, and the fewest samples in any of its identifiers. The first
part of a valve's name is its host.
"""

import argparse
import json
import os
import sys
import time
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmark.harness.processes import Process, module, parameters
from valve_friction_ros.nodes.service_call import caller

_PATIENCE = 300.0
_TURN = 0.05
_EVERY, _COUNTED_EVERY = 0.2, 3.0


def _ask(valves: Sequence[str]) -> None:
    # A process started later has its own shared memory, and would look for the host there.
    os.environ["FASTDDS_BUILTIN_TRANSPORTS"] = "UDPv4"
    answered = 0
    with caller(lambda: True) as client:
        for valve in valves:
            identifier = client.find(valve, _PATIENCE)
            answered += client.call(identifier, "identify", _PATIENCE) is not None
    print(answered, flush=True)


def _serve(options: argparse.Namespace) -> None:
    """Start both processes, and end them when the input ends."""
    given = parameters(
        valves=f"[{','.join(options.valves)}]",
        history_file=options.history,
        history_url=options.history_url,
        window=3600.0,
    )
    words = ("--ros-args", "--log-level", "error")
    stream = ("--rate", str(options.rate), "--seconds", str(options.seconds), "--blocks")
    command = module("valve_friction_ros.nodes.identifiers", *words, *given)
    identifiers = Process(command, Path("/dev/stderr"))
    source = Process(module("benchmark.speed.stream_source", *options.valves, *stream))
    print(identifiers.pid, flush=True)
    print(source.output.readline(), end="", flush=True)
    sys.stdin.read()
    identifiers.end()
    source.end()


def _host_of(identifier: str) -> str:
    return identifier.strip("/").partition("_")[0]


def _picture(node: Any) -> dict[str, dict[str, int]]:
    """Return the data of the plant page, at its refresh rate."""
    groups: dict[str, dict[str, int]] = defaultdict(lambda: {"heard": 0, "silent": 0})
    for valve in node.plant.valves(time.monotonic()):
        groups[_host_of(valve.view.node)]["silent" if valve.is_silent else "heard"] += 1
    return groups


def _fewest(node: Any) -> dict[str, int]:
    """Return the fewest samples per host, from the data of all valve pages, which takes longer."""
    now, fewest = time.monotonic(), dict[str, int]()
    for one in node.plant.valves(now):
        valve, host = node.plant.valve(one.view.node, now), _host_of(one.view.node)
        held = 0 if valve is None else int(valve.view.values.get("buffered_samples", "0"))
        fewest[host] = min(fewest.get(host, held), held)
    return fewest


def _watch() -> None:
    """Run the dashboard's node without pages, and print until a stop signal."""
    import rclpy  # noqa: PLC0415 - the hosts with valves shall not load a dashboard

    from valve_friction_ros.nodes.dashboard import Dashboard  # noqa: PLC0415
    from valve_friction_ros.nodes.plumbing.polled_node import TurnExecutor  # noqa: PLC0415
    from valve_friction_ros.nodes.plumbing.running import StopRequest  # noqa: PLC0415

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


def main() -> None:
    """Serve, ask or watch."""
    if "dashboard" in sys.argv[1:2]:
        return _watch()
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("task", choices=("serve", "ask"))
    parser.add_argument("valves", nargs="+")
    parser.add_argument("--rate", type=int)
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--history", default="''")
    parser.add_argument("--history-url", default="''")
    options = parser.parse_args()
    return _serve(options) if options.task == "serve" else _ask(options.valves)


if __name__ == "__main__":
    main()
