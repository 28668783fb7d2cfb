# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Signals whose source repeats, omits or interpolates values."""

import numpy as np
import pytest

from valve_friction_ros.held_signals import (
    archive_dead_band,
    as_archived,
    as_sent_on_change,
    sent_dead_band,
    without_repeats,
)
from valve_friction_ros.model.recording import StampedSignal

PERIOD = 1e-3


def noisy(count, generator):
    time = np.arange(count) * PERIOD
    return time, np.sin(3 * time) + 0.01 * generator.standard_normal(count)


@pytest.mark.parametrize("hold", [2, 5, 20, 250])
def test_a_held_signal_keeps_its_fresh_values(hold):
    time, values = noisy(200 * hold, np.random.default_rng(hold))
    found = without_repeats(StampedSignal(time, np.repeat(values[::hold], hold)))
    np.testing.assert_array_equal(found.time, time[hold::hold])
    np.testing.assert_array_equal(found.value, values[hold::hold])


def test_a_value_that_came_twice_keeps_its_place():
    """A converter's steps: at rest the source sends the same value again and again."""
    generator, hold = np.random.default_rng(1), 20
    time = np.arange(40_000) * PERIOD
    values = 0.02 * np.rint((np.sin(0.5 * time) + 0.02 * generator.standard_normal(40_000)) / 0.02)
    found = without_repeats(StampedSignal(time, np.repeat(values[::hold], hold)))
    place = found.time / (hold * PERIOD)
    np.testing.assert_allclose(place, np.rint(place), atol=1e-6)
    np.testing.assert_allclose(np.diff(found.time), hold * PERIOD)


def test_jittering_holds_are_found():
    """A source whose period is no multiple of that of the messages."""
    generator = np.random.default_rng(2)
    time = np.arange(60_000) * PERIOD
    fresh = generator.standard_normal(60_000)
    values = fresh[(time / 0.0203).astype(int)]
    found = without_repeats(StampedSignal(time, values))
    assert np.unique(found.value).size == pytest.approx(60 / 0.0203, abs=2)
    assert found.period == pytest.approx(0.02)


NOISY = noisy(20_000, np.random.default_rng(3))[1]


@pytest.mark.parametrize(
    "values",
    [NOISY, 0.02 * np.rint(NOISY / 0.02), 0.01 * np.rint(np.arange(20_000) / 100), np.ones(100)],
    ids=["noise", "coarse noise", "a converter behind a slow stem, by one step each", "constant"],
)
def test_what_is_not_held_stays_as_it_is(values):
    signal = StampedSignal(PERIOD * np.arange(values.size), values)
    assert without_repeats(signal) is signal


class TestSentOnChange:
    """A stem that sticks and jumps, sent when it has moved by more than 0.1 mm."""

    @pytest.fixture
    def stem(self):
        """Jumps of 1 mm, a second or two apart, each sent within 20 ms; then a slow way back."""
        generator = np.random.default_rng(4)
        moments = np.cumsum(generator.uniform(1.0, 2.0, 12))
        jumps = [(t + 0.01 * k, n + 0.5 * k) for n, t in enumerate(moments) for k in (1, 2)]
        slow = [(moments[-1] + 0.4 * k, moments.size - 0.1 * k) for k in range(1, 30)]
        time, place = np.array([(0.0, 0.0), *jumps, *slow]).T
        return StampedSignal(time, 1e-3 * place)

    def test_it_stands_until_it_jumps(self, stem):
        found = as_sent_on_change(stem, sent_dead_band(stem))
        added = np.setdiff1d(found.time, stem.time)
        assert added.size == 12
        for time in added:
            k = np.searchsorted(stem.time, time)
            assert found.value[found.time == time] == stem.value[k - 1]
            assert 0 < stem.time[k] - time < 0.02

    def test_what_is_sent_by_the_clock_is_as_it_was(self):
        time = np.arange(500) * 0.01
        signal = StampedSignal(time, 1e-3 * np.sign(np.sin(time)))
        assert sent_dead_band(signal) == 0.0
        assert as_sent_on_change(signal, 0.0) is signal

    def test_lost_samples_are_no_dead_band(self):
        """A ramp of which every tenth sample, and half a second, is lost."""
        kept = np.array([k for k in range(1000) if k % 10 and not 300 < k < 350])
        signal = StampedSignal(0.01 * kept, 1e-4 * kept)
        assert sent_dead_band(signal) == 0.0
        assert as_sent_on_change(signal, 0.0) is signal

    @pytest.mark.parametrize("band", [0.002, 0.01, 0.03])
    def test_its_dead_band_is_the_least_change(self, band):
        """A wave with rests, of amplitude 1, sent when it has left the band; noise is a tenth."""
        time = np.arange(20_000) * PERIOD
        wave = np.clip(np.sin(1.7 * time) + 0.6 * np.sin(4.3 * time), -1.0, 1.0)
        values = wave + 0.1 * band * np.random.default_rng(4).standard_normal(time.size)
        kept = [0]
        for row in range(1, time.size):
            if abs(values[row] - values[kept[-1]]) > band:
                kept.append(row)
        found = sent_dead_band(StampedSignal(time[kept], values[kept]))
        assert band <= found < 1.1 * band
        assert sent_dead_band(StampedSignal(time, values)) == 0.0


def archived(signal):
    """The signal as it is held alone."""
    (found,) = as_archived(signal)
    return found


class TestArchived:
    """A level with noise and some moves, stored when it has left a dead band of 0.5 % of 100."""

    TIME = np.arange(4000.0)

    @pytest.fixture
    def stored(self):
        """Rows and values that a historian has stored, to three decimals."""
        generator = np.random.default_rng(5)
        level = np.repeat(generator.uniform(0.0, 100.0, 20), 200)
        values = np.round(level + 0.25 * generator.standard_normal(4000), 3)
        rows = [0]
        for row in range(1, 4000):
            if abs(values[row] - values[rows[-1]]) > 0.5:
                rows += [row - 1, row]
        rows = np.unique([*rows, 3999])
        return rows, values[rows]

    def interpolated(self, stored, decimals=3):
        rows, values = stored
        return StampedSignal(self.TIME, np.round(np.interp(self.TIME, rows, values), decimals))

    @pytest.mark.parametrize("decimals", [3, 12])
    def test_each_stored_value_is_held_until_the_next(self, stored, decimals):
        rows, values = stored
        found = archived(self.interpolated(stored, decimals))
        held = values[np.searchsorted(rows, self.TIME, side="right") - 1]
        np.testing.assert_array_equal(found.time, self.TIME)
        # Where three stored values are on a line by chance, the one between them is not found.
        assert np.mean(found.value == held) > 0.98
        assert np.abs(found.value - held).max() < 2.0

    def test_a_scale_does_not_matter(self, stored):
        signal = self.interpolated(stored)
        found = archived(StampedSignal(signal.time, 2e-4 * signal.value))
        expected = 2e-4 * archived(signal).value
        assert np.mean(np.isclose(found.value, expected, rtol=1e-12)) > 0.999

    @staticmethod
    def lines(count, changes, lengths):
        """Rounded lines up and down, whose changes and lengths are drawn, and a move at the end."""
        generator = np.random.default_rng(6)
        steps = generator.uniform(*changes, count) * np.tile([1.0, -1.0], count // 2)
        rows = np.cumsum(generator.integers(*lengths, count))
        values = np.interp(np.arange(rows[-1] + 1.0), rows, np.cumsum(steps))
        return StampedSignal(np.arange(values.size + 1.0), np.append(np.round(values, 3), 100.0))

    def test_a_move_stays_a_line(self):
        """Of the lines, two thirds change by up to 2 % of the range, the others by 20 % or more."""
        small = self.lines(100, (0.5, 1.9), (4, 40)).value[:-1]
        large = self.lines(50, (25.0, 40.0), (4, 40)).value
        values = np.concatenate([small, large])
        found = archived(StampedSignal(np.arange(float(values.size)), values)).value
        assert not np.array_equal(found[: small.size], small)
        assert np.array_equal(found[small.size + 1 :], large[1:])

    @pytest.mark.parametrize(
        ("count", "changes", "lengths"),
        [(48, (0.5, 1.9), (4, 40)), (100, (2.5, 9.0), (4, 40)), (100, (0.5, 1.9), (4, 6))],
        ids=["few moves of an operator", "a controller's output", "a slower scan"],
    )
    def test_lines_without_a_dead_band(self, count, changes, lengths):
        signal = self.lines(count, changes, lengths)
        assert archived(signal) is signal
        other = self.lines(100, (0.5, 1.9), (4, 40))
        assert archived(other) is not other

    def test_less_evidence_is_needed_beside_another_signal(self):
        """Of the same record: its lines change by more than is enough alone."""
        wide, usual = (self.lines(100, changes, (4, 40)) for changes in ((2.5, 4.0), (0.5, 1.9)))
        assert archived(wide) is wide
        other = self.lines(100, (2.5, 4.0), (4, 6))
        assert as_archived(wide, other) == (wide, other)
        held, beside, unlike = as_archived(usual, wide, other)
        np.testing.assert_array_equal(held.value, archived(usual).value)
        assert np.mean(np.diff(beside.value) == 0.0) > 0.8
        assert unlike is other

    def test_a_fast_sensor_has_no_historian(self):
        signal = self.lines(100, (0.5, 1.9), (4, 40))
        fast = StampedSignal(0.1 * signal.time, signal.value)
        assert archived(fast) is fast

    @pytest.mark.parametrize("step", [0.0, 0.01, 0.1, 1.0])
    @pytest.mark.parametrize("noise", [0.0, 0.03, 0.3])
    @pytest.mark.parametrize("period", [50.0, 400.0, 3000.0])
    def test_a_sampled_signal_is_as_it_was(self, step, noise, period):
        """With any noise, and as a converter of any step rounds it."""
        generator = np.random.default_rng(7)
        values = 50.0 * np.sin(2.0 * np.pi * self.TIME / period)
        values = values + noise * generator.standard_normal(4000)
        signal = StampedSignal(self.TIME, step * np.rint(values / step) if step else values)
        assert archived(signal) is signal

    CURVE = 50.0 * np.sin(2.0 * np.pi * TIME / 400.0) + 3.0 * (TIME % 37 == 0)
    LEVELS = np.repeat(np.random.default_rng(8).uniform(0.0, 100.0, 40), 100)

    @pytest.mark.parametrize(
        "values",
        [np.round(CURVE, 1), LEVELS, np.ones(4000)],
        ids=["a curve, straight between its spikes", "levels of an operator", "constant"],
    )
    def test_what_no_historian_has_stored_is_as_it_was(self, values):
        signal = StampedSignal(self.TIME, values)
        assert archived(signal) is signal


class TestDeadBand:
    TIME = np.arange(10_000.0)

    @pytest.mark.parametrize("longest", [60, 10_000])
    @pytest.mark.parametrize("share", [0.3, 0.5])
    @pytest.mark.parametrize("band", [0.2, 0.5, 1.0])
    def test_of_a_signal_that_is_sent_on_change(self, band, share, longest):
        """Levels with noise: no change is smaller, and most of them are little larger.

        Unless a value is also sent where none has been sent for the longest time.
        """
        generator = np.random.default_rng(9)
        level = np.repeat(generator.uniform(0.0, 100.0, 100), 100)
        values = level + share * band * generator.standard_normal(10_000)
        held, sent = values.copy(), 0
        for row in range(1, held.size):
            if abs(values[row] - held[row - 1]) <= band and row - sent < longest:
                held[row] = held[row - 1]
            else:
                sent = row
        found = archive_dead_band(StampedSignal(self.TIME, held))
        assert band < found < 1.3 * band

    def test_a_sampled_signal_has_none(self):
        noise = np.random.default_rng(10).standard_normal(10_000)
        for values in (noise, np.rint(10 * noise), np.sin(self.TIME), np.zeros(10_000)):
            assert archive_dead_band(StampedSignal(self.TIME, values)) == 0.0

    def test_a_valve_that_rests_between_moves_has_none(self):
        """Noiseless, at the resolution of a control system: levels of an operator."""
        ends = np.random.default_rng(11).uniform(0.0, 100.0, 41)
        rows = np.cumsum(np.tile([90.0, 10.0], 40))
        values = np.interp(self.TIME, rows, np.repeat(ends, 2)[1:81])
        assert archive_dead_band(StampedSignal(self.TIME, np.round(values, 1))) == 0.0
