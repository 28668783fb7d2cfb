"""The sub-command `identify-folder` whose cluster does what the names of files say."""

import sys

from dask_workers import identify

from valve_friction_ros.commands.folder import sharing
from valve_friction_ros.commands.main import main

if __name__ == "__main__":
    sharing.identify_job_elsewhere = identify
    sys.exit(main())
