"""The section of a report on the answers of the stem to its command."""

from itertools import pairwise

from valve_friction_ros.reports.page import Column, Paragraph, Section, Table
from valve_friction_ros.response import SIZES, Move, ResponseSummary, Spread
from valve_friction_ros.streams import utc

__all__ = ["response_section"]

_FIGURES = (
    ("dead time [s]", "dead_time", 1.0),
    ("T63 [s]", "t63", 1.0),
    ("T86 [s]", "t86", 1.0),
    ("overshoot [% of the move]", "overshoot", 100.0),
    ("steady error [% of the travel]", "steady_error", 100.0),
)
_CAUSES = (("dead time", "dead_time"), ("T86", "t86"), ("steady error", "deviation"))


def response_section(response: ResponseSummary) -> Section | None:
    """Return the table of the figures of the latest steps; None without any."""
    if not response.moves:
        return None
    columns = ("median", "10 %", "90 %", "steps")
    table = Table(
        (Column("answer"), *(Column(name, is_number=True) for name in columns)),
        tuple((words, *_cells(getattr(response, name), scale)) for words, name, scale in _FIGURES),
    )
    sizes = Table(
        (Column("step [% of the travel]"), Column("moved the stem", is_number=True)),
        tuple(
            (_bounds(*bounds), f"{moved} of {count}")
            for bounds, (moved, count) in zip(pairwise(SIZES), response.by_size, strict=True)
            if count
        ),
    )
    causes = " ".join(
        f"{name[0].upper()}{name[1:]}: {response.cause(which).value}." for name, which in _CAUSES
    )
    words = (
        "The figures, after ANSI/ISA-75.25, are those of the latest "
        f"{len(response.moves)} steps of stem_command, {_dates(response.moves)}; "
        f"{len(response.ignored)} of them did not move the stem. "
        "Steady error is command less position."
    )
    return Section("Answer to the command", (table, sizes, Paragraph(words), Paragraph(causes)))


def _cells(spread: Spread, scale: float) -> tuple[str, ...]:
    if not spread.number:
        return ("–", "–", "–", "0")
    values = (f"{scale * one:.3g}" for one in (spread.median, spread.low, spread.high))
    return (*values, str(spread.number))


def _bounds(low: float, high: float) -> str:
    return f"{100 * low:g} to {100 * high:g}" if high < 1 else f"above {100 * low:g}"


def _dates(moves: tuple[Move, ...]) -> str:
    stamps = [one.stamp for one in moves]
    first, last = (f"{utc(stamp):%Y-%m-%d %H:%M}" for stamp in (min(stamps), max(stamps)))
    return f"from {first} to {last} UTC"
