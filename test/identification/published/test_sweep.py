# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The sweep (8) against its definitions, and the static friction (9) from the breakaways."""

from types import MappingProxyType

import numpy as np
import pytest
from scipy.signal import savgol_coeffs

from valve_friction_ros.identification import (
    IdentificationSettings,
    published_estimate,
    sweep_thresholds,
)
from valve_friction_ros.identification.published.identify import (
    _onset,
    find_breakaways,
)
from valve_friction_ros.identification.published.sweep import (
    ForceBalanceRegression,
    force_balance_regression,
)
from valve_friction_ros.identification.settings import REGRESSED
from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    HIGH_FRICTION,
    Recording,
    SensorNoise,
    SquareWave,
)
from valve_friction_ros.signals import differentiate, position_noise, runs_of, velocity_noise

BIAS = 1.13e-3
ENOUGH = 200  # samples, above which the comparison is not about the noise of a near-singular fit


@pytest.fixture(scope="module")
def record(bench_record):
    return bench_record("high", SquareWave(), 20.8, SensorNoise(10e-6, 100.0, seed=1))


@pytest.fixture(scope="module")
def derivatives(record):
    return differentiate(record.position, record.sample_period)


def swept(record, derivatives, settings):
    force = BENCH_VALVE.actuator_force(record.pressure)
    regression = force_balance_regression(force, record.position, derivatives, settings)
    thresholds = derivatives_top(derivatives) / 350 * np.arange(1, 331)
    return sweep_thresholds(regression, thresholds)


def derivatives_top(derivatives):
    return np.abs(derivatives.velocity).max()


def columns_of(record, derivatives, bias=None):
    """(5) and the preload beside it, by name."""
    place = record.position[15:-15]
    columns = {
        "mass": derivatives.acceleration,
        "coulomb_friction": np.sign(derivatives.velocity),
        "viscous_friction": derivatives.velocity,
        "spring_constant": place if bias is None else place + bias,
    }
    return columns if bias is not None else columns | {"spring_preload": np.ones(place.size)}


def refined_least_squares(table, force):
    """`lstsq`, whose columns differ by nine orders, and a correction by its residual in 80 bits.

    By itself `lstsq` errs by 6e-11 kg in the mass; where the mass passes through zero, that is
    more than the 1e-7 of it to be compared.
    """
    first, *_ = np.linalg.lstsq(table, force, rcond=None)
    long = table.astype(np.longdouble)
    residual = (force - long @ first).astype(float)
    return first + np.linalg.lstsq(table, residual, rcond=None)[0]


FORMS = {
    "five columns": {},
    "four columns": {"position_bias": BIAS},
    "four columns, mass fixed": {"position_bias": BIAS, "fixed": {"mass": 1.75}},
    "four columns, spring fixed": {"position_bias": BIAS, "fixed": {"spring_constant": 2.05e5}},
    **{f"{name} fixed": {"fixed": {name: getattr(HIGH_FRICTION, name)}} for name in REGRESSED},
    "two fixed": {"fixed": {"mass": 1.0, "spring_preload": 200.0}},
}


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS.keys())
def test_against_least_squares_at_each_threshold(record, derivatives, form):
    """(6) by `lstsq` on the samples faster than each threshold, (17) and (18) as they are written.

    The force left by fixed parameters is regressed on the others.
    """
    settings = IdentificationSettings(**form)
    found = swept(record, derivatives, settings)
    force = BENCH_VALVE.actuator_force(record.pressure)[15:-15]
    columns = columns_of(record, derivatives, settings.position_bias)
    for name, value in settings.fixed.items():
        force = force - value * columns.pop(name)
    table = np.column_stack(list(columns.values()))
    speed = np.abs(derivatives.velocity)
    told_apart = {"coulomb_friction", "spring_preload"} <= columns.keys()
    compared = 0
    for step, threshold in enumerate(found.thresholds):
        moving = speed > threshold
        assert found.samples[step] == np.count_nonzero(moving)
        if found.samples[step] < ENOUGH:
            continue
        if told_apart and abs(np.sign(derivatives.velocity[moving]).sum()) == moving.sum():
            assert np.isnan(found.sigma[step])  # all go one way: F_c and F_0 are one number
            continue
        compared += 1
        expected = refined_least_squares(table[moving], force[moving])
        for name, value in zip(columns, expected, strict=True):
            assert found.estimates[name][step] == pytest.approx(value, rel=1e-7, abs=0)
        explained = table[moving] @ expected
        sigma = np.sqrt(
            np.sum((force[moving] - explained) ** 2) / (np.count_nonzero(moving) - len(columns))
        )
        assert found.sigma[step] == pytest.approx(sigma, rel=1e-7)
        mean = force[moving].mean()
        r_squared = np.sum((explained - mean) ** 2) / np.sum((force[moving] - mean) ** 2)
        assert found.r_squared[step] == pytest.approx(r_squared, rel=1e-7)
        _, log_determinant = np.linalg.slogdet(table[moving].T @ table[moving])
        # Normal equations lose twice the digits of the condition, 1e9 at the most here.
        assert found.log_information[step] == pytest.approx(log_determinant, abs=1e-4)
    assert compared > 150
    assert found.free == len(columns)
    for name, value in settings.fixed.items():
        np.testing.assert_array_equal(found.estimates[name], value)


def test_everything_fixed_leaves_only_the_residual(record, derivatives):
    fixed = {name: getattr(HIGH_FRICTION, name) for name in REGRESSED}
    found = swept(record, derivatives, IdentificationSettings(fixed=fixed))
    assert found.free == 0
    columns = columns_of(record, derivatives)
    residual = BENCH_VALVE.actuator_force(record.pressure)[15:-15] - sum(
        fixed[name] * columns[name] for name in REGRESSED
    )
    moving = np.abs(derivatives.velocity) > found.thresholds[100]
    expected = np.sqrt(np.mean(residual[moving] ** 2))
    assert found.sigma[100] == pytest.approx(expected, rel=1e-9)


def synthetic(columns, force, speed):
    columns = np.asarray(columns, dtype=float)
    names = REGRESSED[: columns.shape[1]]
    rest = dict.fromkeys(REGRESSED[columns.shape[1] :], 0.0)
    return ForceBalanceRegression(
        names,
        columns,
        np.asarray(force, float),
        np.asarray(speed, float),
        MappingProxyType(rest),
        None,
    )


def is_unknown(sweep, step):
    return (
        np.isnan([sweep.sigma[step], sweep.r_squared[step], sweep.log_information[step]]).all()
        and np.isnan(sweep.estimates["mass"][step])
        and np.isnan(sweep.estimates["coulomb_friction"][step])
    )


class TestUndetermined:
    THRESHOLDS = np.array([0.5, 1.5, 2.5])

    def test_as_few_samples_as_parameters(self):
        """Two parameters need two degrees of freedom in (17): four samples do, three do not."""
        speed = np.repeat([1.0, 2.0, 3.0], [40, 1, 3])
        columns = np.random.default_rng(0).standard_normal((44, 2))
        found = sweep_thresholds(synthetic(columns, columns @ [2.0, 3.0], speed), self.THRESHOLDS)
        np.testing.assert_array_equal(found.samples, [44, 4, 3])
        assert is_unknown(found, 2)
        np.testing.assert_allclose(found.estimates["mass"][:2], 2.0, rtol=1e-14)
        np.testing.assert_allclose(found.estimates["coulomb_friction"][:2], 3.0, rtol=1e-14)

    @pytest.mark.parametrize(("share", "known"), [(0.8e-10, False), (1.3e-10, True)])
    def test_a_column_that_depends_on_another(self, share, known):
        """All but 10⁻¹⁰ of the second column lies along the first."""
        first, apart = np.ones(40), np.tile([1.0, -1.0], 20)
        columns = np.column_stack([first, first + share * apart])
        regression = synthetic(columns, apart, np.ones(40))
        found = sweep_thresholds(regression, np.array([0.5]))
        assert is_unknown(found, 0) != known

    def test_a_force_that_does_not_vary_has_no_share(self):
        """(18) divides by the spread of the force."""
        columns = np.random.default_rng(0).standard_normal((20, 2))
        found = sweep_thresholds(synthetic(columns, np.zeros(20), np.ones(20)), np.array([0.5]))
        assert np.isnan(found.r_squared[0])
        assert found.sigma[0] == found.estimates["mass"][0] == 0.0

    def test_one_direction_of_a_record(self, record, derivatives):
        """The upstroke of the bench alone, in the five-column form."""
        force = BENCH_VALVE.actuator_force(record.pressure)
        settings = IdentificationSettings()
        regression = force_balance_regression(force, record.position, derivatives, settings)
        up = derivatives.velocity > 0
        one_way = ForceBalanceRegression(
            regression.names,
            regression.columns[up],
            regression.force[up],
            regression.speed[up],
            regression.fixed,
            None,
        )
        found = sweep_thresholds(one_way, np.array([2e-3, 4e-3]))
        assert (found.samples > 1000).all()
        assert np.isnan(found.sigma).all()
        assert np.isnan(found.estimates["coulomb_friction"]).all()


def test_a_sample_at_the_threshold_is_not_above_it():
    speed = np.repeat([1.0, 2.0, 3.0], 10)
    columns = np.random.default_rng(0).standard_normal((30, 2))
    regression = synthetic(columns, columns[:, 0], speed)
    found = sweep_thresholds(regression, np.array([1.0, np.nextafter(2.0, 0.0), 2.0, 3.0]))
    np.testing.assert_array_equal(found.samples, [20, 20, 10, 0])


SETTINGS = IdentificationSettings()


def found_in(graphite_record):
    return find_breakaways(graphite_record, SETTINGS)


@pytest.fixture(scope="module")
def graphite_record(bench_record):
    return bench_record("graphite", SquareWave(), 52.0)


@pytest.fixture(scope="module")
def true_breakaways(bench_trajectory):
    """Last resting sample before each motion of the simulated stem, and the way it goes."""
    _, trajectory = bench_trajectory("graphite", SquareWave(), 52.0)
    moving = trajectory.velocity != 0
    samples = np.flatnonzero(~moving[:-1] & moving[1:])
    return samples, np.sign(trajectory.velocity[samples + 1])


def test_the_instants_of_the_simulation(graphite_record, true_breakaways):
    samples, directions = true_breakaways
    found = found_in(graphite_record)
    assert len(found) == samples.size == 9  # 52 s hold 9 edges of the wave
    assert np.abs(np.array([one.sample for one in found]) - samples).max() <= 2
    np.testing.assert_array_equal([one.direction for one in found], directions)


def test_static_friction(graphite_record, benches):
    """The pull (9) changes by up to 0.0445 m² · 99 kPa/1.3 s: 3.4 N, 0.36 %, in a sample."""
    estimate = published_estimate(
        graphite_record, benches["graphite"].valve, IdentificationSettings(assumed_mass=1.6)
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


def test_none_without_a_rest_or_without_a_departure():
    """A stem that comes to rest and stays has left no rest."""
    time = 1e-3 * np.arange(8000)
    for position in (0.01 * np.sin(2 * np.pi * time), 0.01 * np.exp(-time / 0.3)):
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


def grown(start, power, samples):
    return np.maximum(np.arange(samples) - start, 0.0) ** power


@pytest.mark.parametrize(
    ("displacement", "spread", "onset"),
    [
        (grown(0, 2, 30), 25.0, 0),
        (grown(-1, 2, 30), 25.0, None),
        (101.0 + grown(0, 1, 400), 25.0, None),
        (grown(10, 2, 31), 25.0, None),
        (grown(10, 2, 32), 25.0, 10),
        (np.array([0.0, 0.0, 0.0, 5.0, 6.0]), 0.0, 2),
    ],
    ids=["at once", "before", "displaced", "second mark not passed", "passed", "no noise"],
)
def test_onset(displacement, spread, onset):
    """The spread is chosen so that 4 and 16 of it are passed after whole samples."""
    assert _onset(displacement, spread) == onset


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
    graphite_record = Recording(1e-3, np.ones(speed.size), 1e-3 * np.cumsum(speed))
    assert [one.sample for one in found_in(graphite_record)] == onsets


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
