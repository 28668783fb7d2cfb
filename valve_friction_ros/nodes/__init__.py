# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""ROS 2 nodes: they only translate messages and parameters.

Each node is a class that runs in any executor of rclpy, also next to other nodes in your own
process::

    rclpy.init()
    identifier = Identifier(namespace="/fv_101")
    rclpy.spin(identifier)
    identifier.destroy_node()  # writes pending data
"""

import os
from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.nodes.dashboard import Dashboard as Dashboard
    from valve_friction_ros.nodes.identifier.node import Identifier as Identifier
    from valve_friction_ros.nodes.pressure_source import PressureSource as PressureSource
    from valve_friction_ros.nodes.simulator import Simulator as Simulator
    from valve_friction_ros.nodes.stroke_player import StrokePlayer as StrokePlayer
else:
    __getattr__ = names_on_demand(__name__)

# Read when numpy is imported: for such small matrices more threads only wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
