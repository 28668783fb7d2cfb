# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Identification of a minute by the default method, in a running process and as a command."""

import contextlib
import subprocess
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from benchmark.cases import PLANTS
from benchmark.harness.processes import module
from benchmark.harness.rows import Row
from benchmark.speed.measuring import PERIOD, SAMPLES, Settings, medians, pressure
from valve_friction_ros.identification import RefusalError, identify, published_estimate
from valve_friction_ros.model import Recording, SensorNoise, Valve

_RECORDS = {
    "100 Hz, 10 µm / 100 Pa": (10, SensorNoise(10e-6, 100.0, 1)),
    "1 kHz, ideal": (1, None),
    "1 kHz, 10 µm / 100 Pa": (1, SensorNoise(10e-6, 100.0, 1)),
    "1 kHz, 28.6 µm / 165 Pa": (1, SensorNoise(28.6e-6, 165.0, 1)),
}
"""Stride over the samples at 1 kHz, and noise of both sensors."""

_WARM, _MOST = 0.3, 2.0
"""Goals of processor time, s: a Karnopp valve at 100 Hz or without noise, and any other record."""

_EXAMPLES = Path(__file__).parents[3] / "examples"
_COMMANDS = {
    "identify one_minute.csv": (["one_minute.csv", "--valve", "fv_101.yaml"], 1.0),
    "identify --help": (["--help"], 0.2),
}
"""Arguments of each command, and its goal, s."""


def _tried(do: Callable[[Recording, Valve], object], one: Recording, valve: Valve) -> None:
    """Identify a record; a refusal is measured as well."""
    with contextlib.suppress(RefusalError):
        do(one, valve)


def measure(settings: Settings) -> Iterator[Row]:
    """Measure the default method against the published method, then the command."""
    for name, plant in PLANTS.items():
        driving = pressure("square", SAMPLES)
        clean = Recording(PERIOD, driving, plant.respond(driving, PERIOD))
        for words, (stride, noise) in _RECORDS.items():
            signals = clean.drive[::stride], clean.position[::stride]
            record = Recording(stride * PERIOD, *signals)
            record = record if noise is None else noise.applied_to(record)
            item = f"{name}, {words}"
            settings.say(f"identification, {item}")
            seconds = medians(
                {
                    each.__name__: partial(_tried, each, record, plant.valve)
                    for each in (identify, published_estimate)
                },
                settings.repeats,
            )
            is_easy = plant.is_karnopp and (noise is None or stride > 1)
            goal = _WARM if is_easy else _MOST
            ours = seconds["identify"]
            peer = 1e3 * seconds["published_estimate"]
            told = "the published method alone", f"{1e3 * goal:.0f} ms", ours <= goal
            yield Row(item, 1e3 * ours, "ms", peer, *told)
    for item, (arguments, goal) in _COMMANDS.items():
        settings.say(item)
        command = module("valve_friction_ros", "identify", *arguments)
        run = partial(subprocess.run, command, cwd=_EXAMPLES, check=True, capture_output=True)
        seconds = medians({item: run}, settings.repeats)
        yield Row(item, seconds[item], "s", None, "", f"{goal:g} s", seconds[item] <= goal)
