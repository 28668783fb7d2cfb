"""Records as the refinement takes them."""

import numpy as np
import pytest

from valve_friction_ros.model import Recording, SensorNoise, SquareWave
from valve_friction_ros.signals.conditioned_record import condition

DEVIATION, PRESSURE_NOISE = 28.6e-6, 165.0


def linear(size=8001):
    """Pressure and position rise in straight lines, without noise and without curvature."""
    place = np.arange(float(size))
    return Recording(1e-3, 1e5 + 4.0 * place, 2.0**-20 * place)


def test_noiseless_record_passes_unchanged():
    record = linear()
    found = condition(record)
    assert (found.smoothing_window, found.stride, found.noise) == (1, 1, 0.0)
    assert found.sample_period == 1e-3
    np.testing.assert_array_equal(found.position, record.position)
    for pressure in (found.pressure, *found.halves):
        np.testing.assert_array_equal(pressure, record.pressure)


@pytest.fixture(scope="module")
def clean(bench_record):
    return bench_record("high", SquareWave(), 20.8)


@pytest.fixture(scope="module")
def noisy(bench_record):
    noise = SensorNoise(DEVIATION, PRESSURE_NOISE, seed=3)
    return condition(bench_record("high", SquareWave(), 20.8, noise))


def test_thinned_out_to_five_milliseconds(noisy, clean):
    assert noisy.stride == 5
    assert noisy.sample_period == pytest.approx(5e-3, rel=1e-15)
    size = len(range(0, len(clean), 5))
    assert {part.size for part in (noisy.position, noisy.pressure, *noisy.halves)} == {size}


def test_pressure_without_most_of_its_noise(noisy, clean):
    """Cubics over d samples keep 1.5/√d of white noise; near the corners up to four times that."""
    error = noisy.pressure - clean.pressure[::5]
    kept = 1.5 / np.sqrt(noisy.smoothing_window)
    assert np.sqrt(np.mean(error**2)) < 2 * kept * PRESSURE_NOISE
    assert np.abs(error).max() < PRESSURE_NOISE


def test_noise_of_the_averages(noisy, clean):
    """Weights 1, 2, 3, 4, 5, 4, 3, 2, 1 over 25 keep √85/25 of white noise."""
    expected = DEVIATION * np.sqrt(85) / 25
    assert noisy.noise == pytest.approx(expected, rel=0.05)
    smooth = np.convolve(clean.position, [1, 2, 3, 4, 5, 4, 3, 2, 1], "same")[::5] / 25
    error = (noisy.position - smooth)[1:-1]
    assert error.std() == pytest.approx(expected, rel=4 / np.sqrt(2 * error.size))


def test_averages_of_a_straight_line_are_on_it():
    """Also at both ends, where half of the window is missing: a line is averaged off by there."""
    record = linear()
    rough = Recording(
        1e-3,
        record.pressure + 165 * np.random.default_rng(0).standard_normal(len(record)),
        record.position,
    )
    found = condition(rough)
    assert found.stride > 1
    inner = slice(1, -1)
    np.testing.assert_allclose(
        found.position[inner], record.position[:: found.stride][inner], rtol=1e-12
    )


def test_slow_records_are_not_thinned_out(bench_record):
    noise = SensorNoise(DEVIATION, PRESSURE_NOISE)
    fast = bench_record("high", SquareWave(), 20.8, noise)
    slow = condition(Recording(0.01, fast.pressure[::10], fast.position[::10]))
    assert (slow.stride, slow.sample_period) == (1, 0.01)
