# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the soak sends, and how it accounts for it."""

import itertools

import numpy as np
import pytest
from histories import SECOND, START, success

from benchmark.soak.feed import PIECE, Feed
from benchmark.soak.site import Database, Kept
from benchmark.soak.summary import database_rows, rows
from valve_friction_ros.history import HistoryFile, copied
from valve_friction_ros.history.place import HistoryServer

NOW = 1_700_000_000_000_000_000


def life(end="SIGINT", sent=100, taken=98, rejected=2, unsaved=0):
    known = {"sent": sent, "taken": taken, "rejected": rejected, "unsaved": unsaved}
    return {"kind": "life", "valve": "/fv_1", "end": end, **known}


def call(seconds=0.1, success=True, message="", service="identify", **more):
    known = {"seconds": seconds, "success": success, "message": message}
    return {"kind": "call", "valve": "/fv_1", "service": service, **known, **more}


def missed(events, stored=1):
    return {one.item for one in rows(events, {"/fv_1": stored}) if one.met is False}


def memory(share, megabytes):
    return {"kind": "memory", "share": share, "megabytes": megabytes}


def nonsense(kind="nonsense", seconds=2.0, told=True):
    return {"kind": kind, "name": "STEM_IN_MM", "seconds": seconds, "told": told}


GOOD = [life(), call()]


def test_what_adds_up_misses_nothing():
    killed = life("SIGKILL", 50, 20, 0, unsaved=1)
    refused = call(success=False, message="the record is too short")
    busy = call(success=False, message="an identification is already running: wait for it")
    cut = call(None, None, ended="SIGKILL")
    kept_late = call()  # it waited for a full disk as its process was killed
    assert missed([*GOOD, killed, refused, busy, cut, kept_late], stored=2) == set()
    assert missed([*GOOD, memory(0.1, 50), memory(0.5, 100), memory(1.0, 104)]) == set()
    assert missed([*GOOD, nonsense(), nonsense("nonsense over")]) == set()
    assert missed([*GOOD, cut], stored=2) == set()  # stored, and killed before the answer


@pytest.mark.parametrize(
    ("events", "stored", "item"),
    [
        ([life(taken=97), call()], 1, "samples unexplained"),
        ([life(taken=99), call()], 1, "samples unexplained"),
        ([life(), call(), call()], 1, "answered, and not in the history"),
        (GOOD, 2, "in the history, and never asked"),
        ([*GOOD, call(None, None)], 1, "never answered"),
        ([*GOOD, call(None, None, service="save")], 1, "other calls never answered"),
        ([*GOOD, {"kind": "silence", "told": False}], 1, "silent sensors that nobody told"),
        ([*GOOD, {"kind": "full disk", "told": False}], 1, "full disks that nobody told"),
        ([*GOOD, {"kind": "database away", "told": False}], 1, "databases away that nobody told"),
        (
            [*GOOD, nonsense(told=False)],
            1,
            "nonsense that was not told within 5 s",
        ),
        ([*GOOD, nonsense(seconds=5.1)], 1, "nonsense that was not told within 5 s"),
        (
            [*GOOD, nonsense(), nonsense("nonsense over", 6.0)],
            1,
            "nonsense that was not over within 5 s",
        ),
        ([*GOOD, {"kind": "died"}], 1, "processes that ended by themselves"),
        ([*GOOD, {"kind": "ending", "name": "a", "code": None}], 1, "a ended with code"),
        ([*GOOD, memory(0.5, 100), memory(1.0, 106)], 1, "memory after 100 % of the month"),
        ([call()], 1, "samples sent"),
        ([life()], 0, "identifications asked"),
    ],
)
def test_each_failure_misses_its_goal(events, stored, item):
    assert missed(events, stored) == {item}


def test_a_record_is_whole_and_shows_the_faults_of_its_sensors():
    feed = Feed(2.0)
    feed.clock_error, feed.bad_rows = -(10**9), 3
    pieces = list(feed.record(0.5, NOW))
    stamps, pressure, _ = (np.concatenate(part) for part in zip(*pieces, strict=True))
    assert {len(one.stamps) for one in pieces} == {PIECE}
    assert stamps[0] == NOW - 10**9
    assert set(np.diff(stamps)) == {10**7}
    assert np.flatnonzero(np.isnan(pressure)).tolist() == [0, 1, 2]
    again = itertools.chain.from_iterable(one.pressure for one in feed.record(0.5, NOW))
    assert np.isfinite(list(again)).all()


def test_the_friction_grows_over_the_month():
    swings = [
        np.ptp(np.concatenate([one.position for one in Feed(3.0).record(share, NOW)]))
        for share in (0.0, 1.0)
    ]
    assert swings[1] < swings[0]


def test_a_server_that_holds_less_than_the_file_misses_its_goals(postgres, tmp_path):
    postgres.start()
    file = HistoryFile(tmp_path / "history.sqlite")
    file.add(success())
    database = Database(postgres)
    copied(file.path, HistoryServer(database.url))
    assert database.compared_with(file.path) == Kept(1, 1, 0, 0)
    file.add(success(START + SECOND))
    lacking = database.compared_with(file.path)
    assert (lacking.in_file, lacking.on_server) == (2, 1)
    assert lacking.lacking > 0
    assert [one.met for one in database_rows(lacking)] == [None, False, None, False]
    assert all(one.met is not False for one in database_rows(Kept(2, 2, 1, 1)))
