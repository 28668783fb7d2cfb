# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Evidence from service: moves of a valve, and the friction they show together; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.evidence.estimate import (
        MOST_MOVES as MOST_MOVES,
        Evidence as Evidence,
        FrictionChange as FrictionChange,
        evidence_of as evidence_of,
    )
    from valve_friction_ros.evidence.moves import (
        Move as Move,
        Moves as Moves,
        MoveStream as MoveStream,
        is_clock_reset as is_clock_reset,
        stamp_problem as stamp_problem,
    )
else:
    __getattr__ = names_on_demand(__name__)
