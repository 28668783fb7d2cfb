"""Comparison of a number of the paper with the reproduced number."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Check", "compared", "count", "summary", "within", "written"]


@dataclass(frozen=True)
class Check:
    """One comparison with the paper, in the paper's unit; its criterion was set before the values.

    `item` is the section of the report, from 1. A mismatch has a reason, and a match has none: else
    it raises ValueError.
    """

    item: int
    name: str
    paper: str
    ours: str
    criterion: str
    matched: bool
    why: str = ""

    def __post_init__(self) -> None:
        """Refuse a mismatch without a reason."""
        if self.matched == bool(self.why):
            raise ValueError(f"{self.name}: a mismatch needs a reason, and a match has none")


def compared(
    item: int, name: str, paper: str, ours: str, criterion: str, matched: bool, why: str
) -> Check:
    """Return a check; a match drops the reason."""
    return Check(item, name, paper, ours, criterion, bool(matched), "" if matched else why)


def written(value: float, digits: int = 4) -> str:
    """Write a number with `digits` digits, without decimals if it is large; nan as a dash."""
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
    """Compare two numbers: they match within a share of the paper's number."""
    return compared(
        item,
        name,
        f"{written(paper, digits)} {unit}",
        f"{written(ours, digits)} {unit}",
        f"within {100 * share:g} %",
        abs(ours - paper) <= share * abs(paper),
        why,
    )


def count(checks: Sequence[Check]) -> str:
    """Return the number of matches."""
    return f"{sum(check.matched for check in checks)} of {len(checks)} matched"


def summary(checks: Sequence[Check]) -> str:
    """Return one line: the number of matches, and the names of the mismatches."""
    missed = [check.name for check in checks if not check.matched]
    told = count(checks)
    return f"{told}; not matched: {'; '.join(missed)}." if missed else f"{told}."
