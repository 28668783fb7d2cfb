# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recognition of the times, units, valves and qualities of a table before it is read.

Everything ambiguous becomes a question; all are asked at once, each with the option that answers
it.
"""

import re
import shlex
import zoneinfo
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from statistics import median, mode
from typing import Any

from valve_friction_ros.records.columns import KNOWN_UNITS, Columns
from valve_friction_ros.records.files import table_stem
from valve_friction_ros.records.header_words import (
    Named,
    named,
    number_and_unit,
    plain_name,
    told_good,
)
from valve_friction_ros.records.layout import (
    OWN,
    Layout,
    Look,
    SeenColumn,
    TableSignal,
    quoted,
)
from valve_friction_ros.records.table_rows import RawTable
from valve_friction_ros.records.written_times import (
    TimeForm,
    clock_of,
    date_forms,
    in_one,
    is_date,
    is_time_of_day,
)

_MOST_CHOICES, MOST_TAGS = 6, 10_000
_COARSE, _COARSE_IF_NAMED = 0.5, 60.0
"""Largest step of a time without a unit that is in seconds; the same of a column that is named in
the format. Others may be milliseconds. Chosen: a sample per minute shows no motion."""
_MILLISECONDS = re.compile(r"milli\w*|m ?sec|ms|sub ?sec\w*", re.IGNORECASE)
"""Headers of a column of milliseconds next to a time of day."""

_NANOSECONDS = re.compile(r"n(?:ano)?_?s(?:ec(?:ond)?s?)?$", re.IGNORECASE)
_SINCE_1970 = re.compile(r"1\d{9}")
"""Headers of nanoseconds next to seconds, and these seconds."""

_LONGEST_TRAVEL, LEAST_PRESSURE = 0.5, 2e3
"""Longest travel of a stem, m, and least pressure of a moving actuator, Pa: a percentage is not
below the former, a pressure in bar or kPa not above the latter.

A column that is named without a unit is in its SI unit, as in files of earlier versions."""

_UNCLEAR_ZONE = re.compile(
    r"\b(?:(?:UTC|GMT) ?[+\-−]\d{1,2}:?\d\d"
    r"|(?<=[([ ])(?:CES?T|MES?Z|[ECMP][SD]T|BST|IST|JST|AEST))\b"
)
"""Zones that are not names in the time zone database: offsets with minutes, abbreviations."""

_LOCAL = ("d", "microdays")
"""Units of clocks that count days: they are in local time, as in spreadsheets."""

_UNCLEAR = ("", "value", "command")
"""Named quantities of a column that may still be the pressure or the position."""

_MOST_SIGNALS = 50
"""Most different texts in the first rows of a column of tags. Chosen."""

_Candidate = tuple[str, Named, int]
"""Name, meaning and column of a possible signal."""


class _Recognition(Look):
    """Finds signals and times in the analysed table."""

    def __init__(self, raw: RawTable, form: Columns, is_part: bool = False) -> None:
        super().__init__(raw, form)
        self.is_part = is_part
        self.unclear: dict[str, str] = {}
        self.asked: set[str] = set()
        self.times: dict[tuple[int, ...], TimeForm] = {}
        self.good: dict[int, Callable[[str], bool]] = {}
        self.tag_place: int | None = None
        self.tags: dict[str, Named] = {}
        said = vars(form).items()
        self.given = {value for one, value in said if one.endswith("_column") and value}

    # Times

    def _time_places(self) -> list[tuple[int, ...]]:
        if self.form.time_column:
            column = self.by_name(self.form.time_column, "--time-column")
            return [(column.place,)] if column else []
        dated = self.of_kind("date")
        of_source = [column for column in dated if "source" in column.name.casefold()]
        dates: list[tuple[int, ...]] = [(column.place,) for column in of_source or dated]
        numeric = self._numeric_times()
        fine = [place for place in dates if not self._repeats(place[0])] or self._split_times()
        if fine or (dates and not numeric):
            return fine or dates
        if clocks := self.of_kind("clock") or ([] if numeric else self._written()):
            return [(clocks[0].place,)]
        if len(numeric) == 1 or (numeric and self._are_pairs(numeric)):
            return [(column.place,) for column in numeric]
        possible = [one for one in self.of_kind("number", "") if not one.said.unit]
        self._ask_name("time", [one.name for one in numeric or possible], has_unit=False)
        if not (numeric or dates):
            self.questions[-1] += "; if it has none, add a column of times"
        return []

    def _split_times(self) -> list[tuple[int, ...]]:
        """Return adjacent columns that together are a time: of days, times of day, milliseconds."""
        for day, clock in pairwise(self.columns):
            is_rest = all(one.isdigit() and len(one) <= len("999") for one in clock.filled)
            if day.kind == "date" and is_rest and _MILLISECONDS.fullmatch(clock.name):
                return [(day.place, clock.place)]
            if self._are_stamps(day, clock):
                return [(day.place, clock.place)]
            if (day.kind, clock.kind) == ("day", "clock"):
                beside = self.columns[clock.place + 1 : clock.place + 2]
                rest = (one.place for one in beside if _MILLISECONDS.fullmatch(one.name))
                return [(day.place, clock.place, *rest)]
        return []

    def _are_stamps(self, whole: SeenColumn, rest: SeenColumn) -> bool:
        """Return whether two columns are seconds since 1970 and nanoseconds, as of ROS stamps."""
        is_named = _NANOSECONDS.search(rest.name) is not None or not self.start
        is_since = is_named and all(map(_SINCE_1970.fullmatch, whole.filled))
        if not (is_since and rest.filled and all(map(str.isdigit, rest.filled))):
            return False
        return 1e6 < max(map(int, rest.filled)) < 1e9

    def _written(self) -> list[SeenColumn]:
        """Return the columns that may be times in an unknown format."""
        texts = [one for one in self.of_kind("text") if not self._repeats(one.place)]
        return [one for one in texts if re.search(r"\d\D+\d", one.filled[0])]

    def _repeats(self, place: int) -> bool:
        """Return whether times repeat more often than the signals of a long table explain."""
        cells = self.columns[place].filled
        texts = (len({*column.filled}) for column in self.of_kind("text"))
        return len(cells) > 1 and max(Counter(cells).values()) > max(texts, default=1)

    def _numeric_times(self) -> list[SeenColumn]:
        found = self.of_kind("number", "time")
        return found or [one for one in self.of_kind("number", "") if self._clock(one)]

    def _are_pairs(self, times: Sequence[SeenColumn]) -> bool:
        """Return whether each column of times is next to its own column of values."""
        return all(self.columns[one.place + 1 : one.place + 2] for one in times) and all(
            later.place - earlier.place > 1 for earlier, later in pairwise(times)
        )

    def _numbers(self, column: SeenColumn) -> list[float]:
        read = (number_and_unit(cell, self.decimal) for cell in column.filled)
        return [one[0] for one in read if one is not None]

    def _clock(self, column: SeenColumn) -> tuple[str, int] | None:
        numbers = self._numbers(column)
        if len(numbers) < 2:
            return None
        steps = [abs(b - a) for a, b in pairwise(numbers) if b != a]
        return clock_of(numbers[0], median(steps)) if steps else None

    def _time_form(self, places: tuple[int, ...]) -> TimeForm:
        form, column = self.form, self.columns[places[0]]
        zone = form.time_zone or self._stated_zone()
        if form.time_format:
            return TimeForm((form.time_format,), zone, has_zone="%z" in form.time_format)
        if len(places) > 1 and column.kind == "number":
            return TimeForm(unit="s")
        if len(places) > 1:
            parts = zip(*(self.columns[place].cells for place in places), strict=True)
            return self._dates([in_one(part) for part in parts if all(part)], zone)
        if column.kind in ("date", "text"):
            return self._dates(list(filter(is_date, column.filled)) or column.filled, zone)
        if column.kind == "clock":
            return self._clock_form(column)
        return self._numeric_form(column, zone)

    def _clock_form(self, column: SeenColumn) -> TimeForm:
        """Return the form of times of day; ask whether 14:05 begins with hours or minutes."""
        given = self.form.time_unit
        times = list(filter(is_time_of_day, column.filled))
        is_short = all(re.fullmatch(r"([01]?\d|2[0-3]):\d\d", one.strip()) for one in times)
        if is_short and not given:
            self.questions.append(
                f"whether {quoted(times[-1])} is in hours and minutes (--time-unit min) or in "
                "minutes and seconds (--time-unit s)"
            )
        return TimeForm(last="min" if is_short and given == "min" else "s")

    def _numeric_form(self, column: SeenColumn, zone: str) -> TimeForm:
        given = self.form.time_unit
        if clock := self._clock(column):
            unit, origin = clock
            if not given or given == unit:
                return TimeForm(unit=unit, origin=origin, zone=zone if unit in _LOCAL else "")
        if given or column.said.unit:
            return TimeForm(unit=given or column.said.unit, origin=self.origin)
        numbers = self._numbers(column)
        steps = [b - a for a, b in pairwise(numbers) if b != a]
        is_named = bool(self.form.time_column)
        if not steps or abs(median(steps)) <= (_COARSE_IF_NAMED if is_named else _COARSE):
            return TimeForm(unit="s", is_assumed=not is_named)
        self.questions.append(
            f"the unit of the time {quoted(column.name)}, which rises by {median(steps):g} "
            "(--time-unit s or --time-unit ms)"
        )
        return TimeForm(unit="s")

    def _dates(self, texts: Sequence[str], zone: str) -> TimeForm:
        orders, has_zone = date_forms(texts)
        if not orders:
            self.questions.append(
                f"the format of the dates, such as {quoted(texts[0])} (--time-format "
                "'%d.%m.%Y %H:%M:%S.%f')"
            )
            return TimeForm(("%Y",))
        if not (zone or has_zone):
            self._ask_zone()
        if len(orders) > 1:
            words = {"%d": "the day first", "%m": "the month", "%y": "the year"}
            told = [f"{words[one[0][:2]]} (--time-format {shlex.quote(one[0])})" for one in orders]
            self.questions.append(f"whether {quoted(texts[0])} has {' or '.join(told)}")
        return TimeForm(orders[0], zone, has_zone=has_zone)

    def _stated_zone(self) -> str:
        """Return the time zone named above the values, such as Europe/Berlin, or ''."""
        found = re.findall(r"\b[A-Z][A-Za-z]+/[A-Z][A-Za-z_]+\b", self.preamble)
        known: list[str] = [
            one for one in dict.fromkeys(found) if one in zoneinfo.available_timezones()
        ]
        offsets = re.findall(r"\b(?:UTC|GMT) ?([+\-−]\d{1,2})(?::?00)?(?![:\d])", self.preamble)
        # the Etc zones count westwards
        known += [f"Etc/GMT{-int(one.replace('−', '-')):+d}" for one in dict.fromkeys(offsets)]
        return known[0] if len(known) == 1 else ""

    def _ask_zone(self) -> None:
        if unclear := _UNCLEAR_ZONE.search(self.preamble):
            self.questions.append(
                f"the time zone that {quoted(unclear[0])} above the values means (--time-zone, "
                "such as Europe/Berlin)"
            )

    # Signals

    def _candidates(self, times: set[int]) -> list[_Candidate]:
        """Return all possible signals: names, meanings and columns."""
        if self.tag_place is not None:
            value = self._value_column(times)
            return [(tag, said, value) for tag, said in self.tags.items()] if value >= 0 else []
        return [
            (column.name, column.said, column.place)
            for column in self.columns
            if column.place not in times and self._may_be_signal(column)
        ]

    def _may_be_signal(self, column: SeenColumn) -> bool:
        """Return whether a column contains numbers or has the name of a signal."""
        if column.kind == "number" or column.name in self.given:
            return True
        return column.kind != "" and column.said.quantity in ("position", "pressure", "force")

    def _value_column(self, times: set[int]) -> int:
        if self.form.value_column:
            column = self.by_name(self.form.value_column, "--value-column")
            return column.place if column else -1
        numeric = self._values(times)
        exact = [one for one in numeric if one.name.casefold() == "value"]
        found = exact or [one for one in numeric if one.said.quantity == "value"] or numeric
        if len(found) == 1:
            return found[0].place
        self._ask_name("value", [one.name for one in found])
        return -1

    def _values(self, times: set[int]) -> list[SeenColumn]:
        numeric = [one for one in self.of_kind("number") if one.place not in times]
        return [one for one in numeric if one.said.quantity != "quality"]

    def _find_tags(self, times: set[int]) -> None:
        """Find the tags if each row has one value."""
        texts = [one for one in self.of_kind("text", "tag") if one.place not in times]
        if self.form.tag_column:
            column = self.by_name(self.form.tag_column, "--tag-column")
            texts = [column] if column else []
        elif not self.of_kind("number", "value") and len(self._values(times)) != 1:
            return
        if len(texts) > 1:
            self._ask_name("tag", [one.name for one in texts])
        if len(texts) != 1:
            return
        self.tag_place = texts[0].place
        unit = next((c for c in self.columns if c.said.quantity == "unit"), None)
        wanted = [self.tag_place] + ([unit.place] if unit else [])
        for tag, *of_unit in self._different(wanted):
            self.tags.setdefault(tag, named([tag], of_unit[0] if unit else ""))

    def _different(self, places: Sequence[int]) -> list[tuple[str, ...]]:
        """Return the distinct rows of some columns in the whole table, such as its tags."""
        found: dict[tuple[str, ...], None] = {}
        for _, block in self.raw.blocks(places, self.delimiter, self.start + 1, self.above):
            parts = block[list(places)].astype(str).drop_duplicates()
            for row in parts.itertuples(index=False):
                cells = tuple(str(cell).strip() for cell in row)
                if cells[0]:
                    found.setdefault(cells)
            if len(found) > MOST_TAGS:
                raise ValueError(
                    f"{self.raw.path}: more than {MOST_TAGS} tags: give the --tag-column"
                )
        return list(found)

    def _ask_name(self, quantity: str, among: Sequence[str], has_unit: bool = True) -> None:
        listed = " or ".join(shlex.quote(name) for name in among[:_MOST_CHOICES])
        more = " …" if len(among) > _MOST_CHOICES else ""
        listed = f" {listed}{more}" if among else ""
        is_tag = self.tag_place is not None and quantity not in ("tag", "value")
        what = "tag" if is_tag else "column"
        what = f"which {what} is the {quantity}" + ("" if among else f", of {self.names}")
        unit = "" if has_unit else f", and its unit (--{quantity}-unit)"
        if not among and quantity in ("pressure", "force", "position"):
            unit = "; if another file holds it, give both files (identify-folder: with --plant)"
        self.questions.append(f"{what} (--{quantity}-column{listed}){unit}")
        self.asked.add(quantity)

    def _signal(self, quantity: str, name: str, said: Named, place: int) -> TableSignal:
        unit = self._unit(quantity, name, said, place)
        before = [key for key in self.times if key[0] < place]
        time = max(before, key=lambda key: key[0], default=next(iter(self.times), (0,)))
        quality = self._quality(place, said, time)
        return TableSignal(quantity, name, unit, place, time, quality, self.raw.path)

    def _unit(self, quantity: str, name: str, said: Named, place: int) -> str:
        given = getattr(self.form, f"{quantity}_unit")
        stated = self.unit_row.get(name, "") if self.tag_place is None else ""
        if given:
            if stated in KNOWN_UNITS[quantity] and stated != given:
                self.questions.append(
                    f"the row under the headers says that {name!r} is in {stated}, and {given} was "
                    f"named: name it by {quantity}_unit (--{quantity}-unit {stated})"
                )
            return str(given)
        for unit in (said.unit, self._unit_in_cells(place)):
            if unit in KNOWN_UNITS[quantity]:
                return unit
        numbers = self._of_signal(name, place)
        if name in self.given and _may_be_si(quantity, numbers):
            return {"position": "m", "pressure": "Pa", "force": "N"}[quantity]
        span = f", values from {min(numbers):g} to {max(numbers):g}" if numbers else ""
        known = " ".join(KNOWN_UNITS[quantity])
        if quantity == "pressure" and not self.form.pressure_range:
            known += "; the last three with --pressure-range, unless the valve file has the range"
        self.questions.append(
            f"the unit of the {quantity} {quoted(name)}{span} (--{quantity}-unit, one of {known})"
        )
        return ""

    def _of_signal(self, name: str, place: int) -> list[float]:
        column = self.columns[place]
        if self.tag_place is None:
            return self._numbers(column)
        tags = self.columns[self.tag_place].cells
        own = [cell for tag, cell in zip(tags, column.cells, strict=True) if tag == name and cell]
        return self._numbers(SeenColumn(place, name, column.said, own))

    def _unit_in_cells(self, place: int) -> str:
        cells = self.columns[place].filled
        units = [read[1] for cell in cells if (read := number_and_unit(cell, self.decimal))]
        return mode(units) if units else ""

    def _quality(self, place: int, said: Named, time: tuple[int, ...]) -> int | None:
        """Return the quality column of a signal, by position or by name, or None."""
        found = [one for one in self.columns if one.said.quantity == "quality" and one.filled]
        found = [one for one in found if one.place not in time]
        alike = [c for c in found if said.label and c.said.label == said.label]
        of_opc = [c for c in found if "opc" in c.name.casefold() and self.tag_place is not None]
        beside = [c for c in found if c.place == place + 1] or of_opc
        beside = beside or (alike if len(found) > 1 else found)
        if not beside:
            return None
        column = beside[0]
        if column.place not in self.good:
            self.good[column.place] = self._goodness(column)
        return column.place

    def _goodness(self, column: SeenColumn) -> Callable[[str], bool]:
        cells = column.filled
        tell = told_good(column.name, cells, self.decimal, self.form.good_quality)
        if tell is None:
            said = ", ".join(map(quoted, [*dict.fromkeys(cells)][:_MOST_CHOICES]))
            self.questions.append(
                f"which of {quoted(column.name)} are good: {said} (--good-quality, with commas)"
            )
        return tell or (lambda _: True)

    def signals(self) -> dict[str, tuple[TableSignal, ...]]:
        """Return the signals of each valve; open points become questions."""
        if self.start == len(self.rows):
            where = "under the header" if len(self.columns) > 1 else f"in {len(self.rows)} rows"
            if len(sheets := self.raw.sheets) > 1:
                where = f"in its first sheet (--sheet {' or '.join(map(shlex.quote, sheets[1:]))})"
            self.questions.append(f"what it holds: there are no values {where}")
            return {}
        places = self._time_places()
        taken = {place for group in places for place in group}
        self.times = {group: self._time_form(group) for group in places}
        self._find_tags(taken)
        candidates = self._candidates(taken)
        if self.is_part:
            return {"": tuple(self._of_part(candidates))}
        chosen = {
            quantity: self._chosen(quantity, candidates)
            for quantity in ("position", "pressure", "force")
        }
        if chosen["pressure"]:
            chosen["force"] = []
        drive = "pressure" if chosen["pressure"] or not chosen["force"] else "force"
        drives, positions = chosen[drive], chosen["position"]
        pairs = self._pairs(drives, positions)
        if not pairs:
            self._ask_signals(drive, drives, positions, candidates)
            return {}
        return {
            _as_written(label, one[0]) if len(pairs) > 1 else "": (
                self._signal(drive, *one),
                self._signal("position", *other),
                *self._opposing(),
            )
            for label, (one, other) in pairs.items()
        }

    def _of_part(self, candidates: Sequence[_Candidate]) -> Iterator[TableSignal]:
        """Yield the signals in a partial file; its name stands in for an uninformative header."""
        own = table_stem(self.raw.path)
        of_name = named([own])
        own = next((one for one in self.given if plain_name(one) in plain_name(own)), own)
        by_name = []
        vague = [one for one in candidates if one[1].quantity in ("", "value")]
        if any(one[1].quantity in ("pressure", "force", "position") for one in candidates):
            of_name, vague = named([""]), []
        moving = [one for one in vague if len({*self._of_signal(one[0], one[2])}) > 1]
        if len(vague) > 1 and len(moving) == 1:
            candidates = [one for one in candidates if one not in vague or one in moving]
        for name, said, place in candidates:
            if said.quantity in ("", "value") and name not in self.given:
                said = of_name._replace(unit=said.unit or of_name.unit)  # noqa: PLW2901
                name = name if self.tag_place is not None else own  # noqa: PLW2901
            by_name.append((name, said, place))
        for quantity in ("pressure", "force", "position"):
            for each in self._chosen(quantity, by_name):
                yield self._signal(quantity, *each)
        self.unclear = {name: said.unit for name, said, _ in by_name if said.quantity in _UNCLEAR}

    def _opposing(self) -> Iterator[TableSignal]:
        name = self.form.opposing_pressure_column
        if not name:
            return
        found = [each for each in self._candidates(set()) if each[0] == name]
        if found:
            yield self._signal("pressure", *found[0])
        else:
            self.by_name(name, "--opposing-pressure-column")

    def _chosen(self, quantity: str, candidates: Sequence[_Candidate]) -> list[_Candidate]:
        name = getattr(self.form, f"{quantity}_column")
        if name:
            found = [each for each in candidates if each[0] == name]
            is_needed = quantity != "force" or self.form.pressure_column == ""
            if len(found) != 1 and is_needed and not self.is_part:
                self.lacking[f"--{quantity}-column"] = name
            return found if len(found) == 1 else []
        other = "" if self.is_part else self.form.opposing_pressure_column
        found = [each for each in candidates if each[1].quantity == quantity and each[0] != other]
        own = [each for each in found if each[0] == OWN[quantity]]
        return own or found

    def ask_lacking(self) -> None:
        """Ask for all columns and tags that the valve file or an option names, and that lack."""
        if not self.lacking:
            return
        told = ", ".join(f"{name!r} ({option})" for option, name in self.lacking.items())
        more = ", …" if len(self.columns) > _MOST_CHOICES else ""
        tags = f"; tags: {', '.join([*self.tags][:_MOST_CHOICES])}" if self.tags else ""
        self.questions.insert(
            0,
            f"which column is {told}, as the valve file or an option names it; columns: "
            f"{self.names}{more}{tags}",
        )

    def _pairs(
        self, drives: Sequence[_Candidate], positions: Sequence[_Candidate]
    ) -> dict[str, tuple[_Candidate, _Candidate]]:
        """Return drive and position of each valve by label."""
        if len(drives) == 1 and len(positions) == 1:
            return {"": (drives[0], positions[0])}
        pairs = {}
        for label in dict.fromkeys(said.label for _, said, _ in drives):
            own = _clearest([one for one in drives if one[1].label == label])
            stems = _clearest([one for one in positions if one[1].label == label])
            if label and len(own) == 1 and len(stems) == 1:
                pairs[label] = (own[0], stems[0])
        own, stems = _clearest(drives), _clearest(positions)
        if not pairs and len(own) == 1 and len(stems) == 1:
            pairs[""] = (own[0], stems[0])
        return pairs

    def _ask_signals(
        self,
        drive: str,
        drives: Sequence[_Candidate],
        positions: Sequence[_Candidate],
        candidates: Sequence[_Candidate],
    ) -> None:
        texts = [
            one.name
            for one in self.of_kind("text")
            if 1 < len({*one.filled}) <= _MOST_SIGNALS
            and one.said.quantity not in ("unit", "quality")
        ]
        if texts and not (drives or positions) and self.tag_place is None:
            self._ask_name("tag", texts)
            values = self._values({place for group in self.times for place in group})
            if len(values) > 1:
                self._ask_name("value", [one.name for one in values])
        if self.asked & {"tag", "value"}:
            return
        for quantity, found in ((drive, drives), ("position", positions)):
            if len(found) == 1:
                self._unit(quantity, *found[0])
            elif quantity not in self.asked and f"--{quantity}-column" not in self.lacking:
                unclear = [each for each in candidates if each[1].quantity in _UNCLEAR]
                free = [each for each in unclear if each[1].quantity != "command"]
                among = found or free or unclear
                has_unit = not among or any(said.unit for _, said, _ in among)
                self._ask_name(quantity, [name for name, _, _ in among], has_unit)


def _may_be_si(quantity: str, numbers: Sequence[float]) -> bool:
    """Return whether numbers without a unit may be stem travel in m or actuator pressure in Pa."""
    largest = max(map(abs, numbers), default=0.0)
    if quantity == "position":
        return largest < _LONGEST_TRAVEL
    return quantity != "pressure" or largest > LEAST_PRESSURE


def _as_written(label: str, name: str) -> str:
    """Return a label as it is spelt in a name, such as FV-101."""
    pattern = r"[\W_]*".join(map(re.escape, label.split()))
    found = re.search(pattern, name, re.IGNORECASE)
    return found[0] if found else label


def _clearest(candidates: Sequence[_Candidate]) -> Sequence[_Candidate]:
    """Return a single candidate; of several, those that refer directly to actuator or stem."""
    return candidates if len(candidates) == 1 else [one for one in candidates if one[1].is_strong]


def recognized(raw: RawTable, form: Columns, is_part: bool = False) -> Layout:
    """Recognize the layout of a table and its open questions, given its known format.

    If the file has only a part of the signals of a valve (`is_part`), all signals in it are taken.
    """
    look = _Recognition(raw, form, is_part)
    valves = look.signals()
    look.ask_lacking()
    first = next(iter(look.times), ())
    time = look.times.get(first, TimeForm())
    signals = next(iter(valves.values()), ())
    found: dict[str, Any] = {
        "delimiter": look.delimiter,
        "decimal": look.decimal if raw.is_text else "",
        "encoding": form.encoding or (raw.encoding if raw.encoding == "cp1252" else ""),
        "time_zone": form.time_zone or time.zone,
    }
    if len(first) == 1 and len(look.times) == 1:
        found["time_column"] = look.columns[first[0]].name
        found["time_unit"] = time.unit if not time.origin else ""
    if len(valves) == 1:
        for signal in signals[:2]:
            found[f"{signal.quantity}_column"] = signal.name
            found[f"{signal.quantity}_unit"] = signal.unit
    if look.tag_place is not None:
        found["tag_column"] = look.columns[look.tag_place].name
        found["value_column"] = look.columns[signals[0].place].name if signals else ""
    taken = {place for places in look.times for place in places}
    texts = [cell for _, row in look.rows[: look.start] for cell in row if cell]
    return Layout(
        raw,
        replace(form, **{name: value for name, value in found.items() if value}),
        tuple(column.name for column in look.columns),
        look.start + 1,
        look.above,
        valves,
        look.times,
        look.tag_place,
        look.good,
        look.decimal,
        (*texts, *look.tags),
        {
            column.name: "time" if column.place in taken else column.said.quantity or column.kind
            for column in look.columns
        },
        tuple(dict.fromkeys(look.questions)),
        look.unclear,
    )
