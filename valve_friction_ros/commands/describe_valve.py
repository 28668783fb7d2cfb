"""Sub-command `describe-valve`: ask for the data of an actuator, and write its valve file."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from valve_friction_ros.commands.arguments.recording import add_table_arguments, given_columns
from valve_friction_ros.commands.output.errors import ExitCode
from valve_friction_ros.records.quantities import AREA, LENGTH, MASS, PRESSURE, quantity, span
from valve_friction_ros.records.valve_description import ActuatorData
from valve_friction_ros.records.valve_file import valve_file_of
from valve_friction_ros.records.whole_file import write_whole

__all__ = ["REFUSALS", "declare", "run"]

REFUSALS = ()


def _choice(*words: str) -> Callable[[str], str]:
    def chosen(text: str) -> str:
        close = [word for word in words if text and word.startswith(text.strip().lower())]
        if len(close) != 1:
            raise ValueError(f"{text[:40]!r}: choose {' or '.join(words)}")
        return close[0]

    return chosen


class _Question(NamedTuple):
    """What is asked, how an answer is read, and what stands for none; None: it must be answered."""

    name: str
    words: str
    example: str
    read: Callable[[str], Any]
    default: str | None = ""


_QUESTIONS = (
    _Question("tag", "tag of the valve", "FV-101", str),
    _Question(
        "area",
        "effective area of the diaphragm or piston",
        "690 cm2, 107 in2",
        lambda text: quantity(text, AREA),
        None,
    ),
    _Question(
        "travel",
        "travel of the stem",
        "28.6 mm, 1.125 in",
        lambda text: quantity(text, LENGTH),
        None,
    ),
    _Question("acting", "acting", "single, double", _choice("single", "double"), "single"),
    _Question(
        "opposing_area",
        "area of the other side, that of the rod",
        "650 cm2",
        lambda text: quantity(text, AREA),
    ),
    _Question(
        "spring_range",
        "spring range (bench set)",
        "0.2..1.0 bar, 3..15 psi",
        lambda text: span(text, PRESSURE),
    ),
    _Question(
        "air_to", "more air on the actuator will", "open, close", _choice("open", "close"), "open"
    ),
    _Question(
        "position",
        "the position is that of the plug (0: closed), or of the stem (rising with the pressure)",
        "plug, stem",
        _choice("plug", "stem"),
        "plug",
    ),
    _Question(
        "sensor", "pressure sensor", "gauge, absolute", _choice("gauge", "absolute"), "gauge"
    ),
    _Question("sensor_range", "range of the sensor", "0..7 bar", lambda text: span(text, PRESSURE)),
    _Question("mass", "mass of the moving parts", "1.6 kg", lambda text: quantity(text, MASS)),
)


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments, and what the help says around them."""
    parser.description = (
        "Write the valve file of an actuator. What the options leave open is asked for; with --yes "
        "only what must be known."
    )
    parser.epilog = "Exit code 2: an answer is missing or impossible, or the file was not written."
    parser.add_argument("--output", type=Path, metavar="FILE.yaml", help="file (standard output)")
    parser.add_argument("--replace", action="store_true", help="replace a file that is there")
    parser.add_argument("--yes", action="store_true", help="take the defaults instead of asking")
    for each in _QUESTIONS:
        parser.add_argument(
            f"--{each.name.replace('_', '-')}",
            dest=f"answer_{each.name}",
            metavar="ANSWER",
            help=f"{each.words}: {each.example}" + (f" ({each.default})" if each.default else ""),
        )
    add_table_arguments(parser, "how its tables are written; kept in the section `columns:`")


def _asked(question: _Question) -> Any:
    """Ask until there is an answer that can be read."""
    default = f" [{question.default or 'none'}]" if question.default is not None else ""
    wrong: ValueError | None = None
    while True:
        print(
            f"{question.words} ({question.example}){default}: ",
            end="",
            file=sys.stderr,
            flush=True,
        )
        line = sys.stdin.readline()
        if not line:
            print(file=sys.stderr)
            if wrong is not None:
                raise wrong
        text = line.strip() or question.default
        if text is None and not line:
            option = question.name.replace("_", "-")
            raise ValueError(f"{question.words} is missing: give it by --{option}")
        try:
            if text:
                return question.read(text)
            if text is not None:
                return None
        except ValueError as error:
            print(error, file=sys.stderr)
            wrong = error


def _answers(options: argparse.Namespace) -> dict[str, Any]:
    answers: dict[str, Any] = {}
    for question in _QUESTIONS:
        given = getattr(options, f"answer_{question.name}")
        if given is not None:
            try:
                answers[question.name] = question.read(given)
            except ValueError as error:
                raise ValueError(f"--{question.name.replace('_', '-')}: {error}") from None
        elif question.name == "opposing_area" and answers["acting"] == "single":
            answers[question.name] = None
        elif question.default is not None and options.yes:
            answers[question.name] = question.read(question.default) if question.default else None
        else:
            answers[question.name] = _asked(question)
    return answers


def run(options: argparse.Namespace) -> int:
    """Ask, and write the file."""
    output: Path | None = options.output
    if output is not None and output.exists() and not options.replace:
        raise ValueError(f"{output}: it is there: give another name, or --replace")
    answers = _answers(options)
    is_double = answers["acting"] == "double"
    if answers["opposing_area"] is not None and not is_double:
        raise ValueError("--opposing-area is of a double-acting actuator: give --acting double")
    data = ActuatorData(
        area=answers["area"],
        travel=answers["travel"],
        spring_range=answers["spring_range"],
        is_absolute=answers["sensor"] == "absolute",
        sensor_range=answers["sensor_range"],
        is_air_to_close=answers["air_to"] == "close",
        position_is_opening=answers["position"] == "plug",
        opposing_area=(answers["opposing_area"] or answers["area"]) if is_double else None,
        opposing_area_is_assumed=answers["opposing_area"] is None,
        mass=answers["mass"],
        tag=answers["tag"] or "",
        columns=given_columns(options),
    )
    text = data.text()
    valve_file_of(yaml.safe_load(text), output or Path("the description"))
    if output is None:
        print(text, end="")
    else:
        write_whole(output, text.encode())
        print(output)
    return ExitCode.DONE
