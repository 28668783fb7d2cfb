"""The page of many valves: ranked, each with its picture and a link to its report."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from datetime import datetime, timezone
from typing import NamedTuple
from urllib.parse import quote

from valve_friction_ros import __version__
from valve_friction_ros.fleet.picture import HEIGHT, WIDTH
from valve_friction_ros.fleet.ranking import Status, ranked, status_of
from valve_friction_ros.fleet.row import PICTURE, Cell
from valve_friction_ros.health import percentage
from valve_friction_ros.identification import two_digits
from valve_friction_ros.page_template import page_environment

__all__ = ["page_text"]

_Row = Mapping[str, Cell]


class _Number(NamedTuple):
    """A cell: its text, and what it is sorted by; an empty one comes last."""

    text: str = ""
    detail: str = ""
    key: float = -math.inf


class _Line(NamedTuple):
    """A valve on the page, all of it text."""

    status: Status
    name: str
    began: str
    points: str
    ratio: _Number
    dead_band: _Number
    sliding: _Number
    coulomb: _Number
    finding: str
    report: str


def _with_width(row: _Row, name: str) -> _Number:
    value, width = row[f"{name}_n"], row[f"{name}_half_width_n"]
    if not isinstance(value, (int, float)):
        return _Number()
    detail = f"± {two_digits(width)} N" if isinstance(width, (int, float)) else "N"
    return _Number(f"{value:.4g}", detail, value)


def _ratio(row: _Row) -> _Number:
    ratio, low, high = row["ratio"], row["ratio_low"], row["ratio_high"]
    if not isinstance(ratio, (int, float)):
        return _Number()
    is_known = isinstance(low, (int, float)) and isinstance(high, (int, float))
    return _Number(f"{ratio:.2f}", f"{low:.2f} to {high:.2f}" if is_known else "", ratio)


def _dead_band(row: _Row) -> _Number:
    share = row["dead_band_of_travel"]
    if not isinstance(share, (int, float)):
        return _Number()
    return _Number(percentage(share), "of travel", share)


def _line(row: _Row) -> _Line:
    def text(name: str) -> str:
        return str(row.get(name) or "")

    began = text("began").replace("T", " ").removesuffix("Z")
    return _Line(
        status_of(row),
        " ".join(filter(None, (text("recording"), text("valve")))),
        f"{began[:16]} UTC" if began else "",
        text(PICTURE),
        _ratio(row),
        _dead_band(row),
        _with_width(row, "sliding_friction"),
        _with_width(row, "coulomb_friction"),
        text("error") or "; ".join(filter(None, (text("message"), text("findings")))),
        quote(text("report")),
    )


def page_text(rows: Iterable[_Row], name: str) -> str:
    """Return the page of the rows as one HTML file, which needs no network.

    Its table is sorted by `ranked`, and by any of its columns at a click.
    """
    lines = [_line(row) for row in ranked(rows)]
    return (
        page_environment("valve_friction_ros.fleet")
        .get_template("page.html")
        .render(
            name=name,
            lines=lines,
            counts=Counter(line.status for line in lines),
            size=(WIDTH, HEIGHT),
            made=f"{datetime.now(timezone.utc):%Y-%m-%d %H:%M} UTC",
            version=__version__,
        )
    )
