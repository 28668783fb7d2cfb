"""The tables of the history in SQL, and what leads from an older version of them to the next."""

from collections.abc import Iterator
from itertools import chain

from valve_friction_ros.history.evidence_table import EVIDENCE_CHANGE, EVIDENCE_TABLE
from valve_friction_ros.history.number_rows import NUMBER_TABLES
from valve_friction_ros.history.service_tables import ALARM_RECORDINGS, ANSWERS, TOLD_LEVEL, USAGE

__all__ = ["ADDED_LATE", "SCHEMA_VERSION", "statements_from"]

SCHEMA_VERSION = 8
"""The database's user_version.

Version 1 has no published values, version 2 no sliding friction in baselines and ratios,
and no half widths without calibration; version 3 has no records of baselines; version 4 does not
say what a baseline replaced; version 5 knows nothing of the valve in service; version 6 has no keys
that hold on several machines, and is the last one that servers never had; version 7 has the state
of the friction and an alarm that stands in sentences only."""

_SCHEMA = """
CREATE TABLE valve (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    tag TEXT NOT NULL
);
CREATE TABLE settings (
    id INTEGER PRIMARY KEY,
    content TEXT NOT NULL UNIQUE
);
CREATE TABLE identification (
    id INTEGER PRIMARY KEY,
    valve_id INTEGER NOT NULL REFERENCES valve,
    time_ns INTEGER NOT NULL,
    begin_ns INTEGER,
    end_ns INTEGER,
    method TEXT NOT NULL,
    refusal TEXT,
    fit REAL,
    rms REAL,
    systematic_misfit REAL,
    warnings TEXT NOT NULL,
    level INTEGER NOT NULL CHECK (level BETWEEN 0 AND 2),
    status_signal TEXT NOT NULL,
    message TEXT NOT NULL,
    ratio REAL,
    ratio_low REAL,
    ratio_high REAL,
    ratio_of TEXT,
    ratio_speed REAL,
    baseline REAL,
    baseline_half_width REAL,
    baseline_sliding_friction REAL,
    baseline_sliding_half_width REAL,
    baseline_sliding_speed REAL,
    sliding_speed REAL,
    warn_ratio REAL NOT NULL,
    error_ratio REAL NOT NULL,
    low_ratio REAL NOT NULL,
    settings_id INTEGER NOT NULL REFERENCES settings,
    software_version TEXT NOT NULL
);
CREATE INDEX identification_of_valve ON identification (valve_id, time_ns);
CREATE TABLE parameter (
    identification_id INTEGER NOT NULL REFERENCES identification ON DELETE CASCADE,
    name TEXT NOT NULL,
    value REAL,
    standard_error REAL,
    half_width REAL,
    verdict TEXT NOT NULL,
    reason TEXT NOT NULL,
    published REAL,
    uncalibrated_half_width REAL,
    PRIMARY KEY (identification_id, name)
) WITHOUT ROWID;
"""

_BASELINE = """
CREATE TABLE baseline (
    id INTEGER PRIMARY KEY,
    valve_id INTEGER NOT NULL REFERENCES valve,
    time_ns INTEGER NOT NULL,
    since_ns INTEGER NOT NULL,
    coulomb_friction REAL CHECK (coulomb_friction > 0),
    half_width REAL NOT NULL CHECK (half_width >= 0),
    sliding_friction REAL CHECK (sliding_friction > 0),
    sliding_half_width REAL CHECK (sliding_half_width >= 0),
    sliding_speed REAL CHECK (sliding_speed > 0),
    CHECK (coalesce(coulomb_friction, sliding_friction) IS NOT NULL)
);
CREATE INDEX baseline_of_valve ON baseline (valve_id, id);
CREATE VIEW friction AS
    SELECT
        identification.id AS id,
        strftime('%Y-%m-%dT%H:%M:%SZ', time_ns / 1000000000, 'unixepoch') AS time,
        valve.name AS valve,
        valve.tag AS tag,
        parameter.value AS coulomb_friction,
        parameter.half_width AS half_width,
        parameter.verdict AS verdict,
        sliding.value AS sliding_friction,
        sliding.half_width AS sliding_half_width,
        sliding.verdict AS sliding_verdict,
        identification.sliding_speed AS sliding_speed,
        ratio,
        ratio_of,
        level,
        message,
        refusal
    FROM identification
    JOIN valve ON valve.id = valve_id
    LEFT JOIN parameter
        ON parameter.identification_id = identification.id AND parameter.name = 'coulomb_friction'
    LEFT JOIN parameter AS sliding
        ON sliding.identification_id = identification.id AND sliding.name = 'sliding_friction';
"""

_RECORD = """
CREATE TABLE baseline_record (
    baseline_id INTEGER PRIMARY KEY REFERENCES baseline ON DELETE CASCADE,
    sample_period REAL NOT NULL,
    driven_by TEXT NOT NULL,
    drive BLOB NOT NULL,
    position BLOB NOT NULL
)
"""
"""Samples of the record of a baseline, single precision, the least significant byte first."""

_REPLACED = """
ALTER TABLE baseline ADD COLUMN set_by TEXT NOT NULL DEFAULT 'set_baseline';
ALTER TABLE baseline ADD COLUMN level INTEGER;
ALTER TABLE baseline ADD COLUMN withdrawn INTEGER NOT NULL DEFAULT 0;
ALTER TABLE baseline ADD COLUMN replaced_coulomb_friction REAL;
ALTER TABLE baseline ADD COLUMN replaced_half_width REAL;
ALTER TABLE baseline ADD COLUMN replaced_sliding_friction REAL;
ALTER TABLE baseline ADD COLUMN replaced_sliding_half_width REAL;
ALTER TABLE baseline ADD COLUMN replaced_sliding_speed REAL;
UPDATE baseline SET
    (replaced_coulomb_friction, replaced_half_width, replaced_sliding_friction,
     replaced_sliding_half_width, replaced_sliding_speed)
    = (SELECT coulomb_friction, half_width, sliding_friction, sliding_half_width, sliding_speed
       FROM baseline AS former
       WHERE former.valve_id = baseline.valve_id AND former.id < baseline.id
       ORDER BY former.id DESC LIMIT 1);
"""
"""Who set a baseline, at which level, and what it replaced: in an older file the row before it."""

_SERVICE = ";".join(
    (
        NUMBER_TABLES,
        USAGE,
        ALARM_RECORDINGS,
        TOLD_LEVEL,
        EVIDENCE_TABLE,
        EVIDENCE_CHANGE,
        ANSWERS,
    )
)
"""The tables of the valve in service."""

_SHARED = """
ALTER TABLE identification ADD COLUMN uid TEXT;
ALTER TABLE baseline ADD COLUMN uid TEXT;
UPDATE identification SET uid = time_ns || '-' || id;
UPDATE baseline SET uid = time_ns || '-' || id;
CREATE UNIQUE INDEX identification_uid ON identification (valve_id, uid);
CREATE UNIQUE INDEX baseline_uid ON baseline (valve_id, uid);
CREATE TABLE mark (
    name TEXT PRIMARY KEY,
    value TEXT NOT NULL
);
CREATE TABLE keeper (
    valve_id INTEGER PRIMARY KEY REFERENCES valve,
    file TEXT NOT NULL
);
"""
"""What several files and a server need to share rows: a key of each row that holds everywhere (of
a row from before the same in each copy of its file), names of the database itself, and the file
that keeps a valve now."""

_STATES = ";".join(
    f"ALTER TABLE identification ADD COLUMN {name} {kind}"
    for name, kind in {
        "state": "TEXT",
        "doubt": "TEXT",
        "alarm_level": "INTEGER",
        "alarm_status_signal": "TEXT",
        "alarm_state": "TEXT",
        "alarm_message": "TEXT",
        "alarm_time_ns": "INTEGER",
        "latest_level": "INTEGER",
        "latest_status_signal": "TEXT",
        "latest_state": "TEXT",
        "latest_message": "TEXT",
    }.items()
)
"""The state of the friction, what the model does not describe, and where an alarm of an earlier
record stands, that alarm and what the record says by itself."""

ADDED_LATE = (EVIDENCE_CHANGE, ANSWERS)
"""Tables that the first files of this version lack: each writing makes what is not there."""

_ADDED = {
    "ratio_of": "TEXT",
    "ratio_speed": "REAL",
    "baseline_sliding_friction": "REAL",
    "baseline_sliding_half_width": "REAL",
    "baseline_sliding_speed": "REAL",
    "sliding_speed": "REAL",
}
"""Columns of the identifications that version 3 adds."""

_STEPS = {
    1: ("ALTER TABLE parameter ADD COLUMN published REAL",),
    2: (
        *(f"ALTER TABLE identification ADD COLUMN {name} {kind}" for name, kind in _ADDED.items()),
        "ALTER TABLE parameter ADD COLUMN uncalibrated_half_width REAL",
        "DROP VIEW friction",
        "DROP INDEX baseline_of_valve",
        "ALTER TABLE baseline RENAME TO former_baseline",
        *_BASELINE.split(";"),
        "INSERT INTO baseline (id, valve_id, time_ns, since_ns, coulomb_friction, half_width) "
        "SELECT id, valve_id, time_ns, since_ns, coulomb_friction, half_width FROM former_baseline",
        "DROP TABLE former_baseline",
    ),
    3: (_RECORD,),
    4: tuple(_REPLACED.split(";")),
    5: tuple(_SERVICE.split(";")),
    6: tuple(_SHARED.split(";")),
    7: tuple(_STATES.split(";")),
}
"""What leads from a version to the next one."""


def statements_from(version: int) -> Iterator[str]:
    """Return the statements that lead from a version of the tables to the present; 0: no tables."""
    tables = (_SCHEMA, _BASELINE, _RECORD, _REPLACED, _SERVICE, _SHARED, _STATES)
    steps = (_STEPS[one] for one in range(version, SCHEMA_VERSION) if version)
    return filter(str.strip, chain(*steps) if version else ";".join(tables).split(";"))
