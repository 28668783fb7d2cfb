# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The demo in a fraction of its time: 100 Hz, six seconds of signal a second, a given mass.

At 100 Hz only a derivative window of 50 ms follows the stem, and no such window tells the mass.
"""

import sys

from valve_friction_ros.commands.demo import command as demo
from valve_friction_ros.commands.main import main

QUICKER = {
    # Its signals run ahead of the clock.
    "identifier": {"derivative_window": 5, "fixed.mass": 1.64, "clock_tolerance": 0.0},
    # So few samples in so short a window average little: a tenth of the noise.
    "simulator": {"position_noise": 1e-6},
    "pressure_source": {"sample_rate": 100.0, "speed": 6.0, "pressure_noise": 2.0},
}
UNDER_WAY = 10.4
"""Signal let pass after the change, s: the same two seconds of real time, and some."""

if __name__ == "__main__":
    nodes = [
        node._replace(parameters={**node.parameters, **QUICKER.get(node.executable, {})})
        for node in demo._nodes()
    ]
    demo._nodes = lambda: nodes
    demo._UNDER_WAY = UNDER_WAY
    sys.exit(main())
