"""Many recordings on all cores: CSV files of 62.4 s at 1 kHz, read and identified.

Wall-clock seconds a recording in the steady state: begun when as many answers are there as there
are processes, so that their start does not count.
"""

import statistics
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmark.speed.records import noisy_record
from benchmark.speed.rows import Row, Settings
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
from valve_friction_ros.monitoring.recordings import ReadingOptions

__all__ = ["measure"]

_FILES = 4
_RECORDINGS_A_PROCESS = 12
_SHARE = 0.8


def _write(folder: Path) -> list[Path]:
    """Write the records that take turns as recordings."""
    paths = []
    for seed in range(_FILES):
        record = noisy_record(HIGH_FRICTION, SensorNoise(10e-6, 100.0, seed))
        table = np.column_stack((record.time, record.position, record.pressure))
        path = folder / f"{seed}.csv"
        np.savetxt(
            path,
            table,
            fmt=("%.3f", "%.9f", "%.3f"),
            delimiter=",",
            header="time_s,position_m,pressure_pa",
            comments="",
        )
        paths.append(path)
    return paths


def _never() -> bool:
    return False


def _seconds_a_recording(paths: Sequence[Path], processes: int) -> float:
    options = Options(BENCH_VALVE, ReadingOptions(), DEFAULT_METHOD, IdentificationSettings(), None)
    count = processes * (_RECORDINGS_A_PROCESS + 1)
    jobs = [Job(paths[number % len(paths)], options) for number in range(count)]
    times = []
    for _, answer in in_processes(identify_job, jobs, processes, _never):
        if isinstance(answer, DeadWorker) or answer[0].get("error"):
            raise RuntimeError(f"a recording was not identified: {answer}")
        times.append(time.monotonic())
    return (times[-1] - times[processes - 1]) / (len(times) - processes)


def measure(settings: Settings) -> Iterator[Row]:
    """Measure one process and one on each core, in turn."""
    cores = usable_cores()
    seconds: dict[int, list[float]] = {1: [], cores: []}
    with tempfile.TemporaryDirectory() as folder:
        paths = _write(Path(folder))
        for repeat in range(settings.repeats):
            for processes, found in seconds.items():
                settings.say(f"{processes} processes, {repeat + 1} of {settings.repeats}")
                found.append(_seconds_a_recording(paths, processes))
    one, all_cores = (statistics.median(seconds[processes]) for processes in (1, cores))
    wanted = _SHARE * cores
    yield Row(
        f"seconds a recording, {cores} processes",
        all_cores,
        "s",
        one,
        "one process",
        f"at least {wanted:.1f} times faster",
        one >= wanted * all_cores,
    )
    yield Row(f"recordings a second, {cores} processes", 1 / all_cores, "1/s")
    yield Row("recordings a second, one process", 1 / one, "1/s")
