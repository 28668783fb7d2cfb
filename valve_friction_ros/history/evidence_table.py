"""The table of the moves in service."""

__all__ = ["EVIDENCE_TABLE"]

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
) WITHOUT ROWID
"""
"""A row a move; the forces hold for the area and the pressure reference beside them."""
