# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Names that nobody knows, and the nearest one that somebody does."""

import difflib
from collections.abc import Iterable

_MOST_NAMED = 12
"""Names in a message. Chosen: it stays readable."""

_RESEMBLES = 0.8
"""Likeness (difflib) of a misspelled name. Chosen: two letters of ten may differ."""


def resembling(name: str, known: Iterable[str]) -> list[str]:
    """Return the known name that a misspelled one resembles, if there is one."""
    return difflib.get_close_matches(name, known, n=1, cutoff=_RESEMBLES)


def nearest(name: object, known: Iterable[str]) -> str:
    """Return the end of a message about an unknown name: the nearest known one, or all of few."""
    names = list(known)
    text = str(name)[:100]
    close = difflib.get_close_matches(text, names, n=1)
    if not close:  # such as position for position_column
        close = [each for each in names if text and text in each.split("_")][:1]
    if close:
        return f"did you mean {close[0]!r}?"
    more = ", …" if len(names) > _MOST_NAMED else ""
    return f"known are {', '.join(names[:_MOST_NAMED])}{more}"
