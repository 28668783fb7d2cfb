# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What of a record is fitted: its moves, and of hours of them the best stretch."""

import numpy as np
import pytest

from valve_friction_ros.identification import identify
from valve_friction_ros.identification.engine.moving_part import moving_part
from valve_friction_ros.identification.result import Pause, StemComparison
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, Drive, Recording, simulate
from valve_friction_ros.model.recording import StampedRecord, StampedSignal

STROKE = 0.02
NOISE = 5e-6


def moves(
    begins: list[float], ways: list[float], duration: float, period: float = 0.1
) -> StampedRecord:
    """Return a stem that moves there and back from these times, 10 s each way, and rests between.

    Its pressure equals its position in numbers, so that whatever is cut keeps them together.
    """
    time = np.arange(round(duration / period)) * period
    stem = np.zeros(time.size)
    for begin, way in zip(begins, ways, strict=True):
        stem += way * np.clip(1 - np.abs((time - begin) / 10 - 1), 0, None)
    noise = NOISE * np.random.default_rng(0).standard_normal(time.size)
    signal = StampedSignal(time, stem + noise)
    return StampedRecord(signal, signal, Drive.PRESSURE)


def time_in_the_record(time, pauses):
    """Return times without pauses as times of the record."""
    return time + sum(np.where(time > one.time, one.length, 0.0) for one in pauses)


def test_rests_at_the_ends_are_left_out():
    part = moving_part(moves([100.0], [STROKE], 400.0))
    assert part.record.position.time[0] == pytest.approx(98.0, abs=0.2)
    assert part.record.position.time[-1] == pytest.approx(122.0, abs=0.2)
    assert part.pauses == ()
    assert not part.is_stretch


def test_rests_of_a_long_record_are_left_out():
    begins = [100.0, 3000.0, 7000.0]
    record = moves(begins, 3 * [STROKE], 8000.0)
    part = moving_part(record)
    assert len(part.pauses) == 2
    assert not part.is_stretch
    assert 60 < part.duration < 120  # three moves of 20 s, and what is kept beside them
    for signal in (part.record.position, part.record.drive):
        # What is joined keeps its period, and each sample its time.
        np.testing.assert_allclose(np.diff(signal.time), 0.1, rtol=1e-6)
        times = time_in_the_record(signal.time, part.pauses)
        where = np.searchsorted(record.position.time, times - 0.05)
        np.testing.assert_array_equal(signal.value, record.position.value[where])
        for begin in begins:
            inside = np.count_nonzero((times > begin) & (times < begin + 20))
            assert inside == pytest.approx(200, abs=1)


def test_of_too_much_motion_the_longest_way_is_taken():
    begins = [20.0 * index for index in range(400)]
    ways = [STROKE if 200 <= index < 300 else STROKE / 4 for index in range(400)]
    record = moves(begins, ways, 8100.0)
    part = moving_part(record)
    assert part.is_stretch
    assert part.motion == pytest.approx(8000.0, rel=0.02)
    assert part.duration < 1700  # 16,000 samples
    inside = part.record.position.time
    assert inside[0] > 3900
    assert inside[-1] < 6100


def test_a_creeping_stem_does_not_rest():
    time = np.arange(40_000) * 0.1
    stem = STROKE * np.abs(time / 2000 - 1) + NOISE * np.random.default_rng(1).standard_normal(
        time.size
    )
    signal = StampedSignal(time, stem)
    assert moving_part(StampedRecord(signal, signal, Drive.PRESSURE)).pauses == ()


def test_residuals_are_shown_at_their_own_time():
    stem = StemComparison(
        1.0, np.zeros(5), np.zeros(5), 10.0, (Pause(11.5, 100.0), Pause(13.5, 1000.0))
    )
    np.testing.assert_array_equal(stem.time, [10.0, 11.0, 112.0, 113.0, 1114.0])


def many_steps(seed: int) -> Recording:
    """Return 40 min at 50 Hz of a valve that is moved by steps."""
    rng = np.random.default_rng(seed)
    period, duration = 0.02, 2400.0
    time = np.arange(round(duration / period)) * period
    levels = rng.uniform(70e3, 190e3, 600)
    begins = np.cumsum(rng.uniform(2.0, 30.0, levels.size))
    pressure = np.interp(time, np.sort([*begins, *(begins + 1.5)]), np.repeat(levels, 2))
    stem = simulate(BENCH_VALVE, LOW_FRICTION, pressure, sample_period=period).position
    noise = rng.standard_normal((2, time.size))
    return Recording(period, pressure + 150 * noise[0], stem + 1e-5 * noise[1])


@pytest.mark.parametrize("seed", [3, 4])
def test_a_long_record_gives_the_right_friction(seed):
    result = identify(many_steps(seed), BENCH_VALVE)
    friction = result.parameters["sliding_friction"]
    truth = LOW_FRICTION.coulomb_friction + LOW_FRICTION.viscous_friction * result.sliding_speed
    assert abs(friction.value - truth) < friction.half_width
    assert friction.half_width < 0.1 * truth
    assert any("the stem travels furthest were used" in text for text in result.findings)
    assert result.stem.time[-1] <= 2400
