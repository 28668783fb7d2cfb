# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The dashboard: a plant's valves in a browser; no ROS.

The modules here prepare the content without a web framework. ``pages/`` draws it with NiceGUI.
"""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.dashboard.context import (
        Answer as Answer,
        DashboardOptions as DashboardOptions,
        ServiceRequest as ServiceRequest,
    )
    from valve_friction_ros.dashboard.live_state import (
        ESSENTIAL_KEYS as ESSENTIAL_KEYS,
        Plant as Plant,
        Status as Status,
        Unread as Unread,
        view_of as view_of,
    )
    from valve_friction_ros.dashboard.plant_rows import Selection as Selection, selected as selected
else:
    __getattr__ = names_on_demand(__name__)
