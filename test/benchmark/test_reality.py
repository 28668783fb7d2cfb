# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The benchmark of drawn valves: plants and sensors against closed forms; judged as it is said."""

import math
import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from benchmark.reality import package, records, trial
from benchmark.reality.motions import Kind, drawn_drive
from benchmark.reality.package import Answer, Number
from benchmark.reality.plants import (
    GRID,
    Body,
    Friction,
    Law,
    Motion,
    Plant,
    Trend,
    move,
    open_loop,
)
from benchmark.reality.records import Case, Nominal, Record, TrueValue, make_record, truth_of
from benchmark.reality.report import bounds, in_mode, is_useful, judged, report
from benchmark.reality.sensors import Instruments, Sensor, Signal, Stamping, measured
from benchmark.reality.trial import Row, Task, sliding_friction, tried
from benchmark.reality.valves import (
    IMPERFECTIONS,
    Draft,
    DrawnValve,
    drawn_cylinder,
    drawn_imperfections,
    drawn_valve,
    instruments_of,
)


def valves(count, slips=False, **options):
    return [drawn_valve(np.random.default_rng([3, n]), slips, **options) for n in range(count)]


@pytest.mark.parametrize("grown", [1.0, 2.0])
def test_the_actuator_strokes_the_valve(grown):
    for valve in valves(8, slips=True, reserve=2.2 if grown > 1.0 else 1.0):
        plant = replace(valve.plant, friction=valve.plant.friction.scaled(grown))
        loop = open_loop(valve.low, valve.high - valve.low, 1e-3)
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
    valve = DrawnValve(replace(IDEAL, friction=SLIPPING), 0.0, 4e5, 0.8, (0.0, 4e5), "diaphragm")
    draft = Draft(valve, instruments_of(valve, np.random.default_rng(0)))
    monkeypatch.setattr(records, "_draft", lambda *_: (draft, ()))
    record = make_record(Case(1, Kind.HUNTING, 0))
    seconds = record.position.stamps / 1e9
    every = np.interp(np.arange(seconds[0], seconds[-1], 0.5), seconds, record.position.values)
    moves = np.diff(every) / record.nominal.travel
    assert np.mean(np.abs(moves) < 2e-3) > 0.8
    jumps = moves[np.abs(moves) > 0.008]
    assert np.sum(np.diff(np.sign(jumps)) != 0) >= 5


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


IDEAL = Plant(Body(1.6, 2e5, 500.0, 0.02, 0.0, 0.03), Friction(200.0, 200.0, 4e3))
SLIPPING = Friction(200.0, 350.0, 4e3, stribeck_velocity=1e-3)


def truth(plant, drawn_instruments):
    loop = open_loop(0.0, 4e5, 0.1)
    points = round(4.0 / GRID)
    signal = np.concatenate([np.linspace(0.2, 0.6, points), np.linspace(0.6, 0.2, points)])
    motion = move(plant, loop, signal, np.zeros(signal.size), 0.0)
    return truth_of(plant, motion, drawn_instruments, 8.0)


def with_friction(**changes):
    return replace(IDEAL, friction=replace(IDEAL.friction, **changes))


def with_body(**changes):
    return replace(IDEAL, body=replace(IDEAL.body, **changes))


@pytest.fixture(scope="module")
def drawn_instruments():
    (valve,) = valves(1)
    return instruments_of(valve, np.random.default_rng(0))


def test_truth_of_an_ideal_plant(drawn_instruments):
    found = truth(IDEAL, drawn_instruments)
    assert found["coulomb_friction"] == TrueValue(
        pytest.approx(200.0), pytest.approx(0.0, abs=1e-6)
    )
    assert found["spring_constant"].value == pytest.approx(2e5)
    assert found["spring_preload"].value == pytest.approx(500.0)
    speed = 0.4 * 4e5 * 0.02 / 2e5 / 4.0
    assert found["sliding_friction"].value == pytest.approx(200.0 + 4e3 * speed, rel=0.02)
    assert math.isnan(found["stribeck_velocity"].value)
    assert math.isnan(truth(with_body(spring=0.0), drawn_instruments)["spring_constant"].value)


def test_truth_leaves_open_what_has_no_single_value(drawn_instruments):
    along = truth(with_friction(along_travel=Trend(0.2)), drawn_instruments)["coulomb_friction"]
    assert 0 < along.spread < 0.05 * along.value
    area = truth(with_body(area_change=-0.03), drawn_instruments)
    assert area["spring_constant"].spread > 0.002 * area["spring_constant"].value
    uneven = truth(with_friction(asymmetry=0.1), drawn_instruments)["spring_preload"]
    assert uneven.error(520.0) == pytest.approx(0.0, abs=1e-6)
    assert uneven.error(540.0) == pytest.approx(20.0, rel=1e-3)


STATED = {"coulomb_friction": TrueValue(100.0, 1.0), "sliding_friction": TrueValue(100.0)}


def row(value=100.0, half_width=1.0, verdict="identified", **options):
    numbers = dict.fromkeys(STATED, Number(value, half_width, verdict))
    parts = {"part": "plain", "name": "levels 0", "motion": "levels", "rate": 100.0, "share": 0.05}
    return Row(**(parts | {"truth": STATED, "numbers": numbers, "seconds": 0.1} | options))


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
    valve = DrawnValve(IDEAL, 0.0, 4e5, 0.8, (0.0, 4e5), "diaphragm")
    draft = Draft(valve, instruments_of(valve, np.random.default_rng(0)))
    monkeypatch.setattr(records, "_draft", lambda *_: (draft, ()))
    (one,) = tried(Task("plain", Case(1, Kind.LEVELS, 0), 60.0))
    assert (one.failure, one.refusal) == ("", "")
    assert is_useful(one)
    assert in_mode(one)
    assert 0.5 < one.numbers["coulomb_friction"].half_width / one.widths["coulomb_friction"] < 2.0


LOOP = open_loop(0.0, 1e5, 1e-3)
BODY = Body(1.6, 2e5, 500.0, pressure_reference=0.0)
FRICTION = Friction(400.0, 600.0, 2e4, stribeck_velocity=1e-3)


def ramps(*levels, seconds=2.0):
    """Commands that run from level to level."""
    points = round(seconds / GRID)
    return np.concatenate([np.linspace(a, b, points) for a, b in pairwise(levels)])


def moved(friction, signal, body=BODY, **options):
    return move(Plant(body, friction), LOOP, signal, np.zeros(signal.size), 0.0, **options)


@pytest.mark.parametrize("law", list(Law))
def test_work_is_not_lost(law):
    friction = replace(FRICTION, law=law, presliding=20e-6, limit_velocity=2e-4)
    motion = moved(friction, ramps(0.3, 0.8, 0.8, 0.3, 0.6))
    steps = np.diff(motion.position)

    def integral(force):
        return float(np.sum(0.5 * (force[1:] + force[:-1]) * steps))

    actuator = integral(BODY.area * motion.pressure)
    friction_work = integral(motion.friction)
    ends = motion.position[[0, -1]]
    stored = np.diff(0.5 * BODY.spring * ends**2 + BODY.preload * ends)[0]
    assert actuator == pytest.approx(stored + friction_work, rel=5e-3)
    assert friction_work > 0


@pytest.mark.parametrize("law", [Law.LUGRE, Law.MAXWELL])
def test_stiff_bristles_are_the_set_valued_law(law):
    signal = ramps(0.3, 0.8, 0.8, 0.3, 0.6)
    friction = replace(FRICTION, static=FRICTION.coulomb)
    rigid = moved(friction, signal)
    stiff = moved(replace(friction, law=law, presliding=1e-6), signal, step=1e-6)
    assert np.abs(rigid.position - stiff.position).max() < 8e-6
    assert stiff.work == pytest.approx(rigid.work, rel=1e-3)


@pytest.mark.parametrize("law", [Law.MOREAU, Law.KARNOPP, Law.LATCHED])
def test_sticks_below_static_friction(law):
    friction = replace(FRICTION, law=law)
    below = 0.5 + 0.95 * friction.static / (BODY.area * LOOP.span)
    above = 0.5 + 1.05 * friction.static / (BODY.area * LOOP.span)
    held, loose = moved(friction, ramps(0.5, below)), moved(friction, ramps(0.5, above))
    assert np.ptp(held.position) == 0
    assert held.distance == 0
    assert np.ptp(loose.position) > 1e-4


@pytest.mark.parametrize("law", list(Law))
def test_friction_at_constant_speed(law):
    friction = replace(FRICTION, law=law, presliding=10e-6, static=FRICTION.coulomb)
    motion = moved(friction, ramps(0.2, 1.2))
    later = motion.time > 1.0
    speed = np.polyfit(motion.time[later], motion.position[later], 1)[0]
    expected = friction.coulomb + friction.viscous * speed
    assert np.median(motion.friction[later]) == pytest.approx(expected, rel=2e-3)
    assert motion.work / motion.distance == pytest.approx(expected, rel=2e-2)


def test_slips_by_what_the_spring_holds():
    friction = Friction(400.0, 800.0, 4e3, stribeck_velocity=0.3e-3)
    motion = moved(friction, ramps(0.5, 0.75, seconds=20.0))
    jump = np.abs(motion.position[500:] - motion.position[:-500]).max()
    assert jump == pytest.approx(400.0 / BODY.spring, rel=0.2)


def test_friction_follows_travel_time_and_direction():
    there, back = slice(0, 20000), slice(40000, 60000)
    signal = ramps(0.2, 1.0, 1.0, 0.2)
    coulomb = replace(FRICTION, static=FRICTION.coulomb, viscous=0.0)

    def levels(friction, part):
        motion = moved(friction, signal)
        sliding = np.abs(np.gradient(motion.position, GRID)[part]) > 1e-3
        place = motion.position[part][sliding] / BODY.travel
        return place, np.abs(motion.friction[part][sliding])

    place, force = levels(replace(coulomb, along_travel=Trend(0.2)), there)
    assert force == pytest.approx(400.0 * (1 + 0.2 * (place - 0.5)), rel=1e-2)
    up, down = (levels(replace(coulomb, asymmetry=0.1), part)[1] for part in (there, back))
    assert np.median(up) == pytest.approx(440.0, rel=1e-2)
    assert np.median(down) == pytest.approx(360.0, rel=1e-2)
    first, last = (
        levels(replace(coulomb, in_record=Trend(0.2)), part)[1].mean() for part in (there, back)
    )
    assert first == pytest.approx(400.0 * (1 + 0.2 * (1 / 6 - 0.5)), rel=2e-2)
    assert last == pytest.approx(400.0 * (1 + 0.2 * (5 / 6 - 0.5)), rel=2e-2)


def test_stays_between_the_stops():
    body = replace(BODY, seat=0.3e-3, top=0.5e-3)
    motion = moved(FRICTION, ramps(0.5, -0.2, 2.0), body)
    assert motion.position.min() == pytest.approx(0.3e-3, abs=1e-9)
    assert motion.position.max() == pytest.approx(body.travel - 0.5e-3, abs=1e-9)


def test_volume_delays_the_stem():
    signal = ramps(0.3, 0.8)
    friction = replace(FRICTION, static=FRICTION.coulomb)
    prompt = moved(friction, signal)
    late = moved(friction, signal, replace(BODY, volume_lag=0.05))
    shift = round(0.05 / GRID)
    assert late.position[-1] == pytest.approx(prompt.position[-1 - shift], abs=5e-6)


@pytest.mark.parametrize("kind", [Kind.LOOP, Kind.STEPS])
def test_closed_loop_keeps_its_set_point(kind):
    valve = drawn_valve(np.random.default_rng(2), slips=False)
    drive = drawn_drive(kind, valve, np.random.default_rng(3))
    motion = move(valve.plant, drive.loop, drive.signal, drive.disturbance, drive.before)
    opening = motion.position / valve.plant.body.travel
    assert np.abs(opening - drive.signal)[opening.size // 2 :].mean() < 0.03
    assert np.ptp(opening) > 0.05


DURATION = 20.0


def motion(position, pressure=None):
    blank = np.zeros_like(position)
    pressure = blank if pressure is None else pressure
    return Motion(-1.0, pressure, position, blank, 0.0, 0.0, 0.0, 0.0, 0.0)


TIME = GRID * np.arange(round((DURATION + 1.0) / GRID) + 1) - 1.0
RAMP = motion(1e-3 * TIME, 1e3 * TIME)
QUIET = Sensor(noise=0.0, low=0.0, high=0.030)


def instruments(stamping=None, position=QUIET, pressure=QUIET, together=False):
    stamping = stamping or Stamping()
    return Instruments(pressure, position, stamping, stamping, together)


def stem(one, sensor=QUIET, stamping=None, seed=0):
    return measured(one, instruments(stamping, sensor), DURATION, seed)[1]


def seconds(signal):
    return signal.stamps / 1e9


def test_white_and_coloured_noise():
    white = stem(RAMP, replace(QUIET, noise=10e-6)).values - 1e-3 * np.arange(20000) * 1e-3
    coloured = replace(QUIET, noise=10e-6, colour=0.02)
    slow = stem(RAMP, coloured).values - 1e-3 * np.arange(20000) * 1e-3
    for noise, memory in ((white, 0.0), (slow, np.exp(-0.001 / 0.02))):
        assert noise.std() == pytest.approx(10e-6, rel=0.1)
        assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(memory, abs=0.03)


def test_quantisation():
    values = stem(RAMP, replace(QUIET, bits=10)).values
    codes = values / (0.030 / 2**10)
    assert codes == pytest.approx(np.round(codes), abs=1e-9)
    assert np.abs(values - 1e-3 * np.arange(20000) * 1e-3).max() <= 0.5001 * 0.030 / 2**10


def test_lag_and_drift():
    late = stem(RAMP, replace(QUIET, lag=0.04)).values[5000:]
    assert late == pytest.approx(1e-3 * (np.arange(5000, 20000) * 1e-3 - 0.04), abs=1e-9)
    still = motion(np.zeros_like(TIME))
    drifting = stem(still, replace(QUIET, drift=1e-6))
    assert drifting.values == pytest.approx(1e-6 * seconds(drifting), abs=1e-12)


def test_exception_reporting():
    signal = stem(RAMP, replace(QUIET, dead_band=0.01))
    assert np.diff(signal.values)[1:] == pytest.approx(3.0e-4, abs=2e-6)
    still = stem(motion(np.zeros_like(TIME)), replace(QUIET, dead_band=0.01, silence=5.0))
    assert seconds(still) == pytest.approx([0.0, 5.0, 10.0, 15.0])


def test_jitter_is_in_the_samples_and_not_in_the_stamps():
    signal = stem(RAMP, stamping=Stamping(rate=100.0, jitter=0.3))
    away = seconds(signal) * 100.0 - np.arange(signal.stamps.size)
    assert 0.28 < np.abs(away[1:]).max() <= 0.3
    assert signal.values == pytest.approx(1e-3 * seconds(signal), abs=1e-11)


def test_stamp_errors_are_not_in_the_samples():
    signal = stem(RAMP, stamping=Stamping(stamp_error=2e-4))
    errors = seconds(signal) - np.arange(20000) * 1e-3
    assert 1.9e-4 < np.abs(errors).max() <= 2e-4
    assert signal.values == pytest.approx(1e-6 * np.arange(20000), abs=1e-12)


def test_drops_bursts_and_offset():
    dropped = stem(RAMP, stamping=Stamping(drops=0.2))
    assert dropped.stamps.size == pytest.approx(16000, rel=0.03)
    gaps = np.diff(seconds(stem(RAMP, stamping=Stamping(bursts=2, burst=0.5))))
    assert np.sort(gaps)[-2:].sum() == pytest.approx(1.0, abs=0.01)
    late = stem(RAMP, stamping=Stamping(offset=0.01))
    assert late.values == pytest.approx(1e-3 * (seconds(late) - 0.01), abs=1e-12)


def test_rows_of_a_table_share_all_that_happens():
    clock = Stamping(jitter=0.3, drops=0.1)
    pressure, position = measured(RAMP, instruments(clock, together=True), DURATION, 0)
    assert (pressure.stamps == position.stamps).all()
    pressure, position = measured(RAMP, instruments(clock), DURATION, 0)
    assert (
        pressure.stamps.size != position.stamps.size or (pressure.stamps != position.stamps).any()
    )
