# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The processes of one host: `identifiers` and the source of its samples.

It prints their numbers as JSON, then how many samples of a signal each valve was sent, and ends
with its input.
"""

import argparse
import json
import subprocess
import sys

__all__ = ["main"]

_IDENTIFIERS = ("-m", "valve_friction_ros.nodes.identifiers", "--ros-args", "--log-level", "error")


def main() -> int:
    """Start both, and end them with the input."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("valves", nargs="+")
    parser.add_argument("--rate", type=int, required=True)
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--history", default="''")
    parser.add_argument("--history-url", default="''")
    options = parser.parse_args()
    parameters = [
        f"valves:=[{','.join(options.valves)}]",
        f"history_file:={options.history}",
        f"history_url:={options.history_url}",
        "window:=3600.0",
    ]
    given = [word for one in parameters for word in ("-p", one)]
    identifiers = subprocess.Popen(
        [sys.executable, *_IDENTIFIERS, *given],
        stdin=subprocess.DEVNULL,
        stdout=sys.stderr,
    )
    stream = ["--rate", str(options.rate), "--seconds", str(options.seconds), "--blocks"]
    source = subprocess.Popen(
        [sys.executable, "-m", "benchmark.speed.stream_source", *options.valves, *stream],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    print(json.dumps({"identifiers": identifiers.pid, "source": source.pid}), flush=True)  # noqa: T201
    print(source.stdout.readline() if source.stdout else "", end="", flush=True)  # noqa: T201
    sys.stdin.read()
    for process in (identifiers, source):
        process.terminate()
    for process in (identifiers, source):
        process.wait(20)
    return 0


if __name__ == "__main__":
    sys.exit(main())
