# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Many recordings identified by many processes into one file; no ROS."""

from valve_friction_ros.fleet.cluster import Cluster, cluster_at, in_cluster
from valve_friction_ros.fleet.job import (
    FILING,
    Filed,
    Filing,
    Job,
    Options,
    baseline_kept,
    file_results,
    filed_before,
    identify_job,
    identify_job_elsewhere,
)
from valve_friction_ros.fleet.plant import read_plant, valves_of
from valve_friction_ros.fleet.processes import DeadWorker, in_processes, usable_cores
from valve_friction_ros.fleet.recordings import (
    Baselines,
    Findings,
    FoundRecording,
    find_recordings,
    read_baselines,
)
from valve_friction_ros.fleet.results_file import (
    REFUSED,
    Reason,
    RecordingRows,
    ResultsFile,
    Tally,
    database_of,
    is_page,
    reason_of,
    reports_of,
    tally,
    writer_of,
)
from valve_friction_ros.fleet.rows import (
    COLUMNS,
    error_cells,
    key_cells,
    ranked,
    reaches,
    with_reports_written,
)

__all__ = [
    "COLUMNS",
    "FILING",
    "REFUSED",
    "Baselines",
    "Cluster",
    "DeadWorker",
    "Filed",
    "Filing",
    "Findings",
    "FoundRecording",
    "Job",
    "Options",
    "Reason",
    "RecordingRows",
    "ResultsFile",
    "Tally",
    "baseline_kept",
    "cluster_at",
    "database_of",
    "error_cells",
    "file_results",
    "filed_before",
    "find_recordings",
    "identify_job",
    "identify_job_elsewhere",
    "in_cluster",
    "in_processes",
    "is_page",
    "key_cells",
    "ranked",
    "reaches",
    "read_baselines",
    "read_plant",
    "reason_of",
    "reports_of",
    "tally",
    "usable_cores",
    "valves_of",
    "with_reports_written",
    "writer_of",
]
