# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The simulation of the stem, 62.4 s at 1 kHz; what is told is for one sample."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmark.speed.peer_simulations import bare_recursion, euler, ivp
from benchmark.speed.records import PERIOD, PRESSURES, VALVES, pressure
from benchmark.speed.rows import Row, Settings, medians
from valve_friction_ros.model import BENCH_VALVE, KarnoppParameters, simulate

__all__ = ["measure"]

_ACCURACY = 1e-9
"""Largest error of the position that a peer may make, m: about ours, 0.4 nm."""

_PEER_SAMPLES = {"square": slice(10_400), "sine": slice(10_400), "noisy square": slice(5200, 5600)}
"""Samples that the peers simulate: a period of the square wave, or 0.4 s of it, sliding."""

_TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
_SUBSTEPS = (100, 1000, 3000, 10_000, 30_000)
_TIMES_FASTER = 1000
_TIMES_FLOOR = 2

Simulation = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def _loosest(
    candidates: Sequence[tuple[str, Simulation]],
    driving: NDArray[np.float64],
    expected: NDArray[np.float64],
) -> tuple[str, Simulation] | None:
    """Return the first candidate that is accurate enough, or None."""
    for name, candidate in candidates:
        with np.errstate(all="ignore"):
            error = np.max(np.abs(candidate(driving) - expected))
        if error <= _ACCURACY:
            return name, candidate
    return None


def _ladders(parameters: KarnoppParameters) -> Iterator[list[tuple[str, Simulation]]]:
    """Yield each peer in settings from the loosest to the strictest."""
    for method in ("LSODA", "Radau"):
        yield [
            (
                f"solve_ivp {method}, rtol {tolerance:g}",
                lambda p, m=method, t=tolerance: ivp(BENCH_VALVE, parameters, p, PERIOD, m, t),
            )
            for tolerance in _TOLERANCES
        ]
    yield [
        (
            f"Euler, compiled, {substeps} steps a sample",
            lambda p, s=substeps: euler(BENCH_VALVE, parameters, p, PERIOD, s),
        )
        for substeps in _SUBSTEPS
    ]


def _rows(valve_name: str, pressure_name: str, settings: Settings) -> Iterator[Row]:
    parameters, driving = VALVES[valve_name], pressure(pressure_name)
    item = f"{pressure_name}, {valve_name} friction"
    settings.say(f"simulation, {item}")
    forces = BENCH_VALVE.actuator_force(driving)
    ours = partial(simulate, BENCH_VALVE, parameters, sample_period=PERIOD)
    seconds = medians(
        {"ours": lambda: ours(driving), "floor": lambda: bare_recursion(forces)},
        10 * settings.repeats,
    )
    each = 1e9 * seconds["ours"] / driving.size
    floor = 1e9 * seconds["floor"] / driving.size
    yield Row(
        item,
        each,
        "ns",
        floor,
        "bare recursion",
        f"within {_TIMES_FLOOR} times",
        each <= _TIMES_FLOOR * floor,
    )
    short = driving[_PEER_SAMPLES[pressure_name]]
    expected = ours(short).position
    best_ivp = np.inf
    for ladder in _ladders(parameters):
        found = _loosest(ladder, short, expected)
        if found is None:
            settings.say(f"{ladder[0][0]}: not accurate at any setting")
            continue
        name, simulation = found
        repeats = settings.repeats if "Euler" in name else 1
        cost = medians({"peer": partial(simulation, short)}, repeats)["peer"]
        peer = 1e9 * cost / short.size
        if "solve_ivp" in name:
            best_ivp = min(best_ivp, peer)
        yield Row(item, each, "ns", peer, name)
    yield Row(
        item,
        each,
        "ns",
        float(best_ivp),
        "the better solve_ivp",
        f"{_TIMES_FASTER} times faster",
        bool(best_ivp >= _TIMES_FASTER * each),
    )


def measure(settings: Settings) -> Iterator[Row]:
    """Measure the simulation against a bare recursion, `solve_ivp` and Euler's method."""
    for pressure_name in PRESSURES:
        for valve_name in VALVES:
            yield from _rows(valve_name, pressure_name, settings)
