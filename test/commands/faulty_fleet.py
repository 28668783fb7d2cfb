# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-command `identify-folder` where a file's name says what becomes of its process.

At ``deadly…`` the process is killed, at ``endless…`` it waits until the command is dead.
"""

import multiprocessing
import os
import signal
import sys

from valve_friction_ros.commands import identify_folder
from valve_friction_ros.commands.main import main
from valve_friction_ros.fleet import identify_job


def identify(job):
    if job.path.name.startswith("deadly"):
        os.kill(os.getpid(), signal.SIGKILL)
    if job.path.name.startswith("endless"):
        multiprocessing.parent_process().join()
    return identify_job(job)


if __name__ == "__main__":
    identify_folder.identify_job = identify
    sys.exit(main())
