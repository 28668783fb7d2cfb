# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Processes that each write to a history, and send it to a server, until killed or done.

Arguments: folder, address, rows, and FILE=NUMBER of the valve for each process.
"""

import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from histories import START, VALVE, refused, success

from valve_friction_ros.health import Baseline, Level
from valve_friction_ros.history import (
    HistoryFile,
    HistoryServer,
    KeptBaseline,
    keep_told_level,
    outbox,
    sender_of,
)

# So that a run of seconds has many instants of each kind.
outbox._PAUSE, outbox._MANY = 0.01, 10


def write(path, server, number, most):
    history = HistoryFile(path)
    sends = sender_of(history.path, HistoryServer(server))
    valve = VALVE._replace(name=f"/fv_{number}/identifier")
    for k in range(most):
        entry = refused if k % 5 == 4 else success
        history.add(entry(START + k, valve=valve))
        if k % 10 == 0:
            history.set_baseline(valve, KeptBaseline(Baseline(100.0 + k), START + k, START + k))
            keep_told_level(history, valve, Level(k % 3))
        sys.stdout.write(f"{k}\n")
        sys.stdout.flush()
    outbox.follow(history.path)  # before the sender has done so, nothing is counted
    while outbox.count_unsent(history.path).waiting:
        time.sleep(0.02)
    sends.end()


if __name__ == "__main__":
    folder, server, most = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])
    places = [one.partition("=") for one in sys.argv[4:]]
    children = []
    for name, _, number in places[1:]:
        if not (child := os.fork()):
            write(folder / name, server, int(number), most)
            os._exit(0)
        children.append(child)
    write(folder / places[0][0], server, int(places[0][2]), most)
    sys.exit(any(os.waitpid(child, 0)[1] for child in children))
