# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Make the two recordings of this folder: `python examples/make_examples.py [FOLDER]`.

The simulated valve FV-101 moves to random levels. Stamps jitter, and the sensors are noisy: 150 Pa
for the pressure and 10 µm for the stem. The files look like a plant export: local time, percent of
travel, bar, and two rows above the headers.
"""

import sys
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from valve_friction_ros import KarnoppParameters, simulate
from valve_friction_ros.model import converter_response
from valve_friction_ros.records import read_valve_file

HERE = Path(__file__).resolve().parent
PACKING = KarnoppParameters(
    mass=1.6,
    viscous_friction=1.5e4,
    coulomb_friction=400.0,
    static_friction=400.0,
    spring_constant=2.05e5,
    spring_preload=2000.0,
)
START = datetime(2026, 11, 21, 8, 0)
FINE = 10
"""Simulation steps per sample."""


def make(path: Path, seconds: float, rate: float, hold: float, lag: float, seed: int) -> None:
    """Write one recording."""
    random = np.random.default_rng(seed)
    valve = read_valve_file(HERE / "fv_101.yaml").valve
    period = 1 / (FINE * rate)
    time = np.arange(round(seconds / period)) * period
    levels = random.uniform(0.6e5, 1.6e5, int(seconds / hold) + 1)
    pressure = converter_response(levels[(time / hold).astype(int)], period, lag)
    position = simulate(valve, PACKING, pressure, period).position
    taken = np.arange(0, time.size - FINE, FINE) + random.integers(
        0, FINE // 3, time.size // FINE - 1
    )
    pressure = pressure[taken] + 150 * random.standard_normal(taken.size)
    position = position[taken] + 10e-6 * random.standard_normal(taken.size)
    lines = ["Historian export;FV-101;simulated", "local time Europe/Berlin;;"]
    lines += ["Time;Stem position;Actuator pressure", ";%;bar"]
    for when, place, value in zip(time[taken], position, pressure, strict=True):
        stamp = (START + timedelta(seconds=when)).isoformat(timespec="milliseconds")
        lines.append(f"{stamp};{100 * place / valve.travel:.2f};{value / 1e5:.4f}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE
    make(folder / "one_minute.csv", 60.0, 80.0, 2.5, 0.4, seed=101)
    make(folder / "five_seconds.csv", 5.0, 200.0, 0.5, 0.1, seed=102)
