# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""What an export holds and what its reader knows; exports are read as a person would."""

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model import Recording, Valve
from valve_friction_ros.records.bags.topics import TopicChoice
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.recordings import ReadingOptions, read_recordings

STEP = 1e-3
DURATION = 40.0
"""Simulated time step and duration, s."""


TRANSMITTER = (0.0, 4e5)
"""Range of the pressure transmitters, Pa."""


@dataclass(frozen=True)
class Export:
    """A file, and the knowledge of the person who reads it."""

    name: str
    content: bytes
    # the true answer to each option, by its name in `Columns`
    answers: dict[str, object] = field(default_factory=dict)
    # largest rounding errors, Pa, m and s
    coarse_pressure: float = 1.0
    coarse_position: float = 1e-6
    exact_date: bool = True  # whether the file contains the date of the record
    clock: float = 1e-6


@dataclass(frozen=True, eq=False)
class Truth:
    """A valve and its motion."""

    area: float  # m²
    travel: float  # m
    friction: float  # N
    time: NDArray[np.float64]  # s since `start`
    pressure: NDArray[np.float64]  # Pa, gauge
    position: NDArray[np.float64]  # m
    start: int  # time of the first sample, ns since 1970

    @property
    def stamps(self) -> NDArray[np.int64]:
        """Times, ns since 1970."""
        return self.start + np.rint(self.time * 1e9).astype(np.int64)


def draw(count: int, seed: int) -> list[Truth]:
    """Draw valves, move each by random ramps, and sample each at its own rate.

    The massless stem has Coulomb friction, viscous friction and a spring.
    """
    random = np.random.default_rng(seed)
    area = random.uniform(0.01, 0.12, count)
    travel = random.uniform(0.015, 0.1, count)
    low = random.uniform(2e4, 6e4, count)
    high = low + random.uniform(6e4, 2e5, count)
    spring = area * (high - low) / travel
    friction = random.uniform(0.01, 0.06, count) * area * (high - low)
    viscous = random.uniform(0.02, 0.1, count) * spring
    steps = round(DURATION / STEP)
    corners = np.linspace(0, DURATION, 12)
    shares = random.uniform(0.1, 0.9, (corners.size, count))
    time = np.arange(steps) * STEP
    drive = np.stack([np.interp(time, corners, shares[:, one]) for one in range(count)], axis=1)
    pressure = low + drive * (high - low)
    position = np.empty_like(pressure)
    stem = shares[0] * travel
    for step in range(steps):
        surplus = area * (pressure[step] - low) - spring * stem
        sliding = np.maximum(np.abs(surplus) - friction, 0) * np.sign(surplus)
        stem = np.clip(stem + STEP * sliding / viscous, 0, travel)
        position[step] = stem
    found = []
    for one in range(count):
        every = int(random.choice([5, 10, 20, 50]))
        # 2026-01-01 or up to 299 days later, with whole seconds
        day = int(random.integers(0, 300))
        start = 1_767_225_600_000_000_000 + day * 86_400_000_000_000
        start += int(random.integers(6 * 3600, 20 * 3600)) * 1_000_000_000
        signals = (time[::every], pressure[::every, one], position[::every, one])
        sizes = (float(values[one]) for values in (area, travel, friction))
        found.append(Truth(*sizes, *signals, start))
    return found


_OPTION = re.compile(r"--([a-z][a-z-]+)")


class Outcome(NamedTuple):
    """Outcome of an export: ``none``, ``options``, ``refused`` or ``wrong``; and the message."""

    kind: str
    options: int
    message: str


def read(export: Export, truth: Truth, folder: Path) -> Outcome:
    """Read an export, and compare the recording with the truth."""
    path = folder / export.name
    path.write_bytes(export.content)
    low, high = TRANSMITTER
    valve = Valve(truth.area, 0.0, truth.travel, low - 2e4, high + 2e4)
    name = export.answers.get("valve")
    form = Columns(pressure_range=f"{low / 1e5:g}..{high / 1e5:g} bar")
    given: dict[str, Any] = {}
    message = ""
    for _ in range(2):
        try:
            topics = TopicChoice(valve=str(name) if name else None)
            options = ReadingOptions(replace(form, **given), topics)
            (recorded,) = read_recordings(path, valve, options)
            recording = recorded.recording()
        except (ValueError, RefusalError) as error:
            message = str(error)
            named = {option.replace("-", "_") for option in _OPTION.findall(message)}
            told = {key: value for key, value in export.answers.items() if key in named}
            if not told or given:
                return Outcome("refused", len(given), message)
            given = told
            continue
        if fault := _fault(export, truth, recording):
            return Outcome("wrong", len(given), fault)
        return Outcome("options" if given else "none", len(given), message)
    return Outcome("refused", len(given), message)


def _fault(export: Export, truth: Truth, recording: Recording) -> str:
    """Return how a recording differs from the truth; empty if it does not."""
    if recording.stamped is None:
        drive = (recording.time, recording.drive)
        stem = (recording.time, recording.position)
    else:
        stamped = recording.stamped
        drive = (stamped.drive.time, stamped.drive.value)
        stem = (stamped.position.time, stamped.position.value)
    offset = recording.start_time - truth.start / 1e9 if export.exact_date else 0.0
    if abs(offset) > 0.5:
        return f"begins {offset:g} s late"
    for name, (time, values), true, coarse in (
        ("pressure", drive, truth.pressure, export.coarse_pressure),
        ("position", stem, truth.position, export.coarse_position),
    ):
        at = np.interp(time + offset, truth.time, true)
        steep = np.max(np.abs(np.diff(true)) / np.diff(truth.time)) * export.clock
        worst = float(np.max(np.abs(values - at)))
        if worst > coarse + steep + 1e-9 * float(np.max(np.abs(true))):
            return f"{name} is wrong by {worst:g} (allowed {coarse + steep:g})"
        if time[-1] - time[0] < 0.9 * (truth.time[-1] - truth.time[0]):
            return f"{name} lasts {time[-1] - time[0]:g} s"
    return ""
