# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The moves that are kept, and a clock that was wrong."""

from types import SimpleNamespace

import pytest
from histories import VALVE
from service import SECOND, START
from service import VALVE as BUILT

from valve_friction_ros.evidence import Move
from valve_friction_ros.history import HistoryFile, read_change, read_moves, read_reference
from valve_friction_ros.nodes.identifier.evidence_watch import MoveLedger

HOUR, YEAR = 3600 * SECOND, 365 * 86_400 * SECOND
PERIOD = 12 * SECOND


def move(begin):
    return Move(begin, begin + SECOND, 1e-3, 2e-3, 500.0, 10.0, 1e-3)


class Bench:
    """A ledger without a graph; each move comes a second after its end, by the true time."""

    def __init__(self, path, is_played=False):
        self.file, self.true, self.error, self.log = HistoryFile(path), START, 0, []
        clock = SimpleNamespace(
            now=lambda: SimpleNamespace(nanoseconds=self.true + self.error),
            ros_time_is_active=is_played,
        )
        self.node = SimpleNamespace(
            get_clock=lambda: clock,
            get_logger=lambda: SimpleNamespace(warning=self.log.append, error=self.log.append),
            get_parameter=lambda _: SimpleNamespace(value=0.0),
        )
        self.history = SimpleNamespace(
            valve=VALVE,
            moves=lambda: read_moves(self.file, VALVE.name, BUILT),
            reference=lambda: read_reference(self.file, VALVE.name, BUILT),
            change=lambda: read_change(self.file, VALVE.name, BUILT),
            keep_soon=lambda change: change(self.file),
        )
        self.file.prepare()
        self.start()

    def start(self):
        self.ledger = MoveLedger(self.node, self.history, BUILT)

    def serve(self, count):
        for _ in range(count):
            self.true += PERIOD
            begin = self.true + self.error - 2 * SECOND
            self.ledger.add([move(begin)])

    def kept(self):
        self.ledger.close()
        return read_moves(self.file, VALVE.name, BUILT)


@pytest.mark.parametrize("ahead", [HOUR, 3 * YEAR])
@pytest.mark.parametrize("restarts", [False, True])
def test_a_clock_that_is_set_back_costs_no_later_move(tmp_path, ahead, restarts):
    bench = Bench(tmp_path / "history.sqlite")
    bench.serve(10)
    before = bench.kept()
    bench.error = ahead
    bench.serve(20)
    if restarts:
        assert len(bench.kept()) == 30
        bench.start()
    bench.error = 0
    bench.serve(7)
    assert len(bench.ledger.moves) == 30
    assert "before those that are kept" in bench.ledger.problem
    bench.serve(33)
    assert bench.ledger.problem == ""
    assert bench.ledger.left_out == 0
    found = bench.ledger.moves
    assert found[:10] == before
    assert [one.begin for one in found] == sorted(one.begin for one in found)
    assert len(found) == 50
    assert found[-1].end < bench.true
    assert bench.kept() == found
    assert any("the clock was ahead" in one and "20 kept moves" in one for one in bench.log)


def test_a_clock_that_is_not_set_yet_costs_no_kept_move(tmp_path):
    """A machine that begins hours behind, until it asks for the time."""
    bench = Bench(tmp_path / "history.sqlite")
    bench.serve(20)
    bench.error = -HOUR
    bench.serve(5)
    bench.error = 0
    bench.serve(10)
    assert len(bench.ledger.moves) == 30
    assert bench.ledger.left_out == 5


def test_a_stray_stamp_is_no_problem_and_an_hour_of_them_is(tmp_path):
    """Sensors that are an hour behind, and a node whose clock is right."""
    bench = Bench(tmp_path / "history.sqlite")
    bench.serve(20)
    bench.ledger.add([move(START - HOUR)])
    assert bench.ledger.problem == ""
    assert bench.ledger.left_out == 1
    for number in range(30):
        bench.ledger.add([move(START - HOUR + number * PERIOD)])
    assert "the latest 31 moves in service are left out" in bench.ledger.problem
    assert "check the clocks" in bench.ledger.problem
    assert len(bench.ledger.moves) == 20
    bench.serve(1)
    assert bench.ledger.problem == ""


def test_a_recording_that_is_played_costs_no_kept_move(tmp_path):
    bench = Bench(tmp_path / "history.sqlite", is_played=True)
    bench.serve(20)
    bench.error = -HOUR
    bench.serve(20)
    assert len(bench.ledger.moves) == 20
    assert "a recording that is played" in bench.ledger.problem
