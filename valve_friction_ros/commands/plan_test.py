# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `plan-test`: plan the stroke test that best determines the friction of a valve."""

import argparse
import json
import math
import shlex
from dataclasses import fields
from pathlib import Path
from typing import Any

from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from valve_friction_ros import figures
from valve_friction_ros.commands.arguments import require_outputs
from valve_friction_ros.commands.arguments.planning import frictions_from, planned_settings
from valve_friction_ros.commands.console import plain_console, shown_progress
from valve_friction_ros.commands.process import ExitCode
from valve_friction_ros.identification.rendering import plain
from valve_friction_ros.identification.settings import SLIDING, UNITS
from valve_friction_ros.planning.conditions import Conditions, Limits
from valve_friction_ros.planning.search import Forecast, StrokePlan, plan_remarks, plan_test
from valve_friction_ros.planning.steps import (
    BY_HAND,
    FINEST_POSITION,
    FINEST_PRESSURE,
    ShownUnit,
    form_of,
    set_points,
    shortest_stroke,
    signal_range,
    stem_limits,
    table_of,
)
from valve_friction_ros.planning.stroke_test import pressure_band
from valve_friction_ros.records.files import write_whole
from valve_friction_ros.records.units import POSITION_UNITS, PRESSURE_UNITS, span
from valve_friction_ros.records.valve_file import ValveFile, read_valve_file
from valve_friction_ros.wording import number_and_width, percentage

_NAMES = (
    "coulomb_friction",
    "viscous_friction",
    "static_friction",
    SLIDING,
    "spring_constant",
    "spring_preload",
)
_PLAY = "ros2 run valve_friction_ros pressure_source --ros-args"
_WATCHED = (
    "ros2 run valve_friction_ros stroke_player --ros-args -r __ns:=/YOUR_VALVE "
    "-r pressure_set_point:=/YOUR/CONVERTER/COMMAND"
)
_ROUND = 10.0
"""Step to which limits for the player are rounded outwards, Pa."""


def write_test(path: Path, plan: StrokePlan) -> None:
    """Write the corners of the piecewise linear pressure as time_s and pressure_pa.

    Raises OSError, which names `path`, if writing fails; then no part of the file is left.
    """
    corners = zip(plan.test.times, plan.test.pressures, strict=True)
    rows = ["time_s,pressure_pa", *(f"{time:.6f},{pressure:.2f}" for time, pressure in corners)]
    write_whole(path, ("\n".join(rows) + "\n").encode())


def player(plan: StrokePlan, path: Path, on_bench: bool = False) -> dict[str, Any]:
    """Return the parameters of `pressure_source` that play the file within its limits.

    The converter of a real valve has its own lag; on the simulated bench the player adds the lag.
    """
    return {
        "excitation": "file",
        "file": str(path.resolve()),
        "file_minimum": math.floor(plan.band.low / _ROUND) * _ROUND,
        "file_maximum": math.ceil(plan.band.high / _ROUND) * _ROUND,
        "file_rate": math.ceil(1.001 * plan.test.largest_rate / _ROUND) * _ROUND,
        "converter_lag": plan.conditions.converter_lag if on_bench else 0.0,
    }


def _forecast_json(name: str, one: Forecast, travel: float) -> dict[str, Any]:
    return {
        "friction": name,
        "parameters": {
            each: {
                "value": value,
                "half_width": one.half_widths.get(each),
                "unit": UNITS.get(each, "N"),
            }
            for each, value in one.values.items()
            if each in _NAMES
        },
        "position_range": [*one.reach],
        "travel_range": [reach / travel for reach in one.reach],
        "top_speed": one.top_speed,
        "breakaways": one.breakaways,
        "refusal": one.refusal or None,
    }


def as_json(plan: StrokePlan, path: Path) -> dict[str, Any]:
    """Build the JSON object in SI units."""
    return {
        "file": str(path),
        "aim": plan.aim,
        "duration": plan.test.duration,
        "cycles": plan.test.cycles,
        "pattern": plain(vars(plan.test.pattern)),
        "start_pressure": float(plan.test.pressures[0]),
        "pressure_range": [plan.band.low, plan.band.high],
        "pressure_rate": plan.test.largest_rate,
        "likely": plan.frictions.names[plan.frictions.middle],
        "forecasts": [
            _forecast_json(name, one, plan.valve.travel)
            for name, one in zip(plan.frictions.names, plan.forecasts, strict=True)
        ],
        "tried": plan.tried,
        "warnings": [*plan_remarks(plan)],
        "play": plain(player(plan, path)),
        "play_on_bench": plain(player(plan, path, on_bench=True)),
    }


def _cell(one: Forecast, name: str) -> str:
    share = one.relative(name)
    if one.refusal:
        return "–"
    if not share < 1:
        return "unknown"
    value = one.values[name]
    return f"{number_and_width(value, share * abs(value))[0]} ± {percentage(share)}"


def print_plan(plan: StrokePlan, path: Path) -> None:
    """Print what to expect, what to watch and how to play the test."""
    test, travel = plan.test, plan.valve.travel
    console = plain_console()
    speeds = " and ".join(f"{100 * one:.0f} %" for one in test.pattern.speeds)
    shapes = ", ".join(test.pattern.shapes)
    console.print(
        f"{test.duration:.4g} s, {test.cycles} times up and down ({shapes}) between "
        f"{plan.band.low / 1e3:.4g} and {plan.band.high / 1e3:.4g} kPa, at {speeds} of "
        f"{plan.band.rate / 1e3:.3g} kPa/s; the best of {plan.tried} tests for {plan.aim}"
    )
    table = Table("predicted", *(f"friction {name}" for name in plan.frictions.names), box=None)
    for name in _NAMES:
        table.add_row(
            f"{name} [{UNITS.get(name, 'N')}]", *(_cell(one, name) for one in plan.forecasts)
        )
    table.add_row(
        "position [% of travel]",
        *(
            f"{100 * one.reach[0] / travel:.0f} to {100 * one.reach[1] / travel:.0f}"
            for one in plan.forecasts
        ),
    )
    table.add_row("top speed [mm/s]", *(f"{one.top_speed * 1e3:.2g}" for one in plan.forecasts))
    console.print(table)
    console.print(
        "On simulated valves with other physics the reported intervals were 1.5 to 1.8 times as "
        "wide (median), and that of F_c up to 16 times where friction varies along the travel or "
        "gradually with speed."
    )
    for remark in plan_remarks(plan):
        console.print(f"note: {remark}")
    low, high = plan.limits.lowest, plan.limits.highest
    lowest, highest = stem_limits(plan)
    console.print(
        "Nothing has been moved. Before the test: agree it with operations, put the loop in "
        "manual, keep people away from the stem, and bring the pressure slowly to "
        f"{test.pressures[0] / 1e3:.4g} kPa. "
        f"During the test: watch that the stem stays between {100 * lowest:.0f} and "
        f"{100 * highest:.0f} % of the travel ({100 * low:g} to {100 * high:g} % with the friction "
        "assumed). If it does not, or the process moves too far, abort: stroke_player returns to "
        "the initial pressure; after stopping pressure_source, restore it by hand. After "
        "the test: identify the record before the loop goes back to automatic."
    )
    console.print(
        "Without ROS: --table writes the set points in %, mA and pressure for a control system, "
        "and --form a test sheet for an operator, with the limits at which to abort."
    )
    console.print(
        "On a real valve, use the command topic of your converter, never the topic of the "
        "measured pressure: otherwise simulated pressure would enter the identifier and the valve "
        "would not move. The converter has its own lag, so the player adds none:"
    )
    topic = "-r actuator_pressure:=/YOUR/CONVERTER/COMMAND"
    print(f"{_PLAY} {topic} {_parameters(player(plan, path))}")
    console.print(
        "The same with a node that starts when its ~/start is called, monitors stem and pressure, "
        "and returns at once if a limit is exceeded:"
    )
    print(f"{_WATCHED} {_parameters(_watched(plan, path))}")
    console.print("On the simulated bench, with the bench's lag:")
    print(f"{_PLAY} -r __ns:=/YOUR_BENCH {_parameters(player(plan, path, on_bench=True))}")


def _watched(plan: StrokePlan, path: Path) -> dict[str, Any]:
    """Return the parameters of the node that monitors the test."""
    given, travel = player(plan, path), plan.valve.travel
    lowest, highest = stem_limits(plan)
    return {
        **{name: given[name] for name in ("file", "file_minimum", "file_maximum", "file_rate")},
        "position_minimum": round(lowest * travel, 6),
        "position_maximum": round(highest * travel, 6),
    }


def _parameters(values: dict[str, Any]) -> str:
    return " ".join(f"-p {name}:={shlex.quote(str(value))}" for name, value in values.items())


def _units(options: argparse.Namespace) -> tuple[ShownUnit, ShownUnit]:
    """Return the units of pressure and position in output for people."""
    sizes = PRESSURE_UNITS[options.pressure_unit], POSITION_UNITS[options.position_unit]
    pressure, position = (size.multiplier / size.divisor for size in sizes)
    return (
        ShownUnit(options.pressure_unit, pressure, FINEST_PRESSURE),
        ShownUnit(options.position_unit, position, FINEST_POSITION),
    )


def _planned(
    options: argparse.Namespace, described: ValveFile, signal: tuple[float, float] | None
) -> StrokePlan:
    """Search for the test, with a progress bar on a terminal."""
    frictions = frictions_from(options, described)
    given = {one.name: vars(options).get(one.name, one.default) for one in fields(Limits)}
    limits = Limits(**given)
    if options.table is not None or options.form is not None:
        # Refuses a narrow signal before the search, which is long.
        band = pressure_band(described.valve, frictions, limits)
        signal_range(described.valve, frictions, band, signal)
    conditions = Conditions(
        options.sample_rate,
        1e-6 * options.position_noise_um,
        options.pressure_noise_pa,
        options.converter_lag,
    )
    words = TextColumn("comparing stroke tests")
    with shown_progress(words, BarColumn(), TaskProgressColumn(), TimeElapsedColumn()) as bar:
        task = bar.add_task("", total=1.0)
        return plan_test(
            described.valve,
            frictions,
            limits,
            conditions,
            planned_settings(options, described),
            options.aim,
            lambda share: bar.update(task, completed=share),
        )


def run(options: argparse.Namespace) -> int:
    """Plan the test, write the files, and print what to expect."""
    files: list[Path] = [*filter(None, (options.output, options.table, options.form))]
    for path in files:
        if path.exists() and not options.replace:
            raise ValueError(f"{path}: it already exists: give another name, or --replace")
    require_outputs(*files, picture=options.figure)
    described = read_valve_file(options.valve, options.valve_name)
    signal = span(options.signal_range, PRESSURE_UNITS) if options.signal_range else None
    plan = _planned(options, described, signal)
    texts = {}
    if options.table is not None or options.form is not None:
        steps = set_points(plan, signal)
        units = _units(options)
        texts = {
            options.table: table_of(steps, plan, *units),
            options.form: form_of(steps, plan, described.tag or options.valve_name or "", *units),
        }
    write_test(options.output, plan)
    for path, text in texts.items():
        if path is not None:
            write_whole(path, text.encode())
    if options.figure is not None:
        figures.save_picture(figures.plan_figure(plan), options.figure)
    if options.json:
        print(json.dumps(as_json(plan, options.output), ensure_ascii=False, allow_nan=False))
    else:
        print_plan(plan, options.output)
        if options.form is not None and (shortest := shortest_stroke(steps)) < BY_HAND:
            print(
                f"note: {options.form} has strokes of {shortest:.1f} s, too short for a person: "
                "lower --pressure-rate, and raise --duration"
            )
    return ExitCode.DONE
