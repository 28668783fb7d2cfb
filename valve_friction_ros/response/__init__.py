# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Response of a stem to its command in service: moves, deviation, hunting, causes; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.response.monitor import ResponseMonitor as ResponseMonitor
    from valve_friction_ros.response.moves import Hunting as Hunting, StepAnswer as StepAnswer
    from valve_friction_ros.response.summary import (
        FIGURES as FIGURES,
        SIZES as SIZES,
        AnswerCause as AnswerCause,
        ResponseLimits as ResponseLimits,
        ResponseSummary as ResponseSummary,
        Spread as Spread,
        response_findings as response_findings,
        summarised as summarised,
    )
else:
    __getattr__ = names_on_demand(__name__)
