# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Figures of records and identifications; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.figures.history_figures import trend_figure as trend_figure
    from valve_friction_ros.figures.panels import (
        Case as Case,
        draw_curves as draw_curves,
        require_picture_file as require_picture_file,
        save_picture as save_picture,
    )
    from valve_friction_ros.figures.record_figures import (
        friction_figure as friction_figure,
        identification_figure as identification_figure,
        plan_figure as plan_figure,
        validation_figure as validation_figure,
    )
else:
    __getattr__ = names_on_demand(__name__)
