# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Samples: their dates, their buffer, their arrival by the block, and both signals on one grid."""

import math
from collections import Counter
from contextlib import nullcontext
from datetime import datetime, timezone

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.streams import (
    Arrivals,
    Intake,
    Kind,
    RecordBuffer,
    Samples,
    nanoseconds,
    rows_arrived,
    uniform_recording,
    utc,
)
from valve_friction_ros.streams.samples import SampleBuffer

START = 1_700_000_000_000_000_000  # ns, where float seconds are 238 ns apart


def test_nanoseconds_are_the_nearest():
    found = [nanoseconds(seconds) for seconds in (0.0, 0.1 + 0.2, 1 / 3, -0.5)]
    assert found == [0, 300_000_000, 333_333_333, -500_000_000]
    assert isinstance(found[1], int)


def test_the_window_holds_its_ends():
    """A sample exactly one window old is in; one nanosecond older is out."""
    buffer = SampleBuffer(1.0)
    for stamp in (START - 1, START, START + 500, START + 10**9):
        buffer.append(stamp, 1.0)
    np.testing.assert_array_equal(buffer.samples().stamps, [START, START + 500, START + 10**9])


def test_samples_are_a_copy_until_a_clear():
    buffer = SampleBuffer(1.0)
    buffer.append(START, 1.0)
    before = buffer.samples()
    buffer.append(START + 1, 2.0)
    before.values[0] = 9.0
    assert before.stamps.size == 1
    assert buffer.samples().values.tolist() == [1.0, 2.0]
    buffer.clear()
    assert len(buffer) == 0
    assert buffer.last_stamp is None
    buffer.append(0, 2.0)  # earlier than what was there before
    assert buffer.samples().values.tolist() == [2.0]


@given(
    pauses=st.lists(st.integers(1, 8_000_000), min_size=1, max_size=60),
    repeats=st.integers(1, 80),
    block=st.integers(1, 3000),
    window=st.integers(1, 3 * 10**9),
)
def test_blocks_are_what_their_samples_are(pauses, repeats, block, window):
    """Chunks whose stamps fit 32 bits and chunks whose stamps do not, cut anywhere."""
    stamps = START + np.cumsum(pauses * repeats)
    values = np.sqrt(np.arange(stamps.size))
    buffer = SampleBuffer(window / 1e9)
    for begin in range(0, stamps.size, block):
        part = slice(begin, begin + block)
        buffer.extend(Samples(stamps[part], values[part]))
        last = stamps[part][-1]
        assert buffer.last_stamp == last
        assert len(buffer) == np.count_nonzero((stamps >= last - window) & (stamps <= last))
    inside = stamps >= stamps[-1] - window
    np.testing.assert_array_equal(buffer.samples().stamps, stamps[inside])
    np.testing.assert_array_equal(buffer.samples().values, values[inside])


def test_even_stamps_take_no_memory():
    """One stamp that is 1 ns late costs its chunk of 1024 samples their 4 bytes each."""
    stamps, values = START + 1_000_000 * np.arange(4096), np.zeros(4096)
    uneven = stamps.copy()
    uneven[2000] += 1
    sizes = []
    for some in (stamps, uneven):
        buffer = SampleBuffer(10.0)
        buffer.extend(Samples(some, values))
        np.testing.assert_array_equal(buffer.samples().stamps, some)
        sizes.append(buffer.nbytes)
    opened = 1024 * 16
    assert sizes == [opened + 8 * 4096, opened + 8 * 4096 + 4 * 1024]


def test_a_stamp_is_nanoseconds_since_1970_in_utc():
    assert utc(0) == datetime(1970, 1, 1, tzinfo=timezone.utc)
    assert utc(951_782_400_500_000_000) == datetime(2000, 2, 29, 0, 0, 0, 500_000, timezone.utc)


ARRIVALS_START = 1_700_000_000  # s


def arrivals(samples):
    kinds, stamps, values = zip(*samples, strict=True) if samples else ((), (), ())
    return Arrivals(np.array(kinds, np.uint8), np.array(stamps, np.int64), np.array(values, float))


def add_one_by_one(buffer, samples):
    """Each as a block of its own."""
    intakes = [buffer.add_arrivals(arrivals([one])) for one in samples]
    rejected = sum((Counter(one.rejected) for one in intakes), Counter())
    return Intake(rejected, next((one.cleared for one in intakes if one.cleared), None))


@st.composite
def streams(draw):
    """Blocks of both signals, most of them good; stamps may repeat or go back."""
    steps = st.one_of(st.integers(1, 3), st.integers(1, 3), st.sampled_from([0, -2]))
    values = {
        Kind.PRESSURE: st.one_of(
            st.floats(0, 250e3), st.sampled_from([math.nan, math.inf, -1.0, 250e3 + 1])
        ),
        Kind.POSITION: st.one_of(
            st.floats(0, 0.03), st.sampled_from([math.nan, -math.inf, 1e308, -11.0])
        ),
        Kind.NO_POSITION: st.just(math.nan),
    }
    good = {Kind.PRESSURE: st.floats(0, 250e3), Kind.POSITION: st.floats(0, 0.03)}
    clocks = {False: 0, True: 0}
    blocks = []
    for _ in range(draw(st.integers(1, 5))):
        is_good = draw(st.booleans())
        block = []
        for _ in range(draw(st.integers(0, 12))):
            kind = draw(st.sampled_from(list(good if is_good else values)))
            clock = kind == Kind.PRESSURE
            clocks[clock] += draw(st.integers(1, 3) if is_good else steps)
            value = draw((good if is_good else values)[kind])
            block.append((kind, ARRIVALS_START * 10**9 + clocks[clock] * 10**8, value))
        blocks.append(block)
    return blocks


@given(blocks=streams())
def test_a_block_is_what_its_samples_are(blocks):
    whole, single = (RecordBuffer(BENCH_VALVE, 1.0) for _ in range(2))
    for block in blocks:
        assert whole.add_arrivals(arrivals(block)) == add_one_by_one(single, block)
        assert len(whole) == len(single)
        found, expected = whole.snapshot(), single.snapshot()
        for one, other in zip(found[:2], expected[:2], strict=True):
            np.testing.assert_array_equal(one.stamps, other.stamps)
            np.testing.assert_array_equal(one.values, other.values)
        assert found[2:] == expected[2:]


def table(stamps, pressure=1e5, position=0.01):
    return np.column_stack(np.broadcast_arrays(stamps, pressure, position))


class TestTables:
    def test_rows_become_pairs(self):
        kinds, stamps, values = rows_arrived([[0.001, 1e5, 0.01], [0.002, 2e5, 0.02]])
        assert kinds.tolist() == [Kind.PRESSURE, Kind.POSITION] * 2
        assert stamps.tolist() == [1_000_000, 1_000_000, 2_000_000, 2_000_000]
        assert values.tolist() == [1e5, 0.01, 2e5, 0.02]

    @given(st.lists(st.integers(0, 2_000_000_000 * 10**6), min_size=1, max_size=20))
    def test_whole_microseconds_come_back(self, microseconds):
        """Up to the year 2033; 0.24 µs is what floats of this size tell apart."""
        seconds = np.array([value / 1e6 for value in microseconds])
        expected = [1000 * value for value in microseconds]
        assert rows_arrived(table(seconds)).stamps[::2].tolist() == expected

    @given(st.lists(st.integers(-8_000_000 * 10**9, 8_000_000 * 10**9), min_size=1, max_size=20))
    def test_nanoseconds_of_small_times_come_back(self, nanoseconds):
        seconds = np.array([value / 1e9 for value in nanoseconds])
        assert rows_arrived(table(seconds)).stamps[::2].tolist() == nanoseconds

    @pytest.mark.parametrize(
        ("shape", "told"),
        [((4, 2), "(4, 2)"), ((4, 4), "(4, 4)"), ((3,), "(3,)"), ((1, 4, 3), "(1, 4, 3)")],
    )
    def test_other_shapes_are_refused(self, shape, told):
        with pytest.raises(ValueError, match="the shape is") as refusal:
            rows_arrived(np.zeros(shape))
        assert str(refusal.value) == f"the shape is {told}, not (n, 3)"

    def test_other_columns_are_refused(self):
        with pytest.raises(ValueError, match="time,position,pressure") as refusal:
            rows_arrived(np.zeros((4, 3)), ["time", "position", "pressure"])
        assert "not 'time,pressure,position'" in str(refusal.value)

    @pytest.mark.parametrize("time", [math.nan, math.inf, -math.inf, 1e10])
    def test_impossible_times_are_refused(self, time):
        with pytest.raises(ValueError, match="a time is not finite"):
            rows_arrived(table(np.array([0.0, time])))


EPS = np.finfo(float).eps
MILLISECOND = 1_000_000


def signal(stamps, function):
    """Samples of a function of the seconds since START."""
    stamps = np.asarray(stamps, dtype=np.int64)
    return Samples(stamps, np.asarray(function((stamps - START) / 1e9), dtype=float))


def every(milliseconds, count, first=0):
    return START + MILLISECOND * (first + milliseconds * np.arange(count))


def pressure(seconds):
    return 5e4 + 2e4 * seconds


def position(seconds):
    return 1e-3 - 4e-4 * seconds


def gaps_of(drive, stem, refused=False):
    """The gap that is put into words."""
    named = []
    with pytest.raises(RefusalError) if refused else nullcontext():
        uniform_recording(drive, stem, refusal_of=lambda gap: named.append(gap) or str(gap))
    (gap,) = named
    return gap


class TestUniformSignals:
    @given(
        values=arrays(float, (2, 50), elements=st.floats(-1e6, 1e6)),
        period=st.integers(1, 10**10),
        start=st.integers(0, 2**62),
    )
    def test_shared_stamps_are_taken_to_the_last_bit(self, values, period, start):
        stamps = start + period * np.arange(50)
        record = uniform_recording(Samples(stamps, values[0]), Samples(stamps, values[1]))
        np.testing.assert_array_equal(record.pressure, values[0])
        np.testing.assert_array_equal(record.position, values[1])
        assert record.sample_period == period / 1e9
        assert record.start_time == start / 1e9

    def test_the_positions_are_taken_whatever_the_pressure(self):
        rough = np.random.default_rng(1).standard_normal(200)
        stem = Samples(every(1, 200), rough)
        record = uniform_recording(signal(every(7, 40, -5), pressure), stem)
        np.testing.assert_array_equal(record.position, rough)


class TestOverlap:
    def test_only_the_time_that_both_cover(self):
        """Pressure from 0 to 100 ms, stem from 42 to 170 ms: 42 to 100 ms remain."""
        record = uniform_recording(
            signal(every(1, 101), pressure), signal(every(2, 65, 42), position)
        )
        assert len(record) == (100 - 42) // 2 + 1
        assert record.start_time == (START + 42 * MILLISECOND) / 1e9
        assert record.duration == pytest.approx(0.058, rel=4 * EPS)

    @pytest.mark.parametrize("later", [100, 5000])
    @pytest.mark.parametrize("is_stem", [True, False])
    def test_none(self, later, is_stem):
        early, late = every(1, 101), every(1, 101, later)
        stem = signal(late if is_stem else early, position)
        with pytest.raises(RefusalError) as refusal:
            uniform_recording(signal(early if is_stem else late, pressure), stem)
        name = "stem_state" if is_stem else "actuator_pressure"
        assert str(refusal.value) == (
            f"actuator_pressure and stem_state do not overlap in time ({name} begins "
            f"{later / 1e3:.3g} s later): check that their clocks agree and that both are recorded"
        )


def test_stamps_of_the_arrival_are_told_from_an_outage():
    """As of a gateway that stamps its blocks when they come, each 200 ms with 20 samples."""
    blocks = np.arange(50)[:, np.newaxis] * 200 * MILLISECOND
    stamps = START + (blocks + np.arange(20) * 50_000).ravel()
    samples = Samples(stamps, np.random.default_rng(1).standard_normal(1000))
    with pytest.raises(RefusalError) as refusal:
        uniform_recording(samples, samples)
    assert str(refusal.value) == (
        "the time stamps of actuator_pressure come in 50 bunches, 0.199 s apart: stamp each sample "
        "with the time of its measurement, not of its arrival"
    )
    outages = stamps + np.repeat(np.arange(50) ** 3, 20) * MILLISECOND
    remedy = r": 49 gaps take 100 % of its time; record it at a fixed rate, or export it without"
    with pytest.raises(RefusalError, match=rf"^gap of 7\.\d+ s in actuator_pressure.*{remedy}"):
        uniform_recording(samples._replace(stamps=outages), samples._replace(stamps=outages))


class TestUnevenStamps:
    @given(
        pauses=st.lists(st.integers(500_000, 1_500_000), min_size=20, max_size=100),
        period=st.integers(1, 7),
        slope=st.floats(-1e6, 1e6),
        offset=st.floats(-1e6, 1e6),
    )
    def test_linear_signals_stay_linear(self, pauses, period, slope, offset):
        """At any rate: only rounding remains, of sampled values, chord and comparison.

        Each of these some ten operations rounds by half an EPS of the largest term.
        """
        stamps = START + np.cumsum([0, *pauses])
        other = every(period, 5 + int(stamps[-1] - START) // (period * MILLISECOND), -3)
        record = uniform_recording(
            signal(other, lambda t: offset + slope * t),
            signal(stamps, lambda t: offset - slope * t),
        )
        largest = abs(offset) + abs(slope) * (stamps[-1] - START + 14 * MILLISECOND) / 1e9
        tolerance = 16 * EPS * largest + 1e-300  # subnormal numbers are no test of rounding
        rise = slope * record.time
        np.testing.assert_allclose(record.pressure, offset + rise, rtol=0, atol=tolerance)
        np.testing.assert_allclose(record.position, offset - rise, rtol=0, atol=tolerance)
        assert record.sample_period == int(np.median(pauses)) / 1e9
        assert len(record) == (stamps[-1] - START) // int(np.median(pauses)) + 1


class TestGaps:
    def with_pause(self, periods):
        """Twenty samples at 1 kHz, a pause after the eighth, twenty more."""
        return np.concatenate((every(1, 8), every(1, 20, 7 + periods)))

    def test_ten_periods_are_interpolated(self):
        record = uniform_recording(
            signal(every(1, 37), pressure), signal(self.with_pause(10), position)
        )
        assert len(record) == 37
        assert record.gap == ""
        np.testing.assert_allclose(record.position, position(record.time), rtol=16 * EPS)

    @pytest.mark.parametrize("gappy", ["actuator_pressure", "stem_state"])
    def test_more_is_named_and_found(self, gappy):
        stamps = self.with_pause(10)
        stamps[8:] += 1
        whole, cut = signal(every(1, 37), pressure), signal(stamps, pressure)
        signals = (cut, whole) if gappy == "actuator_pressure" else (whole, cut)
        found = gaps_of(*signals)
        assert uniform_recording(*signals).gap == str(found)
        of_the_caller = uniform_recording(*signals, refusal_of=lambda gap: gap.what).gap
        assert of_the_caller == f"gap of 0.01 s in {gappy}, 0.007 s after its first sample"
        assert str(found) == (
            f"gap of 0.01 s in {gappy}, 0.007 s after its first sample: use a record without a "
            "gap, or clear the buffer and record again"
        )
        assert found.sample == 8
        assert found.seconds == 0.010000001
        assert found.share == pytest.approx(10 / 36, rel=1e-6)

    def test_the_samples_around_it_keep_their_stamps(self):
        stamps = self.with_pause(11)
        record = uniform_recording(signal(every(1, 38), pressure), signal(stamps, position))
        assert len(record) == 38
        np.testing.assert_array_equal(record.stamped.position.time, (stamps - START) / 1e9)
        np.testing.assert_array_equal(record.stamped.drive.value, record.pressure)

    @pytest.mark.parametrize("gappy", ["actuator_pressure", "stem_state"])
    @pytest.mark.parametrize("pauses", [1, 3])
    def test_half_of_the_time_at_most(self, gappy, pauses):
        """90 ms of samples stand beside each pause of 90 ms; one of 91 ms is refused."""
        whole = signal(every(1, 181 * pauses + 1), pressure)
        pairs = []
        for length in (90, 91):
            steps = [0] + [1] * 80 * pauses + ([length] + [1] * 10) * pauses
            cut = signal(START + MILLISECOND * np.cumsum(steps), position)
            pairs.append((cut, whole) if gappy == "actuator_pressure" else (whole, cut))
        assert uniform_recording(*pairs[0]).gap.startswith(f"gap of 0.09 s in {gappy}")
        with pytest.raises(RefusalError, match=rf"^gap of 0\.091 s in {gappy}.*record again$"):
            uniform_recording(*pairs[1])

    def test_a_year_is_refused_before_its_grid_is_made(self):
        stamps = np.concatenate((every(1, 500), every(1, 500, 365 * 24 * 3_600_000)))
        with pytest.raises(RefusalError, match=r"^gap of 365 days in actuator_pressure"):
            uniform_recording(signal(stamps, pressure), signal(stamps, position))

    def test_of_the_longest(self):
        stamps = np.concatenate((every(1, 8), every(1, 8, 20), every(1, 8, 60), every(1, 8, 80)))
        found = gaps_of(signal(stamps, pressure), signal(every(1, 90), position), refused=True)
        assert found.sample == 16
        assert found.seconds == 0.033

    def test_measured_in_periods_of_the_signal_itself(self):
        """A pause of 50 ms is a gap at 1 kHz, not at 100 Hz."""
        slow = np.delete(every(10, 30), [11, 12, 13, 14])
        record = uniform_recording(signal(slow, pressure), signal(every(1, 291), position))
        assert len(record) == 291
        assert record.gap == ""


class TestSentOnChange:
    """A sensor that sends what differs from its last value by a dead band of 2, and no rests."""

    def moves(self, rest=3000, heartbeat=0):
        """Up and down with noise, and a rest of some milliseconds between."""
        place = np.concatenate(
            (np.linspace(0, 400, 800), np.full(rest, 400.0), np.linspace(400, 0, 800))
        )
        place = place + 0.2 * np.random.default_rng(0).standard_normal(place.size)
        sent, last, at = [], np.inf, -heartbeat
        for now, value in enumerate(place.tolist()):
            if abs(value - last) >= 2.0 or (heartbeat and now - at >= heartbeat):
                sent.append((now, value))
                last, at = value, now
        stamps, values = np.array(sent).T
        return Samples((START + MILLISECOND * stamps).astype(np.int64), values)

    @pytest.mark.parametrize("heartbeat", [0, 1000])
    def test_its_rests_are_no_gaps(self, heartbeat):
        stem = self.moves(heartbeat=heartbeat)
        assert np.max(np.diff(stem.stamps)) >= 900 * MILLISECOND
        assert uniform_recording(signal(every(1, 4600), pressure), stem).gap == ""

    def test_what_it_misses_is_one(self):
        """It was silent while the stem went by five dead bands."""
        stem = self.moves()
        lost = np.r_[0:50, 56 : stem.stamps.size]
        later = stem.stamps[lost] + np.where(lost < 50, 0, 200 * MILLISECOND)
        cut = Samples(later, stem.values[lost])
        found = uniform_recording(signal(every(1, 4800), pressure), cut).gap
        assert found.startswith("gap of 0.2")

    def test_ten_minutes_at_most(self):
        stem = self.moves(rest=601_000)
        with pytest.raises(RefusalError, match=r"^gap of 10 min in stem_state"):
            uniform_recording(signal(every(1, 602_600), pressure), stem)


class TestTooLittle:
    @pytest.mark.parametrize(("missing", "name"), [(0, "actuator_pressure"), (1, "stem_state")])
    def test_nothing_and_one(self, missing, name):
        for count, message in (
            (0, f"no samples of {name}: check that it is published on this topic"),
            (
                1,
                f"only one sample of {name}: check that it is sampled, and that it changes",
            ),
        ):
            signals = [signal(every(1, 30), pressure), signal(every(1, 30), position)]
            signals[missing] = Samples(*(column[:count] for column in signals[missing]))
            with pytest.raises(RefusalError) as refusal:
                uniform_recording(*signals)
            assert str(refusal.value) == message
