# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Reading of a table: the samples of each signal, and omitted values with the reason."""

import csv
import itertools
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.records.columns import Columns
from valve_friction_ros.records.files import cause_of
from valve_friction_ros.records.header_words import numbers
from valve_friction_ros.records.layout import Layout, TableSignal, quoted
from valve_friction_ros.records.recognition import LEAST_PRESSURE, MOST_TAGS, recognized
from valve_friction_ros.records.recorded_valve import Stretch
from valve_friction_ros.records.table_rows import open_raw
from valve_friction_ros.records.units import PERCENT, PRESSURE_UNITS, SHARES
from valve_friction_ros.records.written_times import NO_TIME, TimeForm, WrittenTimes, in_one
from valve_friction_ros.signals import runs_of

if TYPE_CHECKING:
    import pandas as pd

_MOST_WORDS = 4
"""Most kinds of bad entries that a message names. Chosen: the message stays on one line."""
_MOST_NAMES = 6
_MOST_SPANS = 3.0
"""Accepted range of a share, over its span, as -100 to 200 %; a number beyond it, such as -9999,
means no value. Chosen."""
_SHORTEST = 2_000_000_000
"""Length of a record, ns, below which a time without a unit may be in minutes. Chosen: a record
of that many seconds shows no friction."""
_MOST_REPEATED = 0.5
"""Largest share of rows that may repeat the previous row exactly. Chosen."""
_DROPOUT = "dropout to 0"
_LEAST_FALL = 5.0
"""A single 0 is a dropout if the signal falls to it by this many times the change around it, and
the steps elsewhere: neither stem nor actuator moves so for one sample. Chosen."""


@dataclass(eq=False)
class ReadSignal:
    """The samples of a signal as read, in the unit of the table."""

    signal: TableSignal
    stamps: NDArray[np.int64]
    values: NDArray[np.float64]
    rows: NDArray[np.int64]
    """Times, ns, values, and rows numbered as in a spreadsheet."""
    bad: Counter[str] = field(default_factory=Counter)
    """Number of omitted entries by kind."""
    example: tuple[int, str, str] = (0, "", "")
    """Row, column and text of the first bad value."""
    bad_at: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    """Times of the bad values, ns."""

    def where(self, kept: NDArray[np.bool_] | slice) -> "ReadSignal":
        """Return the selected samples."""
        return replace(
            self, stamps=self.stamps[kept], values=self.values[kept], rows=self.rows[kept]
        )

    def place(self, sample: int) -> str:
        """Return row and column of a sample."""
        return f"row {self.rows[sample]}, column {self.signal.name!r}"


@dataclass(eq=False)
class _Parts:
    """The blocks of a signal during reading."""

    signal: TableSignal
    blocks: list[ReadSignal] = field(default_factory=list)
    bad: Counter[str] = field(default_factory=Counter)
    example: tuple[int, str, str] = (0, "", "")

    def forget_before(self, begin: float) -> None:
        while self.blocks and not (kept := self.blocks[0].stamps >= begin).all():
            if kept.any():
                self.blocks[0] = self.blocks[0].where(kept)
                return
            del self.blocks[0]

    def joined(self, last: float) -> ReadSignal:
        """Return all samples and release the blocks, so that a signal is in memory only once."""
        blocks, self.blocks = self.blocks, []
        stamps = np.concatenate([np.empty(0, np.int64), *(one.stamps for one in blocks)])
        values = np.concatenate([np.empty(0), *(one.values for one in blocks)])
        rows, bad_at = (
            np.concatenate([np.empty(0, np.int64), *parts])
            for parts in ((one.rows for one in blocks), (one.bad_at for one in blocks))
        )
        found = ReadSignal(self.signal, stamps, values, rows, self.bad, self.example, bad_at)
        if stamps.size and math.isfinite(last):
            return found.where(stamps >= stamps[-1] - last * 1e9)
        return found


class _Reader:
    """Reads the signals of one file, block by block."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.path = layout.raw.path

    def read(self, signals: Sequence[TableSignal], stretch: Stretch) -> list[ReadSignal]:
        """Read signals as `OpenTables.read` does."""
        parts = [_Parts(signal) for signal in signals]
        start: int | None = None
        for stamps_of, block, row_numbers in self._blocks(signals):
            first = _first(stamps_of.values())
            if first is None:
                for part in parts:
                    self._keep(part, block, row_numbers, stamps_of, None)
                continue
            start = first if start is None else start
            bounds = (start + stretch.begin * 1e9, start + stretch.end * 1e9)
            if all((known := each[each != NO_TIME]).size and known.min() > bounds[1]
                   for each in stamps_of.values()):  # fmt: skip
                break
            for part in parts:
                self._keep(part, block, row_numbers, stamps_of, bounds)
            self._drop_old(parts, stretch)
            self._require_room(parts)
        if start is None and not any(part.bad for part in parts):
            raise ValueError(f"{self.path}: no rows below the header")
        found = [part.joined(stretch.last) for part in parts]
        if not any(each.stamps.size for each in found) and not any(each.bad for each in found):
            raise RefusalError(
                f"{self.path}: the chosen stretch holds no rows: choose another begin or end"
            )
        found = [self._in_order(each) for each in found]
        return found if self.layout.is_own else [*map(_without_dropouts, found)]

    def _blocks(
        self, signals: Sequence[TableSignal]
    ) -> Iterator[
        tuple[dict[tuple[int, ...], NDArray[np.int64]], "pd.DataFrame", NDArray[np.int64]]
    ]:
        layout = self.layout
        keys = dict.fromkeys(signal.time for signal in signals)
        clocks = {key: WrittenTimes(layout.times[key]) for key in keys}
        wanted = [place for key in keys for place in key]
        wanted += [signal.place for signal in signals]
        wanted += [signal.quality for signal in signals if signal.quality is not None]
        if layout.tag_place is not None:
            wanted.append(layout.tag_place)
        places = sorted(set(wanted))
        blocks = layout.raw.blocks(places, layout.form.delimiter, layout.first, layout.above)
        for rows, block in blocks:
            if not len(block):
                continue
            yield {key: self._times(clocks[key], key, block) for key in keys}, block, rows

    def _times(
        self, clock: WrittenTimes, key: tuple[int, ...], block: "pd.DataFrame"
    ) -> NDArray[np.int64]:
        form = self.layout.times[key]
        cells = block[key[0]]
        if len(key) > 1:
            parts = block[list(key)].fillna("").astype(str).itertuples(index=False, name=None)
            cells = type(cells)(map(in_one, parts), index=cells.index)
        values = self._numbers(cells, form.unit) if form.unit else np.empty(0)
        return clock(cells, values)

    def _numbers(self, cells: "pd.Series[Any]", unit: str) -> NDArray[np.float64]:
        if cells.dtype.kind in "fiu":
            found = cells.to_numpy(np.float64)
            return np.where(np.isfinite(found), found, np.nan)
        return numbers(cells.fillna("").astype(str).tolist(), self.layout.decimal, unit)

    def _keep(
        self,
        part: _Parts,
        block: "pd.DataFrame",
        rows: NDArray[np.int64],
        stamps_of: Mapping[tuple[int, ...], NDArray[np.int64]],
        bounds: tuple[float, float] | None,
    ) -> None:
        """Keep the good samples of a block, and count the bad ones."""
        signal = part.signal
        stamps, cells = stamps_of[signal.time], block[signal.place]
        there = self._there(block, cells, signal)
        if bounds is not None:
            there &= (stamps == NO_TIME) | ((stamps >= bounds[0]) & (stamps <= bounds[1]))
        values = np.full(len(block), np.nan)
        values[there] = self._numbers(cells[there], signal.unit)
        if signal.unit in SHARES:
            low, high = SHARES[signal.unit]
            is_no_share = np.abs(2 * values - low - high) > _MOST_SPANS * (high - low)
            values[is_no_share] = np.nan
        good = there & np.isfinite(values)
        if signal.quality is not None:
            tell = self.layout.good[signal.quality]
            told = block[signal.quality].fillna("").astype(str)
            verdicts = {word: tell(word) for word in told.unique()}
            trusted = told.map(verdicts).to_numpy(bool)
            self._count(part, rows, told, good & ~trusted)
            good &= trusted
        self._count(part, rows, cells, there & ~np.isfinite(values))
        timeless = good & (stamps == NO_TIME)
        self._count(part, rows, block[signal.time[-1]], timeless)
        good &= ~timeless
        bad_at = stamps[there & ~good & (stamps != NO_TIME)]
        kept = ReadSignal(signal, stamps[good], values[good], rows[good], bad_at=bad_at)
        part.blocks.append(kept)
        self._in_order(part.blocks[-1])

    def _there(
        self, block: "pd.DataFrame", cells: "pd.Series[Any]", signal: TableSignal
    ) -> NDArray[np.bool_]:
        """Return which rows have a value of a signal; an empty entry is not a value."""
        if cells.dtype.kind in "fiu":
            there = cells.notna()
        else:
            there = cells.fillna("").astype(str).str.strip() != ""
        if self.layout.tag_place is not None:
            there = there & (block[self.layout.tag_place].str.strip() == signal.name)
        # The array of pandas 3 itself is read-only.
        return np.asarray(there.to_numpy(np.bool_, copy=True), np.bool_)

    def _count(
        self,
        part: _Parts,
        rows: NDArray[np.int64],
        cells: "pd.Series[Any]",
        bad: NDArray[np.bool_],
    ) -> None:
        if not bad.any():
            return
        texts = cells[bad].astype(str).str.strip()
        counted = texts.value_counts()
        part.bad.update({str(word): int(count) for word, count in counted.items()})
        if len(part.bad) > MOST_TAGS:
            part.bad = Counter({"": part.bad.total()})
        if not part.example[0]:
            name = part.signal.name
            if cells.name != part.signal.place:
                name = self.layout.headers[int(cells.name)]
            part.example = (int(rows[bad][0]), name, str(texts.iloc[0]))

    def _drop_old(self, parts: Sequence[_Parts], stretch: Stretch) -> None:
        last = [part.blocks[-1].stamps for part in parts if part.blocks]
        newest = [stamps[-1] for stamps in last if stamps.size]
        if not newest or not math.isfinite(stretch.last):
            return
        first = next(one.stamps for part in parts for one in part.blocks if one.stamps.size)
        if first[0] > first[-1]:  # newest row first
            return
        for part in parts:
            part.forget_before(min(newest) - (stretch.last + 1) * 1e9)

    def _require_room(self, parts: Sequence[_Parts]) -> None:
        most = self.layout.form.maximum_rows
        if max(sum(each.stamps.size for each in part.blocks) for part in parts) > most:
            raise ValueError(
                f"{self.path}: more than {most} rows: raise maximum_rows (--maximum-rows), or "
                "choose a part with --begin and --end"
            )

    def _in_order(self, read: ReadSignal) -> ReadSignal:
        """Return the samples in order of time; refuse times that go back."""
        if read.stamps.size < 2:
            return read
        steps = np.diff(read.stamps)
        if (steps <= 0).all() and (steps < 0).any():  # newest first, as in some programs
            read = read.where(slice(None, None, -1))
            steps = np.diff(read.stamps)
        same = (steps == 0) & (np.diff(read.values) == 0)
        if 0 < same.sum() <= _MOST_REPEATED * same.size:
            kept = np.concatenate([[True], ~same])
            read.bad["repeated row"] += int(same.sum())
            read = read.where(kept)
            steps = np.diff(read.stamps)
        if (steps <= 0).any():
            raise ValueError(self._goes_back(read, int(np.argmax(steps <= 0)) + 1))
        return read

    def _goes_back(self, read: ReadSignal, sample: int) -> str:
        form = self.layout.times[read.signal.time]
        repeats = read.stamps[sample] == read.stamps[sample - 1]
        now, before = (_shown(read.stamps[one], form) for one in (sample, sample - 1))
        column = self.layout.headers[read.signal.time[0]]
        what = "repeats" if repeats else "goes back"
        remedy = "sort the rows, or use the record before or after it"
        if repeats:
            more = "more decimals" if any("%f" in one for one in form.formats[:1]) else "fractions"
            remedy = f"export it with {more} of a second, or delete one of the rows"
        elif form.formats and not form.has_zone and not form.zone:
            remedy += (
                "; if the clocks were put back during the record, state the time zone (--time-zone)"
            )
        place = f"row {read.rows[sample]}, column {column!r}"
        return f"{self.path}: {place} {what} ({now} after {before}): {remedy}"


def _dropouts(values: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return first and one-past-last sample of each run of zeros that a signal jumps to and from.

    It jumps further than anywhere else, and back to where it was, shape (n, 2).
    """
    is_zero = values == 0
    inner = [run for run in runs_of(is_zero) if run[0] > 0 and run[1] < values.size]
    runs: NDArray[np.intp] = np.array(inner, np.intp).reshape(-1, 2)
    if not inner:
        return runs
    before, after = values[runs[:, 0] - 1], values[runs[:, 1]]
    fall = np.minimum(np.abs(before), np.abs(after))
    steps = np.abs(np.diff(values))[~(is_zero[1:] | is_zero[:-1])]
    usual = np.maximum(np.abs(after - before), np.quantile(steps, 0.99) if steps.size else 0.0)
    return np.asarray(runs[(before * after > 0) & (fall > _LEAST_FALL * usual)])


def _without_dropouts(read: ReadSignal) -> ReadSignal:
    """Leave out single zeros that a signal falls to for one sample, as without connection."""
    lone = [first for first, end in _dropouts(read.values).tolist() if end - first == 1]
    if not lone:
        return read
    kept = np.ones(read.values.size, dtype=np.bool_)
    kept[lone] = False
    read.bad[_DROPOUT] += len(lone)
    if not read.example[0]:
        read.example = (int(read.rows[~kept][0]), read.signal.name, _DROPOUT)
    return read.where(kept)


def layout_of(path: Path, form: Columns, is_part: bool = False) -> Layout:
    """Recognize the layout of a table with its open questions; raises ValueError if unreadable.

    With `is_part` the file holds only a part of the signals of a valve.
    """
    return recognized(open_raw(path, form), form, is_part)


class OpenTables:
    """The table of a recording, or several tables with the signals of one valve."""

    def __init__(self, paths: Sequence[Path], form: Columns) -> None:
        self.given = form
        """The format as given, before recognition."""
        layouts = [layout_of(path, form, len(paths) > 1) for path in paths]
        self._layouts = dict(zip(paths, layouts, strict=True))
        self.name = ", ".join(map(str, self._layouts))
        """All files, for messages."""
        self.layout = layouts[0] if len(layouts) == 1 else _joined(layouts)
        """Common layout with the signals of all tables."""

    def require_settled(self) -> None:
        """Raise ValueError, with all open questions in one line, if the files leave any."""
        if self.layout.questions:
            raise ValueError(self.asked(self.layout.questions))

    def asked(self, questions: Sequence[str]) -> str:
        """Return one line with the files and all questions."""
        layout = self.layout
        is_lone = len(self._layouts) == 1 and len(layout.headers) < 2
        if is_lone and layout.raw.is_text and not layout.times:
            (only, *_) = (*layout.headers, "")
            return (
                f"{self.name}: only one column, {quoted(only)}: specify the delimiter of the file "
                "(--delimiter)"
            )
        return f"{self.name}: cannot tell {'; '.join(questions)}"

    def doubts(self, reads: Sequence[ReadSignal]) -> list[str]:
        """Return questions after units of times and signals that the samples contradict."""
        found: dict[str, None] = {}
        for read in reads:
            layout = self._layouts[read.signal.path]
            form, stamps = layout.times[read.signal.time], read.stamps
            if form.is_assumed and stamps.size and 0 < np.ptp(stamps) < _SHORTEST:
                found[
                    f"the unit of the time {quoted(layout.headers[read.signal.time[0]])}, which "
                    f"rises by {np.ptp(stamps) / 1e9:g} in total (--time-unit s or --time-unit min)"
                ] = None
            if question := _unlikely_unit(read, self.given):
                found[question] = None
        return list(found)

    def clock_of(self, signal: TableSignal) -> str:
        """Return the header of the times of a signal."""
        return self._layouts[signal.path].headers[signal.time[0]]

    def read(self, signals: Sequence[TableSignal], stretch: Stretch) -> list[ReadSignal]:
        """Read signals within a stretch of each file; only these samples are kept in memory.

        Raises
        ------
        ValueError
            If a table cannot be read to its end, has too many rows, or has times that go back. The
            message gives row and remedy.
        RefusalError
            If the stretch contains no rows.
        """
        found: dict[TableSignal, ReadSignal] = {}
        for path, layout in self._layouts.items():
            if own := [signal for signal in signals if signal.path == path]:
                found.update(zip(own, _Reader(layout).read(own, stretch), strict=True))
        return [found[signal] for signal in signals]


def _joined(layouts: Sequence[Layout]) -> Layout:
    """Combine the files of one valve; ask which signal each contains if this is unclear."""
    first, *beside = layouts
    forms = [vars(each.form) for each in layouts]
    form = replace(first.form, **{name: one for each in forms for name, one in each.items() if one})
    names = [quoted(each.raw.path.name) for each in layouts]
    questions = [
        f"in {name} {question}"
        for name, each in zip(names, layouts, strict=True)
        for question in each.questions
    ]
    signals = [one for each in layouts for group in each.valves.values() for one in group]
    by_quantity = {
        quantity: [one for one in signals if one.quantity == quantity]
        for quantity in ("pressure", "force", "position")
    }
    drive = "pressure" if by_quantity["pressure"] or not by_quantity["force"] else "force"
    opposing = [one for one in by_quantity["pressure"] if one.name == form.opposing_pressure_column]
    unclear = {name: unit for each in layouts for name, unit in each.unclear.items()}
    chosen = []
    for quantity in (drive, "position"):
        several = [one for one in by_quantity[quantity] if one not in opposing]
        if len(several) == 1:
            chosen += several
            continue
        among = {one.name: one.unit for one in several} or unclear
        listed = " or ".join(map(quoted, [*among][:_MOST_NAMES]))
        unit = "" if any(among.values()) else f", and its unit (--{quantity}-unit)"
        questions.append(
            f"which of {', '.join(names)} is the {quantity} (--{quantity}-column {listed}){unit}"
        )
    questions += _zones_apart(layouts, names)
    return replace(
        first,
        form=form,
        valves={"": (*chosen, *opposing)} if len(chosen) == 2 else {},
        texts=tuple(text for each in layouts for text in each.texts),
        kinds={name: kind for each in layouts for name, kind in each.kinds.items()},
        questions=tuple(questions),
        beside=tuple(beside),
    )


def _zones_apart(layouts: Sequence[Layout], names: Sequence[str]) -> Iterator[str]:
    """Ask for the time zone of files without one if other files have one."""
    dated = [
        (name, form)
        for name, each in zip(names, layouts, strict=True)
        for form in [*each.times.values()][:1]
        if form.formats
    ]
    stated = [(name, form) for name, form in dated if form.has_zone or form.zone]
    others = [name for name, form in dated if not (form.has_zone or form.zone)]
    if stated and others:
        zone = stated[0][1].zone or "UTC"
        yield (
            f"the zone of the times of {', '.join(others)}; those of {stated[0][0]} have theirs "
            f"(--time-zone {zone})"
        )


def _shown(stamp: int, form: TimeForm) -> str:
    if not form.formats:
        return f"{stamp / 1e9:.12g} s"
    return str(np.datetime64(int(stamp), "ns")).rstrip("0").rstrip(".").replace("T", " ")


def _first(stamps: Any) -> int | None:
    firsts = [int(known[0]) for each in stamps if (known := each[each != NO_TIME]).size]
    return min(firsts) if firsts else None


def left_out(read: ReadSignal) -> str:
    """Describe the omitted entries of a signal; empty if there are none."""
    if not read.bad:
        return ""
    named = [
        f"{quoted(word)} {count}" if word else f"{count} others"
        for word, count in read.bad.most_common(_MOST_WORDS)
    ]
    more = ", …" if len(read.bad) > _MOST_WORDS else ""
    whole = read.bad.total() + read.values.size
    return (
        f"{read.bad.total()} of {whole} values of {quoted(read.signal.name)} are bad and were "
        f"left out ({', '.join(named)}{more})"
    )


def jumps_to_zero(read: ReadSignal) -> str:
    """Say where a signal is 0 for several samples, as a failed transmitter is; '' if nowhere.

    They are kept: a valve may have been shut, and slowly sampled signals jump, too.
    """
    runs = _dropouts(read.values)
    if not runs.size:
        return ""
    first, end = runs[0]
    more = f" (one of {len(runs)} such runs)" if len(runs) > 1 else ""
    return (
        f"{quoted(read.signal.name)} jumps to 0 for {end - first} samples from row "
        f"{read.rows[first]} on{more}: if its transmitter failed then, empty these cells"
    )


def fault_of(read: ReadSignal, form: Columns) -> str:
    """Return why a signal with more bad values than permitted is refused; empty if it is not."""
    count = read.bad.total() - read.bad["repeated row"]
    whole = count + read.values.size
    if count <= form.maximum_bad_share * whole:
        return ""
    share, most = count / whole, 100 * form.maximum_bad_share
    row, column, text = read.example
    if not read.values.size:
        return (
            f"{read.signal.path}: row {row}, column {column!r}: {quoted(text)} is not a valid "
            f"value, and neither is any other of the {whole} values of {read.signal.name!r}: name "
            "another column, or how its entries are written (--decimal, --time-format)"
        )
    return (
        f"{read.signal.path}: row {row}, column {column!r}: {quoted(text)} is not a valid value, "
        f"and {count} of {whole} values of {read.signal.name!r} are bad, more than {most:.3g} %: "
        "use a stretch of the record without them, or allow more (--maximum-bad-share "
        f"{math.ceil(share * 100 + 0.5) / 100:g})"
    )


_LARGEST_FRACTION, _LEAST_SPAN = 1.05, 0.05
"""A share with such values and such a span is rather a fraction than a percentage. Chosen."""


def _unlikely_unit(read: ReadSignal, given: Columns) -> str:
    """Return the question after a unit that the header seems to state wrongly, or ''.

    A unit in the `given` format is right.
    """
    unit, values, quantity = read.signal.unit, read.values, read.signal.quantity
    if getattr(given, f"{quantity}_unit") or not values.size:
        return ""
    low, high = float(values.min()), float(values.max())
    what = f"the unit of the {quantity} {quoted(read.signal.name)}, values from {low:g} to {high:g}"
    if unit == PERCENT and low > -_LEAST_SPAN and low + _LEAST_SPAN < high < _LARGEST_FRACTION:
        return f"{what} (--{quantity}-unit fraction or --{quantity}-unit percent)"
    size = PRESSURE_UNITS.get(unit)
    if size and max(abs(low), abs(high)) * size.multiplier / size.divisor < LEAST_PRESSURE:
        return (
            f"{what}, in {unit} too little to move an actuator (--{quantity}-unit, or --decimal if "
            "these are thousands)"
        )
    return ""


def read_columns(path: Path, names: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    """Read named columns of finite numbers from a CSV file of this package, shape (n,) each.

    This needs no library. Raises ValueError, in one line, if the file cannot be read or contains
    anything else.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            rows = csv.reader(stream)
            header = [name.strip() for name in next(rows, [])]
            if missing := [name for name in names if name not in header]:
                raise ValueError(f"no column {missing[0]!r} among {', '.join(header)[:200]}")
            places = [header.index(name) for name in names]
            read = []
            for number, row in enumerate(itertools.islice(rows, Columns.maximum_rows), start=2):
                if any(row):
                    read.append(_numbers(row, places, number))
    except (OSError, UnicodeError, ValueError, csv.Error) as error:
        raise ValueError(f"{path}: cannot be read: {cause_of(error)}") from None
    if not read:
        raise ValueError(f"{path}: no rows below the header")
    return dict(zip(names, np.array(read).T, strict=True))


def _numbers(row: Sequence[str], places: Sequence[int], number: int) -> list[float]:
    try:
        found = [float(row[place]) for place in places]
    except (ValueError, IndexError):
        found = [math.nan]
    if not all(map(math.isfinite, found)):
        raise ValueError(f"row {number} does not hold numbers: {quoted(','.join(row))}")
    return found
