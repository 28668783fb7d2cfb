"""Signals that repeat each value until the next."""

import numpy as np
import pytest

from valve_friction_ros.model.stamped import StampedSignal
from valve_friction_ros.signals.holds import without_repeats

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


@pytest.mark.parametrize("step", [0.0, 0.02])
def test_noise_is_not_held(step):
    time, values = noisy(20_000, np.random.default_rng(3))
    signal = StampedSignal(time, step * np.rint(values / step) if step else values)
    assert without_repeats(signal) is signal


def test_a_converter_behind_a_slow_stem_is_not_held():
    """Its values stay, and change by one step each."""
    time = np.arange(20_000) * PERIOD
    signal = StampedSignal(time, 0.01 * np.rint(time / 0.1))
    assert without_repeats(signal) is signal


def test_a_constant_signal_is_returned():
    signal = StampedSignal(np.arange(100.0), np.ones(100))
    assert without_repeats(signal) is signal
