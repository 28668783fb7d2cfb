# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Trial of one valve: make its records, identify them within a time limit, and compare."""

import json
import math
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import NamedTuple, TypeVar

import numpy as np
from scipy.signal import savgol_filter

from benchmark.reality import package
from benchmark.reality.motions import Kind
from benchmark.reality.package import Answer, Number
from benchmark.reality.records import Case, Record, TrueValue, make_record

_WINDOW = 0.15
_SURELY = 0.2
"""Length of the filter, s, and share of the top speed above which the stem clearly slides."""


def sliding_friction(record: Record) -> float:
    """Return the sliding friction, N, at the distance-weighted speed; nan if nothing slides.

    Regress the actuator force on sgn v, v, x and 1, without lags, intervals or checks.
    """
    stamps, position = record.position.stamps / 1e9, record.position.values
    pressure_stamps = record.pressure.stamps / 1e9
    period = float(np.median(np.diff(stamps)))
    time = np.arange(
        max(stamps[0], pressure_stamps[0]), min(stamps[-1], pressure_stamps[-1]), period
    )
    window = 2 * max(round(_WINDOW / period / 2), 2) + 1
    if time.size < window:
        return math.nan
    stem = np.interp(time, stamps, position)
    pressure = np.interp(time, pressure_stamps, record.pressure.values)
    place = savgol_filter(stem, window, 2)
    speed = savgol_filter(stem, window, 2, deriv=1, delta=period)
    force = record.nominal.diaphragm_area * savgol_filter(pressure, window, 2)
    slides = np.abs(speed) > _SURELY * np.abs(speed).max()
    columns = np.column_stack([np.sign(speed), speed, place, np.ones_like(speed)])[slides]
    if columns.shape[0] < 4:
        return math.nan
    dry, viscous, *_ = np.linalg.lstsq(columns, force[slides], rcond=None)[0]
    return float(dry + viscous * np.sum(speed**2) / np.sum(np.abs(speed)))


SLIDING = "sliding_friction"

CHANGES = (1.0, 1.5, 2.0, 0.45)
"""Friction over the friction of the baseline."""

_T = TypeVar("_T")


@dataclass(frozen=True)
class Row:
    """The outcome of one record.

    `part` is "plain", "stickslip" or "alarms". `name` to `change` describe the record (`Record`,
    `Case`), with its length in s. `truth` and `numbers` have the names of `truth_of`. `refusal`
    is why there is no result, and `failure` why there is no answer at all. `least_squares` is the
    sliding friction, N, and `seconds` the processor time. `has_baseline` is whether the healthy
    valve gave a baseline, and `alarms` are sentences by side (`package.alarms`). `found` to
    `widths` come from `package.ends`.
    """

    part: str
    name: str
    motion: str
    kind: str = ""
    slips: bool = False
    share: float = math.nan
    rate: float = math.nan
    duration: float = math.nan
    imperfections: tuple[str, ...] = ()
    change: float = 1.0
    truth: Mapping[str, TrueValue] = field(default_factory=dict)
    numbers: Mapping[str, Number] = field(default_factory=dict)
    refusal: str = ""
    failure: str = ""
    warnings: tuple[str, ...] = ()
    least_squares: float = math.nan
    seconds: float = math.nan
    has_baseline: bool | None = None
    alarms: Mapping[str, str] = field(default_factory=dict)
    found: float = math.nan
    begun: float = math.nan
    coulomb: float = math.nan
    widths: Mapping[str, float] = field(default_factory=dict)

    def as_line(self) -> str:
        """Return the row as one line of JSON."""
        return json.dumps(asdict(self), ensure_ascii=False, default=np.generic.item)


class Task(NamedTuple):
    """All records of one valve, of which `case` is the first.

    `limit` is the processor time per identification, s.
    """

    part: str
    case: Case
    limit: float


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """Raise TimeoutError when the processor time is used up; in compiled code, on its return."""

    def stop(*_: object) -> None:
        raise TimeoutError(f"more than {seconds:g} s of the processor")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def _within(limit: float, job: Callable[[], _T]) -> tuple[_T | None, str, float]:
    """Run a job; return its result or the reason of its failure, and its processor time, s."""
    begin = time.process_time()
    try:
        with _limited(limit):
            return job(), "", time.process_time() - begin
    except Exception as error:  # noqa: BLE001  whatever it is, the suite goes on
        return None, f"{type(error).__name__}: {error}", time.process_time() - begin


def _row(task: Task, case: Case, record: Record) -> tuple[Row, Answer]:
    answer, failure, seconds = _within(task.limit, lambda: package.identify(record))
    answer = answer or Answer()
    stamps = record.position.stamps
    row = Row(
        part=task.part,
        name=case.name,
        motion=case.motion.value,
        kind=record.kind,
        slips=record.slips,
        share=record.share,
        rate=record.rate,
        duration=float(stamps[-1] - stamps[0]) / 1e9,
        imperfections=record.imperfections,
        change=case.change,
        truth=record.truth,
        numbers={name: one for name, one in answer.numbers.items() if name in record.truth},
        refusal=answer.refusal,
        failure=failure,
        warnings=answer.warnings,
        least_squares=sliding_friction(record),
        seconds=seconds,
    )
    return row, answer


_warm = False


def _warm_up() -> None:
    """Compile and load once, before the first record."""
    global _warm  # noqa: PLW0603  once a process
    if not _warm:
        record = make_record(Case(0, Kind.LEVELS, 0, slips=True))
        _within(120.0, lambda: package.identify(record))
        _warm = True


def tried(task: Task) -> list[Row]:
    """Run all records of one valve."""
    _warm_up()
    case = task.case
    try:
        record = make_record(case)
    except ValueError as error:
        return [Row(task.part, case.name, case.motion.value, failure=str(error))]
    row, answer = _row(task, case, record)
    if task.part != "alarms":
        ends, failure, _ = _within(task.limit, partial(package.ends, record, answer))
        return [replace(row, failure=row.failure or failure, **(ends or {}))]
    has_baseline = answer.native is not None and package.is_baseline(answer)
    rows = []
    for again, change in enumerate(CHANGES, start=1):
        other = case._replace(again=again, change=change)
        row, later = _row(task, other, make_record(other))
        alarms, failure, _ = _within(task.limit, partial(package.alarms, later, answer))
        rows.append(
            replace(
                row,
                has_baseline=has_baseline,
                alarms=alarms or {},
                failure=row.failure or failure,
            )
        )
    return rows
