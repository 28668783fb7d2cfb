# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Planning of the stroke test that determines the friction of a valve best; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.planning.conditions import (
        AIMS as AIMS,
        Conditions as Conditions,
        Limits as Limits,
    )
    from valve_friction_ros.planning.search import (
        StrokePlan as StrokePlan,
        plan_remarks as plan_remarks,
        plan_test as plan_test,
    )
    from valve_friction_ros.planning.stroke_test import (
        FrictionRange as FrictionRange,
        known_friction as known_friction,
        unknown_friction as unknown_friction,
    )
else:
    __getattr__ = names_on_demand(__name__)
