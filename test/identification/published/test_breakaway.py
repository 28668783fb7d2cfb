# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The instants of breakaway, and the static friction (9) from them."""

import numpy as np
import pytest
from scipy.signal import savgol_coeffs

from valve_friction_ros.identification import (
    IdentificationSettings,
    published_estimate,
)
from valve_friction_ros.identification.published.identify import (
    _last_within,
    _onset,
    find_breakaways,
)
from valve_friction_ros.model import GRAPHITE_PACKING, Recording, SensorNoise, SquareWave
from valve_friction_ros.signals import position_noise, runs_of, velocity_noise

SETTINGS = IdentificationSettings()


def found_in(record):
    return find_breakaways(record, SETTINGS)


@pytest.fixture(scope="module")
def record(bench_record):
    return bench_record("graphite", SquareWave(), 52.0)


@pytest.fixture(scope="module")
def true_breakaways(bench_trajectory):
    """Last resting sample before each motion of the simulated stem, and the way it goes."""
    _, trajectory = bench_trajectory("graphite", SquareWave(), 52.0)
    moving = trajectory.velocity != 0
    samples = np.flatnonzero(~moving[:-1] & moving[1:])
    return samples, np.sign(trajectory.velocity[samples + 1])


def test_the_instants_of_the_simulation(record, true_breakaways):
    samples, directions = true_breakaways
    found = found_in(record)
    assert len(found) == samples.size == 9  # 52 s hold 9 edges of the wave
    assert np.abs(np.array([one.sample for one in found]) - samples).max() <= 2
    np.testing.assert_array_equal([one.direction for one in found], directions)


def test_directions_alternate(record):
    directions = [one.direction for one in found_in(record)]
    assert directions == [1, -1, 1, -1, 1, -1, 1, -1, 1]


def test_static_friction(record, benches):
    """The pull (9) changes by up to 0.0445 m² · 99 kPa/1.3 s: 3.4 N, 0.36 %, in a sample."""
    estimate = published_estimate(
        record, benches["graphite"].valve, IdentificationSettings(assumed_mass=1.6)
    )
    assert estimate.static_friction == pytest.approx(GRAPHITE_PACKING.static_friction, rel=0.005)
    assert estimate.coulomb_friction == pytest.approx(GRAPHITE_PACKING.coulomb_friction, rel=0.001)
    assert not any("breakaway" in warning for warning in estimate.warnings)


@pytest.mark.parametrize("seed", [1, 2])
def test_static_friction_under_noise(bench_record, benches, seed):
    """10 ms too early or late are 34 N of 942 N, 3.6 %."""
    noisy = bench_record("graphite", SquareWave(), 52.0, SensorNoise(10e-6, 100.0, seed))
    bias = GRAPHITE_PACKING.spring_preload / GRAPHITE_PACKING.spring_constant
    settings = IdentificationSettings(fixed={"mass": 1.6}, position_bias=bias)
    estimate = published_estimate(noisy, benches["graphite"].valve, settings)
    assert estimate.static_friction == pytest.approx(GRAPHITE_PACKING.static_friction, rel=0.05)


def test_none_without_a_rest():
    time = 1e-3 * np.arange(5000)
    assert found_in(Recording(1e-3, np.ones(5000), 0.01 * np.sin(2 * np.pi * time))) == []


def test_none_without_a_departure():
    """A stem that comes to rest and stays has left no rest."""
    position = 0.01 * np.exp(-np.arange(8000) / 300)
    assert found_in(Recording(1e-3, np.ones(8000), position)) == []


def test_from_rest_under_a_growing_force():
    """x = a·t²/2 after a rest, both ways: found at the last sample of the rest, no noise."""
    rest, time = np.zeros(300), 1e-3 * np.arange(1, 700)
    for direction in (1, -1):
        position = np.concatenate([rest, direction * time**2 / 2])
        found = found_in(Recording(1e-3, np.ones(position.size), position))
        assert [one.direction for one in found] == [direction]
        assert abs(found[0].sample - 299) <= 2


@pytest.mark.parametrize("seed", range(5))
def test_from_rest_under_noise(seed):
    """Twice the time to 40 µm less the time to 160 µm: the onset, as x = a·t²/2.

    At 1 m/s² these take 9 and 18 ms, at 9 and 18 mm/s, at which 10 µm are 1.1 and 0.6 ms. The
    onset errs by two of the first and one of the second, 2.3 ms; twice that at the most here.
    """
    time = 1e-3 * np.arange(1, 700)
    position = np.concatenate([np.zeros(300), time**2 / 2])
    clean = Recording(1e-3, np.ones(position.size), position)
    (found,) = found_in(SensorNoise(position=10e-6, seed=seed).applied_to(clean))
    assert found.direction == 1
    assert abs(found.sample - 299) <= 5


@pytest.mark.parametrize(
    ("active", "runs"),
    [
        ([0, 1, 1, 0, 1], [(1, 3), (4, 5)]),
        ([1, 0, 0, 1, 0], [(0, 1), (3, 4)]),
        ([1, 1], [(0, 2)]),
        ([0, 0], []),
    ],
)
def test_runs(active, runs):
    assert [tuple(run) for run in runs_of(np.array(active, dtype=bool))] == runs


def test_the_last_sample_within_a_mark():
    """A displacement may pass the mark and return; 10⁻¹² m beyond a mark are rounding."""
    assert _last_within(np.array([0.0, 2.0, 1.0, 3.0]), 1.0) == 2
    assert _last_within(np.array([2.0, 3.0]), 1.0) == -1
    assert _last_within(np.array([0.9e-12, 1.2e-12]), 0.0) == 0


def grown(start, power, samples):
    return np.maximum(np.arange(samples) - start, 0.0) ** power


class TestOnset:
    """The spread is chosen so that 4 and 16 of it are passed after whole samples."""

    def test_of_a_growing_force(self):
        """(t − 10)² is 4·25 at t = 20 and 16·25 at t = 30; what follows does not matter."""
        displacement = grown(10, 2, 40)
        assert _onset(displacement, 25.0) == 10
        displacement[31:] += 1e4
        assert _onset(displacement, 25.0) == 10

    def test_after_a_slip_jump(self):
        """t − 10 is 4·2.5 at t = 20 and 16·2.5 at t = 50."""
        assert _onset(grown(10, 1, 60), 2.5) == 10

    def test_in_the_first_sample(self):
        assert _onset(grown(0, 2, 30), 25.0) == 0

    @pytest.mark.parametrize("start", [-1, -5])
    def test_before_the_record_is_none(self, start):
        assert _onset(grown(start, 2, 30), 25.0) is None

    def test_displaced_from_the_first_sample_is_none(self):
        assert _onset(101.0 + grown(0, 1, 400), 25.0) is None

    def test_a_second_mark_that_is_not_passed_is_none(self):
        assert _onset(grown(10, 2, 31), 25.0) is None
        assert _onset(grown(10, 2, 32), 25.0) == 10

    def test_a_rest_without_noise_ends_at_its_last_sample(self):
        assert _onset(np.array([0.0, 0.0, 0.0, 5.0, 6.0]), 0.0) == 2
        assert _onset(np.array([0.0, 5.0, 6.0]), 0.0) == 0


def crept(creep, shake=0.0):
    """A rest, 100 samples of creep at `creep` m/s, a rest of 40, and a motion at 0.1 m/s.

    The rest of 40 is shorter than two windows of 31. The shake is one that the derivative does
    not see: every other sample up.
    """
    speed = np.repeat([0.0, creep, 0.0, 0.1], [300, 100, 40, 300])
    place = 1e-3 * np.cumsum(speed) + shake * (np.arange(speed.size) % 2)
    return Recording(1e-3, np.ones(speed.size), place)


@pytest.mark.parametrize(("share", "onset"), [(0.8e-3, 439), (1.2e-3, 299)])
def test_a_thousandth_of_the_top_speed_is_motion(share, onset):
    """Slower, the creep is part of the rest; faster, the rest after it is too short for one."""
    (found,) = found_in(crept(share * 0.1))
    assert abs(found.sample - onset) <= 1


@pytest.mark.parametrize(("deviations", "leaves"), [(3.6, False), (4.4, True)])
def test_four_deviations_of_the_velocity_are_motion(deviations, leaves):
    """Slower, the creep is part of the rest, whose spread then hides what follows."""
    shake = 1e-4
    noise = position_noise(crept(0.0, shake).position)
    found = found_in(crept(deviations * velocity_noise(noise, 1e-3, 31, 3), shake))
    assert len(found) == leaves
    assert all(abs(one.sample - 299) <= 4 for one in found)


@pytest.mark.parametrize(("samples", "onsets"), [(91, [390, 890]), (90, [889])])
def test_a_rest_is_two_windows_long(samples, onsets):
    """91 samples without a step make 92 equal positions, which hold 92 − 30 = 2·31 windows."""
    speed = np.repeat([0.1, 0.0, 0.1, 0.0, 0.1], [300, samples, 300, 200, 300])
    record = Recording(1e-3, np.ones(speed.size), 1e-3 * np.cumsum(speed))
    assert [one.sample for one in found_in(record)] == onsets


@pytest.mark.parametrize(("width", "onsets"), [(13, [600]), (15, [299, 600])])
def test_a_burst_shorter_than_half_a_window_is_noise(width, onsets):
    """A small step in a rest is smoothed to a bump of the speed, and half a window is 15.

    The step is as high as makes the bump `width` samples wide at the limit, 1e-3 of the top speed.
    """
    weights = savgol_coeffs(31, 3, deriv=1, delta=1e-3)
    bump = np.sort(np.abs(np.convolve(weights, np.repeat([0.0, 0.5, 1.0], [60, 1, 60]), "valid")))
    step = 1e-3 * 0.1 / bump[-width - 1 : -width + 1].mean()
    position = np.repeat([0.0, 0.5 * step, step], [300, 1, 600])
    position[601:] += 1e-4 * np.arange(1, 301)
    found = found_in(Recording(1e-3, np.ones(901), position))
    assert [one.sample for one in found] == onsets
