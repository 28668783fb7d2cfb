# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A planned test as set points: for a control system, or for a person with a stopwatch."""

import csv
import io
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from valve_friction_ros.model.valve import Valve
from valve_friction_ros.planning.played_test import PRESSURE_MARGIN
from valve_friction_ros.planning.search import StrokePlan
from valve_friction_ros.planning.stroke_test import FrictionRange, PressureBand
from valve_friction_ros.wording import two_digits

_LOW_CURRENT, _CURRENT_SPAN = 4.0, 16.0
"""Current of a signal at 0 %, and from there to 100 %, mA."""
_LEVEL = 1e-6
"""Change of pressure, share of the band, below which a step is a hold."""
_QUICK = 0.9
"""Share of the largest rate from which a stroke is called quick. Chosen."""


_REST = "rest: the next start shows whether static friction exceeds Coulomb friction"
_SHORTEST_REST = 2.0
"""Least rest, s, that has a line of its own in a form for a person. Chosen."""
BY_HAND = 5.0
"""Least duration, s, of a stroke that a person can make by hand. Chosen."""


class ShownUnit(NamedTuple):
    """A unit of set points and limits: its size, and the resolution of shown values, both in SI."""

    name: str
    size: float
    finest: float

    def shown(self, value: float, fewer: int = 0) -> str:
        """Return an SI value in this unit, without its `fewer` last decimals."""
        digits = math.ceil(math.log10(self.size / self.finest) - 1e-9) - fewer
        return f"{value / self.size:.{max(digits, 0)}f}"

    def column(self, name: str) -> str:
        """Return the header of a column in this unit."""
        return f"{name}_{self.name.lower().replace('/', '_')}"


FINEST_PRESSURE, FINEST_POSITION = 1.0, 1e-5
"""Resolution of set points and limits in a table, Pa and m. Chosen: finer than any converter."""
_STEM_MARGIN = 0.05
"""Share of the travel beside the reach of all planned valves at which a test is aborted. Chosen."""


@dataclass(frozen=True)
class SetPoint:
    """A step of a test: a ramp to a pressure within `duration`."""

    time: float
    duration: float
    """Beginning and length, s."""
    pressure: float
    share: float
    """Pressure at its end, Pa, and the same as a share of the signal's range."""
    stem: tuple[float, float]
    """Shares of the travel between which the stem must be from then on until the next step ends:
    beyond them the test is aborted."""
    tells: str
    """Purpose."""

    @property
    def milliamperes(self) -> float:
        """The set point on a loop of 4 to 20 mA."""
        return _LOW_CURRENT + _CURRENT_SPAN * self.share

    @property
    def is_short_rest(self) -> bool:
        """Whether it is a rest that a person does not read off a stopwatch."""
        return self.tells == _REST and self.duration < _SHORTEST_REST


def shortest_stroke(steps: Sequence[SetPoint]) -> float:
    """Return the duration of the shortest stroke, s."""
    return min(one.duration for one in steps[1:] if one.tells != _REST)


def _tells(before: float, now: float, after: float, largest: float) -> str:
    """Say what a step is for; the arguments are rates, Pa/s."""
    if now == 0:
        return _REST
    words = ["reversal: Coulomb friction, dead band"] if before * now < 0 else []
    if abs(now) >= _QUICK * largest:
        words.append("fast: viscous friction, together with the slow strokes")
    if not words:
        words.append("spring, and Coulomb friction in one direction")
    if before == 0 and after == before:
        words.append("start from rest: static friction")
    return "; ".join(words)


def stem_limits(plan: StrokePlan) -> tuple[float, float]:
    """Return the limits of the stem at which a test is aborted, shares of the travel."""
    lows, highs = zip(*(one.reach for one in plan.forecasts), strict=True)
    travel = plan.valve.travel
    lowest, highest = min(lows) / travel - _STEM_MARGIN, max(highs) / travel + _STEM_MARGIN
    return max(lowest, 0.0), min(highest, 1.0)


def signal_range(
    valve: Valve,
    frictions: FrictionRange,
    band: PressureBand,
    signal: tuple[float, float] | None = None,
) -> tuple[float, float]:
    """Return the pressures of a signal of 0 and 100 %, Pa, for a test that spans the band.

    By default they are those between which the spring alone moves the stem; a positioner's set
    point is then the position of a stem without friction.

    Raises ValueError if the range of the signal does not hold the band.
    """
    constant, preload = frictions.spring
    by_spring = (preload, preload + constant * valve.travel)
    low, high = signal or map(valve.actuator_drive, by_spring)
    if any(not 0 <= round((one - low) / (high - low), 6) <= 1 for one in (band.low, band.high)):
        raise ValueError(
            f"the test needs {band.low / 1e5:.4g} to {band.high / 1e5:.4g} bar, but the "
            f"signal covers {low / 1e5:.4g} to {high / 1e5:.4g}: give the converter's range "
            "(--signal-range '0.2..1.0 bar')"
        )
    return low, high


def set_points(plan: StrokePlan, signal: tuple[float, float] | None) -> tuple[SetPoint, ...]:
    """Return the steps of a planned test; `signal` and errors are those of `signal_range`."""
    low, high = signal_range(plan.valve, plan.frictions, plan.band, signal)
    test, stem = plan.test, stem_limits(plan)
    times, pressures = test.times.tolist(), test.pressures.tolist()
    span = plan.band.high - plan.band.low
    rates = [
        0.0 if abs(after - before) < _LEVEL * span else (after - before) / (end - begin)
        for (begin, before), (end, after) in itertools.pairwise(zip(times, pressures, strict=True))
    ]
    shares = [(pressure - low) / (high - low) for pressure in pressures]
    steps = [SetPoint(0.0, 0.0, pressures[0], shares[0], stem, "start")]
    moving = 0.0
    for place, rate in enumerate(rates):
        after = rates[place + 1] if place + 1 < len(rates) else 0.0
        steps.append(
            SetPoint(
                times[place],
                times[place + 1] - times[place],
                pressures[place + 1],
                shares[place + 1],
                stem,
                _tells(moving, rate, after, test.largest_rate),
            )
        )
        moving = rate or moving
    return tuple(steps)


def table_of(
    steps: tuple[SetPoint, ...], plan: StrokePlan, pressure: ShownUnit, position: ShownUnit
) -> str:
    """Write set points as a table (CSV): s, %, mA, pressure, limits of the stem, purpose."""
    travel = plan.valve.travel
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        ["time_s", "within_s", "setpoint_percent", "setpoint_ma", pressure.column("pressure"),
         position.column("abort_below"), position.column("abort_above"), "tells"]
    )  # fmt: skip
    for one in steps:
        low, high = (position.shown(share * travel) for share in one.stem)
        writer.writerow(
            [f"{one.time:.2f}", f"{one.duration:.2f}", f"{100 * one.share:.2f}",
             f"{one.milliamperes:.3f}", pressure.shown(one.pressure), low, high, one.tells]
        )  # fmt: skip
    return text.getvalue()


def _clock(seconds: float) -> str:
    minutes, rest = divmod(seconds, 60)
    return f"{int(minutes)}:{rest:04.1f}"


def form_of(
    steps: tuple[SetPoint, ...],
    plan: StrokePlan,
    tag: str,
    pressure: ShownUnit,
    position: ShownUnit,
) -> str:
    """Write a form of a partial-stroke test for a person: before, limits, steps, after."""
    travel, (low, high) = plan.valve.travel, steps[0].stem
    band, likely = plan.band, plan.likely
    of_stem, of_air = position.name, pressure.name
    lowest, highest = (position.shown(share * travel, 1) for share in (low, high))
    lines = [
        f"PARTIAL-STROKE TEST   valve {tag or '________________'}   date ____________   "
        "by ________________",
        "",
        "BEFORE   [ ] operations agree   [ ] loop in manual   [ ] nobody near the stem",
        f"         [ ] signal brought slowly to {100 * steps[0].share:.1f} % "
        f"({steps[0].milliamperes:.2f} mA, {pressure.shown(steps[0].pressure, 2)} {of_air})   "
        "[ ] pressure and stem are being recorded",
        "",
        "ABORT    and go back slowly to the signal before the test, if",
        f"         the stem is below {100 * low:.0f} % ({lowest} {of_stem}) or above "
        f"{100 * high:.0f} % ({highest} {of_stem}) of the travel, measured from the end without "
        "air,",
        f"         the pressure is below {pressure.shown(band.low - PRESSURE_MARGIN, 2)} or above "
        f"{pressure.shown(band.high + PRESSURE_MARGIN, 2)} {of_air},",
        f"         the stem has not moved after {_clock(_first_return(steps))} (min:s),",
        "         or the process moves further than ________________",
        "",
        f"{'at':>8} {'within':>8} {'to %':>7} {'mA':>7} {of_air:>8}  done  stem {of_stem:<2}  what "
        "it shows",
    ]
    seen = [one for one in steps if not one.is_short_rest]
    lines += [
        f"{_clock(one.time):>8} {one.duration:>6.1f} s {100 * one.share:>7.1f} "
        f"{one.milliamperes:>7.2f} {pressure.shown(one.pressure, 2):>8}  [ ]   _______  {one.tells}"
        for one in seen
    ]
    friction = likely.half_widths.get("coulomb_friction", math.nan)
    lines += [
        "",
        f"EXPECTED the stem moves between {100 * likely.reach[0] / plan.valve.travel:.0f} and "
        f"{100 * likely.reach[1] / plan.valve.travel:.0f} % of the travel; Coulomb friction will "
        f"be known to ± {two_digits(friction)} N",
        "AFTER    [ ] signal as before the test   [ ] recording saved   [ ] loop in automatic   "
        "aborted [ ] because ________________",
    ]
    return "\n".join(lines) + "\n"


def _first_return(steps: tuple[SetPoint, ...]) -> float:
    """Return when the first full stroke has ended, s: by then a healthy stem has moved."""
    lowest = min(one.share for one in steps)
    highest = max(one.share for one in steps)
    reached = [one for one in steps if one.share in (lowest, highest)]
    first = reached[:2][-1]
    return first.time + first.duration
