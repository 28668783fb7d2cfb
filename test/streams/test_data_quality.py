# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Faults of the data: when each begins and ends, and what is none."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.model import BENCH_VALVE, Valve
from valve_friction_ros.streams import (
    Arrivals,
    DataFault,
    DataQuality,
    FaultKind,
    Kind,
    LossCounter,
    RecordBuffer,
    SampleFault,
    Signal,
)

SECOND = 1_000_000_000
NOW = 1_800_000_000 * SECOND
TOLERANCE = 60.0
GOOD = {Kind.PRESSURE: 1e5, Kind.POSITION: 0.01}
REJECTED, OUTSIDE = FaultKind.REJECTED, FaultKind.OUTSIDE_TRAVEL
SKEW, CLOCK = FaultKind.SKEW, FaultKind.CLOCK


class Bench:
    """A buffer and its data quality, fed by a clock of the test's own."""

    def __init__(self, valve=BENCH_VALVE, tolerance=TOLERANCE):
        self.buffer, self.quality = RecordBuffer(valve, 60.0), DataQuality(valve)
        self.time, self.tolerance, self.has_clock = 0.0, tolerance, True

    def arrive(self, *samples):
        """Let samples (kind, seconds after now, value) arrive together."""
        clock = NOW + round(self.time * SECOND)
        arrivals = Arrivals(
            np.array([one[0] for one in samples], np.uint8),
            np.array([clock + round(one[1] * SECOND) for one in samples], np.int64),
            np.array([one[2] for one in samples], float),
        )
        intake = self.buffer.add_arrivals(arrivals)
        known = clock if self.has_clock else None
        self.quality.see(arrivals, intake, self.time, known, self.tolerance)

    def run(self, seconds, every=0.05, stem_every=None, **offsets):
        """Let both sensors speak for a while; `pressure`, `position`: values; `late`, `off`: s."""
        values = {kind: offsets.get(kind.name.lower(), good) for kind, good in GOOD.items()}
        late, off = offsets.get("late", 0.0), offsets.get("off", 0.0)
        for turn in range(round(seconds / every)):
            self.time += every
            samples = [(Kind.PRESSURE, off, values[Kind.PRESSURE])]
            if turn % round((stem_every or every) / every) == 0:
                kind = offsets.get("kind", Kind.POSITION)
                samples.append((kind, off + late, values[Kind.POSITION]))
            self.arrive(*samples)
        return self.faults()

    def faults(self):
        return self.quality.faults(self.time)


@pytest.fixture
def bench():
    found = Bench()
    assert found.run(5.0) == ()
    return found


BAD = {  # what arrives, the fault that it is, and words of its sentence
    "nan pressure": (
        {"pressure": math.nan},
        DataFault(REJECTED, Signal.PRESSURE, SampleFault.NOT_FINITE),
        ("actuator_pressure: 100 %", "not finite: check sensor"),
    ),
    "pressure too high": (
        {"pressure": 9e5},
        DataFault(REJECTED, Signal.PRESSURE, SampleFault.OUT_OF_RANGE),
        ("900000 Pa is outside the sensor's range", "pressure_maximum"),
    ),
    "nan position": (
        {"position": math.nan},
        DataFault(REJECTED, Signal.POSITION, SampleFault.NOT_FINITE),
        ("last usable sample 2 s ago", "check sensor"),
    ),
    "endless position": (
        {"position": 1e308},
        DataFault(REJECTED, Signal.POSITION, SampleFault.OUT_OF_RANGE),
        ("1e+308 m is outside the range of any valve", "unit (m)"),
    ),
    "no joint": (
        {"kind": Kind.NO_POSITION},
        DataFault(REJECTED, Signal.POSITION, SampleFault.NO_JOINT),
        ("no position for the joint 'stem'", "set joint"),
    ),
    "mm": (
        {"position": 9.0},
        DataFault(OUTSIDE, Signal.POSITION),
        ("for example 9 m", "read as m?"),
    ),
    "below its stop": (
        {"position": -0.01},
        DataFault(OUTSIDE, Signal.POSITION),
        ("for example -0.01 m", "check unit (m), zero and travel"),
    ),
    "late": ({"late": 5.0}, DataFault(SKEW), ("stamped 5 s later", "synchronise")),
    "early": ({"late": -5.0}, DataFault(SKEW), ("stamped 5 s earlier", "synchronise")),
    "ahead": (
        {"off": 3e8},
        DataFault(CLOCK),
        ("both inputs are 3472 days ahead", "synchronise"),
    ),
    "behind": ({"off": -3e8}, DataFault(CLOCK), ("inputs are 3472 days behind", "use_sim_time")),
}


@pytest.mark.parametrize("name", BAD)
def test_a_fault_is_found_within_2_s_and_over_2_s_after_it(bench, name):
    """Its sentence has the cause and the remedy."""
    how, fault, words = BAD[name]
    found = bench.run(2.0, **how)
    assert [one for one in found if one.cause is not SampleFault.BACK] == [fault]
    told = str(bench.run(0.1, **how)[0].statement(BENCH_VALVE, "stem"))
    assert all(one in told for one in words), told
    assert "\n" not in told
    assert bench.run(2.1) == ()


def test_unstamped_messages():
    bench = Bench()
    kinds, values = np.array([*GOOD], np.uint8), np.array([*GOOD.values()])
    for turn in range(40):
        bench.time = 0.05 * turn
        arrivals = Arrivals(kinds, np.zeros(2, np.int64), values)
        intake = bench.buffer.add_arrivals(arrivals)
        bench.quality.see(arrivals, intake, bench.time, NOW, TOLERANCE)
    found = set(bench.faults())
    assert DataFault(REJECTED, Signal.PRESSURE, SampleFault.REPEATED) in found
    assert DataFault(REJECTED, Signal.POSITION, SampleFault.REPEATED) in found
    assert DataFault(CLOCK) in found


def test_two_publishers_on_one_topic():
    bench = Bench()
    for turn in range(40):
        bench.time += 0.05
        bench.arrive((Kind.PRESSURE, -(turn % 2), 1e5), (Kind.POSITION, 0.0, 0.01))
    assert DataFault(REJECTED, Signal.PRESSURE, SampleFault.BACK) in bench.faults()


def test_a_rejected_sample_is_not_usable(bench):
    assert bench.quality.unusable(Signal.POSITION, bench.time) == 0.0
    bench.run(3.0, position=math.nan)
    assert bench.quality.unusable(Signal.POSITION, bench.time) == pytest.approx(3.0)
    assert bench.quality.unusable(Signal.PRESSURE, bench.time) == 0.0
    assert math.isinf(DataQuality(BENCH_VALVE).unusable(Signal.PRESSURE, 1.0))


def test_a_share_begins_at_5_percent_and_ends_below_1(bench):
    def one_bad_of(count):
        for _ in range(600 // count):
            bench.run(0.01, 0.01, position=math.nan)
            bench.run(0.01 * (count - 1), 0.01)
        return {one.kind for one in bench.faults()}

    assert one_bad_of(25) == set()  # 4 %
    assert one_bad_of(15) == {REJECTED}  # 7 %
    assert one_bad_of(50) == {REJECTED}  # 2 %, and it has begun
    assert one_bad_of(300) == set()


def test_damaged_messages():
    bench = Bench()
    intake = bench.buffer.drop_damaged(Signal.POSITION, 3)
    bench.quality.see(Arrivals.joined(()), intake, 0.0)
    (found,) = bench.faults()
    assert found == DataFault(REJECTED, Signal.POSITION, SampleFault.DAMAGED)
    assert "no usable sample yet: the messages are damaged" in str(found.statement(BENCH_VALVE))
    assert sum(bench.buffer.rejected.values()) == 3


def test_a_sensor_that_reports_seldom_is_none_and_its_fault_lasts_to_its_next_sample(bench):
    assert bench.run(60.0, stem_every=10.0) == ()
    bench.run(10.0, stem_every=10.0, position=math.nan)
    bench.run(9.9, stem_every=100.0)
    assert bench.faults() == ()  # its first sample of this run is good
    bench.run(1.0, stem_every=100.0, position=math.nan)
    bench.time += 30.0
    assert [one.kind for one in bench.faults()] == [REJECTED]


def test_a_stem_that_stands_still_is_none(bench):
    assert bench.run(3600.0, every=1.0) == ()


@pytest.mark.parametrize("speed", [0.1, 1.0, 3.0, 20.0])
@pytest.mark.parametrize("period", [0.01, 1.0, 10.0])
def test_a_recording_is_played_at_any_speed(speed, period):
    """Its stamps go on by `speed`; both signals are sampled at other times."""
    bench, stamps = Bench(tolerance=0.0), {Kind.PRESSURE: 0.0, Kind.POSITION: -0.5 * period}
    for turn in range(400):
        kind = Kind.POSITION if turn % 2 else Kind.PRESSURE
        bench.time += 0.5 * period / speed
        stamps[kind] += period
        bench.arrive((kind, stamps[kind] - bench.time, GOOD[kind]))
        assert bench.faults() == ()


@pytest.mark.parametrize("how", ["no clock", "no tolerance"])
def test_stamps_are_compared_with_a_comparable_clock_only(how):
    bench = Bench(tolerance=0.0 if how == "no tolerance" else TOLERANCE)
    bench.has_clock = how != "no clock"
    bench.run(3.0, off=-3e8)
    assert bench.faults() == ()


def test_the_stamps_of_a_recording_are_forgotten(bench):
    """Also after its end, when nothing arrives that could show the clock to be right."""
    bench.run(3.0, off=-3e8)
    assert [one.kind for one in bench.faults()] == [CLOCK]
    bench.quality.forget_clocks()
    bench.run(0.5, off=-3e8)
    bench.time += 60.0
    assert bench.faults() == ()


def test_a_backlog_is_none(bench):
    """A node that was held up takes old samples first, in one turn or two."""
    bench.time += 100.0
    bench.arrive(*((kind, -90.0 + k, GOOD[kind]) for k in range(10) for kind in GOOD))
    bench.time += 0.05
    bench.arrive(*((kind, -79.0 + k, GOOD[kind]) for k in range(80) for kind in GOOD))
    bench.run(0.05)
    assert bench.faults() == ()


def test_one_signal_with_a_wrong_clock(bench):
    bench.run(2.0, late=1000.0)
    assert set(bench.faults()) == {DataFault(SKEW), DataFault(CLOCK, Signal.POSITION)}


def test_a_jump_of_the_clock_is_forgotten(bench):
    bench.run(2.0, off=-3e8)
    assert bench.faults()
    bench.quality.forget_stamps()
    assert {one.kind for one in bench.faults()} <= {REJECTED}


def test_without_travel_any_place_of_a_stem_is_possible():
    bench = Bench(replace(BENCH_VALVE, travel=math.inf))
    assert bench.run(3.0, position=9.0) == ()
    assert [one.kind for one in bench.run(3.0, position=11.0)] == [REJECTED]


def test_the_machine_without_ranges_takes_any_pressure():
    bench = Bench(Valve(1.0))
    assert bench.run(3.0, pressure=-1e300) == ()


def counted(*looks, period=0.1):
    """The losses after some looks at the stream, `period` s apart."""
    counter, now = LossCounter(), 0.0
    for now, numbers in zip(itertools.count(0.0, period), looks):
        counter.take(numbers, now)
    return counter.losses(now)


@given(st.sets(st.integers(1, 400), max_size=300), st.integers(1, 60))
def test_each_that_is_missing_is_counted(missing, size):
    """By any looks; those before the first and behind the last cannot be known."""
    sent = [one for one in range(402) if one not in missing]
    looks = [sent[begin : begin + size] for begin in range(0, len(sent), size)]
    losses = counted(*looks, period=0.01)
    assert losses.lost == losses.recently_lost == len(missing)
    assert losses.share == pytest.approx(len(missing) / 402 if missing else 0.0)


@given(st.lists(st.booleans(), max_size=200))
def test_publishers_are_told_apart(turns):
    """One that has published for long, and a new one, in any order."""
    old, new = itertools.count(70_000), itertools.count(1)
    assert counted([next(old)], [next(new if turn else old) for turn in turns]).lost == 0


def test_one_that_was_there_before_is_no_loss_of_another():
    assert counted([1, 2, 3], [500_000, 500_001], [4, 5]).lost == 0


def test_a_publisher_that_begins_anew():
    assert counted([900, 901], [1, 2], [3, 5]).lost == 1


def senders(*publishers, until=6.0, period=0.1):
    """How many send at once at the end; each has a begin, an end, s, and its first number."""
    counter = LossCounter()
    for look in range(round(until / period) + 1):
        now = look * period
        for begin, end, first in publishers:
            if begin <= now < end:
                counter.take([first + look - round(begin / period)], now)
    return counter.senders(until)


def test_publishers_that_send_at_once_are_counted():
    assert senders((0.0, 9.0, 500)) == 1
    assert senders((0.0, 9.0, 500), (1.0, 9.0, 1)) == 2
    assert senders((0.0, 9.0, 1), (0.0, 9.0, 1)) == 2
    assert senders((0.0, 9.0, 1), (0.0, 9.0, 1), (1.0, 9.0, 1)) == 3
    assert senders((0.0, 9.0, 500), (1.0, 9.0, 1), until=9.9, period=3.3) == 2


@pytest.mark.parametrize("pause", [0.0, 0.5, 7.0])
@pytest.mark.parametrize("lasts", [0.5, 3.0, 9.0])
def test_a_restarted_publisher_is_no_second_one(pause, lasts):
    """Also when it comes to the numbers that it had before."""
    for until in np.arange(lasts + pause, 2 * lasts + pause + 6.0, 0.5):
        assert senders((0.0, lasts, 1), (lasts + pause, 99.0, 1), until=until) <= 1


def test_one_that_has_ended_is_no_longer_counted():
    assert senders((0.0, 9.0, 500), (0.0, 20.0, 1), until=13.9) == 2
    assert senders((0.0, 9.0, 500), (0.0, 20.0, 1), until=14.2) == 1


def test_the_share_is_of_the_last_minute():
    counter = LossCounter()
    counter.take(range(100), 0.0)
    counter.take(range(200, 300), 1.0)
    assert counter.losses(1.0).share == pytest.approx(1 / 3)
    assert counter.losses(31.0).silence == pytest.approx(30.0)
    for second in range(2, 120):
        counter.take(range(100 * second + 100, 100 * second + 200), float(second))
    losses = counter.losses(120.0)
    assert (losses.lost, losses.recently_lost) == (100, 0)
    assert losses.share == 0.0


def test_few_publishers_are_held():
    counter = LossCounter()
    for first in range(10**9, 10**5, -(10**7)):
        counter.take([first], 0.0)
    assert len(counter._publishers) == 16
    assert counter.losses(0.0).lost == 0
    assert np.isinf(counter.losses(0.0).silence)
