# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The processes of one host: `identifiers` and the source of its samples; or one that asks them.

It prints the number of `identifiers`, then how many samples of a signal each valve was sent, and
ends with its input. With `--ask` it asks the valves to identify, one after the other, and prints
how many answered; refusals are answers.
"""

import argparse
import os
import sys
from pathlib import Path

from benchmark.harness.processes import Process, module, parameters
from valve_friction_ros.nodes.service_call import caller

_PATIENCE = 300.0


def _ask(options: argparse.Namespace) -> None:
    # A process started later has its own shared memory, and would look for the host there.
    os.environ["FASTDDS_BUILTIN_TRANSPORTS"] = "UDPv4"
    answered = 0
    with caller(lambda: True) as client:
        for valve in options.valves:
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


def main() -> int:
    """Serve, or ask."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("valves", nargs="+")
    parser.add_argument("--rate", type=int)
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--history", default="''")
    parser.add_argument("--history-url", default="''")
    parser.add_argument("--ask", action="store_true")
    options = parser.parse_args()
    (_ask if options.ask else _serve)(options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
