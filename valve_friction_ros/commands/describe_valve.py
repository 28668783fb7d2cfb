# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `describe-valve`: ask for the data of an actuator, and write its valve file."""

import argparse
import sys
from pathlib import Path
from typing import Any

import yaml

from valve_friction_ros.commands.arguments.recording import given_columns
from valve_friction_ros.commands.process import ExitCode
from valve_friction_ros.records.files import write_whole
from valve_friction_ros.records.valve_description import (
    QUESTIONS,
    ActuatorQuestion,
    valve_description,
)
from valve_friction_ros.records.valve_file import valve_file_of


def _asked(question: ActuatorQuestion) -> Any:
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
            raise ValueError(f"{question.words} is missing: give it with --{option}")
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
    for question in QUESTIONS:
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
    """Ask the questions and write the file."""
    output: Path | None = options.output
    if output is not None and output.exists() and not options.replace:
        raise ValueError(f"{output}: it already exists: give another name, or --replace")
    answers = _answers(options)
    if answers["opposing_area"] is not None and answers["acting"] != "double":
        raise ValueError(
            "--opposing-area belongs to a double-acting actuator: give --acting double"
        )
    if answers["opposing_area"] == 0:
        answers["opposing_area"] = answers["area"]
    text = valve_description(answers, given_columns(options))
    valve_file_of(yaml.safe_load(text), output or Path("the description"))
    if output is None:
        print(text, end="")
    else:
        write_whole(output, text.encode())
        print(output)
    return ExitCode.DONE
