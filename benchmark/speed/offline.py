# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""What identification, sweep and simulation cost beside their peers."""

import contextlib
import math
import resource
import statistics
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from benchmark.cases import PLANTS
from benchmark.harness.processes import module
from benchmark.harness.rows import Row
from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    identify,
    published_estimate,
    sweep_thresholds,
)
from valve_friction_ros.identification.published.sweep import (
    ForceBalanceRegression,
    force_balance_regression,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    KarnoppParameters,
    Recording,
    SensorNoise,
    SineWave,
    SquareWave,
    Valve,
    balanced_state,
    converter_response,
    simulate,
)
from valve_friction_ros.signals import differentiate

PERIOD = 1e-3
"""Sample period, s."""

SAMPLES = 62_400

VALVES = {"low": LOW_FRICTION, "high": HIGH_FRICTION}
"""Parameters of the bench valve by the tightness of its packing."""

PRESSURES = ("square", "sine", "noisy square")
"""Names for `pressure`."""

_NOISE = 165.0
"""Pressure noise that makes a sliding stem stick and slip at every other sample, Pa."""


@cache
def pressure(name: str, samples: int = SAMPLES) -> NDArray[np.float64]:
    """Return an actuator pressure after the converter lag, Pa, shape (samples,)."""
    wave = SineWave() if name == "sine" else SquareWave()
    answer = converter_response(wave.sample(np.arange(samples) * PERIOD), PERIOD)
    if name.startswith("noisy"):
        answer = answer + np.random.default_rng(1).normal(0.0, _NOISE, samples)
    return answer


@cache
def noisy_record(
    parameters: KarnoppParameters, noise: SensorNoise, samples: int = SAMPLES
) -> Recording:
    """Return a record of the square wave with sensor noise."""
    driving = pressure("square", samples)
    stem = simulate(BENCH_VALVE, parameters, driving, PERIOD)
    return noise.applied_to(Recording(PERIOD, driving, stem.position))


@dataclass(frozen=True)
class Settings:
    """Settings of the measurements."""

    repeats: int = 5  # repetitions of each measurement; the result is their median
    seconds: float = 60.0  # duration of each stream, s
    # shows the present activity
    say: Callable[[str], None] = field(default=lambda _: None, repr=False)


def _processor_time() -> float:
    """Return the processor time of this process and its ended children, s."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def medians(functions: Mapping[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Return the median processor time of each function, s.

    The functions take turns, so that a change of the machine's speed affects all. Each first runs
    once unmeasured, to exclude compilation and caching.
    """
    seconds: dict[str, list[float]] = {name: [] for name in functions}
    for function in functions.values():
        function()
    for _ in range(repeats):
        for name, function in functions.items():
            begin = _processor_time()
            function()
            seconds[name].append(_processor_time() - begin)
    return {name: statistics.median(times) for name, times in seconds.items()}


_RECORDS = {
    "100 Hz, 10 µm / 100 Pa": (10, SensorNoise(10e-6, 100.0, 1)),
    "1 kHz, ideal": (1, None),
    "1 kHz, 10 µm / 100 Pa": (1, SensorNoise(10e-6, 100.0, 1)),
    "1 kHz, 28.6 µm / 165 Pa": (1, SensorNoise(28.6e-6, 165.0, 1)),
}
"""Stride over the samples at 1 kHz, and noise of both sensors."""

_WARM, _MOST = 0.3, 2.0
"""Goals of processor time, s: a Karnopp valve at 100 Hz or without noise, and any other record."""

_EXAMPLES = Path(__file__).parents[2] / "examples"
_COMMANDS = {
    "identify one_minute.csv": (["one_minute.csv", "--valve", "fv_101.yaml"], 1.0),
    "identify --help": (["--help"], 0.2),
}
"""Arguments of each command, and its goal, s."""


def _tried(do: Callable[[Recording, Valve], object], one: Recording, valve: Valve) -> None:
    """Identify a record; a refusal is measured as well."""
    with contextlib.suppress(RefusalError):
        do(one, valve)


def identification(settings: Settings) -> Iterator[Row]:
    """Identify a minute by the default method, in a running process and as a command."""
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


Floats = NDArray[np.float64]

_ENOUGH = 200
"""Minimum number of samples above a threshold for a comparison of both sweeps."""

_SWEEP_TIMES_FASTER = 100
_AGREEMENT = 1e-7


def plain_sweep(
    columns: Floats, force: Floats, speed: Floats, thresholds: Floats
) -> tuple[Floats, Floats, Floats]:
    """Solve (7) with `numpy.linalg.lstsq` above each threshold δv(s), with (17) and (18).

    The regressors (5) have shape (n, p), and the estimates (S, p). All results are nan where too
    few samples remain for the regressors.
    """
    free = columns.shape[1]
    estimates = np.full((thresholds.size, free), np.nan)
    sigma, r_squared = np.full((2, thresholds.size), np.nan)
    for step, threshold in enumerate(thresholds):
        moving = speed > threshold
        count = np.count_nonzero(moving)
        if count <= free + 1:
            continue
        estimates[step] = np.linalg.lstsq(columns[moving], force[moving], rcond=None)[0]
        modelled = columns[moving] @ estimates[step]
        sigma[step] = np.sqrt(np.sum((force[moving] - modelled) ** 2) / (count - free))
        mean = force[moving].mean()
        r_squared[step] = np.sum((modelled - mean) ** 2) / np.sum((force[moving] - mean) ** 2)
    return estimates, sigma, r_squared


def incremental_sweep(
    columns: Floats, force: Floats, speed: Floats, thresholds: Floats
) -> tuple[Floats, Floats, Floats]:
    """Do the same with `numpy.linalg.qr`, adding only the new rows at each threshold.

    The triangular factor of the rows above a threshold, stacked on the rows between it and the next
    lower threshold, gives the triangular factor of all rows above the latter. Parameters and result
    are those of `plain_sweep`.
    """
    free = columns.shape[1]
    estimates = np.full((thresholds.size, free), np.nan)
    sigma, r_squared = np.full((2, thresholds.size), np.nan)
    steps = np.searchsorted(thresholds, speed)
    order = np.argsort(steps, kind="stable")
    ends = np.searchsorted(steps[order], np.arange(1, thresholds.size + 1))
    parts = np.split(np.column_stack((columns, force))[order], ends)
    factor, sums, count = np.empty((0, free + 1)), np.zeros(free + 1), 0
    for step in range(thresholds.size - 1, -1, -1):
        rows = parts[step + 1]
        factor = np.linalg.qr(np.vstack((factor, rows)), mode="r")
        sums, count = sums + rows.sum(axis=0), count + len(rows)
        if count > free + 1:
            estimates[step] = np.linalg.solve(factor[:free, :free], factor[:free, free])
            sigma[step] = abs(factor[free, free]) / np.sqrt(count - free)
            mean = sums[free] / count
            modelled = factor[:free, free] @ factor[:free, free]
            modelled += mean * (count * mean - 2 * sums[:free] @ estimates[step])
            r_squared[step] = modelled / (factor[:, free] @ factor[:, free] - count * mean**2)
    return estimates, sigma, r_squared


@numba.njit
def _read_through(columns: Floats) -> float:
    """Add up all columns, to measure the cost of merely reading them."""
    total = 0.0
    for row in range(columns.shape[0]):
        for column in range(columns.shape[1]):
            total += columns[row, column]
    return total


def _regression(valve_name: str, samples: int) -> ForceBalanceRegression:
    record = noisy_record(VALVES[valve_name], SensorNoise(10e-6, 100.0, 1), samples)
    settings = IdentificationSettings()
    derivatives = differentiate(
        record.position, record.sample_period, settings.published_window, settings.order
    )
    force = BENCH_VALVE.actuator_force(record.pressure)
    return force_balance_regression(force, record.position, derivatives, settings)


def _thresholds(regression: ForceBalanceRegression, steps: int) -> Floats:
    return float(regression.speed.max()) * 330 / 350 * np.arange(1, steps + 1) / steps


def _largest_difference(regression: ForceBalanceRegression) -> float:
    """Return the largest relative difference between the estimates of both sweeps."""
    thresholds = _thresholds(regression, 330)
    ours = sweep_thresholds(regression, thresholds)
    plain, *_ = plain_sweep(regression.columns, regression.force, regression.speed, thresholds)
    compared = (ours.samples >= _ENOUGH) & np.isfinite(ours.sigma)
    return max(
        float(np.max(np.abs(ours.estimates[name][compared] / plain[compared, index] - 1)))
        for index, name in enumerate(regression.names)
    )


def sweep(settings: Settings) -> Iterator[Row]:
    """Sweep the velocity threshold, 62.4 s at 1 kHz, 330 thresholds."""
    for name in VALVES:
        regression, double = _regression(name, 62_400), _regression(name, 124_800)
        thresholds, few = _thresholds(regression, 330), _thresholds(regression, 33)
        known = regression.columns, regression.force, regression.speed, thresholds
        settings.say(f"sweep, {name} friction")
        seconds = medians(
            {
                "ours": partial(sweep_thresholds, regression, thresholds),
                "few": partial(sweep_thresholds, regression, few),
                "double": partial(sweep_thresholds, double, thresholds),
                "floor": partial(_read_through, regression.columns),
                "incremental": partial(incremental_sweep, *known),
            },
            8 * settings.repeats,
        ) | medians({"plain": partial(plain_sweep, *known)}, settings.repeats)
        time = {what: 1e3 * one for what, one in seconds.items()}
        item, ours = f"sweep, {name} friction", time["ours"]
        peer, goal = "numpy.linalg.lstsq for each threshold", f"{_SWEEP_TIMES_FASTER} times faster"
        met = time["plain"] >= _SWEEP_TIMES_FASTER * ours
        yield Row(item, ours, "ms", time["plain"], peer, goal, met)
        peer = "numpy.linalg.qr, each row taken in once"
        yield Row(item, ours, "ms", time["incremental"], peer)
        difference = _largest_difference(regression)
        told, met = (
            f"largest relative difference from it, {name} friction",
            difference <= _AGREEMENT,
        )
        goal = f"{_AGREEMENT:g} wherever {_ENOUGH} samples are left"
        yield Row(told, difference, goal=goal, met=met)
        yield Row(item, ours, "ms", time["floor"], "one compiled pass that reads the columns")
        item, twice = f"twice the samples, {name} friction", time["double"]
        told = "62 400 samples", "linear: at most 2.5 times", twice <= 2.5 * ours
        yield Row(item, twice, "ms", ours, *told)
        yield Row(f"33 thresholds, {name} friction", time["few"], "ms", ours, "330 thresholds")


_ACCURACY = 1e-9
"""Largest position error of a peer, m: of the order of ours, 0.4 nm."""

_PEER_SAMPLES = {"square": slice(10_400), "sine": slice(10_400), "noisy square": slice(5200, 5600)}
"""Samples for the peers: a period of the square wave, or 0.4 s of sliding."""

_TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
_TIMES_FASTER = 1000
_TIMES_FLOOR = 2

Floats = NDArray[np.float64]
Simulation = Callable[[Floats], Floats]


def _ivp(parameters: KarnoppParameters, method: str, tolerance: float, pressure: Floats) -> Floats:
    """Simulate with `solve_ivp` from rest, one call per slide, which ends by an event at rest.

    A stuck phase costs only a search for the sample at which the stem breaks away. The stem must
    not reach a travel stop, and F_s must equal F_c. `tolerance` is relative; the absolute tolerance
    is the same share of 10 mm and 10 mm/s.
    """
    mass, spring = parameters.mass, parameters.spring_constant
    coulomb, viscous = parameters.coulomb_friction, parameters.viscous_friction
    forces = BENCH_VALVE.actuator_force(pressure) - parameters.spring_preload
    last = forces.size - 1
    rates = np.append(np.diff(forces), 0.0) / PERIOD
    times = np.arange(forces.size) * PERIOD
    positions = np.empty(forces.size)
    position = balanced_state(BENCH_VALVE, parameters, float(pressure[0])).position
    now = 0.0
    jacobian = np.array([[0.0, 1.0], [-spring / mass, -viscous / mass]])
    while True:
        sample = math.ceil(now / PERIOD - 1e-9)
        loose = np.abs(forces[sample:] - spring * position) > coulomb
        if not loose.any():
            positions[sample:] = position
            return positions
        first = sample + int(np.argmax(loose))
        positions[sample:first] = position
        side = math.copysign(1.0, forces[first] - spring * position)
        begin = now
        if first > sample:
            excess = side * (forces[first - 1] - spring * position) - coulomb
            begin = max(now, (first - 1) * PERIOD - excess / (side * rates[first - 1]))

        def motion(time: float, state: Floats, side: float = side) -> tuple[float, float]:
            index = min(int(time / PERIOD), last)
            force = forces[index] + rates[index] * (time - index * PERIOD)
            pull = force - spring * state[0] - side * coulomb - viscous * state[1]
            return state[1], pull / mass

        def stops(time: float, state: Floats, side: float = side, begin: float = begin) -> float:
            return side * float(state[1]) if time > begin else 1.0

        stops.terminal, stops.direction = True, -1
        wanted = times[(times >= begin) & (times <= times[-1])]
        kick = side * 1e-12
        solution = solve_ivp(
            motion,
            (begin, times[-1]),
            (position, kick),
            method=method,
            jac=lambda *_: jacobian,
            events=stops,
            t_eval=wanted,
            rtol=tolerance,
            atol=0.01 * tolerance,
        )
        if len(solution.t):
            positions[first : first + len(solution.t)] = solution.y[0]
        if solution.status != 1:
            return positions
        now, position = float(solution.t_events[0][0]), float(solution.y_events[0][0][0])


@numba.njit(cache=True)
def bare_recursion(forces: Floats) -> tuple[Floats, Floats]:
    """Step a linear second-order system under a force that is linear between samples."""
    positions, velocities = np.empty_like(forces), np.empty_like(forces)
    position, velocity = 0.0, 0.0
    positions[0], velocities[0] = position, velocity
    for sample in range(1, forces.size):
        force, change = forces[sample - 1], forces[sample] - forces[sample - 1]
        place = 0.999 * position + 9e-4 * velocity + 1e-9 * force + 1e-10 * change
        velocity = -0.1 * position + 0.9 * velocity + 1e-6 * force + 1e-7 * change
        position = place
        positions[sample], velocities[sample] = position, velocity
    return positions, velocities


def _loosest(
    candidates: Sequence[tuple[str, Simulation]],
    driving: Floats,
    expected: Floats,
) -> tuple[str, Simulation] | None:
    """Return the first candidate that is accurate enough, or None."""
    for name, candidate in candidates:
        with np.errstate(all="ignore"):
            error = np.max(np.abs(candidate(driving) - expected))
        if error <= _ACCURACY:
            return name, candidate
    return None


def _ladders(parameters: KarnoppParameters) -> Iterator[list[tuple[str, Simulation]]]:
    """Yield each peer with settings from the loosest to the strictest."""
    for method in ("LSODA", "Radau"):
        yield [
            (
                f"solve_ivp {method}, rtol {tolerance:g}",
                partial(_ivp, parameters, method, tolerance),
            )
            for tolerance in _TOLERANCES
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
    told = "bare recursion", f"within {_TIMES_FLOOR} times", each <= _TIMES_FLOOR * floor
    yield Row(item, each, "ns", floor, *told)
    short = driving[_PEER_SAMPLES[pressure_name]]
    expected = ours(short).position
    best_ivp = np.inf
    for ladder in _ladders(parameters):
        found = _loosest(ladder, short, expected)
        if found is None:
            settings.say(f"{ladder[0][0]}: not accurate at any setting")
            continue
        name, simulation = found
        cost = medians({"peer": partial(simulation, short)}, 1)["peer"]
        peer = 1e9 * cost / short.size
        best_ivp = min(best_ivp, peer)
        yield Row(item, each, "ns", peer, name)
    goal, met = f"{_TIMES_FASTER} times faster", bool(best_ivp >= _TIMES_FASTER * each)
    yield Row(item, each, "ns", float(best_ivp), "the better solve_ivp", goal, met)


def simulation(settings: Settings) -> Iterator[Row]:
    """Simulate the stem, 62.4 s at 1 kHz; what is told is for one sample."""
    for pressure_name in PRESSURES:
        for valve_name in VALVES:
            yield from _rows(valve_name, pressure_name, settings)
