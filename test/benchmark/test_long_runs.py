# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the runs over hours and days count: misses of goals, kept samples, faults, restarts."""

import itertools
import math
import signal
import sys
from dataclasses import replace

import numpy as np
import pytest
from histories import SECOND, START, success

from benchmark.churn import hung_services
from benchmark.churn import rows as churn_rows
from benchmark.harness.processes import Process
from benchmark.harness.run import Ledger
from benchmark.service import bounds, tables
from benchmark.service_plants import PLANTS, Duty
from benchmark.service_trial import Number, Task, Told, stretches
from benchmark.soak import database_rows
from benchmark.soak import rows as soak_rows
from benchmark.soak_plant import PIECE, Database, Feed, Kept
from valve_friction_ros.history import HistoryFile, copied
from valve_friction_ros.history.place import HistoryServer

GOOD = (
    {"kind": "visit", "end": "gone"},
    {"kind": "visit", "end": "killed"},
    {"kind": "call", "service": "/fv_101/identifier/identify", "seconds": 0.4},
)
BAD = {
    "never answered": {"kind": "call", "service": "/fv_101/identifier/save", "seconds": None},
    "answered after more than 5 s": {"kind": "call", "service": "/a/b/c", "seconds": 5.1},
    "services not found in 30 s": {"kind": "undiscovered", "service": "/a/b/c"},
    "of these failed": {"kind": "visit", "end": "hung"},
    "nodes that ended themselves, frozen": {"kind": "ended itself", "name": "simulator"},
    "nodes that died or hung": {"kind": "died", "name": "simulator", "code": -6},
}


def missed(events):
    return [row.item for row in churn_rows(events) if row.met is False]


def test_a_good_run_misses_nothing():
    assert missed(GOOD) == []
    found = {row.item: row.ours for row in churn_rows(GOOD)}
    assert found["participants that came and went"] == 2
    assert found["of them killed"] == 1


@pytest.mark.parametrize("item", BAD)
def test_each_failure_misses_its_goal(item):
    assert missed([*GOOD, BAD[item]]) == [item]


def test_a_node_that_answers_others_does_not_hang():
    lost = {"kind": "unanswered twice", "service": "/fv_101/identifier/save", "since": 10.0}
    lost["time"] = 40.0
    answer = {"kind": "call", "service": "/fv_101/identifier/clear", "seconds": 0.1, "time": 20.0}
    other = dict(answer, service="/fv_201/identifier/clear")
    assert hung_services([lost, answer]) == []
    assert hung_services([lost, dict(answer, time=5.0), other]) == [lost["service"]]
    assert hung_services([lost], until=40.0) == []


def test_a_run_without_visitors_has_shown_nothing():
    assert missed([]) == ["participants that came and went", "calls of services and parameters"]


def test_ledger_keeps_the_order(tmp_path):
    ledger = Ledger(tmp_path / "ledger.jsonl")
    ledger.add("call", service="/a", seconds=None)
    ledger.add("visit", end="µ")
    events = [(one["kind"], one.get("end")) for one in ledger.events()]
    assert events == [("call", None), ("visit", "µ")]


def test_hung_process_leaves_its_stacks(tmp_path, monkeypatch):
    hangs = tmp_path / "hangs"
    hangs.write_text(
        f"#!{sys.executable}\n"
        "import signal, time\n"
        "signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "def sleeping_for_ever():\n"
        "    print('ready', flush=True)\n"
        "    while True: time.sleep(1)\n"
        "sleeping_for_ever()\n"
    )
    hangs.chmod(0o755)
    monkeypatch.setattr("benchmark.harness.processes.PATIENCE", 0.2)
    monkeypatch.setattr("benchmark.harness.processes.shutil.which", lambda _: None)
    process = Process([str(hangs)], tmp_path / "log")
    process.wait_for("ready")
    assert process.end(signal.SIGTERM) is None
    assert "sleeping_for_ever" in process.said()
    assert process.exit_code() == -signal.SIGABRT


NOW = 1_700_000_000_000_000_000


def life(end="SIGINT", sent=100, taken=98, rejected=2, unsaved=0):
    known = {"sent": sent, "taken": taken, "rejected": rejected, "unsaved": unsaved}
    return {"kind": "life", "valve": "/fv_1", "end": end, **known}


def call(seconds=0.1, success=True, message="", service="identify", **more):
    known = {"seconds": seconds, "success": success, "message": message}
    return {"kind": "call", "valve": "/fv_1", "service": service, **known, **more}


def missed_in_a_month(events, stored=1):
    return {one.item for one in soak_rows(events, {"/fv_1": stored}) if one.met is False}


def memory(share, megabytes):
    return {"kind": "memory", "share": share, "megabytes": megabytes}


def nonsense(kind="nonsense", seconds=2.0, told=True):
    return {"kind": kind, "name": "STEM_IN_MM", "seconds": seconds, "told": told}


MONTH = [life(), call()]


def test_what_adds_up_misses_nothing():
    killed = life("SIGKILL", 50, 20, 0, unsaved=1)
    refused = call(success=False, message="the record is too short")
    busy = call(
        success=False, message="an identification is already running: wait until it finishes"
    )
    cut = call(None, None, ended="SIGKILL")
    kept_late = call()  # it waited for a full disk as its process was killed
    assert missed_in_a_month([*MONTH, killed, refused, busy, cut, kept_late], stored=2) == set()
    assert missed_in_a_month([*MONTH, memory(0.1, 50), memory(0.5, 100), memory(1.0, 104)]) == set()
    assert missed_in_a_month([*MONTH, nonsense(), nonsense("nonsense over")]) == set()
    assert missed_in_a_month([*MONTH, cut], stored=2) == set()  # killed before the answer


@pytest.mark.parametrize(
    ("events", "stored", "item"),
    [
        ([life(taken=97), call()], 1, "samples unexplained"),
        ([life(taken=99), call()], 1, "samples unexplained"),
        ([life(), call(), call()], 1, "answered, and not in the history"),
        (MONTH, 2, "in the history, and never asked"),
        ([*MONTH, call(None, None)], 1, "never answered"),
        ([*MONTH, call(None, None, service="save")], 1, "other calls never answered"),
        ([*MONTH, {"kind": "silence", "told": False}], 1, "silent sensors that nobody told"),
        ([*MONTH, {"kind": "full disk", "told": False}], 1, "full disks that nobody told"),
        ([*MONTH, {"kind": "database away", "told": False}], 1, "databases away that nobody told"),
        ([*MONTH, nonsense(told=False)], 1, "nonsense that was not told within 5 s"),
        ([*MONTH, nonsense(seconds=5.1)], 1, "nonsense that was not told within 5 s"),
        (
            [*MONTH, nonsense(), nonsense("nonsense over", 6.0)],
            1,
            "nonsense that was not over within 5 s",
        ),
        ([*MONTH, {"kind": "died"}], 1, "processes that ended by themselves"),
        ([*MONTH, {"kind": "ending", "name": "a", "code": None}], 1, "a ended with code"),
        ([*MONTH, memory(0.5, 100), memory(1.0, 106)], 1, "memory after 100 % of the month"),
        ([call()], 1, "samples sent"),
        ([life()], 0, "identifications asked"),
    ],
)
def test_each_failure_of_a_month_misses_its_goal(events, stored, item):
    assert missed_in_a_month(events, stored) == {item}


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


def told(course="steady", **changes):
    names = ("sliding_friction", "static_friction", "dead_band")
    numbers = [Number(name, 100.0, 104.0, 5.0) for name in names]
    task = Task("high", 12, 0, course)
    return replace(
        Told(task, numbers, declared=0.5, alarmed=0.8, alarmed_by_reference=0.8, late=numbers),
        **changes,
    )


def missed_bounds(*some):
    return [one.what for one in bounds(some) if not one.met]


def test_a_good_outcome_meets_the_bounds():
    assert not missed_bounds(told(), told("step"))
    assert all(table.row_count for table in tables([told(), told("step"), told("slow")]))


@pytest.mark.parametrize(
    ("outcome", "words"),
    [
        (told(changes=1), "no false declaration"),
        (told(alarms=1), "no false declaration"),
        (told("step", declared=1.17), "declared within one hour"),
        (told("step", declared=math.nan), "declared within one hour"),
        (told("step", alarmed=math.nan), "alarmed within one hour"),
        (told("slow", alarmed_by_reference=math.nan), "reached slowly"),
        (told("weeks", alarmed_by_reference=math.nan), "reached slowly"),
        (
            told(numbers=[Number("sliding_friction", 100.0, 111.0, 20.0)]),
            "sliding friction, in every hour",
        ),
        (
            told(numbers=[Number("sliding_friction", 100.0, math.nan, 1.0)]),
            "sliding friction, in every hour",
        ),
        (told(numbers=[Number("dead_band", 100.0, 88.0, 20.0)]), "dead band, where"),
        (told(numbers=[Number("static_friction", 100.0, 105.0, 4.0)]), "inside their intervals"),
    ],
)
def test_a_bad_one_misses_its_bound(outcome, words):
    assert any(words in one for one in missed_bounds(told(), told("step"), outcome))


def test_coverage_is_bound_for_each_valve():
    """Four hours of one valve outside, among a hundred of another inside."""
    outside = [Number("static_friction", 100.0, 105.0, 4.0)] * 4
    inside = [Number("static_friction", 100.0, 104.0, 5.0)] * 100
    poor = replace(told(), task=Task("low", 12, 0, "steady"), numbers=[*told().numbers, *outside])
    good = told(numbers=[*told().numbers, *inside])
    assert missed_bounds(told(), told("step"), good, poor) == [
        "at least 95 % inside their intervals, of each valve and number"
    ]


def test_the_stem_follows_its_set_points_and_friction_is_that_of_the_plant():
    valve = PLANTS["high"]
    duty = Duty()
    (first, second) = stretches(valve, 1 / 3, 1, lambda _: 1.0, lambda _: 0.0, lambda _: duty)
    friction = valve.plant.friction
    for stretch in (first, second):
        mean = stretch.work / stretch.distance
        assert friction.coulomb < mean < friction.coulomb + 5e-3 * friction.viscous
        assert stretch.stamps[0].size == stretch.position.size == 24_000
        assert np.ptp(stretch.position) > 2 * duty.step * valve.plant.body.travel
    assert second.stamps[0][0] - first.stamps[0][-1] == pytest.approx(25e6, abs=1)


def test_a_stem_at_rest_moves_as_in_small_steps():
    """The rest is passed over at once; a step that is never longer than the rest must agree."""
    valve = replace(PLANTS["high"], step=2e-4)
    constant = (lambda _: 1.0, lambda _: 0.0, lambda _: Duty())
    (first,) = stretches(valve, 1 / 6, 1, *constant)
    (fine,) = stretches(replace(valve, step=2e-5), 1 / 6, 1, *constant)
    assert first.work / first.distance == pytest.approx(fine.work / fine.distance, rel=1e-3)
    assert np.percentile(np.abs(first.position - fine.position), 99) < 100e-6
