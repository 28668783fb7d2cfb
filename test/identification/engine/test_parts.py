# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Parts of the fit with imperfections, each against what can be derived: lags and search."""

import math
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from valve_friction_ros.identification import identify
from valve_friction_ros.identification.engine.broad_model import ABSENT, SWINGING, BroadModel
from valve_friction_ros.identification.engine.coordinates import TIMING, Profile
from valve_friction_ros.identification.engine.fitted_record import fitted_record, inflation
from valve_friction_ros.identification.engine.intervals import (
    AT_REST,
    AVERAGES,
    OMITTED,
    ROUNDING,
    STROKES,
    UNSEEN,
    Estimated,
)
from valve_friction_ros.identification.engine.lags import (
    LagPrior,
    LagProfile,
    mixture_half_width,
    share_of_timing,
    spread_of,
)
from valve_friction_ros.identification.engine.moving_part import moving_part
from valve_friction_ros.identification.engine.posterior_fit import (
    PosteriorFit,
    bounded_minimum,
    fit,
)
from valve_friction_ros.identification.engine.search import (
    Prior,
    _likeliest,
    _lowest,
    _Search,
    lagging,
)
from valve_friction_ros.identification.engine.verdicts import (
    found_imperfections,
    main_doubt,
    sampling_remarks,
    split_doubt,
)
from valve_friction_ros.identification.result import Pause, StemComparison
from valve_friction_ros.identification.trust.verdict import interval_share
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, Drive, Recording, simulate
from valve_friction_ros.model.recording import StampedRecord, StampedSignal
from valve_friction_ros.signals import stamped_noise

LAGS = LagPrior().lags
SIGMA = 0.01
SHARPNESS = 1.5  # the logarithm of the likelihood is divided by it


class TestLagPrior:
    LAGS = np.linspace(-2.0, 2.0, 400_001)

    def test_unstated(self):
        """Cauchy's: half within 4 ms, 95 % within 51 ms, 2·arctan(x/4 ms)/π; never impossible."""
        density = np.exp(LagPrior().log_density(self.LAGS))
        share = [np.sum(density[np.abs(self.LAGS) < reach]) for reach in (4e-3, 50.82e-3)]
        inside = 2.0 / math.pi * math.atan(self.LAGS[-1] / 4e-3)
        expected = np.array([0.5, 0.95]) / inside
        assert np.array(share) / np.sum(density) == pytest.approx(expected, abs=1e-3)
        assert not LagPrior().is_known

    def test_reach(self):
        """150 ms; three deviations of a larger stated timing, in a tenth of the record at most."""
        usual = LagPrior()
        np.testing.assert_array_equal(usual.lags, np.linspace(-0.15, 0.15, 301))
        np.testing.assert_array_equal(usual.work_lags, usual.lags[::10])
        time = np.arange(0.0, 101.0)
        signal = StampedSignal(time, time)
        record = StampedRecord(signal, signal, Drive.FORCE)
        assert LagPrior.of(None, record) == usual
        assert LagPrior.of(0.04, record).reach == 0.15
        for stated, reach in ((0.5, 1.5), (2.0, 6.0), (20.0, 10.0)):
            prior = LagPrior.of(stated, record)
            assert prior.reach == prior.lags[-1] == -prior.lags[0] == reach
            assert prior.lags[prior.lags.size // 2] == 0.0
        odd = LagPrior(1.0, 1.2033)
        assert odd.lags[0] == odd.work_lags[0] == -1.2033
        assert odd.lags[-1] == odd.work_lags[-1] == 1.2033
        assert odd.work_lags[odd.work_lags.size // 2] == 0.0

    def test_stated(self):
        """A Gaussian."""
        density = LagPrior(0.02).log_density(np.array([0.0, 0.02, 0.06]))
        np.testing.assert_allclose(density - density[0], [0.0, -0.5, -4.5])
        assert LagPrior(0.02).precision(0.3) == pytest.approx(0.02**-2)
        assert LagPrior(0.0).is_known

    def test_its_precision_falls_where_it_is_flat(self):
        assert LagPrior().precision(0.0) > LagPrior().precision(0.05) > 0.0


class TestMixture:
    def test_of_one_normal_distribution(self):
        ones = np.ones(1)
        assert mixture_half_width(ones, 3.0 * ones, 2.0 * ones) == pytest.approx(
            2.0 * 1.959964, rel=1e-5
        )

    def test_of_sharp_ones_apart(self):
        """Two of three share the mean's side; the third is held too: 95 % do not go without it."""
        values = np.array([0.0, 0.0, 3.0])
        assert mixture_half_width(np.ones(3) / 3, values, np.full(3, 1e-6)) == pytest.approx(
            2.0, abs=1e-5
        )

    def test_its_timing_is_what_the_record_leaves(self):
        """In squares, and never more than was found."""
        assert share_of_timing(5.0 * 1.959964, 3.0, 9.0) == pytest.approx(4.0, rel=1e-6)
        assert share_of_timing(5.0 * 1.959964, 3.0, 2.0) == 2.0
        assert share_of_timing(1.0, 3.0, 2.0) == 0.0

    def test_spread(self):
        assert spread_of(np.exp(-0.5 * (LAGS / SIGMA) ** 2), LAGS) == pytest.approx(SIGMA, rel=1e-3)


def fit_at(lag, cost, is_apart=False, residual=0.0):
    at = {"delay": lag, "stem_lag": 0.0, "force_lag": 0.0}
    nothing = np.zeros(1)
    return PosteriorFit(
        SimpleNamespace(weights=1.0),
        ("delay",),
        at,
        np.array([[SIGMA**2]]),
        cost,
        0.0,
        1,
        1.0,
        nothing,
        nothing,
        np.array([residual]),
        is_apart=is_apart,
    )


def parabola(lifted=0.0):
    """Fits at five lags; the one at a deviation above the best ends that much too high."""
    return [fit_at(n * SIGMA, n**2 + (lifted if n == 1 else 0.0)) for n in (-2, -1, 0, 1, 2)]


class TestProfile:
    def test_of_a_parabola(self):
        expected = -0.5 * (LAGS / SIGMA) ** 2 / SHARPNESS
        found = LagProfile.of(parabola(), LagPrior()).by_fits
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)

    @pytest.mark.parametrize("lifted", [0.5, 3.0, 10.0])
    def test_a_fit_that_ends_too_high_excludes_no_lag(self, lifted):
        usual = LagProfile.of(parabola(), LagPrior()).by_fits
        assert np.all(LagProfile.of(parabola(lifted), LagPrior()).by_fits >= usual - 0.5)
        assert LagProfile.of(parabola(lifted), LagPrior()).by_fits[150] == 0.0

    def test_one_far_apart_is_as_likely_as_it_fits_and_no_more_than_the_best(self):
        far = 0.1
        there = int(np.argmin(np.abs(LAGS - far)))
        for cost, expected in ((4.0, -2.0), (-9.0, 0.0)):
            found = LagProfile.of(
                [*parabola(), fit_at(far, cost, is_apart=True)], LagPrior()
            ).by_fits
            assert found[there] == pytest.approx(expected, abs=1e-3)

    def test_a_thirtieth_of_the_simulations_are_misled(self):
        """Of the probability 3 % are √10 times as wide: its logarithm is a tenth there."""
        profile = LagProfile.of(parabola(), LagPrior())
        told, sharp = np.exp(profile.log_likelihood), np.exp(profile.by_fits)
        blunt = np.exp(-0.5 * (LAGS / SIGMA) ** 2 / (10.0 * SHARPNESS))
        expected = 0.97 * sharp / np.sum(sharp) + 0.03 * blunt / np.sum(blunt)
        np.testing.assert_allclose(told / np.sum(told), expected, rtol=1e-6)
        assert profile.spread == pytest.approx(SIGMA * math.sqrt(SHARPNESS), rel=1e-2)

    def test_one_near_is_of_the_same_valley(self):
        assert not LagProfile.of(
            [*parabola(), fit_at(5.9 * SIGMA, 0.0, is_apart=True)], LagPrior()
        ).apart

    def test_none_without_a_lag_or_with_an_absurd_one(self):
        assert LagProfile.of([fit_at(0.15, 0.0)], LagPrior()) is None
        assert LagProfile.of([fit_at(0.0, 0.0, is_apart=True)], LagPrior()) is None

    def test_numbers_along_it(self):
        """Linear between fits, the linear model's slope beyond, and of a fit apart its own."""
        fits = [*parabola(), fit_at(0.1, 0.0, is_apart=True)]
        found = LagProfile.of(fits, LagPrior()).along(
            {one: 7.0 + 100.0 * one.lag for one in fits}, -3.0
        )
        at = dict(zip(np.round(LAGS, 6), found, strict=True))
        assert at[0.005] == pytest.approx(7.5)
        assert at[-0.03] == pytest.approx(5.0 + 0.03)
        assert at[0.1] == at[0.12] == pytest.approx(17.0)


@pytest.mark.parametrize("jitter", [0.0, 0.3])
@pytest.mark.parametrize("lost", [0.0, 0.2])
def test_noise_does_not_depend_on_the_stamps(jitter, lost):
    generator = np.random.default_rng(1)
    time = np.arange(20_000) * 1e-3 + 1e-3 * jitter * generator.uniform(-1, 1, 20_000)
    time = time[generator.random(time.size) >= lost]
    values = np.sin(time) + 0.01 * generator.standard_normal(time.size)
    assert stamped_noise(StampedSignal(time, values)) == pytest.approx(0.01, rel=0.03)


@pytest.mark.parametrize("jitter", [0.0, 0.05, 0.2])
@pytest.mark.parametrize("lost", [0.0, 0.02, 0.1])
def test_samples_are_missing_only_where_some_were_lost(jitter, lost):
    """Stamps in whole milliseconds of an 80 Hz clock: their median pause is 12 ms, not 12.5 ms."""
    generator = np.random.default_rng(7)
    time = (np.arange(8000) + jitter * generator.uniform(-1, 1, 8000)) / 80
    time = np.round(time[generator.random(time.size) >= lost], 3)
    signal = StampedSignal(time, np.sin(time))
    said = [one for one in sampling_remarks(StampedRecord(signal, signal)) if "missing" in one]
    if lost == 0:
        assert said == []
    else:
        share = float(re.match(r"([\d.]+) % of", said[0])[1]) / 100
        assert share == pytest.approx(1 - time.size / 8000, rel=0.15)


def test_minimum_within_bounds():
    """With q₀ held at 0, q₁ is b₁/A₁₁."""
    curvature, slope = np.array([[1.0, 0.9], [0.9, 1.0]]), np.array([-1.0, 0.5])
    found = bounded_minimum(curvature, slope, np.full(2, -np.inf))
    np.testing.assert_allclose(found, np.linalg.solve(curvature, slope))
    found = bounded_minimum(curvature, slope, np.array([0.0, -np.inf]))
    np.testing.assert_allclose(found, [0.0, 0.5])


def test_residuals_are_inflated_by_their_length():
    """Blocks of 64 equal numbers: a mean over them has 64 times the variance of white noise."""
    white = np.random.default_rng(0).standard_normal(4096)
    assert inflation(white, 64) == pytest.approx(1.0, abs=0.6)
    assert inflation(np.repeat(white, 64), 64) == pytest.approx(64.0, rel=0.1)


@pytest.mark.parametrize("profile", Profile)
@pytest.mark.parametrize("rise", [-5.0, 59.0, 61.0])
def test_a_slip_is_taken_where_the_record_demands_it(rise, profile):
    """Inflated twice, 30 variances are 60 of the sum of squares."""
    at = {"stribeck_velocity": 0.0, "slip_force": 5.0}
    best = SimpleNamespace(at=at, names=("mass", "slip_force"), objective=100.0, inflation=2.0)
    plain = SimpleNamespace(at={**at, "slip_force": 0.0}, objective=100.0 + rise)
    fits = {(0.0, ("mass",)): plain}
    searched = SimpleNamespace(
        full=lambda start, names: fits[start["slip_force"], names],
        fit=lambda start, names, steps, _: plain if (names, steps) == (best.names, 0) else start,
        exact=None,
        prior=SimpleNamespace(profile=profile),
    )
    assert _Search.without_slip(searched, best) is (best if rise > 60.0 else plain)
    for change in ({"stribeck_velocity": 1e-3}, {"slip_force": 0.0}):
        best.at = {**at, **change}
        assert _Search.without_slip(searched, best) is best


def test_starts_with_a_lag_keep_the_whole_delay():
    """A sliding stem follows the force by F_v/k and the lags together."""
    at = {"spring_constant": 2e5, "viscous_friction": 1.2e4, **ABSENT}
    starts = lagging(at, 0.04)
    assert len(starts) == 25
    for start in starts:
        lags = sum(start[name] for name in TIMING)
        assert start["stem_lag"] >= 0
        if start["viscous_friction"] > 0.1 * at["viscous_friction"]:
            assert lags + start["viscous_friction"] / 2e5 == pytest.approx(0.06)
        else:
            assert lags >= 0.054


@pytest.fixture(scope="module")
def model():
    """Return the model of a slow triangle, with noise of the pressure only."""
    time = np.arange(20_000) * 1e-3
    pressure = 1e5 + 2e4 * np.abs((time / 10.0) % 2.0 - 1.0)
    position = simulate(BENCH_VALVE, LOW_FRICTION, pressure, 1e-3).position
    generator = np.random.default_rng(0)
    record = StampedRecord(
        StampedSignal(time, pressure + 50.0 * generator.standard_normal(time.size)),
        StampedSignal(time, position + 1e-6 * generator.standard_normal(time.size)),
    )
    return BroadModel(fitted_record(record, BENCH_VALVE), LOW_FRICTION.spring_constant)


TRUE = {
    **ABSENT,
    "mass": LOW_FRICTION.mass,
    "viscous_friction": LOW_FRICTION.viscous_friction,
    "coulomb_friction": LOW_FRICTION.coulomb_friction,
    "spring_constant": LOW_FRICTION.spring_constant,
    "spring_preload": LOW_FRICTION.spring_preload,
}


def test_presliding_leaves_the_sliding_level(model):
    """F_c is what a sliding stem needs, however far its bristles bend before."""
    at = {**TRUE, "start_position": model.record.start}
    stiff, soft = (model.readings({**at, "presliding": bend})[0] for bend in (0.0, 2e-5))
    velocity = np.abs(model.simulate(at).velocity)[model.record.cells.astype(int)]
    cells = np.arange(velocity.size)
    sliding = (velocity > 1e-4) & (cells > 0.2 * cells.size)
    away = np.abs(soft - stiff)
    assert np.median(away[sliding]) < 1e-7
    assert away.max() > 1e-5


def test_difference_of_the_halves_is_foreseen(model):
    """The squares of half the difference sum up to what the noise of the pressure explains."""
    at = {**TRUE, "start_position": model.record.start}
    even, odd = (model.record.position - model.readings(at)) * model.weights
    apart = 0.25 * float(np.sum((even - odd) ** 2))
    assert 0.2 * model.foreseen_difference < apart < 1.2 * model.foreseen_difference


def test_what_the_record_does_not_see_is_unknown(model):
    """Without a slip force no speed at which it falls shows: its variance is not 0."""
    at = {**TRUE, "start_position": model.record.start, "stribeck_velocity": 1e-3}
    names = ("coulomb_friction", "spring_constant", "spring_preload", "stribeck_velocity")
    found = fit(model, at, names, {}, {}, 0)
    assert found.deviation("stribeck_velocity") > 1.0
    assert found.deviation("coulomb_friction") < 0.1 * TRUE["coulomb_friction"]


def test_a_friction_that_falls_with_speed_leaves_that_speed_free(model):
    """Also where only a dead zone was to be added: a speed that is held would look certain."""
    falling = {**TRUE, "slip_force": 50.0, "stribeck_velocity": 1e-3}
    search = _Search(model.record, Prior(LagPrior(0.01), TRUE["mass"], {}))
    assert "stribeck_velocity" in search.full({**search.base, **falling}).names
    assert "stribeck_velocity" not in search.full({**search.base, **TRUE}).names


def test_no_fit_without_a_lag_begins_with_a_stem_that_swings(model, monkeypatch):
    """Its derivatives overflow: a lag of -10 ms in place of no viscous friction leaves less."""
    search = _Search(model.record, Prior(LagPrior(0.01), TRUE["mass"], {}))
    best, starts = search.full({**search.base, **TRUE}), []
    monkeypatch.setattr(search, "fit", lambda start, *_: starts.append(start))
    search.without_lag(best, {**best.at, "viscous_friction": 1e-15, "delay": -0.01})
    (start,) = starts
    assert start["viscous_friction"] >= SWINGING * start["spring_constant"]


@pytest.mark.parametrize(
    ("clock", "pressure", "said"),
    [(0.062, -0.048, ""), (0.014, 0.0, "clock offset"), (0.001, 0.013, "lag of the pressure")],
)
def test_lags_that_compensate_each_other_are_not_named(clock, pressure, said):
    """Each is far beyond its own deviation; only their sum, 14 ms, is in the record."""
    at = dict(zip(TIMING, (clock, 0.0, pressure), strict=True))
    found = SimpleNamespace(names=TIMING, at=at, deviation=dict.fromkeys(TIMING, 2e-4).get)
    lag = Estimated(clock + pressure, 0.002, 0.001)
    sentences = found_imperfections(found, lag)
    assert [one.partition(" (")[0].partition(":")[0] for one in sentences] == [said] * bool(said)


def test_every_source_has_words():
    """Also those that are no imperfection of a plant."""
    of_record = (ROUNDING, OMITTED, UNSEEN, STROKES, AVERAGES, AT_REST)
    for name in (*ABSENT, "start_position", *of_record):
        doubt = main_doubt(Estimated(1.0, 0.2, 1.0, 0.0, {name: 2.0}), interval_share(1.0, 0.2))
        assert doubt.startswith(
            "its interval is ±20 % of its value; not determined by the record: "
        )
    assert main_doubt(Estimated(1.0, 0.2, 1.0, 0.0, {"drift": 0.1}), "").endswith(
        "motion that the model does not explain"
    )
    assert main_doubt(Estimated(1.0, 0.2, 1.0, 2.0), "").endswith(": lag between the signals")


def ended(misfit, penalty, inflation, low_speed=(0.0, 1.0)):
    """Return the end of a fit, as far as the search compares it with others."""
    value, deviation = low_speed
    return SimpleNamespace(
        misfit=misfit,
        penalty=penalty,
        inflation=inflation,
        names=("at_low_speed",),
        at={"at_low_speed": value},
        deviation=lambda _: deviation,
    )


@pytest.mark.parametrize(
    ("inflation", "penalty", "lag", "said"),
    [
        (1.0, 5.0, 0.01, ""),
        (2.0, 5.0, 0.01, "no friction model here"),
        (1.0, 27.0, 0.01, "the best fit needs imperfections that are improbable together"),
        (1.0, 5.0, 9.0, "the best fit puts the signals 9000 ms apart"),
    ],
)
def test_what_keeps_a_fit_from_determining_the_lag(inflation, penalty, lag, said):
    best = replace(fit_at(lag, 100.0), inflation=inflation, penalty=penalty)
    best = replace(best, names=("delay", "viscous_friction"))
    misfit = SimpleNamespace(systematic=1e-5)
    doubt = split_doubt([best, best], misfit, Profile.PLANT, 5.0)
    assert doubt.startswith(said)
    assert bool(doubt) == bool(said)


class TestSearch:
    def test_a_residual_far_above_the_noise_does_not_outweigh_the_priors(self):
        """At 100 variances for one, 1,000 more of the residual are 10, and the priors 30 less."""
        unlikely, likely = ended(50_000.0, 40.0, 100.0), ended(51_000.0, 10.0, 110.0)
        assert _likeliest([unlikely, likely]) is likely

    @pytest.mark.parametrize(("low_speed", "enough"), [((0.19, 0.1), True), ((0.21, 0.1), False)])
    def test_a_friction_that_surely_falls_with_speed_is_looked_into(self, low_speed, enough):
        search = SimpleNamespace(may_go_on=True)
        assert _Search.is_enough(search, [ended(100.0, 1.0, 1.0, low_speed)]) is enough

    @pytest.mark.parametrize(("fall", "is_followed"), [(10.0, False), (20.0, True)])
    def test_the_valley_of_a_far_deeper_fit_is_followed_too(self, fall, is_followed):
        """The fits along the valley of a fit that was not the best say nothing about its width."""
        first, deep = fit_at(0.01, 100.0), fit_at(0.0, 100.0 - fall)
        beside = fit_at(-0.001, 101.0 - fall)
        search = SimpleNamespace(
            prior=SimpleNamespace(profile=Profile.PLANT),
            exact=None,
            may_go_on=True,
            best=lambda: first,
            without_slip=lambda best: best,
            profiled=lambda _: [deep],
            fit=lambda *_: deep,
            along_valley=lambda best: [beside] if best is deep else [],
        )
        expected = [deep, deep, first, *([beside] if is_followed else [])]
        assert _Search.all_probable(search) == expected


@pytest.mark.parametrize(
    ("cost", "is_apart", "residual", "is_taken"),
    [
        (98.5, False, 12.0, True),
        (99.5, False, 8.0, False),
        (65.0, True, 8.0, True),
        (75.0, True, 8.0, False),
        (65.0, True, 12.0, False),
    ],
)
def test_a_slow_sensor_is_no_better_for_the_noise_in_its_jumps(cost, is_apart, residual, is_taken):
    """Apart, a fit must lie 30 lower than the best, and its plain sum of squares below, too."""
    best, other = fit_at(0.0, 100.0, residual=10.0), fit_at(0.1, cost, is_apart, residual)
    assert _lowest([best, other]) is (other if is_taken else best)


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


def test_stamps_at_both_ends_of_a_rest_do_not_coincide():
    # Rests begin and end half a period before a position: between two even seconds, on an odd one.
    stem = moves([1000.0, 20_000.0, 70_000.0], 3 * [STROKE], 90_000.0, period=2.0).position
    seconds = np.arange(90_000.0)
    drive = StampedSignal(seconds, np.interp(seconds, stem.time, stem.value))
    part = moving_part(StampedRecord(drive, stem, Drive.PRESSURE))
    assert len(part.pauses) == 2
    np.testing.assert_allclose(np.diff(part.record.drive.time), 1.0)


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


@pytest.mark.parametrize("seed", [11, 23, 60])
def test_a_few_positions_in_hours_are_kept(seed):
    """As of a stem that was sent on change: no window of it moves."""
    generator = np.random.default_rng(seed)
    count = generator.integers(8, 30)
    time = np.sort(generator.uniform(0, 14_000, count))
    place = np.where(np.arange(count) == count // 2, 0.01, 0.0)
    stem = StampedSignal(time, place + 1e-6 * generator.standard_normal(count))
    seconds = np.arange(14_000.0)
    drive = StampedSignal(seconds, np.sin(seconds / 900.0))
    part = moving_part(StampedRecord(drive, stem, Drive.PRESSURE))
    assert part.record.position.time.size >= StampedSignal.FEWEST


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
    assert any("with the most stem travel" in text for text in result.findings)
    assert result.stem.time[-1] <= 2400
