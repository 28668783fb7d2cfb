# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Table, page and frame of a result, from the mapping that `Result.to_dict` returns."""

import html
import math
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np

from valve_friction_ros.identification.settings import column_suffix
from valve_friction_ros.identification.trust.verdict import Parameter, Verdict
from valve_friction_ros.wording import two_digits

if TYPE_CHECKING:
    import pandas as pd

_HEADER = ("parameter", "value", "± 95 %", "unit", "verdict", "published")
_ALIGNED_RIGHT = (1, 2, 5)
"""Indices of the numeric columns in `_HEADER`."""


def plain(value: object) -> Any:
    """Return a value in JSON types; a number that is not finite becomes None."""
    if isinstance(value, Mapping):
        return {str(name): plain(each) for name, each in value.items()}
    if isinstance(value, Enum):
        return plain(value.value)
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return plain(value._asdict())
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    if isinstance(value, (np.floating, np.integer, np.bool_)):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def parameter_mapping(parameter: Parameter) -> dict[str, Any]:
    """Return a parameter as a mapping of plain values, SI units."""
    return {
        "value": plain(parameter.value),
        "standard_error": plain(parameter.standard_error),
        "half_width": plain(parameter.half_width),
        "interval": plain(parameter.interval),
        "verdict": parameter.verdict.value,
        "reason": parameter.reason,
        "published": plain(parameter.published),
        "unit": parameter.unit,
    }


def parameter_columns(name: str, shown: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return value, standard error, half width and verdict of a parameter, as columns of a table.

    Their names hold the unit. Where there is no `parameter_mapping`, None, the cells are empty.
    """
    cells = {} if shown is None else shown
    unit = column_suffix(name)
    return {
        f"{name}{unit}": cells.get("value"),
        f"{name}_standard_error{unit}": cells.get("standard_error"),
        f"{name}_half_width{unit}": cells.get("half_width"),
        f"{name}_verdict": cells.get("verdict"),
    }


def parameter_cells(name: str, parameter: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the cells of a parameter: name, value, half width, unit, verdict, published value."""
    value, width, published = (parameter[key] for key in ("value", "half_width", "published"))
    return (
        name,
        "–" if value is None else f"{value:.6g}",
        two_digits(width) if width else "",
        parameter["unit"],
        parameter["verdict"],
        "" if published is None else f"{published:.6g}",
    )


def _rows(shown: Mapping[str, Any]) -> list[tuple[str, ...]]:
    return [parameter_cells(name, each) for name, each in shown["parameters"].items()]


def _title(shown: Mapping[str, Any]) -> str:
    fit = shown["fit"]
    return f"method {shown['method']}" + ("" if fit is None else f", fit {100 * fit:.2f} %")


def table_of(shown: Mapping[str, Any]) -> str:
    """Return the parameters as a table of plain text, and the fit below it."""
    rows = [_HEADER, *_rows(shown)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(
            cell.rjust(width) if place in _ALIGNED_RIGHT else cell.ljust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
    return "\n".join([*lines, "", _title(shown)])


def text_of(shown: Mapping[str, Any], findings: Sequence[str]) -> str:
    """Return the table, the reasons of the verdicts, the findings and the warnings."""
    reasons = [
        f"{name} {each['verdict']}: {each['reason']}"
        for name, each in shown["parameters"].items()
        if each["reason"] and each["verdict"] != Verdict.FIXED.value
    ]
    notes = [f"note: {warning}" for warning in shown["warnings"]]
    return "\n".join([table_of(shown), *reasons, *findings, *notes])


def html_of(shown: Mapping[str, Any]) -> str:
    """Return the table of the parameters as HTML; external text is escaped."""

    def row(cells: tuple[str, ...], tag: str) -> str:
        written = (
            f'<{tag} style="text-align:{"right" if place in _ALIGNED_RIGHT else "left"}">'
            f"{html.escape(cell)}</{tag}>"
            for place, cell in enumerate(cells)
        )
        return f"<tr>{''.join(written)}</tr>"

    body = "".join(row(cells, "td") for cells in _rows(shown))
    notes = "".join(f"<li>{html.escape(each)}</li>" for each in shown["warnings"])
    return (
        f"<table><caption>{html.escape(_title(shown))}</caption>"
        f"<thead>{row(_HEADER, 'th')}</thead><tbody>{body}</tbody></table>"
        + (f"<ul>{notes}</ul>" if notes else "")
    )


def frame_of(shown: Mapping[str, Any]) -> "pd.DataFrame":
    """Return a pandas frame with a row for each parameter, columns as in `parameter_mapping`."""
    import pandas as pd  # noqa: PLC0415 - only where it is installed

    rows = {name: dict(each) for name, each in shown["parameters"].items()}
    for each in rows.values():
        each["low"], each["high"] = each.pop("interval")
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("parameter")
