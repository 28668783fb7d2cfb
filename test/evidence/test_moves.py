"""Samples cut into moves: each keeps the work balance, and bad samples are no evidence."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from service import PRELOAD, SPRING, START, STEP, VALVE, arrivals, levels, parts, signals

from valve_friction_ros.evidence import Move, Moves, MoveStream
from valve_friction_ros.streams import Arrivals, Kind

FRICTION = 300.0
PLACES = levels(8, seed=3)
WHOLE = signals(PLACES, FRICTION)
GOOD = Move(0, 10, 1e-3, 2e-3, 500.0, 10.0, 1e-3)


def taken(*some, valve=VALVE):
    stream = MoveStream(valve)
    return [move for one in some for move in stream.take(one)]


def friction_of(move):
    middle = 0.5 * (move.start + move.stop)
    return move.direction * (move.force - SPRING * middle - PRELOAD)


@pytest.fixture(scope="module")
def moves():
    # The first ten seconds tell the noise; what moves in them is lost, and the last may go on.
    return taken(*parts(arrivals(*WHOLE), range(0, 2 * WHOLE[0].size, 37)))


class TestBalance:
    def test_each_move_gives_its_friction(self, moves):
        """Inertia leaves no trace: between two rests it does no work."""
        assert len(moves) >= 6
        for move in moves:
            assert friction_of(move) == pytest.approx(FRICTION, rel=2e-3)
            assert move.distance == pytest.approx(STEP, rel=1e-2)

    def test_its_onset_is_the_force_of_the_breakaway(self, moves):
        for move in moves:
            free = SPRING * move.onset_position + PRELOAD
            assert move.direction * (move.onset_force - free) == pytest.approx(FRICTION, rel=0.05)

    def test_a_lag_adds_its_rate(self, moves):
        """The pressure seen 50 ms late changes the mean force by the rate, to first order."""
        stamps, pressure, position = WHOLE
        late = np.interp(stamps - 50_000_000, stamps, pressure)
        found = taken(arrivals(stamps, late, position))
        for one, exact in zip(found[-4:], moves[-4:], strict=True):
            assert one.force - exact.force == pytest.approx(-0.05 * exact.force_rate, rel=0.1)

    def test_faster_samples_say_the_same(self, moves):
        fast = taken(
            *parts(arrivals(*signals(PLACES, FRICTION, rate=1000.0)), range(0, 96_000, 999))
        )
        assert len(fast) == pytest.approx(len(moves), abs=1)
        for move in fast:
            assert friction_of(move) == pytest.approx(FRICTION, rel=5e-3)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(1, 2 * WHOLE[0].size - 1), max_size=12, unique=True))
def test_the_moves_do_not_depend_on_the_messages_batches(cuts):
    """What comes before the first look at the noise may differ; nothing after it."""
    found = taken(*parts(arrivals(*WHOLE), sorted(cuts)))
    usual = taken(*parts(arrivals(*WHOLE), range(0, 2 * WHOLE[0].size, 37)))
    last = {(one.start, one.stop): one for one in found}
    after = [one for one in usual if one.begin > START + 24e9]
    common = [last[one.start, one.stop] for one in after if (one.start, one.stop) in last]
    assert len(common) >= len(after) - 1
    assert all(friction_of(one) == pytest.approx(FRICTION, rel=2e-3) for one in found)


class TestNoEvidence:
    """Motion 4 lies between 53 s and 55 s."""

    def harmed(self, samples, kind=Kind.POSITION, value=None, at=54.0):
        kinds, stamps, values = (one.copy() for one in samples)
        one = np.flatnonzero((stamps >= START + at * 1e9) & (kinds == kind))[0]
        if value is None:
            kinds[one] = Kind.NO_POSITION
        else:
            values[one] = value
        return Arrivals(kinds, stamps, values)

    def lost(self, samples):
        found = taken(*parts(samples, range(0, samples.stamps.size, 37)))
        middles = [(0.5 * (one.begin + one.end) - START) / 1e9 for one in found]
        assert any(64 < one < 68 for one in middles)
        return not any(52 < one < 56 for one in middles)

    def test_without_harm_it_is_there(self):
        assert not self.lost(arrivals(*WHOLE))

    @pytest.mark.parametrize(
        ("kind", "value"),
        [
            (Kind.POSITION, None),
            (Kind.POSITION, math.nan),
            (Kind.PRESSURE, math.inf),
        ],
    )
    def test_a_bad_sample_in_it(self, kind, value):
        assert self.lost(self.harmed(arrivals(*WHOLE), kind, value))

    def test_a_pressure_outside_the_sensor(self):
        valve = replace(VALVE, pressure_maximum=250e3)
        samples = self.harmed(arrivals(*WHOLE), Kind.PRESSURE, 300e3)
        found = taken(*parts(samples, range(0, samples.stamps.size, 37)), valve=valve)
        middles = [(0.5 * (one.begin + one.end) - START) / 1e9 for one in found]
        assert not any(52 < one < 56 for one in middles)

    def test_a_gap_in_it(self):
        keep = np.abs((WHOLE[0] - START) / 1e9 - 54.0) > 0.5
        assert self.lost(arrivals(*(one[keep] for one in WHOLE)))

    def test_stamps_that_go_back(self):
        stamps = WHOLE[0].copy()
        stamps[stamps > START + 54e9] -= 20_000_000_000
        found = taken(*parts(arrivals(stamps, *WHOLE[1:]), range(0, 2 * stamps.size, 37)))
        assert all(one.end - one.begin < 4e9 for one in found)
        assert all(friction_of(one) == pytest.approx(FRICTION, rel=2e-3) for one in found)

    @pytest.mark.parametrize("rate", [20.0, 1000.0])
    def test_a_repeated_stamp_a_second_costs_nothing(self, rate):
        stamps, *signal = signals(PLACES, FRICTION, rate=rate)
        second = round(rate)
        twice = np.sort(np.concatenate((np.arange(stamps.size), np.arange(0, stamps.size, second))))
        usual, found = (
            taken(*parts(arrivals(*columns), range(0, 2 * columns[0].size, 37)))
            for columns in ((stamps, *signal), (stamps[twice], *(one[twice] for one in signal)))
        )
        assert len(found) == len(usual) >= 6
        assert all(friction_of(one) == pytest.approx(FRICTION, rel=5e-3) for one in found)

    def test_what_is_forgotten_in_it(self):
        stream, found = MoveStream(VALVE), []
        for part in parts(arrivals(*WHOLE), range(0, 2 * WHOLE[0].size, 40)):
            found += stream.take(part)
            if START + 53.9e9 < part.stamps[-1:].sum() < START + 55e9:
                stream.forget()
        middles = [(0.5 * (one.begin + one.end) - START) / 1e9 for one in found]
        assert not any(52 < one < 56 for one in middles)
        assert any(64 < one < 68 for one in middles)

    def test_a_stem_at_rest_under_noise(self):
        random = np.random.default_rng(1)
        stamps = START + np.arange(12_000, dtype=np.int64) * 50_000_000
        position = 0.01 + 20e-6 * random.standard_normal(stamps.size)
        pressure = 9e4 + 2e4 * np.sin(np.arange(stamps.size) / 40)
        assert taken(*parts(arrivals(stamps, pressure, position), range(0, 24_000, 400))) == []

    def test_the_stops(self):
        """On a stop the pressure is that of the stop, not of friction."""
        places = np.array([0.5, 0.0, 0.5, 0.0, 0.5, 0.0, 0.5]) * VALVE.travel
        stamps, pressure, position = signals(places, FRICTION, moving=4.0, rate=50.0)
        pressure[position < 0.005 * VALVE.travel] = 0.0
        found = taken(*parts(arrivals(stamps, pressure, position), range(0, 2 * stamps.size, 80)))
        assert found
        for move in found:
            assert friction_of(move) == pytest.approx(FRICTION, rel=0.02)


@pytest.mark.parametrize("same", [True, False])
def test_memory_is_bounded(same):
    """Whether a signal stays away for an hour, or all stamps are one."""
    stream = MoveStream(VALVE)
    stamps = START + np.arange(72_000, dtype=np.int64) * (0 if same else 50_000_000)
    values = np.full(stamps.size, 0.01)
    kinds = np.full(stamps.size, Kind.POSITION, np.uint8)
    for part in parts(Arrivals(kinds, stamps, values), range(0, stamps.size, 400)):
        assert stream.take(part) == ()
        assert stream.size <= 50_400


def test_a_turn_without_a_rest_makes_two_moves():
    """A quick stroke up and down, at 50 Hz."""
    time = np.arange(0, 60, 0.02)
    phase = np.clip(time - 30, 0, 4)
    position = 0.01 + 2e-3 * np.sin(np.pi * phase / 4)
    way = np.sign(np.gradient(position))
    pressure = (SPRING * position + PRELOAD + way * FRICTION) / VALVE.diaphragm_area
    stamps = START + np.round(time * 1e9).astype(np.int64)
    samples = arrivals(stamps, pressure + VALVE.pressure_reference, position)
    found = taken(*parts(samples, range(0, samples.stamps.size, 100)))
    assert [one.direction for one in found] == [1, -1]
    for move in found:
        assert friction_of(move) == pytest.approx(FRICTION, rel=0.01)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"end": 0}, "must end after its begin"),
        ({"stop": 1e-3}, "distance"),
        ({"force": math.nan}, "force"),
        ({"speed": -1.0}, "speed"),
    ],
)
def test_an_impossible_move_is_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        replace(GOOD, **changes)


def test_columns():
    table = Moves.of([GOOD, replace(GOOD, begin=20, end=1_000_000_000, stop=0.0)])
    assert table.time.tolist() == [1e-8, 1.0]
    assert table.direction.tolist() == [1.0, -1.0]
    assert len(table[table.direction > 0]) == 1
    assert len(Moves.of([])) == 0
