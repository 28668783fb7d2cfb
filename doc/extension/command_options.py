# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sub-commands of `valve_friction`, as their parsers declare them."""

import argparse
from collections.abc import Iterator
from importlib import import_module

from extension.markdown import Entry, definition_list, escaped

__all__ = ["command_as_markdown", "command_names", "list_as_markdown", "parser_of"]


def command_names() -> dict[str, str]:
    """Return what each sub-command does, by name."""
    return dict(import_module("valve_friction_ros.commands.main").SUB_COMMANDS)


def parser_of(command: str) -> argparse.ArgumentParser:
    """Return the parser of a sub-command."""
    declared = import_module("valve_friction_ros.commands.arguments.declared")
    parser = argparse.ArgumentParser(prog=f"valve_friction {command}")
    declared.DECLARATIONS[command](parser)
    return parser


def _term(action: argparse.Action) -> str:
    """Write an option with what it takes."""
    value = action.metavar or action.dest.upper()
    if action.choices and action.metavar is None:
        value = "{" + ",".join(map(str, action.choices)) + "}"
    if not action.option_strings:
        return str(value)
    names = ", ".join(action.option_strings)
    return names if action.nargs == 0 else f"{names} {value}"


def _entries(parser: argparse.ArgumentParser, actions: list[argparse.Action]) -> Iterator[Entry]:
    for action in actions:
        if action.dest != "help" and action.help != argparse.SUPPRESS:
            words = (action.help or "") % {**vars(action), "prog": parser.prog}
            yield Entry(_term(action), "", escaped(words).replace("~", "\\~") or "–")


def _prose(parser: argparse.ArgumentParser, text: str | None) -> str:
    """Write a description; one with lines of its own stays as it is."""
    if not text:
        return ""
    if issubclass(parser.formatter_class, argparse.RawDescriptionHelpFormatter) and "\n" in text:
        return f"```text\n{text.strip()}\n```\n"
    return escaped(" ".join(text.split())) + "\n"


def command_as_markdown(command: str) -> str:
    """Return the arguments and options of a sub-command, by groups."""
    parser = parser_of(command)
    lines = [_prose(parser, parser.description)]
    for group in parser._action_groups:  # noqa: SLF001 - argparse offers no other way
        entries = list(_entries(parser, group._group_actions))  # noqa: SLF001
        if entries:
            lines += [f"**{group.title}**\n", _prose(parser, group.description)]
            lines += definition_list(entries)
    return "\n".join([*lines, _prose(parser, parser.epilog)])


def list_as_markdown() -> str:
    """Return the sub-commands, each with what it does."""
    rows = (
        f"| [`{name}`](#{name.replace(' ', '-')}) | {escaped(text)} |"
        for name, text in command_names().items()
    )
    return "\n".join(["| sub-command | what it does |", "| --- | --- |", *rows])
