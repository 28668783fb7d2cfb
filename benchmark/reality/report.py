"""The rows as tables, and the bounds."""

import math
import statistics
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

from benchmark.reality.trial import SLIDING, Row

__all__ = ["Bound", "bounds", "report"]

_WIDEST_ERROR, _LEAST_ERROR = 3.0, 0.02
"""An identified number is wrong if it is off by more half widths, and by more than this share."""

_USEFUL, _RIGHT = 0.10, 0.05
"""Largest error and half width of a useful sliding friction; largest error of least squares."""

_FLOORS = {
    "clock_offset": 1e-3,
    "coulomb_asymmetry": 0.02,
    "viscous_asymmetry": 0.02,
    "limit_velocity": 1e-4,
    "stribeck_velocity": 1e-4,
}
"""Errors, SI unit, that are not wrong in numbers that may be zero."""

_SAME_MODE = 10.0
"""Rise of the sum of squares, in variances of the residual, that noise explains."""

_FAST = 99.0
"""Samples a second from which a record is one of 100 Hz and better."""


class Judged(NamedTuple):
    """A number beside the truth: error and half width over the truth, and verdict."""

    row: Row
    name: str
    verdict: str
    truth: float
    error: float
    half_width: float

    @property
    def inside(self) -> bool:
        return self.error <= self.half_width

    @property
    def wrong(self) -> bool:
        least = max(_LEAST_ERROR * abs(self.truth), _FLOORS.get(self.name, 0.0))
        far = self.error > _WIDEST_ERROR * self.half_width
        return self.verdict == "identified" and far and self.error > least


def judged(rows: Iterable[Row]) -> list[Judged]:
    """Return all numbers with an interval, beside the truth."""
    return [
        Judged(row, name, one.verdict, truth.value, truth.error(one.value), one.half_width)
        for row in rows
        for name, truth in row.truth.items()
        if (one := row.numbers.get(name)) is not None
        and one.verdict in ("identified", "weak")
        and math.isfinite(truth.value + one.value + one.half_width)
    ]


def is_useful(row: Row) -> bool:
    one, truth = row.numbers.get(SLIDING), row.truth.get(SLIDING)
    if one is None or truth is None:
        return False
    return max(truth.error(one.value), one.half_width) <= _USEFUL * truth.value


def is_right(row: Row) -> bool:
    """Return whether least squares are within 5 %."""
    truth = row.truth.get(SLIDING)
    return truth is not None and truth.error(row.least_squares) <= _RIGHT * truth.value


def _near(row: Row, name: str, share: float) -> bool:
    one, truth = row.numbers.get(name), row.truth.get(name)
    return one is not None and truth is not None and truth.error(one.value) <= share * truth.value


def in_mode(row: Row) -> bool:
    """Return whether the search ended where a fit begun at the truth does."""
    return row.found <= row.begun + _SAME_MODE and row.coulomb_apart <= 2.0


def _share(part: int, whole: int) -> str:
    return f"{part} of {whole} ({part / whole:.0%})" if whole else "–"


def _inside(some: Sequence[Judged]) -> str:
    return _share(sum(one.inside for one in some), len(some))


def _median(values: Iterable[float], form: str) -> str:
    known = [one for one in values if math.isfinite(one)]
    return format(statistics.median(known), form) if known else "–"


def _table(title: str, heads: Sequence[str], lines: Iterable[Sequence[str]]) -> Iterator[str]:
    yield from ("", f"### {title}", "")
    yield f"| {' | '.join(heads)} |"
    yield f"|{' --- |' * len(heads)}"
    for line in lines:
        yield f"| {' | '.join(line)} |"


_HEADS = (
    "",
    "records",
    "refused",
    "failed",
    "useful",
    "LS within 5 %",
    "sliding within 5 %",
    "F_c within 10 %",
    "wrong",
    "inside, identified",
    "inside, weak",
    "median s",
    "max s",
)


def _line(name: str, rows: Sequence[Row]) -> tuple[str, ...]:
    numbers = judged(rows)
    by = {verdict: [one for one in numbers if one.verdict == verdict] for verdict in _VERDICTS}
    return (
        name,
        str(len(rows)),
        str(sum(bool(row.refusal) for row in rows)),
        str(sum(bool(row.failure) for row in rows)),
        str(sum(map(is_useful, rows))),
        str(sum(map(is_right, rows))),
        str(sum(_near(row, SLIDING, _RIGHT) for row in rows)),
        str(sum(_near(row, "coulomb_friction", 0.1) for row in rows)),
        str(sum(one.wrong for one in numbers)),
        *(_inside(by[verdict]) for verdict in _VERDICTS),
        _median((row.seconds for row in rows), ".2f"),
        format(max((row.seconds for row in rows if row.seconds >= 0), default=math.nan), ".2f"),
    )


_VERDICTS = ("identified", "weak")


def _classes(
    title: str, rows: Sequence[Row], classes: Callable[[Row], Iterable[str]]
) -> Iterator[str]:
    names = dict.fromkeys(name for row in rows for name in classes(row))
    groups = {name: [row for row in rows if name in classes(row)] for name in names}
    lines = [_line(name, some) for name, some in groups.items()]
    yield from _table(title, _HEADS, [*lines, _line("all", rows)])


def _parameters(rows: Sequence[Row]) -> Iterator[str]:
    numbers = judged(rows)
    lines = []
    for name in dict.fromkeys(one.name for one in numbers):
        own = [one for one in numbers if one.name == name]
        some = [[one for one in own if one.verdict == verdict] for verdict in _VERDICTS]
        widths = [
            number.half_width / row.widths[name]
            for row in rows
            if (number := row.numbers.get(name)) is not None and row.widths.get(name, 0.0) > 0
        ]
        relative = [one.half_width / abs(one.truth) for one in own if one.truth]
        lines.append(
            (
                name,
                *(_inside(one) for one in some),
                str(sum(one.wrong for one in own)),
                _median(relative, ".1%"),
                _median(widths, ".2f"),
            )
        )
    heads = ("number", "identified: inside", "weak: inside", "wrong", "median ±", "± over truth's")
    yield from _table("by number", heads, lines)


def _slips(rows: Sequence[Row]) -> Iterator[str]:
    some = [row for row in rows if row.slips]
    lines = []
    for motion in (*dict.fromkeys(row.motion for row in some), "all"):
        group = [row for row in some if motion in (row.motion, "all")]
        compared = [row for row in group if math.isfinite(row.begun)]
        fast = [row for row in group if row.rate > _FAST]
        lines.append(
            (
                motion,
                str(len(group)),
                _share(sum(map(in_mode, compared)), len(compared)),
                _share(sum(map(_has_static, fast)), len(fast)),
            )
        )
    heads = ("stick-slip", "records", "in the mode of the truth", "F_s identified, 100 Hz and better")
    yield from _table("packings that slip", heads, lines)


def _has_static(row: Row) -> bool:
    one = row.numbers.get("static_friction")
    return one is not None and one.verdict == "identified"


def _declared(row: Row) -> bool:
    return ("high" if row.change > 1.0 else "low") in row.alarms


def _alarms(rows: Sequence[Row]) -> Iterator[str]:
    lines = []
    for motion in (*dict.fromkeys(row.motion for row in rows), "all"):
        group = [row for row in rows if motion in (row.motion, "all")]
        changes = sorted({row.change for row in group})
        same = [row for row in group if row.change == 1.0]
        lines.append(
            (
                motion,
                _share(sum(bool(row.has_baseline) for row in same), len(same)),
                _share(sum(bool(row.alarms) for row in same), len(same)),
                *(
                    _share(sum(_declared(r) for r in group if r.change == change),
                           sum(r.change == change for r in group))
                    for change in changes
                    if change != 1.0
                ),
            )
        )
    changes = [f"×{change:g} declared" for change in sorted({row.change for row in rows}) if change != 1.0]
    yield from _table("alarms", ("", "baseline", "alarms, unchanged", *changes), lines)


class Bound(NamedTuple):
    """A requirement, what was reached, and whether that is enough."""

    what: str
    reached: str
    met: bool


def _least(what: str, part: int, whole: int, least: float) -> Bound:
    met = whole > 0 and part >= least * whole - 1e-9
    return Bound(f"{what}: at least {least:.0%}", _share(part, whole), met)


def bounds(rows: Sequence[Row]) -> list[Bound]:
    """Return the requirements of all that was run."""
    found = []
    whole = [row for row in rows if row.part != "alarms"]
    numbers = judged(rows)
    wrong = sum(one.wrong for one in numbers)
    found.append(Bound("identified and wrong: none", str(wrong), not wrong))
    for verdict in _VERDICTS:
        for name in dict.fromkeys(one.name for one in numbers):
            some = [one for one in numbers if (one.name, one.verdict) == (name, verdict)]
            if some:
                inside = sum(one.inside for one in some)
                found.append(_least(f"{name} {verdict}, inside", inside, len(some), 0.9))
    plain = [row for row in whole if row.part == "plain"]
    if plain:
        useful, right = sum(map(is_useful, plain)), sum(map(is_right, plain))
        found.append(_least("useful sliding friction", useful, len(plain), 0.7))
        found.append(Bound("useful at least as often as LS is right", f"{useful}, LS {right}", useful >= right))
        fast = [row for row in plain if row.motion in ("levels", "multisine") and row.rate > _FAST]
        found.append(_least("useful, levels and multisines of 100 Hz", sum(map(is_useful, fast)), len(fast), 0.9))
    slips = [row for row in whole if row.slips]
    if slips:
        compared = [row for row in slips if math.isfinite(row.begun)]
        found.append(_least("stick-slip: mode of the truth", sum(map(in_mode, compared)), len(compared), 0.95))
        fast = [row for row in slips if row.rate > _FAST]
        found.append(_least("stick-slip: F_s identified, 100 Hz", sum(map(_has_static, fast)), len(fast), 0.7))
    widths = [
        one.half_width / row.widths[name]
        for row in whole
        for name, one in row.numbers.items()
        if row.widths.get(name, 0.0) > 0 and math.isfinite(one.half_width)
    ]
    if widths:
        median = statistics.median(widths)
        found.append(Bound("median half width over that at the truth: at most 1.3", f"{median:.2f}", median <= 1.3))
    alarms = [row for row in rows if row.part == "alarms"]
    if alarms:
        same = [row for row in alarms if row.change == 1.0]
        some = sum(bool(row.alarms) for row in same)
        found.append(Bound("alarms of unchanged valves: none", _share(some, len(same)), not some))
        for change, least in ((1.5, 0.85), (2.0, 0.98), (0.45, 0.85)):
            changed = [row for row in alarms if row.change == change]
            found.append(_least(f"friction ×{change:g} declared", sum(map(_declared, changed)), len(changed), least))
        found.append(_least("a baseline", sum(bool(row.has_baseline) for row in same), len(same), 0.95))
    slow = [row.seconds for row in rows if math.isfinite(row.seconds)]
    longer = sum(one > 2.0 for one in slow)
    found.append(Bound("no record above 2 s", f"{longer} longer, the longest {max(slow, default=math.nan):.1f} s", not longer))
    failed = sum(bool(row.failure) for row in rows)
    found.append(Bound("no failures", str(failed), not failed))
    return found


def _violations(rows: Sequence[Row]) -> Iterator[str]:
    for one in judged(rows):
        if one.wrong:
            sign = one.row.numbers[one.name].value - one.truth
            yield (
                f"- wrong: {one.row.part} {one.row.name} {one.name} off by {sign / abs(one.truth):+.1%} ± "
                f"{one.half_width / abs(one.truth):.1%}, {', '.join(one.row.imperfections)}"
            )
    for row in rows:
        if row.failure:
            yield f"- failed: {row.part} {row.name}: {row.failure}"
        if row.change == 1.0:
            for side, words in row.alarms.items():
                yield f"- alarm, unchanged: {row.name} {side}: {words[:200]}"
    refusals = [row.refusal[:70] for row in rows if row.refusal]
    for words in dict.fromkeys(refusals):
        yield f"- refused {refusals.count(words)} times: {words} …"


def report(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the lines of the report, Markdown."""
    plain = [row for row in rows if row.part == "plain"]
    if plain:
        yield from _classes("by motion", plain, lambda row: [row.motion])
        yield from _classes("by imperfection", plain, lambda row: row.imperfections)
        yield from _classes("by valve", plain, lambda row: [row.kind, "slips" if row.slips else "slides"])
        yield from _classes("by rate", plain, lambda row: ["100 Hz and better" if row.rate > _FAST else "slower"])
    whole = [row for row in rows if row.part != "alarms"]
    if whole:
        yield from _parameters(whole)
        yield from _slips(whole)
    if alarms := [row for row in rows if row.part == "alarms"]:
        yield from _alarms(alarms)
    yield from ("", "### what was missed", "")
    yield from _violations(rows)
    met = [(one.what, one.reached, "met" if one.met else "**missed**") for one in bounds(rows)]
    yield from _table("bounds", ("bound", "reached", ""), met)
