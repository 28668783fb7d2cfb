# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Pieces of the pages that are written from the code: text of a person as Markdown."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

__all__ = ["Entry", "definition_list", "escaped"]


class Entry(NamedTuple):
    """A word of the reference, what it is, and what it means; the last two are Markdown."""

    term: str
    facts: str
    meaning: str


def escaped(text: str) -> str:
    """Write text of a person so that Markdown shows it as it is."""
    for mark in ("\\", "<", "*", "|", "[", "]"):
        text = text.replace(mark, "\\" + mark)
    return text


def definition_list(entries: Iterable[Entry]) -> Iterator[str]:
    """Write entries as a list of definitions, one line each."""
    for entry in entries:
        yield f"`{entry.term}`"
        if entry.facts:
            yield f": {entry.facts}"
            yield ""
            yield f"  {entry.meaning}"
        else:
            yield f": {entry.meaning}"
        yield ""
