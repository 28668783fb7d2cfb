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
from valve_friction_ros.fleet.job import Job, Options, identify_job, identify_job_elsewhere
from valve_friction_ros.fleet.plant import read_plant
from valve_friction_ros.fleet.processes import DeadWorker, in_processes, usable_cores
from valve_friction_ros.fleet.recordings import Baselines, Findings, find_recordings, read_baselines
from valve_friction_ros.fleet.results_file import RecordingRows, ResultsFile

__all__ = [
    "Baselines",
    "Cluster",
    "DeadWorker",
    "Findings",
    "Job",
    "Options",
    "RecordingRows",
    "ResultsFile",
    "cluster_at",
    "find_recordings",
    "identify_job",
    "identify_job_elsewhere",
    "in_cluster",
    "in_processes",
    "read_baselines",
    "read_plant",
    "usable_cores",
]
