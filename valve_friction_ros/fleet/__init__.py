# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Identification of many recordings by several processes into one file; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.fleet.job import (
        Job as Job,
        Options as Options,
        identify_job as identify_job,
        identify_job_elsewhere as identify_job_elsewhere,
    )
    from valve_friction_ros.fleet.recordings import (
        Baselines as Baselines,
        Findings as Findings,
        find_recordings as find_recordings,
        read_baselines as read_baselines,
        read_plant as read_plant,
    )
    from valve_friction_ros.fleet.results_file import (
        RecordingRows as RecordingRows,
        ResultsFile as ResultsFile,
    )
    from valve_friction_ros.fleet.workers import (
        Cluster as Cluster,
        DeadWorker as DeadWorker,
        cluster_at as cluster_at,
        in_cluster as in_cluster,
        in_processes as in_processes,
        usable_cores as usable_cores,
    )
else:
    __getattr__ = names_on_demand(__name__)
