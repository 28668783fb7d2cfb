# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A Dask cluster on this machine, and what its workers are asked to do."""

import os
import signal
import time
from contextlib import contextmanager
from pathlib import Path

LOOK = 0.05  # s


def answer(task):
    """Do what the task says: tell the process, raise, be killed always or at first, wait."""
    word, _, place = task.partition(" ")
    if word == "kill" or (word == "once" and not Path(place).exists()):
        if place:
            Path(place).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if word == "raise":
        raise RuntimeError("of two\nlines")
    if word == "wait":
        Path(place).touch()
        while Path(place).exists():
            time.sleep(LOOK)
    return os.getpid(), os.environ["OPENBLAS_NUM_THREADS"]


@contextmanager
def local_cluster(workers=1, threads=1, allowed_failures=0, **options):
    """A scheduler in this process, with workers that are processes and come back when they die."""
    import dask
    from distributed import LocalCluster

    settings = {
        "distributed.scheduler.allowed-failures": allowed_failures,
        "distributed.deploy.lost-worker-timeout": "600s",  # a loaded machine brings it back late
    }
    with (
        dask.config.set(settings),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=threads,
            dashboard_address="127.0.0.1:0",
            silence_logs=50,
            **options,
        ) as cluster,
    ):
        yield cluster


def identify(job):
    """Identify a recording, or do what its name says: be killed, or wait for ``go`` beside it."""
    from valve_friction_ros.fleet import identify_job_elsewhere

    if job.path.name.startswith("deadly"):
        os.kill(os.getpid(), signal.SIGKILL)
    if job.path.name.startswith("endless"):
        while not job.path.with_name("go").exists():
            time.sleep(LOOK)
    return identify_job_elsewhere(job)
