# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Read an export as a person would: without options, then with those named in the message."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmark.exports.programs import TRANSMITTER, Export
from benchmark.exports.truth import Truth
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model import Recording, Valve
from valve_friction_ros.records.bags.topics import TopicChoice
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.recordings import ReadingOptions, read_recordings

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
