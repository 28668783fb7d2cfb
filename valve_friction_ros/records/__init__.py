# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recordings in tables and bags, and the valve file that describes them; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.records.recorded_valve import (
        RecordedValve as RecordedValve,
        Stretch as Stretch,
    )
    from valve_friction_ros.records.recordings import (
        ReadingOptions as ReadingOptions,
        read_recordings as read_recordings,
    )
    from valve_friction_ros.records.valve_file import (
        ValveFile as ValveFile,
        read_valve_file as read_valve_file,
    )
else:
    __getattr__ = names_on_demand(__name__)
