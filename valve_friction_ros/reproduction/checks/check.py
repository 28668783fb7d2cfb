"""A number of the paper beside ours, and whether they agree."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Check", "compared", "summary", "within", "written"]


@dataclass(frozen=True)
class Check:
    """One thing that a reader of the paper ticks off.

    Attributes
    ----------
    item : int
        Section of the report that it belongs to, from 1.
    name : str
        What is compared, with its place in the paper.
    paper, ours : str
        Both values, in the paper's unit.
    criterion : str
        When they count as equal; chosen before they were known.
    matched : bool
        Whether they do.
    why : str
        The reason, where they do not.

    Raises
    ------
    ValueError
        If a reason is given for a match, or none for a mismatch.
    """

    item: int
    name: str
    paper: str
    ours: str
    criterion: str
    matched: bool
    why: str = ""

    def __post_init__(self) -> None:
        """Refuse a mismatch that nobody explains."""
        if self.matched == bool(self.why):
            raise ValueError(f"{self.name}: a reason belongs to a mismatch, and to nothing else")


def compared(
    item: int, name: str, paper: str, ours: str, criterion: str, matched: bool, why: str
) -> Check:
    """Return a check that keeps the reason only where it did not match."""
    return Check(item, name, paper, ours, criterion, bool(matched), "" if matched else why)


def written(value: float, digits: int = 4) -> str:
    """Write a number with so many digits, or all of its whole ones; a dash if there is none."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    places = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    return f"{value:.{min(places, 9)}f}"


def within(
    item: int,
    name: str,
    paper: float,
    ours: float,
    share: float,
    unit: str,
    why: str,
    digits: int = 4,
) -> Check:
    """Compare two numbers: equal within a share of the paper's."""
    return compared(
        item,
        name,
        f"{written(paper, digits)} {unit}",
        f"{written(ours, digits)} {unit}",
        f"within {100 * share:g} %",
        abs(ours - paper) <= share * abs(paper),
        why,
    )


def summary(checks: Sequence[Check]) -> str:
    """Say in one line how many checks matched, and name those that did not."""
    missed = [check.name for check in checks if not check.matched]
    count = f"{len(checks) - len(missed)} of {len(checks)} matched"
    return f"{count}; not matched: {'; '.join(missed)}." if missed else f"{count}."
