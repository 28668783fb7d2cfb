# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""Recordings identified by the processes of one machine."""

import os
import statistics
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmark.harness.rows import Row
from benchmark.speed.offline import Settings, noisy_record
from valve_friction_ros.fleet import (
    DeadWorker,
    Job,
    Options,
    identify_job,
    in_processes,
    usable_cores,
)
from valve_friction_ros.identification import DEFAULT_METHOD, IdentificationSettings
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION, SensorNoise
from valve_friction_ros.records.recordings import ReadingOptions

_FILES = 4
_RECORDINGS_A_PROCESS = 12
_SHARE = 0.8


def write_recordings(folder: Path) -> list[Path]:
    """Write the recordings, which are used in turn."""
    paths = []
    for seed in range(_FILES):
        record = noisy_record(HIGH_FRICTION, SensorNoise(10e-6, 100.0, seed))
        table = np.column_stack((record.time, record.position, record.pressure))
        path, header = folder / f"{seed}.csv", "time_s,position_m,pressure_pa"
        form = ("%.3f", "%.9f", "%.3f")
        np.savetxt(path, table, form, delimiter=",", header=header, comments="")
        paths.append(path)
    return paths


class _Answer(NamedTuple):
    """End time of a recording, s since 1970, with its process, processor time and error."""

    ended: float
    process: int
    processor_time: float
    error: object


class Cost(NamedTuple):
    """Seconds per recording."""

    wall: float
    processor: float


def timed(job: Job) -> _Answer:
    """Identify a recording."""
    (row,) = identify_job(job)
    return _Answer(time.time(), os.getpid(), time.process_time(), row.get("error"))


def recordings(paths: Sequence[Path], processes: int) -> list[Job]:
    """Return the jobs for a number of processes: the recordings in turn."""
    options = Options(BENCH_VALVE, ReadingOptions(), DEFAULT_METHOD, IdentificationSettings())
    count = processes * (_RECORDINGS_A_PROCESS + 1)
    turns = (paths[number % len(paths)] for number in range(count))
    return [Job(path, path.name, options) for path in turns]


def cost_of(answers: Iterable[tuple[Job, _Answer | DeadWorker]], processes: int) -> Cost:
    """Return the cost per recording for a number of processes, once each has answered."""
    ends: list[float] = []
    processor_times: dict[int, list[float]] = {}
    for _, answer in answers:
        if isinstance(answer, DeadWorker) or answer.error:
            raise RuntimeError(f"a recording was not identified: {answer}")
        ends.append(answer.ended)
        processor_times.setdefault(answer.process, []).append(answer.processor_time)
    over = time.time()  # after all answers, which may arrive several at once
    return Cost(
        (over - sorted(ends)[processes - 1]) / (len(ends) - processes),
        sum(times[-1] - times[0] for times in processor_times.values())
        / sum(len(times) - 1 for times in processor_times.values()),
    )


def fleet(settings: Settings) -> Iterator[Row]:
    """Identify many recordings on all cores: CSV files of 62.4 s at 1 kHz, read and identified.

    The result is wall-clock seconds per recording in steady state. The measurement begins after as
    many answers as there are processes, to exclude their start. Other work on the machine takes
    cores away from several processes but not from a single process. Processor seconds per recording
    show whether the processes disturb each other.
    """
    cores = usable_cores()
    costs: dict[int, list[Cost]] = {1: [], cores: []}
    with tempfile.TemporaryDirectory() as folder:
        paths = write_recordings(Path(folder))
        for repeat in range(settings.repeats):
            for processes, found in costs.items():
                settings.say(f"{processes} processes, {repeat + 1} of {settings.repeats}")
                answers = in_processes(
                    timed, recordings(paths, processes), processes, lambda: False
                )
                found.append(cost_of(answers, processes))
    one, every = (
        Cost(*(statistics.median(column) for column in zip(*costs[processes], strict=True)))
        for processes in (1, cores)
    )
    wanted, peer = _SHARE * cores, "one process"
    goal, met = f"at least {wanted:.1f} times faster", one.wall >= wanted * every.wall
    yield Row(f"seconds a recording, {cores} processes", every.wall, "s", one.wall, peer, goal, met)
    yield Row(f"recordings a second, {cores} processes", 1 / every.wall, "1/s")
    yield Row("recordings a second, one process", 1 / one.wall, "1/s")
    item = f"processor seconds a recording, {cores} processes"
    goal, met = f"at most 1/{_SHARE} of it", _SHARE * every.processor <= one.processor
    yield Row(item, every.processor, "s", one.processor, peer, goal, met)
