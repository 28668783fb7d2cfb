# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The history's file: what goes in comes out, and what plain SQL finds in it."""

import re
import sqlite3
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from full_history import NUMBERS, SLIDING, all_of, all_of_valve, fill
from histories import (
    DAY,
    OTHER,
    SECOND,
    START,
    VALVE,
    change,
    make_version,
    make_version_5,
    parameter,
    refused,
    select,
    success,
)
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.health import Baseline, DatedNumber, Level, Measured, MonitorSettings
from valve_friction_ros.history import (
    HistoryError,
    HistoryFile,
    KeptBaseline,
    KeptValve,
    database,
    tables,
)
from valve_friction_ros.history.entry import settings_text
from valve_friction_ros.identification import SPEED_EXPONENT, Verdict
from valve_friction_ros.identification.trust.verdict import calibrated
from valve_friction_ros.model import BENCH_VALVE, Drive, Recording


@pytest.fixture
def history(tmp_path):
    return HistoryFile(tmp_path / "folder" / "a file ?#%.sqlite")


OF_VERSION_2 = {
    "version": "0.1.0",
    "settings": re.search(
        r"INTO \"settings\" VALUES\(1,'(.*)'\);",
        Path(__file__).with_name("history_of_version_2.sql").read_text(),
    )[1],
}


def make_old(version, history):
    """Make a file of an older version: as it dumped one, or without what later ones know."""
    if version in (2, 6, 7, 8):
        return make_version(version, history)
    if version == 1:
        make_version(2, history)
        change(history, "ALTER TABLE parameter DROP COLUMN published; PRAGMA user_version = 1")
        return history
    for valve in (VALVE, OTHER):
        fill(history, valve)
    make_version_5(history)
    if version < 5:  # who set a baseline, and what it replaced
        columns = select(history, "SELECT name FROM pragma_table_info('baseline')")
        new = [one for (one,) in columns if one.startswith("replaced_")]
        for name in (*new, "set_by", "level", "withdrawn"):
            change(history, f"ALTER TABLE baseline DROP COLUMN {name}; PRAGMA user_version = 4")
    if version < 4:
        change(history, "DROP TABLE baseline_record; PRAGMA user_version = 3")
    return history


def same(found, expected):
    """Equal, with nan equal to nan: two entries are written alike."""
    return repr(found) == repr(expected)


def test_what_goes_in_comes_out(history):
    entries = [
        success(START, 150.123456789, 1 / 3, warnings=("one", "two")),
        success(START + 1, verdict=Verdict.WEAK, baseline=Baseline(140.0, 2.0)),
        success(START + 2, baseline=Baseline(140.0, 2.0, SLIDING), sliding=SLIDING),
        success(START + 3, baseline=Baseline(sliding=SLIDING)),
        refused(START + 4),
    ]
    for entry in entries:
        history.add(entry)
    found = history.entries()
    assert found[2].diagnosis.ratio.of == "sliding_friction"
    assert len(found) == len(entries)
    for one, other in zip(found, entries, strict=True):
        assert same(one, other)


def test_a_trend_leaves_the_calibration_out(history):
    """It is common to all points; the half width that is shown holds it."""
    widened = calibrated(parameter("coulomb_friction", 100.0, 2.0), 0.02)
    entry = success(parameters={widened.name: widened})
    history.add(entry)
    (found,) = history.entries()
    kept = found.parameters[widened.name]
    assert same(kept, widened)
    assert kept.half_width == pytest.approx(20**0.5)
    point = DatedNumber(START, 100.0, 2.0)
    assert history.points(VALVE.name, "bench") == (point,)
    assert found.point() == entry.point() == point


def version(history):
    return select(history, "PRAGMA user_version")[0][0]


@pytest.mark.parametrize("number", range(1, tables.SCHEMA_VERSION))
def test_a_file_of_an_older_version_is_read_as_it_is_and_extended(number, history, tmp_path):
    """Reading changes nothing; what is written then is kept as in a new file."""
    make_old(number, history)
    before, entries = all_of(history), history.entries()
    assert entries
    kept = history.baseline(VALVE.name)
    assert version(history) == number
    history.prepare()
    assert version(history) == tables.SCHEMA_VERSION
    assert same(history.entries(), entries)
    assert history.baseline(VALVE.name).baseline == kept.baseline
    assert number < 5 or all_of(history) == before  # they do not say what a baseline replaced
    third, new = KeptValve("/fv_9/identifier", "FV-9"), HistoryFile(tmp_path / "new.sqlite")
    for one in (history, new):
        fill(one, third)
    assert all_of_valve(history, third) == all_of_valve(new, third)
    assert select(history, "PRAGMA foreign_key_check") == []


@pytest.mark.parametrize("driven_by", Drive)
def test_the_record_of_a_baseline_is_kept_thinned(history, driven_by):
    drive = 1e5 + 100.0 * np.arange(4500)
    record = Recording(0.01, drive, drive / 1e8, driven_by=driven_by)
    kept = KeptBaseline(Baseline(150.0), START, START, KeptBaseline.thin(record))
    history.set_baseline(VALVE, kept)
    found = history.baseline(VALVE.name)
    assert found == kept
    assert (len(found.record), found.record.driven_by) == (1500, driven_by)
    assert found.record.sample_period == 0.03
    np.testing.assert_allclose(found.record.drive, drive[::3], rtol=1e-6)
    np.testing.assert_allclose(found.record.position, drive[::3] / 1e8, rtol=1e-6)


def test_records_go_with_their_baselines(history):
    """A baseline that is forgotten leaves no record behind; one without a record has none."""
    record = Recording(0.01, np.arange(100.0), np.arange(100.0))
    history.set_baseline(VALVE, KeptBaseline(Baseline(150.0), START, START, record))
    history.set_baseline(VALVE, KeptBaseline(Baseline(150.0), START + DAY, START + DAY))
    assert history.baseline(VALVE.name).record is None
    history.add(success(START + 30 * DAY), days=1.0)
    assert select(history, "SELECT count(*) FROM baseline_record") == [(0,)]


def test_the_numbers_of_baseline_and_identification_are_kept(history):
    kept = KeptBaseline(Baseline(150.0, numbers=NUMBERS), START, START)
    history.set_baseline(OTHER, KeptBaseline(Baseline(150.0), START, START))
    history.set_baseline(VALVE, kept)
    assert history.baseline(VALVE.name).baseline.numbers == NUMBERS
    assert history.baseline(OTHER.name).baseline.numbers == {}
    bare, whole = success(), success(START + 1, numbers=NUMBERS)
    for entry in (bare, whole, refused(START + 2)):
        history.add(entry)
    assert [entry.numbers for entry in history.entries()] == [{}, NUMBERS, {}]
    assert history.last_success(VALVE.name).numbers == NUMBERS
    history.add(success(START + 9 * DAY), days=1.0)
    assert select(history, "SELECT count(*) FROM identification_number") == [(0,)]


def test_the_newest_measurement_of_each_number_is_known_after_a_restart(history):
    lost = {"lower_stop": Measured(2e-3, 1e-5), "lowest_position": Measured(2e-3, 1e-5)}
    within = {"lowest_position": Measured(5e-3, 1e-5), "lag": Measured(0.0, 0.003)}
    other = settings_text(MonitorSettings(replace(BENCH_VALVE, travel=0.02)))
    for entry in (
        success(START - 1, numbers={"slip_force": Measured(9.0, 1.0)}),
        success(numbers=NUMBERS | lost),
        success(valve=OTHER, numbers={"stem_noise": Measured(1e-6, 1e-8)}),
        success(START + 1, numbers={"slip_force": Measured(5.0, 1.0)}, settings=other),
        success(START + 2, numbers=within),
    ):
        history.add(entry)
    known = history.known_numbers(VALVE.name, BENCH_VALVE, START)
    assert known.numbers == NUMBERS | lost | {"lag": within["lag"]}
    assert known.dated["lag"].time == START + 2
    assert known.dated["spring_constant"].time == START
    assert history.known_numbers("none", BENCH_VALVE, 0).numbers == {}
    repaired = {"lowest_position": Measured(0.0, 1e-5)}
    history.add(success(START + 3, numbers=repaired))
    known = history.known_numbers(VALVE.name, BENCH_VALVE, START)
    assert known.numbers == NUMBERS | {"lag": within["lag"]} | repaired


def test_a_baseline_of_version_4_replaced_that_of_the_row_before(history):
    make_old(4, history)
    change(history, "UPDATE baseline SET coulomb_friction = 100 + id")
    assert [one.replaced for one in history.baselines(VALVE.name)] == [None, None]
    history.prepare()
    for valve in (VALVE, OTHER):
        first, second = history.baselines(valve.name)
        assert (first.replaced, second.replaced) == (None, first.baseline)


@pytest.mark.parametrize("number", [1, 2])
def test_what_the_first_versions_hold(number, history):
    """They have no sliding friction in their baselines, and version 1 no published values."""
    make_old(number, history)
    baseline = Baseline(140.0, 2.0)
    expected = (
        success(**OF_VERSION_2),
        success(START + DAY, 210.0, 4.0, baseline=baseline, **OF_VERSION_2),
        refused(START + 2 * DAY, **OF_VERSION_2),
    )
    assert all(map(same, history.entries(), expected))
    assert history.baseline(VALVE.name) == KeptBaseline(baseline, START + 5, START)
    assert history.baseline(OTHER.name).baseline == Baseline(600.0, 7.0)
    points = history.points(VALVE.name, "bench", baseline=baseline)
    assert points == (DatedNumber(START, 150.0, 3.0), DatedNumber(START + DAY, 210.0, 4.0))


def test_a_file_of_version_2_then_has_the_tables_of_a_new_one(history, tmp_path):
    make_old(2, history).prepare()
    new = HistoryFile(tmp_path / "new.sqlite")
    new.prepare()
    for table in tables.METADATA.tables:
        info = f"pragma_table_info('{table}') WHERE name != 'id'"
        columns = f'SELECT name, type, "notnull" FROM {info}'
        assert sorted(select(history, columns)) == sorted(select(new, columns))
    of = "SELECT sql FROM sqlite_master WHERE name = 'friction'"
    assert select(history, of) == select(new, of)
    indices = "SELECT name, sql FROM sqlite_master WHERE type = 'index' AND sql NOT NULL"
    found, expected = (sorted(select(one, indices)) for one in (history, new))
    assert [one for one in expected if one[0] != "settings_content"] == found


@given(
    friction=st.floats(1e-300, 1e300),
    half_width=st.floats(0, 1e300),
    time=st.integers(0, 2**63 - 1 - 60 * SECOND),
    text=st.text(st.characters(exclude_categories=["Cs"]), min_size=1),
)
def test_numbers_and_texts_come_back_to_the_last_bit(
    tmp_path_factory, friction, half_width, time, text
):
    history = HistoryFile(tmp_path_factory.mktemp("history") / "history.sqlite")
    entry = success(
        time, friction, half_width, KeptValve(text, text), warnings=(text.strip() or "-",)
    )
    history.add(entry)
    (found,) = history.entries([text])
    assert found.friction == entry.friction
    assert (found.time, found.valve) == (time, entry.valve)


def test_entries_are_sorted_by_time_and_chosen(history):
    times = [START + 3, START, START + 2]
    for time in times:
        history.add(success(time))
    history.add(success(START + 1, valve=OTHER))
    assert [one.time - START for one in history.entries()] == [0, 1, 2, 3]
    chosen = history.entries([VALVE.name], START + 2, START + 3)
    assert [one.time - START for one in chosen] == [2]
    assert history.entries(["/nobody"]) == ()
    assert history.valves() == (OTHER, VALVE)


def test_a_valve_takes_its_new_tag(history):
    history.add(success())
    history.add(success(START + 1, valve=VALVE._replace(tag="FV-101A")))
    assert history.valves() == (VALVE._replace(tag="FV-101A"),)


def test_points_are_those_of_the_entries(history):
    entries = [
        success(START + k, 150.0 + k, 1.0 + k, verdict=verdict) for k, verdict in enumerate(Verdict)
    ]
    others = (refused(START + 9), success(START, valve=OTHER), success(START, method="signature"))
    for entry in (*entries, *others):
        history.add(entry)
    expected = [point for one in entries if (point := one.point()) is not None]
    assert expected
    assert history.points(VALVE.name, "bench") == tuple(expected)
    later = expected[0].time + 1
    assert history.points(VALVE.name, "bench", later) == tuple(
        p for p in expected if p.time >= later
    )
    assert history.points(OTHER.name, "bench") == (DatedNumber(START, 150.0, 3.0),)


def test_points_of_the_sliding_friction_are_those_of_the_entries(history):
    """Carried to the speed of the baseline; an entry without one, or too slow, is left out."""
    baseline = Baseline(140.0, 2.0, SLIDING)
    entries = [
        success(START, sliding=SLIDING),
        success(
            START + 1,
            sliding=replace(SLIDING, speed=8e-3),
            numbers={SPEED_EXPONENT: Measured(0.5, 0.01)},
        ),
        success(START + 2),
        success(START + 3, sliding=replace(SLIDING, speed=1e-3)),
    ]
    for entry in entries:
        history.add(entry)
    points = history.points(VALVE.name, "bench", baseline=baseline)
    assert points == tuple(p for one in entries if (p := one.point(baseline)) is not None)
    assert [point.time - START for point in points] == [0, 1]
    assert points[0] == DatedNumber(START, SLIDING.value, SLIDING.half_width)
    assert 205.5 < points[1].value < 205.5 * 9.5 / 8
    assert points[1].half_width > SLIDING.half_width


class TestBaseline:
    def test_the_last_one_counts(self, history):
        first, last = (
            KeptBaseline(Baseline(friction, 0.5), START + 10 * k, START + k)
            for k, friction in enumerate((150.0, 140.0))
        )
        history.prepare()
        assert history.baseline(VALVE.name) is None
        for kept in (first, last):
            history.set_baseline(VALVE, kept)
        assert history.baseline(VALVE.name) == last
        assert history.baseline(VALVE.name, until=START + 10) == first
        assert history.baseline(OTHER.name) is None

    def test_it_says_what_it_replaced(self, history):
        old = Baseline(150.0, 2.0, SLIDING)
        first = KeptBaseline(old, START, START, replaced=Baseline(140.0))
        second = KeptBaseline(
            Baseline(600.0, 7.0), START + 1, START, replaced=old, level=Level.ERROR
        )
        for kept in (first, second):
            history.set_baseline(VALVE, kept)
        history.set_baseline(OTHER, first)
        assert history.baselines(VALVE.name) == (first, second)
        assert history.baselines(VALVE.name, START + 1) == (second,)
        assert history.baselines(VALVE.name, until=START + 1) == (first,)
        told = second.to_dict()
        assert (told["set_by"], told["level"]) == ("set_baseline", "ERROR")
        assert (told["baseline"], told["baseline_half_width"]) == (600.0, 7.0)
        assert (told["replaced"], told["replaced_half_width"]) == (150.0, 2.0)
        assert (told["baseline_sliding"], told["replaced_sliding"]) == (None, vars(SLIDING))

    def test_one_that_was_withdrawn_leaves_none(self, history):
        kept = KeptBaseline(Baseline(150.0), START, START)
        history.set_baseline(VALVE, kept)
        gone = replace(kept, time=START + 1, by="restore_baseline", withdrawn=True)
        history.set_baseline(VALVE, gone)
        assert history.baseline(VALVE.name) is None
        assert history.baseline(VALVE.name, until=START + 1) == kept
        assert history.baselines(VALVE.name) == (kept, gone)
        assert gone.in_force is None
        assert gone.to_dict()["baseline"] is None

    def test_it_outlives_the_retention(self, history):
        for k in range(2):
            history.set_baseline(VALVE, KeptBaseline(Baseline(150.0 + k), START + k, START))
        history.add(success(START + 100 * DAY), days=10)
        assert history.baseline(VALVE.name).baseline == Baseline(151.0)
        assert select(history, "SELECT count(*) FROM baseline") == [(1,)]


class TestLastSuccess:
    def test_it_is_the_one_written_last(self, history):
        """In the order of writing, as a clock may go back; no refusal, no other valve."""
        history.add(refused(START))
        assert history.last_success(VALVE.name) is None
        last = success(START + 1, 400.0, baseline=Baseline(100.0))
        for entry in (success(START + 2), last, refused(START + 3), success(valve=OTHER)):
            history.add(entry)
        assert same(history.last_success(VALVE.name), last)

    def test_it_outlives_the_retention(self, history):
        history.add(success(START))
        history.add(success(START + 1))
        history.add(refused(START + 100 * DAY), days=10)
        assert [one.time - START for one in history.entries()] == [1, 100 * DAY]

    @pytest.mark.parametrize(
        "damage",
        [
            "identification SET level = 'high'",
            "identification SET status_signal = 'X'",
            "identification SET warn_ratio = 'much'",
            "parameter SET name = 'friction' WHERE name = 'coulomb_friction'",
            "parameter SET verdict = 'perhaps'",
        ],
    )
    def test_a_row_that_holds_none_is_an_error(self, history, damage):
        history.add(success())
        change(history, f"UPDATE {damage}")
        with pytest.raises(HistoryError, match="a row holds no result"):
            history.last_success(VALVE.name)


class TestRetention:
    def test_what_is_older_goes_with_all_its_rows(self, history):
        for day in range(5):
            history.add(success(START + day * DAY))
        history.add(success(START, valve=OTHER))
        history.add(success(START + 5 * DAY), days=2)
        kept = [(one.time - START) / DAY for one in history.entries([VALVE.name])]
        assert kept == [3, 4, 5]
        assert len(history.entries([OTHER.name])) == 1
        assert select(history, "SELECT count(*) FROM parameter") == [(4 * 3,)]

    def test_zero_keeps_all(self, history):
        history.add(success(0))
        history.add(success(START), days=0)
        assert len(history.entries()) == 2

    def test_a_time_ahead_of_the_clock_ages_nothing(self, history):
        """As where a clock was set wrong by a century."""
        history.add(success(START), days=10_000)
        history.add(success(START + 36_525 * DAY), days=10_000)
        assert len(history.entries()) == 2

    def test_settings_are_kept_once_and_as_long_as_needed(self, history):
        history.add(success(START, settings='{"window": 1.0}'))
        for day in (1, 2):
            history.add(success(START + day * DAY))
        assert select(history, "SELECT count(*) FROM settings") == [(2,)]
        history.add(success(START + 3 * DAY), days=2.5)
        assert select(history, "SELECT count(*) FROM settings") == [(1,)]


class TestSql:
    """What the reliability engineer's own query finds."""

    def test_the_view(self, history):
        history.add(success(START, 150.0, 3.0, baseline=Baseline(100.0)))
        history.add(refused(START + SECOND, "no motion"))
        rows = select(
            history,
            "SELECT time, valve, tag, coulomb_friction, half_width, verdict, ratio, level, refusal "
            "FROM friction ORDER BY time",
        )
        name, tag = VALVE
        assert rows == [
            ("2026-09-21T14:13:20Z", name, tag, 150.0, 3.0, "identified", 1.5, 0, None),
            ("2026-09-21T14:13:21Z", name, tag, None, None, None, None, 0, "no motion"),
        ]

    def test_what_is_not_known_is_null_and_settings_are_json(self, history):
        history.add(success())
        query = "SELECT value, verdict FROM parameter WHERE name = 'static_friction'"
        assert select(history, query) == [(None, "not identifiable")]
        query = "SELECT json_extract(content, '$.valve.diaphragm_area') FROM settings"
        assert select(history, query) == [(0.0445,)]

    def test_a_new_file(self, history):
        history.add(success())
        assert version(history) == tables.SCHEMA_VERSION
        assert select(history, "PRAGMA journal_mode") == [("wal",)]
        assert select(history, "PRAGMA foreign_key_check") == []


def test_a_file_system_without_shared_memory(history, monkeypatch):
    """There SQLite writes its older journal; the file is as good."""
    connect = sqlite3.connect

    def elsewhere(where, **options):
        return connect(f"{where}&vfs=unix-dotfile", **options)

    monkeypatch.setattr(database.sqlite3, "connect", elsewhere)
    history.add(success())
    assert len(history.entries()) == 1
    monkeypatch.undo()
    assert select(history, "PRAGMA journal_mode") == [("delete",)]
    assert same(history.entries(), (success(),))


def test_parameters_come_back_in_their_order(history):
    names = ["mass", "viscous_friction", "coulomb_friction", "stribeck_velocity", "novelty"]
    history.add(success(parameters={name: parameter(name, 1.0) for name in reversed(names)}))
    assert [*history.entries()[0].parameters] == names


@pytest.mark.parametrize(
    ("formers", "method"), [(("sweep", "refined"), "bench"), (("best", "robust"), "plant")]
)
def test_rows_of_an_earlier_version_go_on_under_the_new_name(history, formers, method):
    for later, name in enumerate((*formers, method, "published")):
        history.add(success(START + later, method=name))
    times = [START, START + 1, START + 2]
    assert [point.time for point in history.points(VALVE.name, method)] == times
    assert [entry.method for entry in history.entries()] == [*[method] * 3, "published"]
