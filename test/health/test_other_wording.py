# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A wording decides nothing: what is diagnosed, kept and restored is the same in another one."""

import ast
from dataclasses import replace
from pathlib import Path

import pytest
from histories import DAY, START, VALVE

import valve_friction_ros
from valve_friction_ros import wording
from valve_friction_ros.health import (
    Baseline,
    FrictionMonitor,
    Measured,
    MonitorSettings,
    SlidingFriction,
    diagnose_numbers,
)
from valve_friction_ros.history import HistoryFile, entry_of
from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.streams.record_buffer import RecordBuffer
from valve_friction_ros.wording import Code, Statement, headline, said, sentence

EXACT = 1e-5
PAIRS = {  # of the healthy valve and of the changed one
    "spring_constant": (Measured(2e5, 1e3), Measured(1.2e5, 1e3)),
    "spring_preload": (Measured(500.0, 1.0), Measured(900.0, 1.0)),
    "coulomb_friction": (Measured(150.0, 2.0), Measured(150.0, 2.0)),
    "viscous_friction": (Measured(5e3, 50.0), Measured(5e4, 500.0)),
    "viscous_asymmetry": (Measured(0.0, 0.01), Measured(0.4, 0.01)),
    "slip_force": (Measured(10.0, 1.0), Measured(400.0, 1.0)),
    "drive_noise": (Measured(100.0, 1.0), Measured(900.0, 1.0)),
    "stem_noise": (Measured(1e-6, 1e-8), Measured(9e-6, 1e-8)),
    "lower_stop": (Measured(0.0, EXACT), Measured(0.004, EXACT)),
    "upper_stop": (Measured(0.028, EXACT), Measured(0.028, EXACT)),
    "lag": (Measured(0.0, 1e-3), Measured(0.1, 1e-3)),
}
NUMBERS, CHANGED = ({name: pair[k] for name, pair in PAIRS.items()} for k in (0, 1))
HEALTHY = Baseline(sliding=SlidingFriction(150.0, 3.0, 2e-3), numbers=NUMBERS)


@pytest.fixture
def sentences_of_another(monkeypatch):
    """Function that puts a wording in force in which no word and no mark of this one is left."""

    def put():
        for code in Code:
            monkeypatch.setattr(code, "_value_", f"§{code.name}")
        monkeypatch.setattr(wording, "_HEADLINES", {})
        for name, members in wording._TABLES.items():
            monkeypatch.setitem(wording._TABLES, name, dict.fromkeys(members, "¶"))

    return put


@pytest.fixture
def life(with_values, unknown, friction, tmp_path):
    """Function of a name: all that a valve's monitors and history say in a long life, typed."""

    def result(value, width=6.0, **changes):
        slid = friction(value, width, "sliding_friction")
        found = with_values(coulomb_friction=unknown(), sliding_friction=slid)
        return replace(found, sliding_speed=2e-3, **changes)

    doubtful = replace(result(150.0).misfit, systematic=1e-3, tolerated=1e-6)
    records = [
        result(150.0),
        result(400.0),
        result(200.0, 40.0),
        RefusalError("the stem did not move"),
        result(150.0, 100.0),
        result(150.0, misfit=doubtful),
        result(100.0, 3.0),
        with_values(coulomb_friction=unknown(), sliding_friction=unknown("sliding_friction")),
        result(60.0, 3.0),
        result(-60.0, 3.0),
        result(230.0, 20.0),
    ]

    def live(name):
        file = HistoryFile(tmp_path / f"{name}.sqlite")
        monitor, lived = FrictionMonitor(MonitorSettings(BENCH_VALVE)), []
        snapshot = RecordBuffer(BENCH_VALVE, 60.0).snapshot()
        for day, record in enumerate(records):
            time = START + day * DAY
            if isinstance(record, RefusalError):
                monitor.refuse(record)
            else:
                monitor.accept(record, time)
                file.add(entry_of(monitor, VALVE, snapshot, monitor.settings, time))
            if day == 0:
                monitor.baseline = HEALTHY
            lived.append(monitor.diagnosis(time))
            restarted = FrictionMonitor(MonitorSettings(BENCH_VALVE))
            restarted.baseline = monitor.baseline
            restarted.remember(file.last_success(VALVE.name))
            lived.append(restarted.diagnosis())
            restarted.accept(records[2], time + 1)
            lived.append(restarted.diagnosis())
        lived += [entry.diagnosis for entry in file.entries()]
        lived += diagnose_numbers(CHANGED, HEALTHY, BENCH_VALVE)
        return lived

    return live


def assert_eventful(lived):
    """Else the test below would say little."""
    assert {one.level.name for one in lived} == {"OK", "WARN", "ERROR"}
    states = {one.own.state.name for one in lived if hasattr(one, "own")}
    assert states >= {"NORMAL", "EXCESS", "GROWN", "FALLEN", "COLLAPSED", "IMPOSSIBLE"}
    codes = {one.statement.code for one in lived}
    around = {Code.DOUBTED, Code.STANDS_UNCERTAIN, Code.STANDS_UNCOMPARED, Code.REFUSED}
    assert codes >= {*around, Code.SPRING_CHANGED, Code.TRAVEL_LOST, Code.LAG_CHANGED}


def test_no_behaviour_changes(life, sentences_of_another):
    usual = life("usual")
    assert_eventful(usual)
    told = [one.message for one in usual]
    sentences_of_another()
    other = life("other")
    assert other == usual
    assert len({one.message for one in other}) > 12
    assert not {one.message for one in other} & set(told)


def test_what_is_kept_is_restored_word_by_word(life):
    for one in life("usual"):
        again = Statement.from_dict(one.statement.to_dict())
        assert again == one.statement
        assert sentence(again) == one.message


def test_an_unknown_code_is_named():
    with pytest.raises(ValueError, match="'FROM_LATER' is not a statement code"):
        Statement.from_dict({"code": "FROM_LATER"})


def test_a_headline_has_no_figures():
    ratio = Measured.between(2.0, 1.9, 2.1)
    compared = said(Code.COMPARED, state="EXCESS", ratio=(ratio.value, ratio.low, ratio.high))
    dated = said(Code.DATED, of=compared, time=START)
    assert headline(said(Code.STANDS_UNCERTAIN, alarm=dated)) == "excess friction"


_LOOKS = {"startswith", "endswith", "partition", "rpartition", "split", "replace", "count", "find"}
_SENTENCES = {"message", "reason", "refusal", "sentence"}
FORMER = "history/rows.py"
"""The one file that reads sentences, of rows that former versions have written."""


def looks(path):
    """Line numbers where a file looks into a sentence."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        looked = []
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            looked = [node.func.value] if node.func.attr in _LOOKS else []
        elif isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            pairs = zip(node.ops, sides, sides[1:], strict=False)
            texts = (ast.In, ast.NotIn)
            looked = [right for operator, _, right in pairs if isinstance(operator, texts)]
        if any(isinstance(one, ast.Attribute) and one.attr in _SENTENCES for one in looked):
            yield node.lineno


def test_no_code_looks_into_a_sentence():
    package = Path(valve_friction_ros.__file__).parent
    found = {str(path.relative_to(package)): [*looks(path)] for path in package.rglob("*.py")}
    found.pop(FORMER)
    assert not {path: lines for path, lines in found.items() if lines}
