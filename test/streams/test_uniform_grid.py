"""Two stamped signals on one grid: exact where it can be, refused where it cannot."""

from contextlib import nullcontext

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.streams import Samples, uniform_recording

EPS = np.finfo(float).eps
MILLISECOND = 1_000_000
START = 1_700_000_000_000_000_000  # ns, where float seconds are 238 ns apart


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

    @pytest.mark.parametrize(
        ("pressures", "positions"),
        [
            (every(4, 60, -3), every(1, 200)),
            (every(1, 300, -17), every(4, 60)),
            (every(10, 30, -1), every(3, 80)),
        ],
        ids=["slow pressure", "slow stem", "unrelated"],
    )
    def test_rates_and_phases_may_differ(self, pressures, positions):
        """Linear signals pass through linear interpolation: only rounding remains."""
        record = uniform_recording(signal(pressures, pressure), signal(positions, position))
        time = record.time + (positions[0] - START) / 1e9
        assert record.sample_period == (positions[1] - positions[0]) / 1e9
        np.testing.assert_allclose(record.pressure, pressure(time), rtol=16 * EPS)
        np.testing.assert_allclose(record.position, position(time), rtol=16 * EPS)

    def test_a_curve_is_met_at_the_stamps_and_missed_by_its_sagitta_between(self):
        """c·t² between two samples h apart lies c·h²/4 below the chord's middle."""
        curvature, step = 3e4, 0.02
        record = uniform_recording(
            signal(every(20, 50), lambda t: curvature * t**2), signal(every(10, 99), position)
        )
        excess = record.pressure - curvature * record.time**2
        largest = 16 * EPS * record.pressure.max()
        np.testing.assert_allclose(excess[::2], 0.0, atol=largest)
        np.testing.assert_allclose(excess[1::2], curvature * step**2 / 4, atol=largest)


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
    def test_none(self, later):
        stem = signal(every(1, 101, later), position)
        with pytest.raises(RefusalError) as refusal:
            uniform_recording(signal(every(1, 101), pressure), stem)
        assert str(refusal.value) == (
            "actuator_pressure and stem_state do not overlap in time (stem_state begins "
            f"{later / 1e3:.3g} s later): check that their clocks agree and that both are recorded"
        )


class TestUnevenStamps:
    @given(
        pauses=st.lists(st.integers(500_000, 1_500_000), min_size=20, max_size=100),
        slope=st.floats(-1e6, 1e6),
        offset=st.floats(-1e6, 1e6),
    )
    def test_linear_signals_stay_linear(self, pauses, slope, offset):
        """Only rounding remains: of the sampled values, the chord and the comparison.

        Each of these some ten operations rounds by half an EPS of the largest term.
        """
        stamps = START + np.cumsum([0, *pauses])
        other = START + MILLISECOND * np.arange(-3, 1 + int(stamps[-1] - START) // MILLISECOND + 3)
        record = uniform_recording(
            signal(other, lambda t: offset + slope * t),
            signal(stamps, lambda t: offset - slope * t),
        )
        largest = abs(offset) + abs(slope) * (stamps[-1] - START + 3 * MILLISECOND) / 1e9
        tolerance = 16 * EPS * largest
        np.testing.assert_allclose(
            record.pressure, offset + slope * record.time, rtol=0, atol=tolerance
        )
        np.testing.assert_allclose(
            record.position, offset - slope * record.time, rtol=0, atol=tolerance
        )
        assert record.sample_period == int(np.median(pauses)) / 1e9
        assert len(record) == (stamps[-1] - START) // int(np.median(pauses)) + 1

    @given(
        st.lists(st.integers(500_000, 1_500_000), min_size=20, max_size=60), st.integers(1, 10**18)
    )
    def test_the_clock_may_start_anywhere(self, pauses, shift):
        stamps = np.cumsum(pauses)
        rough = np.sin(np.arange(stamps.size) ** 2)
        at_once = uniform_recording(Samples(stamps, rough), Samples(stamps + 7, rough))
        later = uniform_recording(
            Samples(stamps + shift, rough), Samples(stamps + 7 + shift, rough)
        )
        np.testing.assert_array_equal(at_once.pressure, later.pressure)
        np.testing.assert_array_equal(at_once.position, later.position)
        assert later.start_time == float(stamps[0] + 7 + shift) / 1e9

    def test_the_first_and_last_samples_stay(self):
        """Stamps at 0, 1, 2, 4, 5 ms: the grid of 1 ms fills the missing one in."""
        stamps = START + MILLISECOND * np.array([0, 1, 2, 4, 5])
        stem = Samples(stamps, np.array([0.0, 1.0, 2.0, 8.0, 16.0]))
        record = uniform_recording(signal(every(1, 6), pressure), stem)
        np.testing.assert_array_equal(record.position, [0, 1, 2, 5, 8, 16])


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

    def test_both_signals_have_one(self):
        """That of the pressure is named."""
        cut = self.with_pause(11)
        record = uniform_recording(signal(cut, pressure), signal(cut, position))
        assert record.gap.startswith("gap of 0.011 s in actuator_pressure")

    @pytest.mark.parametrize("gappy", ["actuator_pressure", "stem_state"])
    @pytest.mark.parametrize("pauses", [1, 3])
    def test_half_of_the_time_at_most(self, gappy, pauses):
        """90 ms of samples stand beside each pause of 90 ms; one of 91 ms is refused."""
        whole = signal(every(1, 181 * pauses + 1), pressure)
        for length, enough in ((90, True), (91, False)):
            steps = [0] + [1] * 80 * pauses + ([length] + [1] * 10) * pauses
            cut = signal(START + MILLISECOND * np.cumsum(steps), position)
            signals = (cut, whole) if gappy == "actuator_pressure" else (whole, cut)
            if enough:
                assert uniform_recording(*signals).gap.startswith(f"gap of 0.09 s in {gappy}")
            else:
                with pytest.raises(
                    RefusalError, match=rf"^gap of 0\.091 s in {gappy}.*record again$"
                ):
                    uniform_recording(*signals)

    def test_a_year_is_refused_before_its_grid_is_made(self):
        stamps = np.concatenate((every(1, 500), every(1, 500, 365 * 24 * 3_600_000)))
        with pytest.raises(RefusalError, match=r"^gap of 3\.15e\+07 s in actuator_pressure"):
            uniform_recording(signal(stamps, pressure), signal(stamps, position))

    def test_words_of_the_caller(self):
        record = uniform_recording(
            signal(self.with_pause(11), pressure),
            signal(every(1, 38), position),
            refusal_of=lambda gap: f"{gap.what}: choose a stretch",
        )
        assert record.gap == (
            "gap of 0.011 s in actuator_pressure, 0.007 s after its first sample: choose a stretch"
        )

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


class TestTooLittle:
    @pytest.mark.parametrize(("missing", "name"), [(0, "actuator_pressure"), (1, "stem_state")])
    def test_nothing_and_one(self, missing, name):
        for count, message in (
            (0, f"no samples of {name}: check that it is published, and on this topic"),
            (1, f"only one sample of {name}: check that it is sampled continuously"),
        ):
            signals = [signal(every(1, 30), pressure), signal(every(1, 30), position)]
            signals[missing] = Samples(*(column[:count] for column in signals[missing]))
            with pytest.raises(RefusalError) as refusal:
                uniform_recording(*signals)
            assert str(refusal.value) == message

    def test_names_of_the_caller(self):
        nothing = signal([], pressure)
        with pytest.raises(RefusalError, match=r"^no samples of force_n"):
            uniform_recording(nothing, nothing, ("force_n", "position_m"))
