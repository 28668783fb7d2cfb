# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the churn counts, and which of its goals are missed."""

import signal
import sys

import numpy as np
import pytest

from benchmark.churn.places import RATE
from benchmark.churn.summary import hung_services, rows
from benchmark.churn.visitor import missing_samples
from benchmark.harness.processes import Process
from benchmark.harness.run import Ledger

GOOD = (
    {"kind": "run", "seconds": 60.0},
    {"kind": "visit", "end": "gone"},
    {"kind": "visit", "end": "killed"},
    {"kind": "call", "service": "/fv_101/identifier/identify", "seconds": 0.4},
    {"kind": "samples", "topic": "/p", "first": 0, "last": 60, "count": 16, "missing": 0},
    {"kind": "samples", "topic": "/p", "first": 30, "last": 90, "count": 16, "missing": 0},
    {"kind": "diagnostics", "longest": 1.2},
    {"kind": "ending", "node": "simulator", "seconds": 0.2, "code": 0},
)
BAD = {
    "never answered": {"kind": "call", "service": "/fv_101/identifier/save", "seconds": None},
    "answered after more than 5 s": {"kind": "call", "service": "/a/b/c", "seconds": 5.1},
    "services not found in 30 s": {"kind": "undiscovered", "service": "/a/b/c"},
    "samples lost": dict(GOOD[4], missing=1),
    "stream looked at, both signals": {"kind": "run", "seconds": 120.0},
    "times at which the look came too late": {"kind": "unsaved", "message": "no answer"},
    "of these and their helpers failed": {"kind": "broken", "name": "audit"},
    "longest silence on /diagnostics": {"kind": "diagnostics", "longest": 6.0},
    "ended after more than 3 s": dict(GOOD[7], seconds=3.1),
    "ended with another code": dict(GOOD[7], code=1),
    "nodes that ended themselves, frozen": {"kind": "ended itself", "name": "simulator"},
    "nodes that died or hung": {"kind": "died", "name": "simulator", "code": -6},
}


def missed(events):
    return [row.item for row in rows(events) if row.met is False]


def test_a_good_run_misses_nothing():
    assert missed(GOOD) == []
    found = {row.item: row.ours for row in rows(GOOD)}
    assert found["participants that came and went"] == 2
    assert found["of them killed"] == 1
    assert found["stream looked at, both signals"] == pytest.approx(90e-9)
    assert found["times at which the look came too late"] == 0


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


def test_a_run_in_which_nothing_was_looked_at_has_shown_nothing():
    assert missed([{"kind": "run", "seconds": 120.0}]) == [
        "participants that came and went",
        "calls of services and parameters",
        "stream looked at, both signals",
        "longest silence on /diagnostics",
        "nodes ended by SIGINT or SIGTERM",
    ]


def test_missing_samples_are_counted_within_the_record():
    stamps = np.arange(1000) * (1_000_000_000 // RATE) + 5
    assert missing_samples(stamps) == 0
    assert missing_samples(np.delete(stamps, [3, 4, 700])) == 3
    assert missing_samples(stamps[:0]) == 0


def test_ledger_keeps_the_order(tmp_path):
    ledger = Ledger(tmp_path / "ledger.jsonl")
    ledger.add("call", service="/a", seconds=None)
    ledger.add("visit", end="µ")
    assert [(one["kind"], one.get("end")) for one in ledger.events()] == [
        ("call", None),
        ("visit", "µ"),
    ]


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
