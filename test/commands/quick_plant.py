# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The demo with the dashboard in a fraction of its time: six seconds of signal a second.

After the second identification the friction of the valves is what it is at the story's end.
"""

import sys
import webbrowser

from valve_friction_ros.commands.demo import plant
from valve_friction_ros.commands.main import main

QUICKER = {
    "identifier": {"clock_tolerance": 0.0},  # the stamps run ahead
    "pressure_source": {"sample_rate": 100.0, "speed": 6.0},
}

if __name__ == "__main__":
    nodes_of = plant.plant_nodes

    def quick_nodes(*arguments):
        return [
            node._replace(parameters={**node.parameters, **QUICKER.get(node.executable, {})})
            for node in nodes_of(*arguments)
        ]

    plant.plant_nodes = quick_nodes
    plant._REST /= 3.0  # still the signal of two records
    plant.VALVES = tuple(
        valve._replace(growth=valve.end) if valve.fate != "healthy" else valve
        for valve in plant.VALVES
    )
    webbrowser.open = lambda _: None
    sys.exit(main())
