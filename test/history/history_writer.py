# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A process that writes to a history until it is killed, and says what it has finished."""

import sys
from itertools import count
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

if __name__ == "__main__":
    from histories import START, VALVE, refused, success

    from valve_friction_ros.health import Baseline
    from valve_friction_ros.history import HistoryFile, KeptBaseline

    history, number = HistoryFile(Path(sys.argv[1])), int(sys.argv[2])
    for k in count() if len(sys.argv) < 4 else range(int(sys.argv[3])):
        valve = VALVE._replace(name=f"/fv_{number}/identifier")
        if k % 5 == 4:
            history.add(refused(START + k, valve=valve))
        else:
            history.add(success(START + k, 100.0 + k, valve=valve))
        history.set_baseline(valve, KeptBaseline(Baseline(100.0 + k), START + k, START + k))
        sys.stdout.write(f"{k}\n")
        sys.stdout.flush()
