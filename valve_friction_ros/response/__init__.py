# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The answer of a stem to its command in service: moves, deviation, hunting, blame; no ROS."""

from valve_friction_ros.response.monitor import ResponseMonitor
from valve_friction_ros.response.moves import Hunting, StepAnswer
from valve_friction_ros.response.summary import (
    FIGURES,
    SIZES,
    AnswerCause,
    ResponseLimits,
    ResponseSummary,
    Spread,
    response_findings,
    summarised,
)

__all__ = [
    "FIGURES",
    "SIZES",
    "AnswerCause",
    "Hunting",
    "ResponseLimits",
    "ResponseMonitor",
    "ResponseSummary",
    "Spread",
    "StepAnswer",
    "response_findings",
    "summarised",
]
