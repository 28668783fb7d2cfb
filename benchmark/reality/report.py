"""The outcomes as tables, and every case that violates a bound with its figures."""

import math
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence

from rich.table import Table

from benchmark.reality.answers import Outcome
from benchmark.reality.bounds import Bound
from benchmark.reality.counts import Count, Judged

__all__ = ["bounds_table", "counts_table", "numbers_table", "violations"]


def _percent(share: float, least: float = math.nan) -> str:
    if math.isnan(share):
        return "–"
    text = f"{100 * share:.0f}%"
    return f"[red]{text}[/]" if share < least else text


def _some(count: int) -> str:
    return f"[red]{count}[/]" if count else ""


def counts_table(title: str, counts: Mapping[str, Count]) -> Table:
    """Tabulate the counts of each group, a row a group."""
    table = Table(title=title)
    columns = (
        "records",
        "refused",
        "failed",
        "identified",
        "wrong",
        "inside",
        "F_c sure",
        "sliding usable",
    )
    table.add_column("")
    for column in (*columns, "alarms", "growth", "named", "median s", "max s"):
        table.add_column(column, justify="right")
    for name, one in counts.items():
        table.add_row(
            name,
            str(one.records),
            str(one.refused or ""),
            _some(one.failed),
            str(one.numbers),
            _some(len(one.wrong)),
            _percent(one.coverage, 0.9),
            _percent(one.sure_share),
            _percent(one.usable_share, 0.85),
            _some(len(one.alarms)),
            _percent(one.declared_share, 0.9),
            f"{_percent(one.named_share, 0.8)} of {one.doubted}" if one.doubted else "",
            f"{statistics.median(one.seconds):.2f}",
            f"{max(one.seconds):.2f}",
        )
    return table


def numbers_table(every: Sequence[Judged]) -> Table:
    """Tabulate how often each number is identified, right and wrong."""
    table = Table(title="identified numbers")
    for column in ("number", "identified", "inside", "wrong", "median ±"):
        table.add_column(column, justify="left" if column == "number" else "right")
    for name in dict.fromkeys(one.name for one in every):
        some = [one for one in every if one.name == name]
        widths = [one.half_width / abs(one.truth) for one in some if one.truth]
        table.add_row(
            name,
            str(len(some)),
            _percent(sum(one.is_inside for one in some) / len(some), 0.93),
            _some(sum(one.is_wrong for one in some)),
            f"{100 * statistics.median(widths):.2g} %" if widths else "–",
        )
    return table


def bounds_table(every: Sequence[Bound]) -> Table:
    """Tabulate the requirements."""
    table = Table(title="requirements")
    for column in ("requirement", "reached", ""):
        table.add_column(column)
    for bound in every:
        mark = "[green]met[/]" if bound.met else "[red]missed[/]"
        table.add_row(bound.what, bound.reached, mark)
    return table


def _relative(value: float, truth: float) -> str:
    return f"{100 * value / abs(truth):.3g} %" if truth else f"{value:.3g}"


def _of_wrong(one: Judged) -> str:
    error = _relative(one.value - one.truth, one.truth)
    width = _relative(one.half_width, one.truth)
    return f"{one.outcome.name}: {one.name} {error} ± {width}, truth {one.truth:.5g}"


def _of_sliding(one: Outcome) -> str:
    truth, number = one.truth.get("sliding_friction"), one.numbers.get("sliding_friction")
    if number is None or truth is None or math.isnan(number.value):
        return f"{one.name}: none; {' | '.join(one.sentences)[:200] or one.failure}"
    error = _relative(number.value - truth.value, truth.value)
    return f"{one.name}: {error} ± {_relative(number.half_width, truth.value)}"


def _of_alarm(one: Outcome) -> str:
    return f"{one.name}: {one.alarm}; {_of_sliding(one).removeprefix(one.name + ': ')}"


def _of_silence(one: Outcome) -> str:
    return f"{one.name}: {' | '.join(one.sentences)[:300]}"


def _of_failure(one: Outcome) -> str:
    return f"{one.name}: {one.failure}"


def _of_time(one: Outcome) -> str:
    return f"{one.name}: {one.processor_seconds:.2f} s of the processor, {one.seconds:.2f} s"


def violations(outcomes: Sequence[Outcome], whole: Count, slowest: float) -> Iterator[str]:
    """Yield the lines of a list of all cases that violate a bound, a heading before each kind."""
    undeclared = [one for one in outcomes if one.growth != 1.0 and one.alarm != "high"]
    failed = [one for one in outcomes if one.failure]
    slow = [one for one in outcomes if one.processor_seconds > slowest]
    yield from _list("identified and wrong", whole.wrong, _of_wrong)
    yield from _list("alarms of an unchanged valve", whole.alarms, _of_alarm)
    yield from _list("growth not declared", undeclared, _of_sliding)
    yield from _list("sliding friction not usable", whole.unusable, _of_sliding)
    yield from _list("doubted without naming why", whole.unnamed, _of_silence)
    yield from _list("failed", failed, _of_failure)
    yield from _list(f"longer than {slowest:g} s", slow, _of_time)


def _list(heading: str, some: Sequence[object], line: Callable[..., str]) -> Iterator[str]:
    if some:
        yield f"{heading}: {len(some)}"
        for one in some:
            yield f"  {line(one)}"
