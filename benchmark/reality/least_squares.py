# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Plain least squares: what anyone has in an hour, to stand beside the package."""

import math

import numpy as np
from scipy.signal import savgol_filter

from benchmark.reality.records import Record

_WINDOW = 0.15
_SURELY = 0.2
"""Length of the filter, s, and share of the top speed above which a sample surely slides."""


def sliding_friction(record: Record) -> float:
    """Return the sliding friction, N, at the distance-weighted speed; nan where none slides.

    The actuator force is regressed on sgn v, v, x and 1. No lag, no interval, no doubt.
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
