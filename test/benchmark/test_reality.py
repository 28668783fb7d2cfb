# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The draws are valves that can exist, the same each time; judged and counted as it is said."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest

from benchmark.reality import package, records, trial
from benchmark.reality.imperfections import (
    IMPERFECTIONS,
    Draft,
    drawn_imperfections,
    instruments_of,
)
from benchmark.reality.least_squares import sliding_friction
from benchmark.reality.motions import Kind, drawn_drive
from benchmark.reality.package import Answer, Number
from benchmark.reality.plants import Body, Friction, Plant, Trend, move
from benchmark.reality.plants.kernel import GRID, Loop
from benchmark.reality.real import real_rows
from benchmark.reality.records import Case, Nominal, Record, load, make_record, save
from benchmark.reality.report import bounds, in_mode, is_right, is_useful, judged, report
from benchmark.reality.sensors import Signal
from benchmark.reality.trial import Row, Task, rows_of, tried
from benchmark.reality.truth import TrueValue, truth_of
from benchmark.reality.valves import DrawnValve, drawn_cylinder, drawn_valve


def valves(count, slips=False, **options):
    return [drawn_valve(np.random.default_rng([3, n]), slips, **options) for n in range(count)]


def test_sizes_of_drawn_valves():
    for slips in (False, True):
        for valve in valves(100, slips):
            body, friction = valve.plant.body, valve.plant.friction
            assert 0.004 <= body.area <= 0.12
            assert 0.008 <= body.travel <= 0.08
            assert 2e4 <= body.spring <= 2e6
            assert 0.003 <= valve.friction_share <= 0.3
            assert valve.slips is slips
            assert friction.viscous <= 0.6001 * valve.filling * body.spring
            if slips:
                assert 1.15 <= friction.static / friction.coulomb <= 2.0
                assert 0.3e-3 <= friction.stribeck_velocity <= 5e-3


@pytest.mark.parametrize("grown", [1.0, 2.0])
def test_the_actuator_strokes_the_valve(grown):
    for valve in valves(8, slips=True, reserve=2.2 if grown > 1.0 else 1.0):
        plant = replace(valve.plant, friction=valve.plant.friction.scaled(grown))
        loop = Loop(False, False, 0.0, 1.0, 1000, 1.0, valve.low, valve.high - valve.low, 1e-3)
        points = round(2.0 * valve.settling / GRID) + 20_000
        there_and_back = np.concatenate([np.linspace(0.0, 1.0, points), np.ones(points)])
        signal = np.concatenate([there_and_back, 1.0 - there_and_back])
        motion = move(plant, loop, signal, np.zeros(signal.size), 0.0)
        assert np.ptp(motion.position[: 2 * points]) > 0.9 * plant.body.travel
        assert np.ptp(motion.position[2 * points :]) > 0.9 * plant.body.travel


@pytest.mark.parametrize("kind", Kind)
def test_a_record_moves_both_ways_and_is_the_same_each_time(kind):
    case = Case(5, kind, 0)
    first, again = make_record(case), make_record(case)
    way = np.diff(first.position.values[:: max(first.position.values.size // 200, 1)])
    assert way.max() > 0.0 > way.min()
    assert np.ptp(first.position.values) > 0.004 * first.nominal.travel
    assert first.truth["sliding_friction"].value > 0.0
    assert 1 <= len(first.imperfections) <= 3
    for name in ("pressure", "position"):
        signal, same = getattr(first, name), getattr(again, name)
        assert (signal.stamps == same.stamps).all()
        assert (signal.values == same.values).all()
        assert (np.diff(signal.stamps) >= 0).all()


def test_records_of_one_valve():
    case = Case(5, Kind.LEVELS, 1, reserve=2.2)
    first, other = make_record(case), make_record(case._replace(again=1))
    grown = make_record(case._replace(again=2, change=1.5))
    assert other.nominal == first.nominal
    assert other.imperfections == first.imperfections
    assert not np.array_equal(other.position.values, first.position.values)
    for name in ("coulomb_friction", "static_friction", "viscous_friction"):
        assert grown.truth[name].value == pytest.approx(1.5 * first.truth[name].value, rel=0.05)
    assert grown.truth["spring_constant"].value == pytest.approx(
        first.truth["spring_constant"].value, rel=0.03
    )


def test_a_loop_hunts_by_rests_and_jumps(monkeypatch):
    valve = DrawnValve(replace(PLANT, friction=SLIPPING), 0.0, 4e5, 0.8, (0.0, 4e5), "diaphragm")
    draft = Draft(valve, instruments_of(valve, np.random.default_rng(0)))
    monkeypatch.setattr(records, "_draft", lambda *_: (draft, ()))
    record = make_record(Case(1, Kind.HUNTING, 0))
    seconds = record.position.stamps / 1e9
    every = np.interp(np.arange(seconds[0], seconds[-1], 0.5), seconds, record.position.values)
    moves = np.diff(every) / record.nominal.travel
    assert np.mean(np.abs(moves) < 2e-3) > 0.8
    jumps = moves[np.abs(moves) > 0.008]
    assert np.sum(np.diff(np.sign(jumps)) != 0) >= 5


@pytest.mark.parametrize("name", IMPERFECTIONS)
def test_each_imperfection_changes_something(name):
    random = np.random.default_rng(1)
    valve = drawn_valve(random, slips=False)
    draft = Draft(valve, instruments_of(valve, random))
    assert IMPERFECTIONS[name](draft, random) != draft


def test_imperfections_do_not_exclude_each_other():
    seen = set()
    for seed in range(300):
        random = np.random.default_rng([1, seed])
        is_cylinder = seed % 2 == 0
        valve = drawn_cylinder(random, True) if is_cylinder else drawn_valve(random, slips=False)
        _, names = drawn_imperfections(valve, random)
        seen |= set(names)
        assert len(set(names) & {"stem lag", "pressure lag", "volume", "clock offset"}) <= 1
        assert not (is_cylinder and set(names) & {"curved", "Karnopp", "latched"})
    assert seen == set(IMPERFECTIONS)


def test_steps_are_those_of_the_standard():
    (valve,) = valves(1)
    drive = drawn_drive(Kind.STEPS, valve, np.random.default_rng(1))
    sizes = np.unique(np.abs(np.diff(drive.signal)).round(6))
    assert sizes[sizes > 0] == pytest.approx([0.01, 0.02, 0.05, 0.1])


def record_of(force, position, period=0.01, **options):
    stamps = np.rint(np.arange(position.size) * period * 1e9).astype(np.int64)
    nominal = Nominal(0.02, 0.0, 0.03)
    return Record(nominal, Signal(stamps, force / 0.02), Signal(stamps, position), **options)


def test_least_squares_finds_what_is_so():
    period = np.arange(0.0, 40.0, 0.01)
    position = 0.015 + 0.01 * np.sin(0.5 * period)
    speed = 0.005 * np.cos(0.5 * period)
    force = 100.0 * np.sign(speed) + 4e3 * speed + 2e5 * position + 500.0
    expected = 100.0 + 4e3 * np.sum(speed**2) / np.sum(np.abs(speed))
    assert sliding_friction(record_of(force, position, truth={})) == pytest.approx(
        expected, rel=2e-3
    )


PLANT = Plant(Body(1.6, 2e5, 500.0, 0.02, 0.0, 0.03), Friction(200.0, 200.0, 4e3))
SLIPPING = Friction(200.0, 350.0, 4e3, stribeck_velocity=1e-3)


def truth(plant, instruments):
    loop = Loop(False, False, 0.0, 1.0, 1000, 1.0, 0.0, 4e5, 0.1)
    points = round(4.0 / GRID)
    signal = np.concatenate([np.linspace(0.2, 0.6, points), np.linspace(0.6, 0.2, points)])
    motion = move(plant, loop, signal, np.zeros(signal.size), 0.0)
    return truth_of(plant, motion, instruments, 8.0)


def with_friction(**changes):
    return replace(PLANT, friction=replace(PLANT.friction, **changes))


def with_body(**changes):
    return replace(PLANT, body=replace(PLANT.body, **changes))


@pytest.fixture(scope="module")
def instruments():
    (valve,) = valves(1)
    return instruments_of(valve, np.random.default_rng(0))


def test_truth_of_an_ideal_plant(instruments):
    found = truth(PLANT, instruments)
    assert found["coulomb_friction"] == TrueValue(
        pytest.approx(200.0), pytest.approx(0.0, abs=1e-6)
    )
    assert found["spring_constant"].value == pytest.approx(2e5)
    assert found["spring_preload"].value == pytest.approx(500.0)
    speed = 0.4 * 4e5 * 0.02 / 2e5 / 4.0
    assert found["sliding_friction"].value == pytest.approx(200.0 + 4e3 * speed, rel=0.02)
    assert math.isnan(found["stribeck_velocity"].value)
    assert math.isnan(truth(with_body(spring=0.0), instruments)["spring_constant"].value)


def test_truth_leaves_open_what_has_no_single_value(instruments):
    along = truth(with_friction(along_travel=Trend(0.2)), instruments)["coulomb_friction"]
    assert 0 < along.spread < 0.05 * along.value
    area = truth(with_body(area_change=-0.03), instruments)
    assert area["spring_constant"].spread > 0.002 * area["spring_constant"].value
    uneven = truth(with_friction(asymmetry=0.1), instruments)["spring_preload"]
    assert uneven.error(520.0) == pytest.approx(0.0, abs=1e-6)
    assert uneven.error(540.0) == pytest.approx(20.0, rel=1e-3)


TRUTH = {"coulomb_friction": TrueValue(100.0, 1.0), "sliding_friction": TrueValue(100.0)}


def row(value=100.0, half_width=1.0, verdict="identified", **options):
    numbers = dict.fromkeys(TRUTH, Number(value, half_width, verdict))
    parts = {"part": "plain", "name": "levels 0", "motion": "levels", "rate": 100.0, "share": 0.05}
    return Row(**(parts | {"truth": TRUTH, "numbers": numbers, "seconds": 0.1} | options))


@pytest.mark.parametrize(
    ("value", "half_width", "inside", "wrong"),
    [
        (101.5, 0.6, True, False),  # 0.5 beyond what is open
        (104.0, 2.0, False, False),  # outside, within three half widths
        (104.0, 0.5, False, True),
        (102.5, 0.1, False, False),  # off by 1.5 % only
    ],
)
def test_wrong_and_inside(value, half_width, inside, wrong):
    one = judged([row(value, half_width)])[0]
    assert (one.name, one.inside, one.wrong) == ("coulomb_friction", inside, wrong)
    weak = judged([row(value, half_width, "weak")])[0]
    assert (weak.inside, weak.wrong) == (inside, False)
    assert not judged([row(value, half_width, "not identifiable")])


@pytest.mark.parametrize(
    ("value", "half_width", "useful"),
    [(109.0, 9.0, True), (111.0, 9.0, False), (100.0, 11.0, False), (math.nan, math.nan, False)],
)
def test_useful(value, half_width, useful):
    assert is_useful(row(value, half_width, "weak")) is useful


def test_least_squares_is_right_within_five_percent():
    assert is_right(row(least_squares=95.5))
    assert not is_right(row(least_squares=94.5))
    assert not is_right(row())


@pytest.mark.parametrize(
    ("found", "coulomb", "width", "same"),
    [
        (1009.0, 104.9, 1.0, True),  # no half width below 2 %, and 1 N beyond is open
        (1009.0, 105.1, 1.0, False),
        (1009.0, 110.9, 5.0, True),
        (1011.0, 100.0, 5.0, False),
        (900.0, 100.0, 5.0, True),
        (math.nan, 100.0, 5.0, False),
    ],
)
def test_mode_of_the_truth(found, coulomb, width, same):
    widths = {"coulomb_friction": width}
    assert in_mode(row(found=found, begun=1000.0, coulomb=coulomb, widths=widths)) is same
    assert not in_mode(row())


def missed(*rows):
    return [one.what for one in bounds(rows) if not one.met]


def test_bounds():
    good = row(least_squares=100.0, found=1.0, begun=1.0, coulomb=100.0, slips=True)
    widths = {"coulomb_friction": 0.8, "sliding_friction": 0.8}
    static = {"static_friction": Number(150.0, 1.0, "identified"), **good.numbers}
    good = replace(good, numbers=static, widths=widths)
    watched = [
        row(part="alarms", change=change, has_baseline=True, alarms=alarms)
        for change, alarms in (
            (1.0, {}),
            (1.5, {"high": "!"}),
            (2.0, {"high": "!"}),
            (0.45, {"low": "!"}),
        )
    ]
    assert not missed(good, *watched)
    assert missed(replace(good, widths=dict.fromkeys(widths, 0.7)), *watched) == [
        "median half width over that at the truth: at most 1.3"
    ]
    assert missed(good, replace(watched[0], alarms={"other": "C"}), *watched[1:]) == [
        "alarms of unchanged valves: none"
    ]
    assert missed(good, watched[0], replace(watched[1], alarms={"low": "!"}), *watched[2:]) == [
        "friction ×1.5 declared: at least 85%"
    ]
    assert missed(replace(good, failure="odd", seconds=2.5), *watched) == [
        "records above 2 s: none",
        "failures: none",
    ]
    vague = replace(good, numbers={**static, "sliding_friction": Number(100.0, 20.0, "weak")})
    assert "useful: at least 70%" in missed(vague, *watched)
    text = "\n".join(report([good, *watched]))
    assert "**missed**" not in text
    assert "| levels | 1 | 0 | 1 | 1 | 1 | 1 | 0 |" in text


def test_rows_come_back_from_their_file(tmp_path):
    path = tmp_path / "rows.jsonl"
    one = row(half_width=math.nan, imperfections=("noise",), warnings=("a",), alarms={"high": "b"})
    path.write_text(one.as_line() + "\n", encoding="utf-8")
    (back,) = rows_of(path)
    assert back.as_line() == one.as_line()
    assert back.imperfections == ("noise",)


def test_records_come_back_from_their_folder(tmp_path):
    record = make_record(Case(5, Kind.FROM_MIDDLE, 0))
    save(record, tmp_path / "one.npz")
    (back,) = load(tmp_path)
    assert (back.nominal, back.name, back.late) == (record.nominal, record.name, record.late)
    assert back.truth["coulomb_friction"] == record.truth["coulomb_friction"]
    assert (back.pressure.stamps == record.pressure.stamps).all()
    assert (back.position.values == record.position.values).all()


def task(part="plain", limit=1.0):
    return Task(part, Case(5, Kind.FROM_MIDDLE, 0), limit)


@pytest.fixture
def _no_warm_up(monkeypatch):
    monkeypatch.setattr(trial, "_warm", True)


@pytest.mark.usefixtures("_no_warm_up")
def test_whatever_an_identification_does_each_record_has_its_row(monkeypatch):
    def odd(_):
        raise RuntimeError("odd")

    def endless(_):
        while True:
            time.perf_counter()

    monkeypatch.setattr(package, "identify", odd)
    (one,) = tried(task())
    assert one.failure == "RuntimeError: odd"
    assert one.truth["sliding_friction"].value > 0
    monkeypatch.setattr(package, "identify", endless)
    (one,) = tried(task(limit=0.2))
    assert one.failure == "TimeoutError: more than 0.2 s of the processor"
    monkeypatch.setattr(package, "identify", lambda _: Answer(refusal="no"))
    (one,) = tried(task())
    assert (one.refusal, one.failure, one.numbers) == ("no", "", {})
    changes = [(one.change, one.has_baseline, one.alarms) for one in tried(task("alarms"))]
    assert changes == [(change, False, {}) for change in trial.CHANGES]


@pytest.mark.usefixtures("_no_warm_up")
def test_the_package_answers_and_is_compared_with_the_truth(monkeypatch):
    valve = DrawnValve(PLANT, 0.0, 4e5, 0.8, (0.0, 4e5), "diaphragm")
    draft = Draft(valve, instruments_of(valve, np.random.default_rng(0)))
    monkeypatch.setattr(records, "_draft", lambda *_: (draft, ()))
    (one,) = tried(Task("plain", Case(1, Kind.LEVELS, 0), 60.0))
    assert (one.failure, one.refusal) == ("", "")
    assert is_useful(one)
    assert in_mode(one)
    assert 0.5 < one.numbers["coulomb_friction"].half_width / one.widths["coulomb_friction"] < 2.0


def test_real_machines_that_are_absent_are_left_out(tmp_path):
    assert list(real_rows(tmp_path)) == []
