# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The rows as tables, and the requirements."""

import math
import re
import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

from benchmark.harness.rows import Bound
from benchmark.reality.trial import CHANGES, SLIDING, Row

_WIDEST_ERROR, _LEAST_ERROR = 3.0, 0.02
"""An identified number is wrong if its error exceeds both this many half widths and this share."""

_FLOORS = {
    "clock_offset": 1e-3,
    "coulomb_asymmetry": 0.02,
    "viscous_asymmetry": 0.02,
    "limit_velocity": 1e-4,
    "stribeck_velocity": 1e-4,
}
"""Tolerated errors, SI unit, of numbers that may be zero."""

_USEFUL, _RIGHT = 0.10, 0.05
"""Largest error and half width of useful sliding friction, and largest error of least squares."""

_SAME_MODE, _SAME_FRICTION, _LEAST_WIDTH = 10.0, 2.0, 0.02
"""Increase of the sum of squares, in variances of the residual, and distance of F_c from the truth,
in half widths of the fit that starts there, that noise can explain; and the smallest such half
width, share of the truth."""

_FAST = 99.0
_SLOWEST = 2.0
"""Samples per second above which a record belongs to 100 Hz and better; and the time limit, s."""

_DECLARED = {1.5: 0.85, 2.0: 0.98, 0.45: 0.85}
"""Required share of plants on which a change of friction by this factor is declared."""

_VERDICTS = ("identified", "weak")

_Rows = Sequence[Row]


class Judged(NamedTuple):
    """A number and its truth, SI unit; the error is the distance from all acceptable values."""

    row: Row
    name: str
    verdict: str
    truth: float
    error: float
    half_width: float

    @property
    def inside(self) -> bool:
        """Whether the truth lies in the interval."""
        return self.error <= self.half_width

    @property
    def wrong(self) -> bool:
        """Whether the number is identified but wrong."""
        least = max(_LEAST_ERROR * abs(self.truth), _FLOORS.get(self.name, 0.0))
        far = self.error > max(_WIDEST_ERROR * self.half_width, least)
        return self.verdict == "identified" and far


def judged(rows: Iterable[Row]) -> list[Judged]:
    """Return all numbers with an interval, together with the truth."""
    return [
        Judged(row, name, one.verdict, truth.value, truth.error(one.value), one.half_width)
        for row in rows
        for name, truth in row.truth.items()
        if (one := row.numbers.get(name)) is not None
        and one.verdict in _VERDICTS
        and math.isfinite(truth.value + one.value + one.half_width)
    ]


def _near(row: Row, name: str, share: float, narrow: float = math.inf) -> bool:
    one, truth = row.numbers.get(name), row.truth.get(name)
    if one is None or truth is None:
        return False
    is_narrow = narrow == math.inf or one.half_width <= narrow * truth.value
    return truth.error(one.value) <= share * truth.value and is_narrow


def is_useful(row: Row) -> bool:
    """Return whether the sliding friction is correct and known to 10 %."""
    return _near(row, SLIDING, _USEFUL, _USEFUL)


def is_right(row: Row) -> bool:
    """Return whether the sliding friction of least squares is within 5 %."""
    truth = row.truth.get(SLIDING)
    return truth is not None and truth.error(row.least_squares) <= _RIGHT * truth.value


def in_mode(row: Row) -> bool:
    """Return whether the search ended in the same mode as a fit that starts at the truth."""
    if not _is_fitted(row):
        return False
    truth = row.truth["coulomb_friction"]
    width = max(row.widths["coulomb_friction"], _LEAST_WIDTH * truth.value)
    is_near = truth.error(row.coulomb) <= _SAME_FRICTION * width
    return row.found <= row.begun + _SAME_MODE and is_near


def _has_static(row: Row) -> bool:
    one = row.numbers.get("static_friction")
    return one is not None and one.verdict == "identified"


def _is_fitted(row: Row) -> bool:
    return math.isfinite(row.begun)


def _is_fast(row: Row) -> bool:
    return row.rate > _FAST


def _declaration(row: Row) -> str:
    """Return the friction alarm on the side of the change; empty without an alarm."""
    return row.alarms.get("high" if row.change > 1.0 else "low", "")


def _ratios(rows: _Rows, name: str = "") -> list[float]:
    """Return the half widths over those of the fit that starts at the truth."""
    return [
        one.half_width / row.widths[other]
        for row in rows
        for other, one in row.numbers.items()
        if name in ("", other) and row.widths.get(other, 0.0) > 0.0
    ]


def _count(test: Callable[[Row], object], rows: Iterable[Row]) -> int:
    return sum(bool(test(row)) for row in rows)


def _share(part: int, whole: int) -> str:
    return f"{part} of {whole} ({part / whole:.0%})" if whole else "–"


def _of(test: Callable[[Row], object], rows: _Rows) -> str:
    return _share(_count(test, rows), len(rows))


def _inside(some: Sequence[Judged]) -> str:
    return _share(sum(one.inside for one in some), len(some))


def _median(values: Iterable[float], form: str) -> str:
    known = [one for one in values if math.isfinite(one)]
    return format(statistics.median(known), form) if known else "–"


def _table(heads: Sequence[str], lines: Iterable[Sequence[object]]) -> Iterator[str]:
    yield ""
    for line in (heads, ["---"] * len(heads), *lines):
        yield f"| {' | '.join(map(str, line))} |"


_HEADS = [
    *("records", "refused", "useful", "LS within 5 %", "sliding within 5 %", "F_c within 10 %"),
    *("wrong", "identified, inside", "weak, inside", "median s", "max s"),
]


def _line(name: str, rows: _Rows) -> tuple[object, ...]:
    numbers = judged(rows)
    by_verdict = ([one for one in numbers if one.verdict == verdict] for verdict in _VERDICTS)
    return (
        name,
        len(rows),
        _count(lambda row: row.refusal, rows),
        *(_count(test, rows) for test in (is_useful, is_right)),
        _count(lambda row: _near(row, SLIDING, _RIGHT), rows),
        _count(lambda row: _near(row, "coulomb_friction", _USEFUL), rows),
        sum(one.wrong for one in numbers),
        *map(_inside, by_verdict),
        _median((row.seconds for row in rows), ".2f"),
        f"{max((row.seconds for row in rows), default=math.nan):.2f}",
    )


def _light(row: Row) -> str:
    limits = (0.01, 0.03, 0.1)
    return next((f"F_c to {one:.0%}" for one in limits if row.share < one), "F_c above 10%")


_CLASSES: dict[str, Callable[[Row], tuple[str, ...]]] = {
    "motion": lambda row: (row.motion,),
    "imperfection": lambda row: row.imperfections,
    "valve": lambda row: (row.kind, "slips" if row.slips else "slides", _light(row)),
    "rate": lambda row: ("100 Hz and better" if _is_fast(row) else "slower",),
}


def _groups(
    rows: _Rows, classes: Callable[[Row], tuple[str, ...]]
) -> Iterator[tuple[str, list[Row]]]:
    for name in dict.fromkeys(name for row in rows for name in classes(row)):
        yield name, [row for row in rows if name in classes(row)]


def _by_number(rows: _Rows) -> Iterator[str]:
    numbers = judged(rows)
    lines = []
    for name in dict.fromkeys(one.name for one in numbers):
        own = [one for one in numbers if one.name == name]
        lines.append(
            (
                name,
                *(_inside([one for one in own if one.verdict == each]) for each in _VERDICTS),
                sum(one.wrong for one in own),
                _median((one.half_width / abs(one.truth) for one in own if one.truth), ".1%"),
                _median(_ratios(rows, name), ".2f"),
            )
        )
    heads = ("number", "identified, inside", "weak, inside", "wrong", "±", "± over that at truth")
    yield from _table(heads, lines)


def _by_motion(
    rows: _Rows, heads: Sequence[str], line: Callable[[_Rows], Sequence[object]]
) -> Iterator[str]:
    groups = [*_groups(rows, _CLASSES["motion"]), ("all", rows)]
    yield from _table(heads, ([name, *line(some)] for name, some in groups))


def _slips(rows: _Rows) -> Sequence[object]:
    fitted = [row for row in rows if _is_fitted(row)]
    return (
        len(rows),
        _of(in_mode, fitted),
        _of(_has_static, [row for row in rows if _is_fast(row)]),
        _median(_ratios(fitted), ".2f"),
    )


def _alarms(rows: _Rows) -> Sequence[object]:
    same = [row for row in rows if row.change == 1.0]
    changed = ([row for row in rows if row.change == change] for change in CHANGES[1:])
    return (
        _of(lambda row: row.has_baseline, same),
        _of(lambda row: row.alarms, same),
        *(_declared(some) for some in changed),
    )


def _declared(rows: _Rows) -> str:
    """Return how often a change is declared, at which level, and how often it is uncertain."""
    errors = _count(lambda row: _declaration(row).startswith("ERROR"), rows)
    unsure = _count(lambda row: not _declaration(row) and "perhaps" in row.alarms, rows)
    return f"{_of(_declaration, rows)}, {errors} as ERROR; {unsure} perhaps"


def _least(what: str, test: Callable[[Row], object], rows: _Rows, least: float) -> Bound:
    part = _count(test, rows)
    met = bool(rows) and part >= least * len(rows)
    return Bound(f"{what}: at least {least:.0%}", _share(part, len(rows)), met)


def _none(what: str, some: int, reached: str = "") -> Bound:
    return Bound(f"{what}: none", reached or str(some), not some)


def _bounds_of_the_mode(rows: _Rows) -> Iterator[Bound]:
    if slips := [row for row in rows if row.slips]:
        fitted = [row for row in slips if _is_fitted(row)]
        yield _least("stick-slip: in the mode of the truth", in_mode, fitted, 0.95)
        fast = [row for row in slips if _is_fast(row)]
        yield _least("stick-slip: F_s identified, 100 Hz and better", _has_static, fast, 0.7)
    if ratios := [one for one in _ratios(rows) if math.isfinite(one)]:
        median = statistics.median(ratios)
        what = "median half width over that at the truth: at most 1.3"
        yield Bound(what, f"{median:.2f}", median <= 1.3)


def _bounds_of_alarms(rows: _Rows) -> Iterator[Bound]:
    if not rows:
        return
    same = [row for row in rows if row.change == 1.0]
    alarmed = _count(lambda row: row.alarms, same)
    yield _none("alarms of unchanged valves", alarmed, _share(alarmed, len(same)))
    for change, least in _DECLARED.items():
        changed = [row for row in rows if row.change == change]
        yield _least(f"friction ×{change:g} declared", _declaration, changed, least)
    yield _least("a baseline", lambda row: row.has_baseline, same, 0.95)


def bounds(rows: _Rows) -> Iterator[Bound]:
    """Yield the requirements of all parts that were run, with the figures reached."""
    numbers = judged(rows)
    yield _none("identified and wrong", sum(one.wrong for one in numbers))
    for verdict in _VERDICTS:
        for name in dict.fromkeys(one.name for one in numbers if one.verdict == verdict):
            some = [one for one in numbers if (one.name, one.verdict) == (name, verdict)]
            inside = sum(one.inside for one in some)
            what = f"{name}, {verdict}, inside: at least 90%"
            yield Bound(what, _inside(some), inside >= 0.9 * len(some))
    if plain := [row for row in rows if row.part == "plain"]:
        yield _least("useful", is_useful, plain, 0.7)
        useful, right = _count(is_useful, plain), _count(is_right, plain)
        what = "useful at least as often as least squares are within 5 %"
        yield Bound(what, f"{useful}, and {right}", useful >= right)
        behind = [
            name
            for name, some in _groups(plain, _CLASSES["motion"])
            if _count(is_useful, some) < _count(is_right, some)
        ]
        yield Bound("the same with each motion; not in", ", ".join(behind) or "in all", not behind)
        easy = [row for row in plain if row.motion in ("levels", "multisine") and _is_fast(row)]
        yield _least("useful, levels and multisines of 100 Hz and better", is_useful, easy, 0.9)
    yield from _bounds_of_the_mode([row for row in rows if row.part != "alarms"])
    yield from _bounds_of_alarms([row for row in rows if row.part == "alarms"])
    if rows:
        longer = _count(lambda row: row.seconds > _SLOWEST, rows)
        yield _none(f"records above {_SLOWEST:g} s", longer)
        yield _none("failures", _count(lambda row: row.failure, rows))


def _missed(rows: _Rows) -> Iterator[str]:
    """Yield violations of the requirements, one line each, and refusals with their counts."""
    for one in judged(rows):
        if one.wrong:
            error = one.row.numbers[one.name].value / one.truth - 1.0
            width = one.half_width / abs(one.truth)
            told = f"{one.name} {error:+.1%} ± {width:.1%}; {', '.join(one.row.imperfections)}"
            yield f"- wrong: {one.row.part} {one.row.name}: {told}"
    for row in rows:
        if row.failure:
            yield f"- failed: {row.part} {row.name}: {row.failure}"
        for words in row.alarms.values() if row.change == 1.0 else ():
            yield f"- alarm of an unchanged valve: {row.name}: {words[:200]}"
    refusals = Counter(re.sub(r"-?\d[\d.]*", "#", row.refusal)[:60] for row in rows if row.refusal)
    for words, count in refusals.most_common():
        yield f"- refused {count} times: {words} …"


def report(rows: _Rows) -> Iterator[str]:
    """Yield the lines of the report in Markdown."""
    whole = [row for row in rows if row.part != "alarms"]
    if plain := [row for row in rows if row.part == "plain"]:
        for title, classes in _CLASSES.items():
            lines = [_line(name, some) for name, some in _groups(plain, classes)]
            yield from _table((title, *_HEADS), [*lines, _line("all", plain)])
    if whole:
        yield from _by_number(whole)
    if slips := [row for row in whole if row.slips]:
        heads = ("stick-slip", "records", "in the mode of the truth", "F_s identified", "±/±")
        yield from _by_motion(slips, heads, _slips)
    if alarms := [row for row in rows if row.part == "alarms"]:
        declared = (f"×{change:g} declared" for change in CHANGES[1:])
        watched = ("alarms", "baseline", "unchanged: alarms", *declared)
        yield from _by_motion(alarms, watched, _alarms)
    yield ""
    yield from _missed(rows)
    marks = {True: "met", False: "**missed**"}
    reached = [(one.what, one.reached, marks[one.met]) for one in bounds(rows)]
    yield from _table(("bound", "reached", ""), reached)
