# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Text from outside: escaping for terminals, CSV and pages; unknown names; names of hosts."""

import csv
import difflib
import io
import ipaddress
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment

_LONGEST = 10_000
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""Characters with which a formula of a spreadsheet begins."""


def printable(text: str, most: int = _LONGEST) -> str:
    """Return text with its control characters escaped, so that a terminal does not obey them."""
    short = text if len(text) <= most else f"{text[:most]}…"
    if short.isprintable():
        return short
    return "".join(mark if mark.isprintable() else ascii(mark)[1:-1] for mark in short)


def _is_formula(text: str) -> bool:
    return text.lstrip("'").startswith(_FORMULA)


def harmless(cell: Any) -> Any:
    """Return the value of a CSV cell, with an apostrophe before text that looks like a formula."""
    return f"'{cell}" if isinstance(cell, str) and _is_formula(cell) else cell


def csv_text(header: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> str:
    """Return rows as CSV with harmless cells; missing values become empty cells."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([harmless(row.get(name)) for name in header] for row in rows)
    return text.getvalue()


def as_read(cell: str) -> str:
    """Undo `harmless`."""
    return cell[1:] if cell.startswith("'") and _is_formula(cell) else cell


def page_environment(package: str) -> "Environment":
    """Return the environment of the templates in a package's folder; it escapes all they are given.

    Pages alone need jinja2.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined  # noqa: PLC0415

    return Environment(
        loader=PackageLoader(package, "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


NAMESPACE = re.compile(r"/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)
"""Namespace of a valve on the ROS graph, relative or absolute."""


def require_namespace(valve: str, argument: str) -> None:
    """Refuse the name of a valve that is no namespace; `argument` shows how to give one.

    Raises
    ------
    ValueError
        If the name cannot be a namespace.
    """
    if not NAMESPACE.fullmatch(valve):
        raise ValueError(
            f"valve '{valve}' is not a ROS namespace: use letters, digits and underscores, as in "
            f"{argument}"
        )


def is_loopback(host: str) -> bool:
    """Return whether a host is a loopback address or ``localhost``."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


_MOST_NAMED = 12
"""Largest number of names in a message. Chosen: the message stays readable."""

_RESEMBLES = 0.8
"""Least similarity (difflib) of a misspelled name. Chosen: two letters of ten may differ."""


def resembling(name: str, known: Iterable[str]) -> list[str]:
    """Return a list with the known name that a misspelled name resembles, or an empty list."""
    return difflib.get_close_matches(name, known, n=1, cutoff=_RESEMBLES)


def nearest(name: object, known: Iterable[str]) -> str:
    """Return the end of a message about an unknown name: the nearest known name, or a list."""
    names = list(known)
    text = str(name)[:100]
    close = difflib.get_close_matches(text, names, n=1)
    if not close:  # such as position for position_column
        close = [each for each in names if text and text in each.split("_")][:1]
    if close:
        return f"did you mean {close[0]!r}?"
    more = ", …" if len(names) > _MOST_NAMED else ""
    return f"known are {', '.join(names[:_MOST_NAMED])}{more}"
