# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Arguments of the commands that identify: the method and its settings."""

import argparse
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from valve_friction_ros.identification.settings import (
    DEFAULT_METHOD,
    FIXABLE,
    IdentificationSettings,
)
from valve_friction_ros.records.spelling import nearest, resembling
from valve_friction_ros.settings import (
    IDENTIFICATION,
    SURVEY,
    identification_from,
    survey_from,
)

if TYPE_CHECKING:
    from valve_friction_ros.health import FrictionLimits
    from valve_friction_ros.records.valve_file import ValveFile

_NUMBERS = {int: "N", float: "SHARE"}
"""What the help calls pure numbers."""


def add_identification_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the settings that are options, and the known parameters."""
    for one in (*IDENTIFICATION, *SURVEY):
        if not one.option:
            continue
        kind = float if one.default is None else type(one.default)
        usual = f" ({one.default})" if one.is_given(one.default) else ""
        nothing = "unset" if kind is float else "0"
        words = one.description.replace(" [-]", "").replace(f"; {nothing}:", "; without it:")
        parser.add_argument(
            one.option,
            type=one.spell if kind is str else kind,
            choices=one.choices or None,
            metavar=None if one.choices else one.unit.upper() or _NUMBERS[kind],
            help=(words[0].lower() + words[1:] + usual).replace("%", "%%"),
        )
    parser.add_argument(
        "--fix",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help=f"take a parameter as known ({', '.join(FIXABLE)}); NAME alone: from the valve file",
    )


def _fixed(entries: Sequence[str], known: Mapping[str, float]) -> dict[str, float]:
    fixed = {}
    for entry in entries:
        name, separator, text = entry.partition("=")
        name = name.strip()
        if name in fixed:
            raise ValueError(f"--fix {name} is given twice")
        if name not in FIXABLE and (close := resembling(name, FIXABLE)):
            raise ValueError(
                f"{name[:60]!r} is not a parameter that can be fixed; {nearest(name, close)}"
            )
        if separator:
            try:
                fixed[name] = float(text)
            except ValueError:
                raise ValueError(f"--fix {entry}: {text!r} is not a number") from None
        elif name in known:
            fixed[name] = known[name]
        else:
            raise ValueError(
                f"--fix {name}: give a value, as {name}=VALUE, or a valve file with it"
            )
    return fixed


def method_name(options: argparse.Namespace, described: Mapping[str, Any]) -> str:
    """Return the method that was asked for, or else the valve file's."""
    return str(options.method or described.get("method", DEFAULT_METHOD))


def identification_settings(
    options: argparse.Namespace, described: "ValveFile"
) -> IdentificationSettings:
    """Build the settings from the parsed arguments, and from what the valve file names.

    An option goes before the settings of the valve file. Raises ValueError if they do not go
    together.
    """
    options_given = {one.name: getattr(options, one.field) for one in IDENTIFICATION if one.option}
    known = {f"fixed.{name}": value for name, value in _fixed(options.fix, described.known).items()}
    given = {
        **described.settings,
        **{name: value for name, value in options_given.items() if value is not None},
        **known,
    }
    if "mass" in described.known:
        given["assumed_mass"] = described.known["mass"]
    return identification_from(given, stated=described.stated, assumed=described.assumed)


def survey_limits(options: argparse.Namespace, described: "ValveFile") -> "FrictionLimits":
    """Build the limits from the parsed arguments, and from what the valve file names.

    An option goes before the valve file. Raises ValueError if they are out of order.
    """
    from valve_friction_ros.health import FrictionLimits, SurveyLimits  # noqa: PLC0415 - slow

    given = {one.name: getattr(options, one.field) for one in SURVEY}
    stated = {name: value for name, value in given.items() if value is not None}
    return FrictionLimits(
        survey=SurveyLimits.of_packing(**survey_from({**described.survey, **stated}))
    )
