"""The tables of the valve in service: its usage, alarms, told level and answers."""

__all__ = ["ALARM_RECORDINGS", "ANSWERS", "TOLD_LEVEL", "USAGE"]

USAGE = """
CREATE TABLE usage (
    valve_id INTEGER NOT NULL REFERENCES valve,
    renewal_ns INTEGER NOT NULL,
    day INTEGER NOT NULL,
    run TEXT NOT NULL,
    distance REAL NOT NULL CHECK (distance >= 0),
    reversals INTEGER NOT NULL CHECK (reversals >= 0),
    breakaways INTEGER NOT NULL CHECK (breakaways >= 0),
    time_watched_ns INTEGER NOT NULL CHECK (time_watched_ns >= 0),
    histogram_ns TEXT NOT NULL,
    PRIMARY KEY (valve_id, renewal_ns, day, run)
) WITHOUT ROWID;
CREATE TABLE packing_renewal (
    valve_id INTEGER NOT NULL REFERENCES valve,
    time_ns INTEGER NOT NULL,
    PRIMARY KEY (valve_id, time_ns)
) WITHOUT ROWID;
"""
"""A row for each day (since 1970, UTC) of each run of an identifier, with the packing in use.

Runs that have ended become one, "", once two days have passed.
"""

ALARM_RECORDINGS = """
CREATE TABLE alarm_recording (
    valve_id INTEGER NOT NULL REFERENCES valve,
    time_ns INTEGER NOT NULL,
    level INTEGER NOT NULL CHECK (level BETWEEN 0 AND 2),
    path TEXT NOT NULL,
    message TEXT NOT NULL,
    PRIMARY KEY (valve_id, path)
) WITHOUT ROWID;
"""
"""A row for each alarm that was recorded."""

TOLD_LEVEL = """
CREATE TABLE told_level (
    valve_id INTEGER PRIMARY KEY REFERENCES valve,
    level INTEGER NOT NULL CHECK (level BETWEEN 0 AND 2)
);
"""
"""The level of each valve that its alerts have told last."""

ANSWERS = """
CREATE TABLE IF NOT EXISTS answer (
    id INTEGER PRIMARY KEY,
    valve_id INTEGER NOT NULL REFERENCES valve,
    travel REAL NOT NULL,
    stamp INTEGER NOT NULL,
    change REAL NOT NULL,
    held REAL NOT NULL,
    moved INTEGER NOT NULL CHECK (moved IN (0, 1)),
    settled INTEGER NOT NULL CHECK (settled IN (0, 1)),
    dead_time REAL,
    t63 REAL,
    t86 REAL,
    overshoot REAL,
    steady_error REAL,
    deviation REAL,
    high_deviation REAL,
    pressure_delay REAL,
    pressure_t86 REAL,
    push REAL,
    pressure REAL,
    position REAL,
    rested INTEGER NOT NULL CHECK (rested IN (0, 1)),
    pressure_rested INTEGER NOT NULL CHECK (pressure_rested IN (0, 1)),
    at_stop INTEGER NOT NULL CHECK (at_stop IN (0, 1)),
    UNIQUE (valve_id, stamp)
)
"""
"""A row for each answer of the stem to a step of its command, shares of the travel beside it."""
