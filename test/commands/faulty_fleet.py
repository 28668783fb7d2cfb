"""The sub-command `identify-folder` where a file's name says what becomes of its process.

At ``deadly…`` the process is killed, at ``endless…`` it waits until the command is dead.
"""

import multiprocessing
import os
import signal
import sys

from valve_friction_ros.commands.folder import sharing
from valve_friction_ros.commands.main import main
from valve_friction_ros.fleet import identify_job


def identify(job):
    if job.path.name.startswith("deadly"):
        os.kill(os.getpid(), signal.SIGKILL)
    if job.path.name.startswith("endless"):
        multiprocessing.parent_process().join()
    return identify_job(job)


if __name__ == "__main__":
    sharing.identify_job = identify
    sys.exit(main())
