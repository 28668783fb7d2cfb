# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Moves in the history."""

import math
import sqlite3
from dataclasses import replace

import pytest
from histories import DAY, OTHER, SECOND, START, VALVE
from test_file import write_version_2

from valve_friction_ros.evidence import FrictionChange, Move
from valve_friction_ros.health import Reference, SlidingFriction
from valve_friction_ros.history import (
    HistoryError,
    HistoryFile,
    keep_change,
    keep_moves,
    keep_reference,
    keep_renewal,
    read_change,
    read_moves,
    read_reference,
    service_rows,
)
from valve_friction_ros.model import Valve

BUILT = Valve(diaphragm_area=0.0445, pressure_reference=41_740.0, travel=0.03)


def move(number, start=START):
    begin = start + 12 * SECOND * number
    onset = (500.0, 1e-3, 20.0) if number % 2 else ()
    return Move(begin, begin + SECOND, 1e-3, 2e-3, 500.0 + number, 10.0, 1e-3, *onset)


@pytest.fixture
def history(tmp_path):
    return HistoryFile(tmp_path / "history.sqlite")


def kept(history, built=BUILT, valve=VALVE):
    return [one.force for one in read_moves(history, valve.name, built)]


def test_what_goes_in_comes_out(history):
    moves = tuple(map(move, range(4)))
    keep_moves(history, VALVE, BUILT, moves)
    found = read_moves(history, VALVE.name, BUILT)
    assert found[1::2] == moves[1::2]
    assert [math.isnan(one.onset_force) for one in found] == [True, False, True, False]
    assert replace(found[0], onset_force=0.0) != found[1]
    assert kept(history, valve=OTHER) == []


def test_twice_is_once_and_nothing_is_nothing(history):
    for _ in range(2):
        keep_moves(history, VALVE, BUILT, list(map(move, range(3))))
    keep_moves(history, VALVE, BUILT, [])
    assert kept(history) == [500.0, 501.0, 502.0]


def test_their_number_is_bounded(history, monkeypatch):
    monkeypatch.setattr(service_rows, "MOST_MOVES", 5)
    keep_moves(history, OTHER, BUILT, [move(0)])
    for number in range(9):
        keep_moves(history, VALVE, BUILT, [move(number)])
    assert kept(history) == [504.0, 505.0, 506.0, 507.0, 508.0]
    assert kept(history, valve=OTHER) == [500.0]


def test_their_age_is_bounded(history):
    keep_moves(history, VALVE, BUILT, [move(0), move(1, START + DAY)])
    keep_moves(history, VALVE, BUILT, [move(2, START + 3 * DAY)], days=2.5)
    assert kept(history) == [501.0, 502.0]


@pytest.mark.parametrize("start", [SECOND, START + 70 * 365 * DAY])
def test_one_wrong_stamp_costs_no_kept_move(history, start):
    keep_moves(history, VALVE, BUILT, list(map(move, range(40))), days=10_000.0)
    keep_moves(history, VALVE, BUILT, [move(99, start)], days=10_000.0)
    keep_moves(history, VALVE, BUILT, [move(40)], days=10_000.0)
    assert len(kept(history)) >= 41


class TestReference:
    FIRST, LATER = (Reference(SlidingFriction(one, 9.0, 1e-3), START) for one in (300.0, 450.0))

    def kept(self, history, built=BUILT, valve=VALVE):
        return read_reference(history, valve.name, built)

    def test_the_first_stays(self, history):
        for one in (self.FIRST, self.LATER):
            keep_reference(history, VALVE, BUILT, one)
        assert self.kept(history) == self.FIRST
        assert self.kept(history, valve=OTHER) is None

    def test_another_actuator_has_another(self, history):
        larger = replace(BUILT, diaphragm_area=0.05)
        keep_reference(history, VALVE, BUILT, self.FIRST)
        assert self.kept(history, larger) is None
        keep_reference(history, VALVE, larger, self.LATER)
        assert self.kept(history, larger) == self.LATER
        assert self.kept(history, replace(larger, travel=0.05)) == self.LATER

    def test_a_renewal_begins_anew(self, history):
        for valve in (VALVE, OTHER):
            keep_moves(history, valve, BUILT, [move(0)])
            keep_reference(history, valve, BUILT, self.FIRST)
        keep_renewal(history, VALVE, START + DAY)
        assert kept(history) == []
        assert self.kept(history) is None
        assert kept(history, valve=OTHER) == [500.0]
        assert self.kept(history, valve=OTHER) == self.FIRST
        keep_moves(history, VALVE, BUILT, [move(1)])
        keep_reference(history, VALVE, BUILT, self.LATER)
        assert kept(history) == [501.0]
        assert self.kept(history) == self.LATER

    def test_an_older_file_holds_none(self, history):
        write_version_2(history)
        assert self.kept(history) is None


class TestChange:
    FIRST, LATER = (
        FrictionChange(START, START + DAY, one, 0.9 * one, 1.1 * one) for one in (1.3, 1.5)
    )

    def kept(self, history, built=BUILT, valve=VALVE):
        return read_change(history, valve.name, built)

    def test_the_last_one_stays_until_the_packing_is_renewed(self, history):
        for valve, change in ((VALVE, self.FIRST), (OTHER, self.FIRST), (VALVE, self.LATER)):
            keep_change(history, valve, BUILT, change)
        assert self.kept(history) == self.LATER
        assert self.kept(history, replace(BUILT, diaphragm_area=0.05)) is None
        keep_renewal(history, VALVE, START + DAY)
        assert self.kept(history) is None
        assert self.kept(history, valve=OTHER) == self.FIRST

    def test_an_older_file_and_one_without_the_table(self, history):
        write_version_2(history)
        assert self.kept(history) is None
        for change in (
            lambda: keep_change(history, VALVE, BUILT, self.FIRST),
            lambda: keep_renewal(history, VALVE, START),
        ):
            keep_change(history, VALVE, BUILT, self.LATER)
            connection = sqlite3.connect(history.path)
            with connection:
                connection.execute("DROP TABLE evidence_change")
                connection.execute("PRAGMA user_version = 6")  # the last that may lack it
            connection.close()
            assert self.kept(history) is None
            change()
        assert self.kept(history) is None


@pytest.mark.parametrize("changes", [{"diaphragm_area": 0.05}, {"pressure_reference": 0.0}])
def test_forces_of_another_actuator_are_not_read(history, changes):
    keep_moves(history, VALVE, BUILT, [move(0)])
    assert kept(history, replace(BUILT, **changes)) == []
    assert kept(history, replace(BUILT, travel=0.05)) == [500.0]


def test_a_machine_without_a_diaphragm(history):
    driven = Valve()
    keep_moves(history, VALVE, driven, [move(0)])
    assert kept(history, driven) == [500.0]


def test_an_older_file_is_read_and_extended(history):
    write_version_2(history)
    assert read_moves(history, VALVE.name, BUILT) == ()
    keep_moves(history, VALVE, BUILT, [move(0)])
    assert kept(history) == [500.0]
    assert history.valves()


def test_a_row_that_holds_no_move(history):
    keep_moves(history, VALVE, BUILT, [move(0)])
    connection = sqlite3.connect(history.path)
    with connection:
        connection.execute("UPDATE move SET force = 'much'")
    connection.close()
    with pytest.raises(HistoryError, match="a row holds no"):
        read_moves(history, VALVE.name, BUILT)
