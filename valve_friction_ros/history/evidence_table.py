"""The tables of the moves in service."""

__all__ = ["EVIDENCE_CHANGE", "EVIDENCE_TABLE"]

EVIDENCE_TABLE = """
CREATE TABLE move (
    valve_id INTEGER NOT NULL REFERENCES valve,
    end_ns INTEGER NOT NULL,
    begin_ns INTEGER NOT NULL CHECK (begin_ns < end_ns),
    diaphragm_area REAL,
    pressure_reference REAL NOT NULL,
    start REAL NOT NULL,
    stop REAL NOT NULL CHECK (stop != start),
    force REAL NOT NULL,
    force_rate REAL NOT NULL,
    speed REAL NOT NULL CHECK (speed >= 0),
    onset_force REAL,
    onset_position REAL,
    onset_rate REAL,
    PRIMARY KEY (valve_id, end_ns)
) WITHOUT ROWID;
CREATE TABLE evidence_reference (
    valve_id INTEGER PRIMARY KEY REFERENCES valve,
    time_ns INTEGER NOT NULL,
    diaphragm_area REAL,
    pressure_reference REAL NOT NULL,
    sliding_friction REAL NOT NULL CHECK (sliding_friction > 0),
    half_width REAL NOT NULL CHECK (half_width >= 0),
    speed REAL NOT NULL CHECK (speed > 0)
)
"""
"""A row a move, and one a valve of what its moves said first, since the packing was renewed; the
forces hold for the area and the pressure reference beside them."""

EVIDENCE_CHANGE = """
CREATE TABLE IF NOT EXISTS evidence_change (
    valve_id INTEGER PRIMARY KEY REFERENCES valve,
    diaphragm_area REAL,
    pressure_reference REAL NOT NULL,
    earliest_ns INTEGER NOT NULL,
    latest_ns INTEGER NOT NULL CHECK (earliest_ns <= latest_ns),
    ratio REAL NOT NULL CHECK (ratio > 0),
    low REAL NOT NULL CHECK (low > 0),
    high REAL NOT NULL CHECK (low <= high)
)
"""
"""A row a valve of the last change of friction that its moves have shown, since the packing was
renewed."""
