# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Arguments of `plan-test`: known data of a valve, and limits of the test."""

import argparse
import math
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

from valve_friction_ros.commands.arguments import add_options, percent
from valve_friction_ros.commands.arguments.identification import (
    PLACE,
    chosen_valves,
    history_place,
    read_estimate,
)
from valve_friction_ros.identification.settings import (
    CALIBRATION,
    TIMING_UNCERTAINTY,
    UNITS,
    IdentificationSettings,
)
from valve_friction_ros.planning.conditions import AIMS, STOP_MARGIN, Conditions, Limits
from valve_friction_ros.settings import identification_from

if TYPE_CHECKING:
    from valve_friction_ros.planning.stroke_test import FrictionRange
    from valve_friction_ros.records.valve_file import ValveFile


_percent = partial(percent, least=0.0, words=" of the travel, such as 40")


def add_planning_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments on known data, limits, sensors and aim."""
    _add_known(parser)
    _add_limits(parser.add_argument_group("limits", "what the test may do"))
    _add_sensors(parser.add_argument_group("sensors"))
    parser.add_argument(
        "--for",
        dest="aim",
        choices=[*AIMS],
        default="friction",
        help="parameter to determine best; friction: F_c, F_v and F_s alike (%(default)s)",
    )


def _add_known(parser: argparse.ArgumentParser) -> None:
    known = parser.add_argument_group(
        "known",
        "friction and spring: an option overrides an earlier result, which overrides the valve "
        "file; without any friction, the plan covers light to heavy packings",
    )
    source = known.add_mutually_exclusive_group()
    add_options(
        source,
        f"""
        --estimate ESTIMATE.json: an earlier result, as `valve_friction identify --json` prints it
        --history {PLACE}: the last identification in the identifiers' history_file, or on their
            server; if there are several valves, that of --valve-name
        """,
        history={"type": history_place},
    )
    for name, unit in UNITS.items():
        known.add_argument(
            f"--{name.replace('_', '-')}",
            type=float,
            metavar=unit.upper().replace("·", "*"),
            help=f"{name}, {unit}",
        )
    add_options(
        known,
        "--friction-factor FACTOR: factor by which friction may be smaller or larger than stated "
        "(%(default)g)",
        friction_factor={"type": float, "default": 2.0},
    )


def _add_numbers(group: argparse._ArgumentGroup, *numbers: tuple[str, str, float, str]) -> None:
    """Declare options for numbers: name, unit, default, which is shown if finite, and help."""
    for name, unit, default, text in numbers:
        shown = f" ({default:g})" if math.isfinite(default) else ""
        group.add_argument(
            f"--{name}", type=float, default=default, metavar=unit, help=f"{text}{shown}"
        )


def _add_limits(group: argparse._ArgumentGroup) -> None:
    default = Limits()
    lowest = {"dest": "lowest", "type": _percent, "default": default.lowest}
    add_options(
        group,
        f"""
        --from PERCENT: lowest position, in percent of travel ({100 * default.lowest:g})
        --to PERCENT: highest position ({100 * default.highest:g})
        --allow-stops: let the stem reach seat and stop; otherwise even a stem without friction
            stays {100 * STOP_MARGIN:g} %% of travel away from them
        """,
        **{"from": lowest},
        to={"dest": "highest", "type": _percent, "default": default.highest},
    )
    too = "Pa; the limit in the valve file applies too"
    _add_numbers(
        group,
        ("speed", "M/S", default.speed, "largest speed of the sliding stem, m/s"),
        ("duration", "S", default.duration, "longest duration, s"),
        ("pressure-rate", "PA/S", default.pressure_rate, "largest rate of the pressure, Pa/s"),
        ("pressure-minimum", "PA", default.pressure_minimum, f"lowest pressure, {too}"),
        ("pressure-maximum", "PA", default.pressure_maximum, f"highest pressure, {too}"),
    )


def _add_sensors(group: argparse._ArgumentGroup) -> None:
    usual = Conditions()
    _add_numbers(
        group,
        ("sample-rate", "HZ", usual.sample_rate, "samples per second of both signals"),
        ("position-noise-um", "UM", 1e6 * usual.position_noise, "noise of the stem sensor, µm"),
        ("pressure-noise-pa", "PA", usual.pressure_noise, "noise of the pressure sensor, Pa"),
        ("converter-lag", "S", usual.converter_lag, "time constant of the pressure converter, s"),
    )
    add_options(
        group,
        "--timing-uncertainty S: standard deviation of the total lag between the signals, as in "
        f"`identify` (valve file, or {TIMING_UNCERTAINTY:g})",
        timing_uncertainty={"type": float},
    )


def _earlier(options: argparse.Namespace) -> Mapping[str, float]:
    from valve_friction_ros.history import History  # noqa: PLC0415 - slow to import

    if options.estimate is not None:
        return read_estimate(options.estimate)
    if options.history is None:
        return {}
    file = History(options.history)
    names = None if options.valve_name is None else [options.valve_name]
    valves = chosen_valves(file.valves(), names, "--valve-name")
    if len(valves) != 1:
        told = ", ".join(valve.name for valve in valves) or "none"
        raise ValueError(f"{options.history}: holds {told}: choose one valve with --valve-name")
    entry = file.last_success(valves[0].name)
    if entry is None:
        raise ValueError(f"{options.history}: no identification of {valves[0].name} succeeded")
    return entry.values


def frictions_from(options: argparse.Namespace, described: "ValveFile") -> "FrictionRange":
    """Return the range of friction to plan for.

    Raises ValueError if the spring is unknown or a number is impossible.
    """
    from valve_friction_ros.planning.stroke_test import (  # noqa: PLC0415 - slow to import
        known_friction,
        unknown_friction,
    )

    found = dict(described.known)
    found |= {name: one for name, one in _earlier(options).items() if math.isfinite(one)}
    given = {name: getattr(options, name) for name in UNITS}
    found |= {name: one for name, one in given.items() if one is not None}
    for name in ("spring_constant", "spring_preload"):
        if name not in found:
            option = name.replace("_", "-")
            raise ValueError(
                f"the {name} is unknown, but pressures cannot be planned without it: give "
                f"--estimate, --history or --{option}, or state it in the valve file, as "
                "`describe-valve --spring-range` does"
            )
    if not found["spring_constant"] > 0:
        raise ValueError(
            "a machine without a spring has no stroke test: pressure alone does not hold a position"
        )
    spring = found["spring_constant"], found["spring_preload"]
    mass = found.get("mass", IdentificationSettings().assumed_mass)
    if "coulomb_friction" not in found:
        return unknown_friction(described.valve, spring, mass)
    coulomb, static = found["coulomb_friction"], found.get("static_friction")
    if static is not None and given["static_friction"] is None:
        static = max(static, coulomb)
    viscous = found.get("viscous_friction")
    if viscous is not None and viscous < 0 and given["viscous_friction"] is None:
        viscous = None
    return known_friction(
        coulomb,
        spring,
        mass,
        static_friction=static,
        viscous_friction=viscous,
        factor=options.friction_factor,
    )


def planned_settings(options: argparse.Namespace, described: "ValveFile") -> IdentificationSettings:
    """Return the settings of the identification, with timing and calibration of the valve file."""
    timing = options.timing_uncertainty
    if timing is None:
        timing = described.settings.get("timing_uncertainty")
    mass = described.known.get("mass") if options.mass is None else options.mass
    given = {"timing_uncertainty": timing, "assumed_mass": mass}
    given |= {name: described.settings.get(name) for name in CALIBRATION}
    return identification_from({name: one for name, one in given.items() if one is not None})
