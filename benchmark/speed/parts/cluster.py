# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Many recordings on the workers of a Dask cluster, beside the processes of one machine.

Recordings and clock are the same as in the part `fleet`. This part needs the extra `cluster`, and
as many free cores as workers.
"""

import statistics
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmark.harness.rows import Row
from benchmark.speed.measuring import Settings
from benchmark.speed.parts.fleet import Cost, cost_of, recordings, timed, write_recordings
from valve_friction_ros.fleet import in_processes
from valve_friction_ros.fleet.workers import Cluster, cluster_at, in_cluster

_WORKERS = (1, 2)
_OVERHEAD, _GAIN = 1.15, 1.8


@contextmanager
def _cluster(workers: int) -> Iterator[Cluster]:
    """Start a scheduler and single-threaded workers, and connect to the scheduler."""
    from distributed import LocalCluster  # noqa: PLC0415 - an extra

    with (
        LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as started,
        cluster_at(started.scheduler_address) as cluster,
    ):
        cluster.compare()
        yield cluster


def measure(settings: Settings) -> Iterator[Row]:
    """Measure one and two workers, in turn with as many processes."""
    pool: dict[int, list[Cost]] = {count: [] for count in _WORKERS}
    workers: dict[int, list[Cost]] = {count: [] for count in _WORKERS}
    with tempfile.TemporaryDirectory() as folder:
        paths = write_recordings(Path(folder))
        for repeat in range(settings.repeats):
            for count in _WORKERS:
                settings.say(f"{count} processes and workers, {repeat + 1} of {settings.repeats}")
                jobs = recordings(paths, count)
                answers = in_processes(timed, jobs, count, lambda: False)
                pool[count].append(cost_of(answers, count))
                with _cluster(count) as cluster:
                    found = in_cluster(cluster, timed, jobs, lambda: False)
                    workers[count].append(cost_of(found, count))
    walls = {
        (name, count): statistics.median(one.wall for one in costs[count])
        for name, costs in (("pool", pool), ("workers", workers))
        for count in _WORKERS
    }
    for count in _WORKERS:
        ours, peer = walls["workers", count], walls["pool", count]
        item, goal = f"seconds a recording, {count} workers", f"at most {_OVERHEAD:g} times it"
        name = f"{count} processes"
        yield Row(item, ours, "s", peer, name, goal, ours <= _OVERHEAD * peer)
    one, two = walls["workers", 1], walls["workers", 2]
    goal = f"at least {_GAIN:g} times faster"
    yield Row("two workers", two, "s", one, "one worker", goal, one >= _GAIN * two)
