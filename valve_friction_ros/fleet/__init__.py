"""Many recordings identified by many processes into one file; no ROS."""

from valve_friction_ros.fleet.baselines import Baselines, read_baselines
from valve_friction_ros.fleet.discovery import Findings, FoundRecording, find_recordings
from valve_friction_ros.fleet.job import Job, Options, identify_job, identify_job_elsewhere
from valve_friction_ros.fleet.outputs import is_page, writer_of
from valve_friction_ros.fleet.ranking import ranked, reaches
from valve_friction_ros.fleet.report_files import with_reports_written
from valve_friction_ros.fleet.results_file import Entry, ResultsFile, database_of, reports_of
from valve_friction_ros.fleet.row import COLUMNS, error_cells, key_cells
from valve_friction_ros.fleet.sharing.batches import in_cluster
from valve_friction_ros.fleet.sharing.cluster import Cluster, cluster_at
from valve_friction_ros.fleet.sharing.processes import DeadWorker, in_processes, usable_cores
from valve_friction_ros.fleet.tally import REFUSED, Reason, Tally, tally

__all__ = [
    "COLUMNS",
    "REFUSED",
    "Baselines",
    "Cluster",
    "DeadWorker",
    "Entry",
    "Findings",
    "FoundRecording",
    "Job",
    "Options",
    "Reason",
    "ResultsFile",
    "Tally",
    "cluster_at",
    "database_of",
    "error_cells",
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
    "reports_of",
    "tally",
    "usable_cores",
    "with_reports_written",
    "writer_of",
]
