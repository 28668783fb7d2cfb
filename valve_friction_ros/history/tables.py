# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Tables of the history, for both SQLite and PostgreSQL, and differences of older versions.

- Version 1 lacks published values.
- Version 2 lacks sliding friction in baselines and ratios, and half widths without calibration.
- Version 3 lacks records of baselines.
- Version 4 lacks the replaced baseline.
- Version 5 lacks the valve in service.
- Version 6 lacks keys that are valid on several machines. It is the last version without servers.
- Version 7 holds the state of the friction and a standing alarm only as sentences.
- Version 8 holds statements about them only as sentences, and lacks alarm events.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.engine import Connection, Dialect
from sqlalchemy.schema import CreateColumn, CreateTable

SCHEMA_VERSION = 9
"""The user_version of a file; a row of `mark` on a server."""

METADATA = sa.MetaData()
"""The tables of a history."""

FILE_METADATA = sa.MetaData()
"""Further tables of a file whose rows go to a server."""

_INTEGER: Any = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
_REAL: Any = sa.REAL().with_variant(postgresql.DOUBLE_PRECISION(), "postgresql")


class _Text(sa.types.TypeDecorator[str]):
    """A text; on a server without NUL, which PostgreSQL does not allow."""

    impl = sa.Text
    cache_ok = True

    def process_bind_param(self, value: str | None, dialect: Dialect) -> str | None:
        return without_nul(value) if dialect.name == "postgresql" else value


def without_nul(value: Any) -> Any:
    """Return a value as both databases hold it."""
    return value.replace("\0", "\u2400") if isinstance(value, str) else value


def _some(kind: Any, names: str, *, null: bool = True) -> list[sa.Column[Any]]:
    return [sa.Column(name, kind, nullable=null) for name in names.split()]


def _integers(names: str) -> list[sa.Column[Any]]:
    return _some(_INTEGER, names, null=False)


def _numbers(names: str) -> list[sa.Column[Any]]:
    return _some(_REAL, names, null=False)


def _texts(names: str) -> list[sa.Column[Any]]:
    return _some(_Text, names, null=False)


def _id() -> sa.Column[Any]:
    return sa.Column("id", _INTEGER, sa.Identity(), primary_key=True)


def _valve(*, key: bool = False) -> sa.Column[Any]:
    return sa.Column(
        "valve_id",
        _INTEGER,
        sa.ForeignKey("valve.id"),
        primary_key=key,
        nullable=False,
        autoincrement=False,
    )


def _owner(table: str) -> sa.Column[Any]:
    """Return the column that refers to the owner of a row; the row is deleted with its owner."""
    owner = sa.ForeignKey(f"{table}.id", ondelete="CASCADE")
    return sa.Column(f"{table}_id", _INTEGER, owner, primary_key=True, autoincrement=False)


def _key(name: str, kind: Any = _INTEGER) -> sa.Column[Any]:
    return sa.Column(name, kind, primary_key=True, autoincrement=False)


def _table(name: str, *columns: sa.schema.SchemaItem, key: Sequence[str] = ()) -> sa.Table:
    """Declare a table; `key` names the identifying columns if they are not the primary key."""
    has_rows_of_size = name == "baseline_record"
    numbered = has_rows_of_size or any(getattr(one, "name", None) == "id" for one in columns)
    return sa.Table(name, METADATA, *columns, sqlite_with_rowid=numbered, info={"key": tuple(key)})


def key_of(table: sa.Table) -> tuple[str, ...]:
    """Return the columns that identify the rows of a table."""
    return table.info["key"] or tuple(one.name for one in table.primary_key)


valve = _table(
    "valve",
    _id(),
    sa.Column("name", _Text, nullable=False, unique=True),
    *_texts("tag"),
    key=["name"],
)
settings = _table("settings", _id(), *_texts("content"))
identification = _table(
    "identification",
    _id(),
    _valve(),
    *_integers("time_ns"),
    *_some(_INTEGER, "begin_ns end_ns"),
    *_texts("method"),
    *_some(_Text, "refusal"),
    *_some(_REAL, "fit rms systematic_misfit"),
    *_texts("warnings"),
    *_integers("level"),
    *_texts("status_signal message"),
    *_some(_REAL, "ratio ratio_low ratio_high"),
    *_some(_Text, "ratio_of"),
    *_some(_REAL, "ratio_speed baseline baseline_half_width baseline_sliding_friction"),
    *_some(_REAL, "baseline_sliding_half_width baseline_sliding_speed sliding_speed"),
    *_numbers("warn_ratio error_ratio low_ratio"),
    sa.Column("settings_id", _INTEGER, sa.ForeignKey("settings.id"), nullable=False),
    *_texts("software_version"),
    *_some(_Text, "uid state doubt"),
    *_some(_INTEGER, "alarm_level"),
    *_some(_Text, "alarm_status_signal alarm_state alarm_message"),
    *_some(_INTEGER, "alarm_time_ns latest_level"),
    *_some(_Text, "latest_status_signal latest_state latest_message statements"),
    sa.CheckConstraint("level BETWEEN 0 AND 2"),
    sa.Index("identification_of_valve", "valve_id", "time_ns"),
    sa.Index("identification_uid", "valve_id", "uid", unique=True),
    key=["valve_id", "uid"],
)
"""An identification. If an alarm of an earlier record stands, the row holds that alarm and the
diagnosis of the record by itself (`latest_`). The `statements` are a JSON object; the messages are
for people who read the table."""

parameter = _table(
    "parameter",
    _owner("identification"),
    _key("name", _Text),
    *_some(_REAL, "value standard_error half_width"),
    *_texts("verdict reason"),
    *_some(_REAL, "published uncalibrated_half_width"),
)
baseline = _table(
    "baseline",
    _id(),
    _valve(),
    *_integers("time_ns since_ns"),
    *_some(_REAL, "coulomb_friction"),
    *_numbers("half_width"),
    *_some(_REAL, "sliding_friction sliding_half_width sliding_speed"),
    sa.Column("set_by", _Text, nullable=False, server_default="set_baseline"),
    *_some(_INTEGER, "level"),
    sa.Column("withdrawn", _INTEGER, nullable=False, server_default=sa.text("0")),
    *_some(_REAL, "replaced_coulomb_friction replaced_half_width replaced_sliding_friction"),
    *_some(_REAL, "replaced_sliding_half_width replaced_sliding_speed"),
    *_some(_Text, "uid"),
    sa.CheckConstraint(
        "coulomb_friction > 0 AND half_width >= 0 AND sliding_friction > 0 "
        "AND sliding_half_width >= 0 AND sliding_speed > 0"
    ),
    sa.CheckConstraint("coalesce(coulomb_friction, sliding_friction) IS NOT NULL"),
    sa.Index("baseline_of_valve", "valve_id", "id"),
    sa.Index("baseline_uid", "valve_id", "uid", unique=True),
    key=["valve_id", "uid"],
)
"""A change of a baseline: the service that set it, the level then, and the replaced baseline."""

baseline_record = _table(
    "baseline_record",
    _owner("baseline"),
    *_numbers("sample_period"),
    *_texts("driven_by"),
    *_some(sa.LargeBinary, "drive position", null=False),
)
"""Samples of the record of a baseline, single precision, little-endian."""

baseline_number, identification_number = (
    _table(f"{owner}_number", _owner(owner), _key("name", _Text), *_numbers("value half_width"))
    for owner in ("baseline", "identification")
)
usage = _table(
    "usage",
    _valve(key=True),
    _key("renewal_ns"),
    _key("day"),
    _key("run", _Text),
    *_numbers("distance"),
    *_integers("reversals breakaways time_watched_ns"),
    *_texts("histogram_ns"),
    sa.CheckConstraint(
        "distance >= 0 AND reversals >= 0 AND breakaways >= 0 AND time_watched_ns >= 0"
    ),
)
"""One row per day (since 1970, UTC) and run of an identifier, with the packing in use.

Ended runs are merged into the run "" once two days have passed."""

packing_renewal = _table("packing_renewal", _valve(key=True), _key("time_ns"))
alarm_recording = _table(
    "alarm_recording",
    _valve(key=True),
    *_integers("time_ns level"),
    _key("path", _Text),
    *_texts("message"),
    sa.CheckConstraint("level BETWEEN 0 AND 2"),
)
told_level = _table(
    "told_level", _valve(key=True), *_integers("level"), sa.CheckConstraint("level BETWEEN 0 AND 2")
)
"""The last notified level of each valve."""

alarm_event = _table(
    "alarm_event",
    _id(),
    _valve(),
    *_texts("uid"),
    *_integers("time_ns"),
    *_texts("kind action state_before state"),
    *_integers("level"),
    *_texts("status_signal message"),
    *_some(_INTEGER, "raised_ns until_ns"),
    *_texts("who text"),
    sa.CheckConstraint("level BETWEEN 0 AND 2"),
    sa.Index("alarm_event_of_valve", "valve_id", "kind", "id"),
    sa.Index("alarm_event_time", "time_ns"),
    sa.Index("alarm_event_uid", "valve_id", "uid", unique=True),
    key=["valve_id", "uid"],
)
"""A step of an alarm, with the complete alarm from then on: the last row gives the alarm."""

move = _table(
    "move",
    _valve(key=True),
    _key("end_ns"),
    *_integers("begin_ns"),
    *_some(_REAL, "diaphragm_area"),
    *_numbers("pressure_reference start stop force force_rate speed"),
    *_some(_REAL, "onset_force onset_position onset_rate"),
    sa.CheckConstraint("begin_ns < end_ns AND stop != start AND speed >= 0"),
)
"""A move in service; its forces are valid for the area and pressure reference in the row."""

evidence_reference = _table(
    "evidence_reference",
    _valve(key=True),
    *_integers("time_ns"),
    *_some(_REAL, "diaphragm_area"),
    *_numbers("pressure_reference sliding_friction half_width speed"),
    sa.CheckConstraint("sliding_friction > 0 AND half_width >= 0 AND speed > 0"),
)
"""The first friction from the moves of a valve since the packing was renewed."""

evidence_change = _table(
    "evidence_change",
    _valve(key=True),
    *_some(_REAL, "diaphragm_area"),
    *_numbers("pressure_reference"),
    *_integers("earliest_ns latest_ns"),
    *_numbers("ratio low high"),
    sa.CheckConstraint("earliest_ns <= latest_ns AND ratio > 0 AND low > 0 AND low <= high"),
)
"""The last change of friction from the moves of a valve since the packing was renewed."""

answer = _table(
    "answer",
    _id(),
    _valve(),
    *_numbers("travel"),
    *_integers("stamp"),
    *_numbers("change held"),
    *_integers("moved settled"),
    *_some(_REAL, "dead_time t63 t86 overshoot steady_error deviation high_deviation"),
    *_some(_REAL, "pressure_delay pressure_t86 push pressure position"),
    *_integers("rested pressure_rested at_stop"),
    sa.CheckConstraint(
        "moved IN (0, 1) AND settled IN (0, 1) AND rested IN (0, 1) "
        "AND pressure_rested IN (0, 1) AND at_stop IN (0, 1)"
    ),
    sa.UniqueConstraint("valve_id", "stamp"),
    key=["valve_id", "stamp"],
)
"""A response of the stem to a step of its command; positions are shares of the `travel`."""

mark = _table("mark", _key("name", _Text), *_texts("value"))
"""Properties of the database itself, such as its schema and identity."""

keeper = _table("keeper", _valve(key=True), *_texts("file"))
"""The file that presently keeps a valve."""

unsent = sa.Table(
    "unsent",
    FILE_METADATA,
    sa.Column("number", sa.Integer, primary_key=True),
    *_integers("valve_id"),
    *_texts("part key"),
    *_integers("since"),
    *_some(_Text, "refusal"),
    sa.Index("unsent_row", "valve_id", "part", "key"),
    sqlite_autoincrement=True,
)
"""Queue of the rows that were added, changed or deleted and not sent since. A row that changes
again gets a new number, so that a late acknowledgement covers only the earlier change."""


@cache
def joined(*some: sa.Table) -> Any:
    """Return the join of tables, one after another, by their references."""
    found: Any = some[0]
    for table in some[1:]:
        found = found.join(table)
    return found


def of_valve(table: sa.Table, name: str) -> Any:
    """Return a query for the rows of the valve of this name."""
    return sa.select(table).select_from(joined(table, valve)).where(valve.c.name == name)


_TIME = {
    "sqlite": "strftime('%Y-%m-%dT%H:%M:%SZ', time_ns / 1000000000, 'unixepoch')",
    "postgresql": "to_char(to_timestamp(time_ns / 1000000000) AT TIME ZONE 'UTC', "
    '\'YYYY-MM-DD"T"HH24:MI:SS"Z"\')',
}
_CONTENT = {"sqlite": "content", "postgresql": "md5(content)"}
"""The settings in their index: an index of PostgreSQL limits the length of a text."""

_VIEW = """
CREATE VIEW friction AS
    SELECT
        identification.id AS id,
        {time} AS time,
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
        ON sliding.identification_id = identification.id AND sliding.name = 'sliding_friction'
"""

_OF_BASELINE_2 = "id, valve_id, time_ns, since_ns, coulomb_friction, half_width"

_CHANGES = {
    3: (
        f"INSERT INTO baseline ({_OF_BASELINE_2}) SELECT {_OF_BASELINE_2} FROM former_baseline",  # noqa: S608
        "DROP TABLE former_baseline",
    ),
    5: (
        """
        UPDATE baseline SET
            (replaced_coulomb_friction, replaced_half_width, replaced_sliding_friction,
             replaced_sliding_half_width, replaced_sliding_speed)
            = (SELECT coulomb_friction, half_width, sliding_friction, sliding_half_width,
                   sliding_speed
               FROM baseline AS former
               WHERE former.valve_id = baseline.valve_id AND former.id < baseline.id
               ORDER BY former.id DESC LIMIT 1)
        """,
    ),
    7: (
        "UPDATE identification SET uid = time_ns || '-' || id",
        "UPDATE baseline SET uid = time_ns || '-' || id",
    ),
}
"""Changes of a version other than additions: baselines without F_c; the replaced baseline, which in
an older file is the previous row; and keys of rows that are the same in each copy of a file."""


def bring_up_to_date(connection: Connection, version: int) -> None:
    """Create the tables of a new history (version 0), or update the tables of an older version.

    Runs within a transaction. It adds the declared tables and columns that are missing, and applies
    the few other changes.
    """
    do, database = connection.exec_driver_sql, connection.dialect.name
    if 0 < version < 3:  # these versions require F_c in a baseline
        do("DROP VIEW friction")
        do("DROP INDEX baseline_of_valve")
        do("ALTER TABLE baseline RENAME TO former_baseline")
    METADATA.create_all(connection)
    if version:
        for table in METADATA.sorted_tables:
            for column in _lacking(connection, table):
                definition = CreateColumn(column).compile(dialect=connection.dialect)
                do(f"ALTER TABLE {table.name} ADD COLUMN {definition}")
            for index in table.indexes:
                index.create(connection, checkfirst=True)
        for statement in (one for of, some in _CHANGES.items() if version < of for one in some):
            do(statement)
    else:
        do(f"CREATE UNIQUE INDEX settings_content ON settings ({_CONTENT[database]})")
    if version < 3:
        do(_VIEW.format(time=_TIME[database]))


def _lacking(connection: Connection, table: sa.Table) -> list[sa.Column[Any]]:
    found = {one["name"] for one in sa.inspect(connection).get_columns(table.name)}
    return [column for column in table.c if column.name not in found]


def show_as_of_now(connection: Connection) -> None:
    """Make an older history appear like one of this version, for this connection only.

    Temporary views show missing columns as NULL, and missing tables as empty.
    """
    prefix = "main." if connection.dialect.name == "sqlite" else ""
    there = set(sa.inspect(connection).get_table_names())
    for table in METADATA.sorted_tables:
        if table.name not in there:
            columns = [sa.Column(one.name, one.type) for one in table.c]
            empty = sa.Table(table.name, sa.MetaData(), *columns, prefixes=["TEMPORARY"])
            connection.execute(CreateTable(empty))
            continue
        added = [
            sa.cast(sa.null(), one.type).label(one.name) for one in _lacking(connection, table)
        ]
        if added:
            former = sa.select(sa.literal_column("*"), *added).select_from(
                sa.text(prefix + table.name)
            )
            text = former.compile(dialect=connection.dialect)
            connection.exec_driver_sql(f"CREATE TEMPORARY VIEW {table.name} AS {text}")


@cache
def _insertion(database: str, table: sa.Table, names: tuple[str, ...], is_kept: bool) -> Any:
    """Return the statement of `put`, cached so that it does not delay a transaction."""
    dialect: Any = postgresql if database == "postgresql" else sqlite
    insert, key = dialect.insert(table), key_of(table)
    changed = {name: insert.excluded[name] for name in names if name not in key}
    if is_kept or not changed:
        return insert.on_conflict_do_nothing()
    return insert.on_conflict_do_update(index_elements=key, set_=changed)


def put(
    connection: Connection,
    table: sa.Table,
    rows: Sequence[dict[str, Any]],
    *,
    is_kept: bool = False,
) -> None:
    """Insert rows, mappings of the same columns.

    An existing row with the same key is updated; with `is_kept` it stays unchanged.
    """
    if rows:
        insert = _insertion(connection.dialect.name, table, tuple(rows[0]), is_kept)
        connection.execute(insert, list(rows))


def has_table(connection: Connection, table: sa.Table) -> bool:
    """Return whether a history has a table."""
    return sa.inspect(connection).has_table(table.name)
