"""Conversion between the history's value types and the rows of its tables."""

import math
import sqlite3
import uuid
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

import numpy as np

from valve_friction_ros.health.baseline import Baseline, SlidingFriction
from valve_friction_ros.health.comparison import Ratio
from valve_friction_ros.health.diagnosis import FrictionLimits
from valve_friction_ros.health.levels import Level
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.history.connection import Connection, has_table
from valve_friction_ros.history.diagnosis_rows import diagnosis_in, state_columns
from valve_friction_ros.history.entry import (
    Fit,
    HistoryEntry,
    KeptBaseline,
    KeptValve,
    Span,
)
from valve_friction_ros.history.number_rows import insert_numbers, numbers_in
from valve_friction_ros.identification import (
    FORMER_METHODS,
    PARAMETER_UNITS,
    Parameter,
    Verdict,
)
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.recording import Recording

__all__ = [
    "entries_in",
    "frictions_in",
    "insert_baseline",
    "insert_entry",
    "kept_baseline_in",
    "record_in",
    "settings_id",
    "valve_id",
]

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
"""Columns of a baseline: in its table, in that of the identifications, and as the one before."""


def valve_id(connection: Connection, valve: KeptValve) -> int:
    """Return the row of a valve, with its tag updated."""
    connection.execute(
        "INSERT INTO valve (name, tag) VALUES (?, ?) ON CONFLICT (name) DO UPDATE SET "
        "tag = excluded.tag WHERE valve.tag != excluded.tag",
        valve,
    )
    (row,) = connection.execute("SELECT id FROM valve WHERE name = ?", valve[:1]).fetchone()
    return int(row)


def settings_id(connection: Connection, text: str) -> int:
    """Return the row of settings, which are added where they are new."""
    connection.execute("INSERT INTO settings (content) VALUES (?) ON CONFLICT DO NOTHING", (text,))
    (row,) = connection.execute("SELECT id FROM settings WHERE content = ?", (text,)).fetchone()
    return int(row)


def _insert(connection: sqlite3.Connection, table: str, **values: object) -> int:
    names, marks = ", ".join(values), ", ".join("?" * len(values))
    statement = f"INSERT INTO {table} ({names}) VALUES ({marks})"  # noqa: S608 - no user's text
    row = connection.execute(statement, tuple(values.values())).lastrowid
    return int(row or 0)


def insert_entry(connection: sqlite3.Connection, valve: int, entry: HistoryEntry) -> None:
    """Add an identification to a valve. SQLite stores nan as NULL."""
    diagnosis, baseline = entry.diagnosis, entry.baseline
    begin, end = entry.span or (None, None)
    ratio, low, high, of, speed = diagnosis.ratio or (None,) * 5
    identification = _insert(
        connection,
        "identification",
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
        ratio=ratio,
        ratio_low=low,
        ratio_high=high,
        ratio_of=of,
        ratio_speed=speed,
        sliding_speed=entry.sliding_speed,
        **_baseline_columns(baseline, _OF_ENTRY),
        warn_ratio=entry.limits.warn_ratio,
        error_ratio=entry.limits.error_ratio,
        low_ratio=entry.limits.low_ratio,
        **state_columns(diagnosis),
        settings_id=settings_id(connection, entry.settings),
        software_version=entry.version,
    )
    for one in entry.parameters.values():
        _insert(
            connection,
            "parameter",
            identification_id=identification,
            name=one.name,
            value=one.value,
            standard_error=one.standard_error,
            half_width=one.half_width,
            verdict=one.verdict.value,
            reason=one.reason,
            published=one.published,
            uncalibrated_half_width=one.uncalibrated and one.uncalibrated.half_width,
        )
    insert_numbers(connection, "identification", identification, entry.numbers)


def insert_baseline(connection: sqlite3.Connection, valve: int, kept: KeptBaseline) -> None:
    """Add a baseline to a valve."""
    row = _insert(
        connection,
        "baseline",
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
    insert_numbers(connection, "baseline", row, kept.baseline.numbers)
    if kept.record is not None:
        _insert(
            connection,
            "baseline_record",
            baseline_id=row,
            sample_period=kept.record.sample_period,
            driven_by=kept.record.driven_by.name,
            drive=kept.record.drive.astype(_SAMPLE).tobytes(),
            position=kept.record.position.astype(_SAMPLE).tobytes(),
        )


def record_in(connection: Connection, baseline: int) -> Recording | None:
    """Return the record of the baseline of this row, if any."""
    if not has_table(connection, "baseline_record"):
        return None
    row = connection.execute(
        "SELECT sample_period, driven_by, drive, position FROM baseline_record "
        "WHERE baseline_id = ?",
        (baseline,),
    ).fetchone()
    if row is None:
        return None
    period, driven_by, *samples = row
    drive, position = (np.frombuffer(one, dtype=_SAMPLE).astype(float) for one in samples)
    return Recording(period, drive, position, driven_by=Drive[driven_by])


def _baseline_columns(baseline: Baseline | None, names: Sequence[str]) -> dict[str, float | None]:
    if baseline is None:
        return dict.fromkeys(names)
    slid = baseline.sliding
    sliding = (None,) * 3 if slid is None else (slid.value, slid.half_width, slid.speed)
    values = (baseline.coulomb_friction, baseline.half_width, *sliding)
    return dict(zip(names, values, strict=True))


def kept_baseline_in(row: Any) -> KeptBaseline:
    """Return the baseline in a row of its table, without its record."""
    baseline, level = _baseline_in(row, _OF_BASELINE), _cell(row, "level")
    if baseline is None:
        raise ValueError("a baseline without a friction")
    return KeptBaseline(
        baseline,
        row["time_ns"],
        row["since_ns"],
        replaced=_baseline_in(row, _OF_REPLACED),
        by=_cell(row, "set_by") or "set_baseline",
        level=None if level is None else Level(level),
        withdrawn=bool(_cell(row, "withdrawn")),
    )


def _baseline_in(row: Any, names: Sequence[str]) -> Baseline | None:
    friction, width, *sliding = (_cell(row, name) for name in names)
    if friction is None and sliding[0] is None:
        return None
    return Baseline(friction, width, None if sliding[0] is None else SlidingFriction(*sliding))


def _cell(row: Any, name: str) -> Any:
    """Return a cell, or None where a file of an older version has no such column."""
    return row[name] if name in row.keys() else None  # noqa: SIM118 - a row is no mapping


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _place(parameter: Parameter) -> int:
    """Place of a parameter in a result."""
    names = [*PARAMETER_UNITS]
    return names.index(parameter.name) if parameter.name in names else len(names)


def _parameter(row: Any) -> Parameter:
    shown = Parameter(
        row["name"],
        _number(row["value"]),
        _number(row["standard_error"]),
        _number(row["half_width"]),
        Verdict(row["verdict"]),
        row["reason"],
        published=_number(_cell(row, "published")),
    )
    width = _cell(row, "uncalibrated_half_width")
    if width is None:
        return shown
    return replace(shown, uncalibrated=replace(shown, standard_error=math.nan, half_width=width))


def _entry(
    row: Any, parameters: Sequence[Parameter], numbers: Mapping[str, Measured]
) -> HistoryEntry:
    ratio = Ratio(
        _number(row["ratio"]),
        _number(row["ratio_low"]),
        _number(row["ratio_high"]),
        _cell(row, "ratio_of") or "coulomb_friction",
        _number(_cell(row, "ratio_speed")),
    )
    limits = FrictionLimits(row["warn_ratio"], row["error_ratio"], row["low_ratio"])
    known = None if row["ratio"] is None else ratio
    return HistoryEntry(
        time=row["time_ns"],
        valve=KeptValve(row["name"], row["tag"]),
        span=None if row["begin_ns"] is None else Span(row["begin_ns"], row["end_ns"]),
        method=FORMER_METHODS.get(row["method"], row["method"]),
        diagnosis=diagnosis_in(row, known, limits, any(one.value < 0 for one in parameters)),
        limits=limits,
        baseline=_baseline_in(row, _OF_ENTRY),
        sliding_speed=_number(_cell(row, "sliding_speed")),
        settings=row["content"],
        parameters={one.name: one for one in parameters},
        fit=Fit(*(_number(row[name]) for name in ("fit", "rms", "systematic_misfit"))),
        warnings=tuple(filter(None, row["warnings"].split("\n"))),
        refusal=row["refusal"] or "",
        version=row["software_version"],
        numbers=numbers,
    )


def frictions_in(
    rows: Sequence[Any],
) -> Iterator[tuple[int, dict[str, Parameter], float]]:
    """Gather rows of parameters, each with its identification: time, parameters, sliding speed."""
    for _, some in groupby(rows, key=lambda row: row["identification_id"]):
        several = [*some]
        parameters = {row["name"]: _parameter(row) for row in several}
        yield several[0]["time_ns"], parameters, _number(_cell(several[0], "sliding_speed"))


def entries_in(
    connection: Connection, valves: Sequence[str] | None, since: int, until: int
) -> tuple[HistoryEntry, ...]:
    """Read identifications, oldest first; see `HistoryFile.entries`."""
    names = sorted(name for (name,) in connection.execute("SELECT name FROM valve"))
    wanted = names if valves is None else valves
    found = [
        entry for valve in wanted for entry in _entries_of_valve(connection, (valve, since, until))
    ]
    return tuple(sorted(found, key=lambda entry: entry.time))


def _entries_of_valve(
    connection: Connection, choice: tuple[str, int, int]
) -> Iterator[HistoryEntry]:
    parameters: defaultdict[int, list[Parameter]] = defaultdict(list)
    for row in connection.execute(
        "SELECT parameter.* FROM parameter JOIN identification ON identification.id = "
        "identification_id JOIN valve ON valve.id = valve_id "
        "WHERE valve.name = ? AND time_ns >= ? AND time_ns < ?",
        choice,
    ):
        parameters[row["identification_id"]].append(_parameter(row))
    rows = connection.execute(
        "SELECT identification.*, valve.name, valve.tag, settings.content FROM identification "
        "JOIN settings ON settings.id = settings_id JOIN valve ON valve.id = valve_id "
        "WHERE valve.name = ? AND time_ns >= ? AND time_ns < ? "
        "ORDER BY time_ns, identification.id",
        choice,
    ).fetchall()
    ids = [row["id"] for row in rows] or [0]
    numbers = numbers_in(connection, "identification", choice[0], min(ids), max(ids))
    for row in rows:
        ordered = sorted(parameters[row["id"]], key=_place)
        yield _entry(row, ordered, numbers.get(row["id"], {}))
