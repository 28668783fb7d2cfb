# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Text from files, topics and tags, made harmless where it is shown."""

from typing import Any

_LONGEST = 10_000
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""What a spreadsheet takes for the begin of a formula."""


def printable(text: str, most: int = _LONGEST) -> str:
    """Return text whose control characters, which a terminal would obey, are written out."""
    short = text if len(text) <= most else f"{text[:most]}…"
    if short.isprintable():
        return short
    return "".join(mark if mark.isprintable() else ascii(mark)[1:-1] for mark in short)


def _is_formula(text: str) -> bool:
    return text.lstrip("'").startswith(_FORMULA)


def harmless(cell: Any) -> Any:
    """Return the value of a CSV cell; a text that looks like a formula gets an apostrophe first."""
    return f"'{cell}" if isinstance(cell, str) and _is_formula(cell) else cell


def as_read(cell: str) -> str:
    """Return the text that `harmless` was given."""
    return cell[1:] if cell.startswith("'") and _is_formula(cell) else cell
