# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What would be read of a table: its columns, units, rates, gaps, qualities."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.layout import Layout
from valve_friction_ros.records.stretch import Stretch
from valve_friction_ros.records.table import OpenTable, ReadSignal

_GAP = 10
"""Sampling periods above which a pause is a gap."""
_BARS = "▁▂▃▄▅▆▇█"


@dataclass(frozen=True, eq=False)
class InspectedSignal:
    """A signal as it would be read.

    Attributes
    ----------
    valve, quantity, name, unit : str
        The valve of several, what it is, its header or tag, its unit.
    samples, bad : int
        Good values, and those that would be left out.
    period : float
        Median time between two samples, s; nan of fewer than two.
    low, high : float
        Smallest and largest value, in `unit`.
    gaps : int
        Pauses of more than ten periods.
    longest : float
        The longest time between two samples, s.
    begin : int
        Time of the first sample, ns, since 1970 if the times are dates.
    course : ndarray of float, shape (k,)
        Means of the values over equal parts of the time; nan where there is none.
    """

    valve: str
    quantity: str
    name: str
    unit: str
    samples: int
    bad: int
    period: float
    low: float
    high: float
    gaps: int
    longest: float
    begin: int
    course: NDArray[np.float64]

    @property
    def picture(self) -> str:
        """The course of the values in one line of text."""
        known = np.isfinite(self.course)
        if not known.any():
            return ""
        span = float(np.ptp(self.course[known])) or 1.0
        height = (self.course - self.course[known].min()) / span * (len(_BARS) - 1)
        return "".join(
            _BARS[round(float(one))] if there else " "
            for one, there in zip(height, known, strict=True)
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers as a mapping of plain values."""
        shown = {name: value for name, value in vars(self).items() if name != "course"}
        return {
            name: None if isinstance(value, float) and not np.isfinite(value) else value
            for name, value in shown.items()
        }


@dataclass(frozen=True, eq=False)
class Inspection:
    """What would be read of a table, and what is open.

    Attributes
    ----------
    path : Path
        The file.
    layout : Layout
        How it would be read; its questions are open.
    signals : sequence of InspectedSignal
        The signals; none while something is open.
    kinds : mapping of str to str
        What each column was taken for, by its header.
    """

    path: Path
    layout: Layout
    signals: Sequence[InspectedSignal]
    kinds: Mapping[str, str]


def _inspected(valve: str, read: ReadSignal, parts: int) -> InspectedSignal:
    steps = np.diff(read.stamps) / 1e9
    period = float(np.median(steps)) if steps.size else np.nan
    course = np.full(parts, np.nan)
    if read.stamps.size:
        since = read.stamps - read.stamps[0]
        part = np.minimum(since * parts // (int(since[-1]) + 1), parts - 1)
        counts = np.bincount(part, minlength=parts)
        sums = np.bincount(part, read.values, minlength=parts)
        course[counts > 0] = sums[counts > 0] / counts[counts > 0]
    signal = read.signal
    return InspectedSignal(
        valve,
        signal.quantity,
        signal.name,
        signal.unit,
        read.values.size,
        read.bad.total(),
        period,
        float(np.min(read.values, initial=np.inf)),
        float(np.max(read.values, initial=-np.inf)),
        int((steps > _GAP * period).sum()),
        float(np.max(steps, initial=0.0)),
        int(read.stamps[0]) if read.stamps.size else 0,
        course,
    )


def inspected(
    path: Path, form: Columns | None = None, stretch: Stretch | None = None, parts: int = 60
) -> Inspection:
    """Look at a table as a reader would, and read it where nothing is open.

    Parameters
    ----------
    path : Path
        The file.
    form : Columns, optional
        What it does not say itself.
    stretch : Stretch, optional
        The part to look at.
    parts : int
        Parts of the time in the course of a signal.

    Raises
    ------
    ValueError, RefusalError
        If it cannot be read: file, cause and remedy.
    """
    table = OpenTable(path, form)
    layout = table.layout
    found: list[InspectedSignal] = []
    if not layout.questions:
        named = [(label, one) for label, group in layout.valves.items() for one in group]
        reads = table.read([one for _, one in named], stretch)
        found = [
            _inspected(label, read, parts) for (label, _), read in zip(named, reads, strict=True)
        ]
    return Inspection(path, layout, tuple(found), dict(layout.kinds))
