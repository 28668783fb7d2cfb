# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Planned stroke tests on valves that the planner does not know: promises kept, and what is gained.

Random valves with other physics (`benchmark.reality.plants`) play the test that was planned for a
friction assumed 2 times too small, right, or 2 times too large. The default method identifies the
record. Beside it the same valve plays the default square wave of equal band and duration.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from benchmark.reality.package import identify
from benchmark.reality.plants import GRID, Body, Friction, Law, Plant, Trend, move, open_loop
from benchmark.reality.records import Nominal, Record, truth_of
from benchmark.reality.sensors import Instruments, Stamping, measured
from valve_friction_ros.identification import IdentificationSettings, RefusalError
from valve_friction_ros.model import Excitation, SquareWave, Valve
from valve_friction_ros.planning import Conditions, Limits, StrokePlan, known_friction, plan_test

NUMBERS = ("coulomb_friction", "viscous_friction", "static_friction", "sliding_friction")
_HELD_BACK = 90_000
_RATE = 100.0
_BOTTOM, _SPAN = 0.0, 1e6
_CONDITIONS = Conditions(_RATE)
_LIMITS = Limits(0.2, 0.8)
_WRONG = (1.0, 0.5, 2.0)
"""Assumed friction over the true friction."""

_COMPARED = (("reported", "predicted"), ("errors", "predicted"), ("square", "reported"))

_LAWS: Mapping[str, Mapping[str, object]] = {
    "ideal": {},
    "stribeck": {"stribeck_velocity": 1.5e-3},
    "lugre": {"law": Law.LUGRE, "presliding": 10e-6},
    "uneven": {"asymmetry": 0.04, "along_travel": Trend(0.1, 0.2)},
}


@dataclass(frozen=True)
class Trial:
    """One valve with its planned test and its identification."""

    law: str  # name of its friction law
    wrong: float  # assumed friction over the true friction
    # half widths predicted, reported, and reported for the square wave, and actual errors, as
    # shares of the true values, by the name of the number
    predicted: Mapping[str, float] = field(default_factory=dict)
    reported: Mapping[str, float] = field(default_factory=dict)
    square: Mapping[str, float] = field(default_factory=dict)
    errors: Mapping[str, float] = field(default_factory=dict)
    refusal: str = ""  # why there is no plan or no result; empty otherwise
    reach: tuple[float, float] = (0.0, 0.0)  # lowest and highest position, shares of the travel


def _plant(law: str, random: np.random.Generator) -> Plant:
    spring = 2.05e5 * random.uniform(0.8, 1.25)
    dry = 150.0 * 5.0 ** random.random()
    slip = 1.0 if law == "ideal" and random.random() < 0.5 else random.uniform(1.1, 1.5)
    friction = Friction(dry, slip * dry, spring * 0.03 * 10.0 ** random.random(), **_LAWS[law])
    return Plant(Body(1.6, spring, random.uniform(200.0, 2500.0)), friction)


def _record(
    plant: Plant, excitation: Excitation, duration: float, seed: int
) -> tuple[Record, tuple[float, float]]:
    """Drive a valve with a signal, and measure it."""
    loop = open_loop(_BOTTOM, _SPAN, _CONDITIONS.converter_lag)
    time = np.arange(round(duration / GRID) + 1) * GRID
    signal = (excitation.sample(time) - _BOTTOM) / _SPAN
    motion = move(plant, loop, signal, np.zeros(time.size // loop.every + 1), 0.0)
    stamping = Stamping(rate=_RATE)
    instruments = Instruments(pressure_stamping=stamping, position_stamping=stamping)
    pressure, position = measured(motion, instruments, duration, seed)
    body = plant.body
    nominal = Nominal(body.area, body.pressure_reference, body.travel)
    truth = truth_of(plant, motion, instruments, duration)
    reach = motion.position / body.travel
    record = Record(nominal, pressure, position, truth)
    return record, (float(reach.min()), float(reach.max()))


def _told(record: Record) -> tuple[dict[str, float], dict[str, float], str]:
    """Identify a record; return half widths and errors over the true values, and a refusal."""
    answer = identify(record)
    if answer.refusal:
        return {}, {}, answer.refusal
    widths, errors = {}, {}
    for name in NUMBERS:
        one, truth = answer.numbers.get(name), record.truth[name]
        if one is not None and one.half_width >= 0 and truth.value:
            widths[name] = one.half_width / abs(truth.value)
            errors[name] = truth.error(one.value) / abs(truth.value)
    return widths, errors, ""


def _plan(plant: Plant, wrong: float) -> tuple[StrokePlan, int]:
    """Plan for a wrong friction; return the plan, and the index of the true friction's forecast."""
    body, friction = plant.body, plant.friction
    valve = Valve(body.area, body.pressure_reference, body.travel, -20e3, 270e3)
    frictions = known_friction(
        friction.coulomb * wrong,
        (body.spring, body.preload),
        body.mass,
        static_friction=friction.static * wrong,
        viscous_friction=friction.viscous * wrong,
    )
    settings = IdentificationSettings(assumed_mass=1.6)
    plan = plan_test(valve, frictions, _LIMITS, _CONDITIONS, settings)
    return plan, {1.0: 1, 0.5: 2, 2.0: 0}[wrong]


def trials(count: int, first_seed: int = _HELD_BACK) -> Iterator[Trial]:
    """Plan tests for `count` random valves, and run them."""
    for seed in range(first_seed, first_seed + count):
        random = np.random.default_rng(seed)
        law = list(_LAWS)[seed % len(_LAWS)]
        wrong = _WRONG[(seed // len(_LAWS)) % len(_WRONG)]
        plant = _plant(law, random)
        try:
            plan, place = _plan(plant, wrong)
        except RefusalError as refusal:
            yield Trial(law, wrong, refusal=f"no plan: {refusal}")
            continue
        test, forecast = plan.test, plan.forecasts[place]
        record, reach = _record(plant, test.excitation, test.duration, seed)
        reported, errors, refusal = _told(record)
        wave = SquareWave(plan.band.low, plan.band.high)
        square, _, _ = _told(_record(plant, wave, test.duration, seed)[0])
        predicted = {name: forecast.relative(name) for name in NUMBERS}
        yield Trial(law, wrong, predicted, reported, square, errors, refusal, reach)


def report(found: Sequence[Trial]) -> str:
    """Return the table of medians, with 10 and 90 % quantiles, by law and number.

    A ratio counts where its denominator is below 1. `in interval` is the share of true values.
    """
    shares = ("predicted", "reported", "square", "errors")
    frame = pd.DataFrame(
        {"law": one.law, "assumed": one.wrong, "number": name}
        | {share: getattr(one, share).get(name, np.nan) for share in shares}
        for one in found
        for name in NUMBERS
    )
    for over, under in _COMPARED:
        frame[f"{over}/{under}"] = frame[over] / frame[under].where(
            frame[under].between(0.0, 1.0, "neither")
        )
    frame["in interval"] = (frame["errors"] <= frame["reported"]).where(frame["reported"].notna())
    groups = pd.concat([frame, frame.assign(law="all")]).groupby(["law", "number"])
    ratios = [f"{over}/{under}" for over, under in _COMPARED]
    table = groups[ratios].quantile([0.1, 0.5, 0.9]).unstack()
    table["in interval"] = groups["in interval"].mean()
    widths = frame[frame["number"] == "coulomb_friction"].groupby("assumed")["reported"]
    refused = sum(bool(one.refusal) for one in found)
    reach = np.array([one.reach for one in found if one.reach != (0.0, 0.0)])
    return (
        f"{table.round(2).to_string()}\n\n"
        "F_c known to, share of itself, by assumed over true friction:\n"
        f"{widths.describe([0.1, 0.5, 0.9]).round(3).to_string()}\n\n"
        f"{len(found)} valves, {refused} refused\n"
        f"positions from {100 * reach.min():.1f} to {100 * reach.max():.1f} % of the travel"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--valves", type=int, default=48, metavar="N", help="valves (%(default)s)")
    parser.add_argument("--seed", type=int, default=_HELD_BACK, metavar="N", help="first seed")
    options = parser.parse_args(arguments)
    found = []
    for one in trials(options.valves, options.seed):
        found.append(one)
        widths = {name: f"{100 * one.reported.get(name, np.nan):.2g}" for name in NUMBERS}
        sys.stderr.write(f"{len(found)} {one.law} {one.wrong:g} {widths} {one.refusal}\n")
    sys.stdout.write(f"{report(found)}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
