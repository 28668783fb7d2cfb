# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Identifications and baselines of the history as rows of its tables, and back."""

import json
import math
import re
import time
import uuid
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import sqlalchemy as sa
from sqlalchemy.engine import Connection, RowMapping

from valve_friction_ros.evidence.estimate import FrictionChange
from valve_friction_ros.evidence.moves import Move
from valve_friction_ros.health.baseline import Baseline, SlidingFriction
from valve_friction_ros.health.comparison import Ratio
from valve_friction_ros.health.diagnosis import (
    Diagnosis,
    FrictionLimits,
    FrictionState,
    StandingAlarm,
    friction_state,
)
from valve_friction_ros.health.levels import Level, StatusSignal
from valve_friction_ros.health.measured import DIFFERENCES, RATIOS, DatedNumber, Measured
from valve_friction_ros.health.valve_diagnosis import KnownNumbers
from valve_friction_ros.history import tables
from valve_friction_ros.history.entry import (
    AlarmRecording,
    Fit,
    HistoryEntry,
    KeptBaseline,
    KeptValve,
    Span,
    friction_point,
)
from valve_friction_ros.history.tables import joined, put
from valve_friction_ros.identification.rendering import plain
from valve_friction_ros.identification.settings import PARAMETER_UNITS, current_name
from valve_friction_ros.identification.trust.uncertainty import SPEED_EXPONENT
from valve_friction_ros.identification.trust.verdict import Parameter, Verdict
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams import DAY
from valve_friction_ros.usage import Usage
from valve_friction_ros.wording import Code, Statement, quoted, said, sentence

_SAMPLE = np.dtype("<f4")

_OF_BASELINE = (
    "coulomb_friction",
    "half_width",
    "sliding_friction",
    "sliding_half_width",
    "sliding_speed",
)
_OF_ENTRY = (
    "baseline",
    "baseline_half_width",
    "baseline_sliding_friction",
    "baseline_sliding_half_width",
    "baseline_sliding_speed",
)
_OF_REPLACED = tuple(f"replaced_{name}" for name in _OF_BASELINE)
"""Columns of a baseline: in its own table, in that of identifications, and as a replaced one."""

_NUMBERS = {"baseline": tables.baseline_number, "identification": tables.identification_number}


T = TypeVar("T")

# Fields of a value are columns of the same name; some columns have another name or do not exist.

_COLUMNS: dict[type, dict[str, str | None]] = {
    AlarmRecording: {"time": "time_ns"},
    Move: {"begin": "begin_ns", "end": "end_ns"},
    FrictionChange: {"earliest": "earliest_ns", "latest": "latest_ns"},
    SlidingFriction: {"value": "sliding_friction"},
    Usage: {"histogram": "histogram_ns"},
    Parameter: {"withheld": None, "uncalibrated": None},
    Ratio: {"value": "ratio", "half_width": None, "low": "ratio_low", "high": "ratio_high",
            "of": "ratio_of", "speed": "ratio_speed"},
    FrictionLimits: {"survey": None},
}  # fmt: skip
_WRITERS: dict[Any, Callable[[Any], Any]] = {
    Level: int,
    Path: str,
    Verdict: lambda one: one.value,
    tuple[int, ...]: json.dumps,
}
_READERS: dict[Any, Callable[[Any], Any]] = {
    float: lambda one: float(_number(one)),
    tuple[int, ...]: lambda one: tuple(json.loads(one)),
}


@cache
def _stored(kind: Any) -> tuple[tuple[str, str, Any], ...]:
    """Return name, column and type of each stored field of a type."""
    columns = {one.name: one.name for one in fields(kind)} | _COLUMNS.get(kind, {})
    return tuple((one.name, to, one.type) for one in fields(kind) if (to := columns[one.name]))


def columns_of(one: Any, kind: Any = None) -> dict[str, Any]:
    """Return the columns of a value; if it is None, the columns of its `kind`, all None."""
    return {
        column: None if one is None else _WRITERS.get(of, lambda value: value)(getattr(one, name))
        for name, column, of in _stored(kind or one.__class__)
    }


def value_of(kind: Callable[..., T], row: RowMapping, **more: Any) -> T:
    """Return the value of a type from a row, with `more` of its fields."""
    found = {name: _READERS.get(of, of)(row[column]) for name, column, of in _stored(kind)}
    return kind(**found | more)


def valve_id(connection: Connection, valve: KeptValve) -> int:
    """Return the row of a valve, added if it is new, with its tag updated."""
    row = connection.execute(_VALVE, {"named": valve.name}).first()
    if row is None or row.tag != valve.tag:
        put(connection, tables.valve, [{"name": valve.name, "tag": valve.tag}])
        row = connection.execute(_VALVE, {"named": valve.name}).one()
    return int(row.id)


_VALVE = sa.select(tables.valve).where(tables.valve.c.name == sa.bindparam("named"))
_SETTINGS = sa.select(tables.settings.c.id).where(tables.settings.c.content == sa.bindparam("text"))


def settings_id(connection: Connection, text: str) -> int:
    """Return the row of settings, added if they are new."""
    if (row := connection.scalar(_SETTINGS, {"text": text})) is None:
        put(connection, tables.settings, [{"content": text}], is_kept=True)
        row = connection.execute(_SETTINGS, {"text": text}).scalar_one()
    return int(row)


def oldest_kept(newest: int, days: float) -> int:
    """Return the time, ns, before which rows are more than `days` older than the newest row.

    If the newest row is ahead of the clock of this machine, the clock is used instead.
    """
    return min(newest, time.time_ns()) - round(days * DAY)


def _insert(connection: Connection, table: sa.Table, **values: object) -> int:
    done: Any = connection.execute(sa.insert(table), values)
    return int(done.inserted_primary_key[0])


def insert_entry(connection: Connection, valve: int, entry: HistoryEntry) -> None:
    """Add an identification to a valve. SQLite stores nan as NULL."""
    diagnosis = entry.diagnosis
    begin, end = entry.span or (None, None)
    row = _insert(
        connection,
        tables.identification,
        uid=uuid.uuid4().hex,
        valve_id=valve,
        time_ns=entry.time,
        begin_ns=begin,
        end_ns=end,
        method=entry.method,
        refusal=entry.refusal or None,
        fit=entry.fit.share,
        rms=entry.fit.rms,
        systematic_misfit=entry.fit.systematic,
        warnings="\n".join(entry.warnings),
        level=int(diagnosis.level),
        status_signal=diagnosis.status_signal.value,
        message=diagnosis.message,
        **columns_of(diagnosis.ratio, Ratio),
        sliding_speed=entry.sliding_speed,
        **_baseline_columns(entry.baseline, _OF_ENTRY),
        **columns_of(entry.limits),
        **state_columns(diagnosis),
        settings_id=settings_id(connection, entry.settings),
        software_version=entry.version,
    )
    parameters = [
        {
            "identification_id": row,
            "uncalibrated_half_width": one.uncalibrated and one.uncalibrated.half_width,
            **columns_of(one),
        }
        for one in entry.parameters.values()
    ]
    put(connection, tables.parameter, parameters)
    _insert_numbers(connection, "identification", row, entry.numbers)


def insert_baseline(connection: Connection, valve: int, kept: KeptBaseline) -> None:
    """Add a baseline to a valve."""
    row = _insert(
        connection,
        tables.baseline,
        uid=uuid.uuid4().hex,
        valve_id=valve,
        time_ns=kept.time,
        since_ns=kept.since,
        **_baseline_columns(kept.baseline, _OF_BASELINE),
        **_baseline_columns(kept.replaced, _OF_REPLACED),
        set_by=kept.by,
        level=kept.level,
        withdrawn=kept.withdrawn,
    )
    _insert_numbers(connection, "baseline", row, kept.baseline.numbers)
    if kept.record is not None:
        _insert(
            connection,
            tables.baseline_record,
            baseline_id=row,
            sample_period=kept.record.sample_period,
            driven_by=kept.record.driven_by.name,
            drive=kept.record.drive.astype(_SAMPLE).tobytes(),
            position=kept.record.position.astype(_SAMPLE).tobytes(),
        )


def _insert_numbers(
    connection: Connection, owner: str, row: int, numbers: Mapping[str, Measured]
) -> None:
    rows = [
        {f"{owner}_id": row, "name": name, "value": one.value, "half_width": one.half_width}
        for name, one in numbers.items()
    ]
    put(connection, _NUMBERS[owner], rows)


def _baseline_columns(baseline: Baseline | None, names: Sequence[str]) -> dict[str, float | None]:
    if baseline is None:
        return dict.fromkeys(names)
    slid = baseline.sliding
    sliding = (None,) * 3 if slid is None else (slid.value, slid.half_width, slid.speed)
    values = (baseline.coulomb_friction, baseline.half_width, *sliding)
    return dict(zip(names, values, strict=True))


def _baseline_in(row: RowMapping, names: Sequence[str]) -> Baseline | None:
    friction, width, *sliding = (row[name] for name in names)
    if friction is None and sliding[0] is None:
        return None
    return Baseline(friction, width, None if sliding[0] is None else SlidingFriction(*sliding))


def kept_baseline_in(row: RowMapping) -> KeptBaseline:
    """Return the baseline in a row of its table, without its record."""
    baseline, level = _baseline_in(row, _OF_BASELINE), row["level"]
    if baseline is None:
        raise ValueError("a baseline without a friction")
    return KeptBaseline(
        baseline,
        row["time_ns"],
        row["since_ns"],
        replaced=_baseline_in(row, _OF_REPLACED),
        by=row["set_by"] or "set_baseline",
        level=None if level is None else Level(level),
        withdrawn=bool(row["withdrawn"]),
    )


def record_in(connection: Connection, baseline: int) -> Recording | None:
    """Return the record of the baseline of this row, if any."""
    table = tables.baseline_record
    found = connection.execute(sa.select(table).where(table.c.baseline_id == baseline))
    row = found.mappings().first()
    if row is None:
        return None
    drive, position = (
        np.frombuffer(row[name], dtype=_SAMPLE).astype(float) for name in ("drive", "position")
    )
    return Recording(row["sample_period"], drive, position, driven_by=Drive[row["driven_by"]])


def numbers_in(
    connection: Connection, owner: str, valve: str, ids: Sequence[int], *names: str
) -> dict[int, dict[str, Measured]]:
    """Return the numbers of a valve's rows of the table `owner`, from the lowest to the highest id.

    With `names`, only the numbers of these names are read.
    """
    table, owners = _NUMBERS[owner], tables.METADATA.tables[owner]
    span = owners.c.id.between(min(ids, default=0), max(ids, default=0))
    of_valve = sa.select(table).select_from(joined(table, owners, tables.valve))
    query = of_valve.where(tables.valve.c.name == valve, span)
    if names:
        query = query.where(table.c.name.in_(names))
    found: defaultdict[int, dict[str, Measured]] = defaultdict(dict)
    for row, name, value, width in connection.execute(query):
        found[row][name] = Measured(value, width)
    return found


_FARTHEST = {"lowest_position": ("lower_stop", False), "highest_position": ("upper_stop", True)}
"""Ends of the stem motion: the adjacent stop, and whether the farthest value is the largest."""


def known_numbers_in(connection: Connection, name: str, valve: Valve, since: int) -> KnownNumbers:
    """Return the numbers of a valve from its identifications since a time, ns (`KnownNumbers`).

    Identifications with other parameters of the valve are ignored.
    """
    same = json.dumps(plain(vars(valve)), sort_keys=True)
    settings = [
        row
        for row, content in connection.execute(sa.select(tables.settings))
        if json.dumps(json.loads(content).get("valve"), sort_keys=True) == same
    ]
    entry, number = tables.identification.c, tables.identification_number.c
    of_valve = (
        sa.select(entry.time_ns, number.value, number.half_width)
        .select_from(joined(tables.identification, tables.identification_number, tables.valve))
        .where(tables.valve.c.name == name, entry.settings_id.in_(settings))
    )
    newest = (entry.time_ns.desc(), entry.id.desc())

    def first(named: str, since: int, *order: Any) -> tuple[int, str, Measured] | None:
        chosen = of_valve.where(number.name == named, entry.time_ns >= since)
        row = connection.execute(chosen.order_by(*order, *newest).limit(1)).first()
        return None if row is None else (row[0], named, Measured(*row[1:]))

    found = [first(one, since) for one in (*RATIOS, *DIFFERENCES)]
    times = {one[1]: one[0] for one in found if one is not None}
    for end, (stop, is_largest) in _FARTHEST.items():
        order = number.value.desc() if is_largest else number.value
        found.append(first(end, times.get(stop, since), order))
    records: defaultdict[int, dict[str, Measured]] = defaultdict(dict)
    for stamp, one, measured in filter(None, found):
        records[stamp][one] = measured
    known = KnownNumbers()
    for stamp in sorted(records):
        known = known.followed_by(records[stamp], stamp)
    return known


def _number(value: float | None) -> float:
    return math.nan if value is None else value  # SQLite stores nan as NULL


_PLACES = {name: place for place, name in enumerate(PARAMETER_UNITS)}
"""Positions of the parameters in a result; any other parameter follows them."""


def _parameter(row: RowMapping) -> Parameter:
    shown = value_of(Parameter, row)
    if (width := row["uncalibrated_half_width"]) is None:
        return shown
    return replace(shown, uncalibrated=replace(shown, standard_error=math.nan, half_width=width))


def ratio_in(row: RowMapping) -> Ratio | None:
    """Return the ratio in the row of an identification."""
    if row["ratio"] is None:
        return None
    low, high = (_number(row[f"ratio_{end}"]) for end in ("low", "high"))
    of, speed = row["ratio_of"] or "coulomb_friction", _number(row["ratio_speed"])
    return Ratio.between(row["ratio"], low, high, of=of, speed=speed)


def _entry(
    row: RowMapping, parameters: Sequence[Parameter], numbers: Mapping[str, Measured]
) -> HistoryEntry:
    ratio = ratio_in(row)
    limits = value_of(FrictionLimits, row)
    return HistoryEntry(
        time=row["time_ns"],
        valve=KeptValve(row["valve_name"], row["tag"]),
        span=None if row["begin_ns"] is None else Span(row["begin_ns"], row["end_ns"]),
        method=current_name(row["method"]),
        diagnosis=_diagnosis_in(row, ratio, limits, any(one.value < 0 for one in parameters)),
        limits=limits,
        baseline=_baseline_in(row, _OF_ENTRY),
        sliding_speed=_number(row["sliding_speed"]),
        settings=row["content"],
        parameters={one.name: one for one in parameters},
        fit=Fit(*(_number(row[name]) for name in ("fit", "rms", "systematic_misfit"))),
        warnings=tuple(filter(None, row["warnings"].split("\n"))),
        refusal=row["refusal"] or "",
        version=row["software_version"],
        numbers=numbers,
    )


def points_in(
    connection: Connection, valve: str, rows: Sequence[RowMapping], baseline: Baseline | None
) -> Iterator[DatedNumber | None]:
    """Yield `friction_point` of each identification, from the rows of a valve's parameters."""
    ids = [row["identification_id"] for row in rows]
    numbers = numbers_in(connection, "identification", valve, ids, SPEED_EXPONENT)
    for key, some in groupby(rows, key=lambda row: row["identification_id"]):
        first, *others = some
        parameters = {row["name"]: _parameter(row) for row in (first, *others)}
        speed, own = _number(first["sliding_speed"]), numbers.get(key, {})
        yield friction_point(first["time_ns"], parameters, speed, baseline, own)


def entries_in(
    connection: Connection, valves: Sequence[str] | None, since: int, until: int
) -> tuple[HistoryEntry, ...]:
    """Read identifications, oldest first; see `History.entries`."""
    if valves is None:
        valves = sorted(connection.scalars(sa.select(tables.valve.c.name)))
    found = [
        entry for valve in valves for entry in _entries_of_valve(connection, valve, since, until)
    ]
    return tuple(sorted(found, key=lambda entry: entry.time))


def _entries_of_valve(
    connection: Connection, valve: str, since: int, until: int
) -> Iterator[HistoryEntry]:
    time = tables.identification.c.time_ns
    chosen = (tables.valve.c.name == valve, time >= since, time < until)
    parameters: defaultdict[int, list[Parameter]] = defaultdict(list)
    of_entries = joined(tables.parameter, tables.identification, tables.valve)
    query = sa.select(tables.parameter).select_from(of_entries).where(*chosen)
    for row in connection.execute(query).mappings():
        parameters[row["identification_id"]].append(_parameter(row))
    entries = (
        sa.select(
            tables.identification,
            tables.valve.c.name.label("valve_name"),
            tables.valve.c.tag,
            tables.settings.c.content,
        )
        .select_from(joined(tables.identification, tables.valve, tables.settings))
        .where(*chosen)
        .order_by(time, tables.identification.c.id)
    )
    rows = connection.execute(entries).mappings().all()
    numbers = numbers_in(connection, "identification", valve, [row["id"] for row in rows])
    for row in rows:
        ordered = sorted(parameters[row["id"]], key=lambda one: _PLACES.get(one.name, len(_PLACES)))
        yield _entry(row, ordered, numbers.get(row["id"], {}))


# The diagnosis: its state, and a standing alarm


def state_columns(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the columns of the state of a diagnosis; None where there is no entry."""
    doubt, alarm, latest = diagnosis.own.doubt, diagnosis.alarm, diagnosis.latest
    columns: dict[str, Any] = {
        "state": diagnosis.state.name,
        "doubt": "" if doubt is None else sentence(doubt),
    }
    statements = {"message": diagnosis.statement.to_dict()}
    if doubt is not None:
        statements["doubt"] = doubt.to_dict()
    for name, one in (("alarm", alarm), ("latest", latest)):
        columns |= {
            f"{name}_level": None if one is None else int(one.level),
            f"{name}_status_signal": None if one is None else one.status_signal.value,
            f"{name}_state": None if one is None else one.state.name,
            f"{name}_message": None if one is None else sentence(one.statement),
        }
        if one is not None:
            statements[f"{name}_message"] = one.statement.to_dict()
    columns["statements"] = json.dumps(statements, allow_nan=False)
    return columns | {"alarm_time_ns": None if alarm is None else alarm.time}


def _diagnosis_in(
    row: RowMapping, ratio: Ratio | None, limits: FrictionLimits, is_below_zero: bool
) -> Diagnosis:
    """Return the diagnosis in a row of any version."""
    level, signal = Level(row["level"]), StatusSignal(row["status_signal"])
    if row["state"] is None:
        return _of_former_version(
            level, signal, row["message"], ratio, row["time_ns"], limits, is_below_zero
        )
    kept = json.loads(row["statements"] or "{}")
    statement = _statement(row, kept, "message")
    state = _state(row["state"])
    doubt = _statement(row, kept, "doubt") if row["doubt"] else None
    if row["alarm_state"] is None:
        return Diagnosis(level, signal, statement, ratio, state, doubt)
    raised, its_latest = (_statement(row, kept, f"{one}_message") for one in ("alarm", "latest"))
    alarm = StandingAlarm(*_stated(row, "alarm"), raised, row["alarm_time_ns"])
    of_latest, its_signal, its_state = _stated(row, "latest")
    latest = Diagnosis(of_latest, its_signal, its_latest, ratio, its_state, doubt)
    return Diagnosis(level, signal, statement, ratio, state, alarm=alarm, latest=latest)


def _statement(row: RowMapping, kept: Mapping[str, Any], column: str) -> Statement:
    """Return a statement of a row; a row of version 8 holds only its sentence."""
    return Statement.from_dict(kept[column]) if column in kept else _quoted(row[column])


def _stated(row: RowMapping, what: str) -> tuple[Level, StatusSignal, FrictionState]:
    signal = StatusSignal(row[f"{what}_status_signal"])
    return Level(row[f"{what}_level"]), signal, _state(row[f"{what}_state"])


_FORMER_STATES = {"PERHAPS_GROWN": FrictionState.UNCLEAR, "PERHAPS_FALLEN": FrictionState.UNCLEAR}
"""States of a friction in versions 8 and earlier, and their present states."""


def _state(name: str) -> FrictionState:
    try:
        return _FORMER_STATES.get(name) or FrictionState[name]
    except KeyError:
        raise ValueError(f"{name!r} is not a friction state") from None


# Rows before version 9 hold statements only as sentences. Rows before version 8 also hold the state
# of the friction and a standing alarm only as sentences. No other code reads a sentence.

_DOUBT = "the Karnopp model does not describe this valve"
_LINK = "; the latest record cannot be compared: "
_SCALED = re.compile(
    "friction and spring constant have changed by one factor, which points to (.*?): check them "
    "before any work on the packing; (.*)",
    re.DOTALL,
)
_BY_SIGNAL = {
    StatusSignal.FAILURE: FrictionState.EXCESS,
    StatusSignal.OUT_OF_SPECIFICATION: FrictionState.COLLAPSED,
    StatusSignal.MAINTENANCE_REQUIRED: FrictionState.GROWN,
}


def _quoted(message: str) -> Statement:
    if found := _SCALED.fullmatch(message):
        return said(Code.SCALED, scale=quoted(found[1]), of=quoted(found[2]))
    return quoted(message)


def _of_former_version(
    level: Level,
    signal: StatusSignal,
    message: str,
    ratio: Ratio | None,
    time: int,
    limits: FrictionLimits,
    is_below_zero: bool,
) -> Diagnosis:
    """Return the diagnosis in a row from before version 8, with its state and alarm."""
    raised, stood, of_record = message.partition(_LINK)
    if not stood:
        state = _BY_SIGNAL.get(signal, FrictionState.UNKNOWN)
        if ratio is not None and state is FrictionState.UNKNOWN:
            state = friction_state(ratio, limits)
        state = FrictionState.IMPOSSIBLE if is_below_zero else state
        return Diagnosis(level, signal, _quoted(message), ratio, state, _doubt(message))
    of_level = FrictionState.EXCESS if level is Level.ERROR else FrictionState.GROWN
    state, doubt = _BY_SIGNAL.get(signal, of_level), _doubt(of_record)
    alarm = StandingAlarm(level, signal, state, _quoted(raised), time)
    latest = Diagnosis.of(FrictionState.UNKNOWN, quoted(of_record))
    if doubt is not None or is_below_zero:
        own = FrictionState.IMPOSSIBLE if is_below_zero else FrictionState.UNKNOWN
        check = StatusSignal.CHECK_FUNCTION
        latest = Diagnosis(Level.WARN, check, quoted(of_record), None, own, doubt)
    return Diagnosis(level, signal, quoted(message), None, state, alarm=alarm, latest=latest)


def _doubt(message: str) -> Statement | None:
    doubt, _, _ = message.partition(";")
    return quoted(doubt) if doubt.startswith(_DOUBT) else None
