# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Arguments on identifications: settings, ``--fail-on``, a history, an estimate."""

import argparse
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from valve_friction_ros.history import HistoryServer, is_url
from valve_friction_ros.identification.settings import (
    DEFAULT_METHOD,
    FIXABLE,
    PARAMETER_UNITS,
    IdentificationSettings,
)
from valve_friction_ros.outside_text import nearest, resembling
from valve_friction_ros.records.files import cause_of
from valve_friction_ros.settings import IDENTIFICATION, SURVEY, identification_from, survey_from

if TYPE_CHECKING:
    from valve_friction_ros.health.diagnosis import FrictionLimits
    from valve_friction_ros.health.levels import Level
    from valve_friction_ros.history import KeptValve
    from valve_friction_ros.records.valve_file import ValveFile

_NUMBERS = {int: "N", float: "SHARE"}
"""Placeholders of pure numbers in the help."""


def add_identification_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the settings that have options, and the known parameters."""
    for one in (*IDENTIFICATION, *SURVEY):
        if not one.option:
            continue
        kind = float if one.default is None else type(one.default)
        usual = f" ({one.default})" if one.is_given(one.default) else ""
        nothing = "unset" if kind is float else "0"
        words = one.description.replace(" [-]", "").replace(f"; {nothing}:", "; default:")
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
    """Return the requested method, else that of the valve file."""
    return str(options.method or described.get("method", DEFAULT_METHOD))


def identification_settings(
    options: argparse.Namespace, described: "ValveFile"
) -> IdentificationSettings:
    """Build the settings from the parsed arguments and the valve file.

    An option overrides the valve file. Raises ValueError if the settings are incompatible.
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
    """Build the limits from the parsed arguments and the valve file.

    An option overrides the valve file. Raises ValueError if the limits are out of order.
    """
    from valve_friction_ros.health.diagnosis import FrictionLimits  # noqa: PLC0415 - slow
    from valve_friction_ros.health.levels import SurveyLimits  # noqa: PLC0415 - slow

    given = {one.name: getattr(options, one.field) for one in SURVEY}
    stated = {name: value for name, value in given.items() if value is not None}
    return FrictionLimits(
        survey=SurveyLimits.of_packing(**survey_from({**described.survey, **stated}))
    )


def add_fail_on(parser: argparse.ArgumentParser) -> None:
    """Declare the option for the level from which a diagnosis fails the command."""
    parser.add_argument(
        "--fail-on",
        choices=("warn", "error"),
        help="exit with code 3 if a diagnosis is at least this severe; without a baseline no "
        "friction is compared and no alarm is raised",
    )


def has_failed(options: argparse.Namespace, found: "Iterable[Level]") -> bool:
    """Return whether ``--fail-on`` is given and one of the levels reaches it."""
    if options.fail_on is None:
        return False
    from valve_friction_ros.health.levels import Level  # noqa: PLC0415 - slow to import

    return any(one >= Level[options.fail_on.upper()] for one in found)


PLACE = "FILE.sqlite|URL"
"""Placeholder of a history in the help."""


def history_place(text: str) -> Path | HistoryServer:
    """Parse a path, or the address of a server."""
    if not is_url(text):
        return Path(text)
    try:
        return HistoryServer(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _is_called(valve: "KeptValve", name: str) -> bool:
    namespace = valve.name.rpartition("/")[0]
    return name == valve.tag or f"/{name.strip('/')}" in (valve.name, namespace)


def chosen_valves(
    valves: "Sequence[KeptValve]", names: Sequence[str] | None, option: str
) -> "tuple[KeptValve, ...]":
    """Return the valves with these names (tag, namespace or identifier); by default all.

    Raises ValueError, with `option` and the known valves, if a valve is unknown.
    """
    if names is None:
        return tuple(valves)
    for name in names:
        if not any(_is_called(valve, name) for valve in valves):
            known = ", ".join(valve.name for valve in valves) or "none"
            raise ValueError(f"{option} {name}: unknown valve; known valves: {known}")
    return tuple(valve for valve in valves if any(_is_called(valve, name) for name in names))


_LARGEST = 10_000_000
"""Largest file of an estimate, bytes. Chosen: `identify --json` writes some ten thousand."""


def _value(path: Path, name: str, entry: Any) -> float:
    if not isinstance(entry, dict) or "value" not in entry:
        raise ValueError(f"{path}: parameters.{name} has no value")
    value = math.nan if entry["value"] is None else entry["value"]
    if not isinstance(value, float) or math.isinf(value):
        raise ValueError(
            f"{path}: parameters.{name}.value must be a number or null, got {value!r:.80}"
        )
    return value


def read_estimate(path: Path) -> dict[str, float]:
    """Read the values by name from the JSON of `valve_friction identify`; nan: not identifiable.

    Raises ValueError, one line with the file and the problem.
    """
    try:
        with path.open("rb") as stream:
            text = stream.read(_LARGEST + 1)
        if len(text) > _LARGEST:
            raise ValueError(f"more than {_LARGEST // 1_000_000} MB: too large for an estimate")
        content = json.loads(text.decode("utf-8-sig"), parse_int=float)
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: cannot be read: {cause_of(error)}") from None
    except json.JSONDecodeError as error:
        raise ValueError(f"{path}: not JSON: {error}") from None
    except RecursionError:
        raise ValueError(f"{path}: not JSON: it is nested too deeply") from None
    except ValueError as error:  # too large
        raise ValueError(f"{path}: {error}") from None
    if isinstance(content, dict) and "valves" in content:
        raise ValueError(f"{path}: contains several valves: identify one of them with --valve-name")
    parameters = content.get("parameters") if isinstance(content, dict) else None
    if not isinstance(parameters, dict):
        raise ValueError(
            f"{path}: contains no parameters: give a file written by `valve_friction identify "
            "--json`"
        )
    for name in parameters:
        if name not in PARAMETER_UNITS:
            hint = nearest(name, PARAMETER_UNITS)
            raise ValueError(f"{path}: unknown parameter {name!r:.80}; {hint}")
    return {name: _value(path, name, entry) for name, entry in parameters.items()}
