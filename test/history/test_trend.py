# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What an identification becomes in the history, and the drift of the friction along it."""

import json
import math

import numpy as np
import pytest
from histories import DAY, SECOND, START, VALVE, parameter, refused, success
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom, linregress

from valve_friction_ros import __version__
from valve_friction_ros.health import (
    Baseline,
    DatedNumber,
    FrictionLimits,
    FrictionMonitor,
    Measured,
    MonitorSettings,
    RefusedRecordError,
    SlidingFriction,
    identify_snapshot,
)
from valve_friction_ros.history import MONTH, Limit, entry_of, trend_of
from valve_friction_ros.history.entry import settings_text
from valve_friction_ros.history.trend import ScatteredLine, fit_line
from valve_friction_ros.identification import IdentificationSettings, RefusalError, Verdict
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, SineWave, Valve, simulate

NOON = START // DAY * DAY + DAY // 2
RUNS = 400


def points(drift=0.0, count=20, scatter=0.0, half_width=3.0, rng=None, every=7):
    """One identification every so many days, N a month of drift from 150 N on."""
    rng = rng or np.random.default_rng(0)
    found = []
    for k in range(count):
        day = k * every
        width = half_width * rng.uniform(0.5, 2.0)
        friction = 150.0 + drift * day * DAY / MONTH
        friction += rng.normal(0, scatter) + rng.normal(0, width / 1.959964)
        found.append(DatedNumber(NOON + day * DAY, friction, width))
    return found


def straight(drift=3.0, count=20, every=7):
    """Frictions on a line, each ± 1 N."""
    return [
        DatedNumber(NOON + k * every * DAY, 150.0 + drift * k * every * DAY / MONTH, 1.0)
        for k in range(count)
    ]


HISTORIES = {
    "intervals alone": {"scatter": 0.0},
    "both": {"scatter": 3.0},
    "scatter alone": {"scatter": 3.0, "half_width": 1e-6},
    "five exact-looking": {"scatter": 3.0, "half_width": 1e-6, "count": 5},
    "four": {"scatter": 3.0, "half_width": 1.0, "count": 4},
    "a year of weeks": {"scatter": 3.0, "half_width": 1.0, "count": 52},
}


@pytest.mark.parametrize("drift", [0.0, 2.0])
@pytest.mark.parametrize("name", HISTORIES)
def test_the_interval_covers_the_drift(name, drift):
    """At least as often as it says, by the chance of so many runs (1 in 1000).

    So a stationary valve shows a drift in 5 % of the histories at most.
    """
    rng = np.random.default_rng(20)
    trends = [trend_of(points(drift, rng=rng, **HISTORIES[name])) for _ in range(RUNS)]
    covered = sum(abs(trend.drift - drift) <= trend.half_width for trend in trends)
    assert covered >= binom.ppf(0.001, RUNS, 0.95)
    assert drift or covered == sum(not trend.is_significant for trend in trends)


def test_a_straight_drift():
    trend = trend_of(straight(3.0))
    assert trend.drift == pytest.approx(3.0)
    assert trend.is_significant
    assert (trend.days, trend.outliers) == (20, 0)
    assert (trend.begin, trend.end) == (NOON, NOON + 19 * 7 * DAY)


def test_order_does_not_matter():
    some = points(2.0, scatter=2.0)
    shuffled = trend_of([*reversed(some)])
    assert shuffled.drift == pytest.approx(trend_of(some).drift, rel=1e-9)


class TestDays:
    def test_all_of_a_day_count_as_one(self):
        """Their weighted mean: here of 150 ± 1 and 156 ± 2, a fifth of the weight."""
        some = straight(0.0, count=6)
        double = [*some, some[2]._replace(time=some[2].time + SECOND, value=156.0, half_width=2.0)]
        single = [*some]
        single[2] = DatedNumber(some[2].time, 151.2, math.sqrt(0.8))
        found, expected = trend_of(double), trend_of(single)
        assert found.days == 6
        assert found.drift == pytest.approx(expected.drift, rel=1e-6)
        assert found.half_width == pytest.approx(expected.half_width, rel=1e-6)

    def test_many_of_three_days_are_no_trend(self):
        some = [DatedNumber(NOON + k * DAY // 20, 150.0 + k, 1.0) for k in range(49)]
        assert trend_of(some) is None
        assert trend_of([*some, some[-1]._replace(time=some[-1].time + DAY)]).days == 4
        assert trend_of([]) is None


class TestOutliers:
    def test_one_is_left_out(self):
        rng = np.random.default_rng(4)
        some = points(2.0, scatter=1.0, rng=rng)
        spoilt = [*some]
        spoilt[7] = some[7]._replace(value=400.0)
        expected = trend_of(some[:7] + some[8:])
        found = trend_of(spoilt)
        assert (found.outliers, found.days) == (1, 19)
        assert found.drift == pytest.approx(expected.drift, rel=1e-6)

    def test_a_tenth_at_most(self):
        some = straight(count=19)
        for k, friction in ((3, 400.0), (9, 20.0)):
            some[k] = some[k]._replace(value=friction)
        assert trend_of(some).outliers <= 1

    def test_a_few_have_none(self):
        some = straight(0.0, count=9)
        some[4] = some[4]._replace(value=400.0)
        assert trend_of(some).outliers == 0


class TestCrossing:
    """150 N at the beginning, 20 weeks less one: 13.1 N more or less at the end."""

    def crossing(self, baseline, drift=3.0, limits=None):
        return trend_of(straight(drift), baseline, limits).crossing

    def test_the_next_limit(self):
        """176.25 N = 1.25 · 141 N is 8.75 months after the beginning."""
        found = self.crossing(Baseline(141.0))
        assert found.limit is Limit.WARN
        assert found.level == 176.25
        assert found.time == pytest.approx(NOON + 8.75 * MONTH, abs=1e-3 * DAY)
        assert found.earliest < found.time < found.latest

    def test_beyond_the_first_limit_the_second_is_next(self):
        found = self.crossing(Baseline(88.0))
        assert (found.limit, found.level) == (Limit.ERROR, 176.0)

    def test_falling(self):
        found = self.crossing(Baseline(200.0), drift=-3.0, limits=FrictionLimits(low_ratio=0.625))
        assert (found.limit, found.level) == (Limit.LOW, 125.0)
        assert found.time == pytest.approx(NOON + 25 / 3 * MONTH, abs=1e-3 * DAY)

    @pytest.mark.parametrize(
        ("baseline", "drift"),
        [(70.0, 3.0), (300.0, -3.0), (400.0, -3.0)],
        ids=["beyond all", "falls to a limit it has reached", "long ago"],
    )
    def test_what_is_passed_is_not_expected(self, baseline, drift):
        assert self.crossing(Baseline(baseline), drift) is None

    @pytest.mark.parametrize(("months", "is_told"), [(13.0, True), (13.2, False)])
    def test_no_further_ahead_than_twice_the_span(self, months, is_told):
        """The span is 133 days, 4.37 months; three times that is 13.1."""
        baseline = Baseline((150.0 + 3.0 * months) / 1.25)
        assert (self.crossing(baseline) is not None) == is_told

    def test_an_uncertain_baseline_widens_the_interval(self):
        sure, unsure = (self.crossing(Baseline(141.0, width)) for width in (0.0, 10.0))
        assert unsure.time == sure.time
        assert unsure.earliest < sure.earliest < sure.latest < unsure.latest

    def test_none_without_a_significant_drift_or_a_baseline(self):
        assert self.crossing(None) is None
        rng = np.random.default_rng(5)
        trend = trend_of(points(0.1, scatter=20.0, rng=rng), Baseline(120.0))
        assert not trend.is_significant
        assert trend.crossing is None


def test_against_a_baseline_of_sliding_friction_its_limits_count():
    """200 N at 9.5 mm/s: worth maintenance at 250 N; F_c of the baseline does not matter."""
    baseline = Baseline(1.0, 0.0, SlidingFriction(200.0, 1.0, 9.5e-3))
    rising = [DatedNumber(NOON + k * DAY, 220.0 + k, 1.0) for k in range(20)]
    trend = trend_of(rising, baseline)
    assert trend.what == "sliding friction at 9.5 mm/s"
    assert trend.crossing.limit is Limit.WARN
    assert trend.crossing.level == pytest.approx(250.0)
    assert trend.crossing.time == pytest.approx(NOON + 30 * DAY, rel=1e-6)
    assert trend_of(rising).what == "Coulomb friction"


TIMES = np.array([0.0, 1.0, 3.0, 4.0, 7.0])


def test_exact_estimates_on_a_line():
    line = fit_line(TIMES, 100.0 + 2.0 * TIMES, np.zeros(5))
    assert line.slope == pytest.approx(2.0, rel=1e-9)
    assert line.at(10.0) == pytest.approx(120.0, rel=1e-9)
    assert line.scatter == 0.0
    assert line.slope_half_width < 1e-6


def test_known_errors_alone():
    """Without scatter, the textbook's weighted line; its errors are not scaled down."""
    errors = np.array([1.0, 2.0, 1.0, 4.0, 2.0])
    line = fit_line(TIMES, 5.0 - 0.5 * TIMES, errors)
    weights = errors**-2
    centre = weights @ TIMES / weights.sum()
    assert line.centre == pytest.approx(centre)
    assert line.level_error == pytest.approx(weights.sum() ** -0.5)
    assert line.slope_error == pytest.approx((weights @ (TIMES - centre) ** 2) ** -0.5)
    assert line.scatter == 0.0


def test_scatter_alone_is_the_ordinary_regression():
    """Estimates that look exact: their intervals tell nothing, their scatter all."""
    values = np.array([100.0, 104.0, 103.0, 109.0, 111.0])
    line, ordinary = fit_line(TIMES, values, np.full(5, 1e-6)), linregress(TIMES, values)
    assert line.slope == pytest.approx(ordinary.slope, rel=1e-9)
    assert line.slope_error == pytest.approx(ordinary.stderr, rel=1e-6)
    residual = values - ordinary.intercept - ordinary.slope * TIMES
    assert line.scatter == pytest.approx(math.sqrt(residual @ residual / 3), rel=1e-6)
    assert line.freedom == 3
    assert line.quantile == pytest.approx(3.182446, rel=1e-6)  # of Student's t, from the tables


def test_scatter_brings_chi_squared_to_its_freedom():
    values = np.array([100.0, 106.0, 101.0, 111.0, 109.0])
    errors = np.array([1.0, 2.0, 1.5, 1.0, 3.0])
    line = fit_line(TIMES, values, errors)
    assert line.scatter > 0
    residual = values - line.at(TIMES)
    assert residual**2 @ (1 / (errors**2 + line.scatter**2)) == pytest.approx(3.0, rel=1e-9)


@given(st.floats(-1e6, 1e6), st.floats(0.01, 1e4), st.integers(0, 2**32))
def test_units_do_not_matter(origin, unit, seed):
    rng = np.random.default_rng(seed)
    values, errors = 100 + rng.normal(0, 3, 5), rng.uniform(0.5, 3, 5)
    line, other = fit_line(TIMES, values, errors), fit_line(TIMES, unit * values, unit * errors)
    assert other.slope == pytest.approx(unit * line.slope, rel=1e-6, abs=1e-9 * unit)
    assert other.slope_error == pytest.approx(unit * line.slope_error, rel=1e-6)
    moved = fit_line(TIMES + origin, values, errors)
    assert moved.slope == pytest.approx(line.slope, rel=1e-6, abs=1e-6)


def line_with(**changes):
    defaults = {
        "centre": 2.0,
        "level": 100.0,
        "slope": 5.0,
        "level_error": 1.0,
        "slope_error": 0.5,
        "scatter": 0.0,
        "freedom": 10,
    }
    return ScatteredLine(**{**defaults, **changes})


@pytest.mark.parametrize("slope", [5.0, -5.0])
@pytest.mark.parametrize("level", [150.0, 101.0, 20.0])
@pytest.mark.parametrize("level_error", [0.0, 2.0])
def test_the_crossing_is_where_line_and_level_are_as_far_apart_as_their_interval(
    slope, level, level_error
):
    line = line_with(slope=slope)
    expected, *ends = line.crossing(level, level_error)
    assert line.at(expected) == pytest.approx(level)
    assert ends[0] < expected < ends[1]
    for end in ends:
        error = math.hypot(line.half_width(end), line.quantile * level_error)
        assert abs(line.at(end) - level) == pytest.approx(error)


def test_no_crossing_without_a_slope():
    assert line_with(slope_error=2.3).crossing(150.0, 0.0) is None  # 2.3 · 2.228 > 5
    assert line_with(slope_error=2.2).crossing(150.0, 0.0) is not None


PERIOD = 10_000_000


@pytest.fixture
def monitor():
    """A monitor that has gathered five seconds; the pressure begins a sample later."""
    monitor = FrictionMonitor(MonitorSettings(BENCH_VALVE))
    pressure = SineWave(period=5.0).sample(np.arange(500) / 100)
    position = simulate(BENCH_VALVE, LOW_FRICTION, pressure, 0.01).position
    for k in range(500):
        if k:
            monitor.buffer.add_pressure(k * PERIOD, pressure[k])
        monitor.buffer.add_position(k * PERIOD, position[k])
    return monitor


def test_a_success(monitor):
    snapshot = monitor.buffer.snapshot()
    result = identify_snapshot(snapshot, monitor.settings)
    monitor.accept(result, START)
    baseline = monitor.baseline = monitor.result_as_baseline()
    entry = entry_of(monitor, VALVE, snapshot, monitor.settings, START)
    assert entry.parameters == dict(result.parameters)
    assert entry.span == (0, 499 * PERIOD)
    assert entry.fit == (result.fit, result.rms, result.misfit.systematic)
    assert entry.diagnosis == monitor.diagnosis()
    assert entry.diagnosis.ratio.value == 1.0
    assert (entry.baseline, entry.limits) == (baseline, monitor.settings.limits)
    assert entry.warnings == result.warnings
    assert (entry.time, entry.valve, entry.refusal) == (START, VALVE, "")
    assert entry.method == result.method == "plant"
    assert entry.version == __version__


def test_a_refusal(monitor):
    """It keeps why, and nothing of the estimate before it."""
    snapshot = monitor.buffer.snapshot()
    monitor.accept(identify_snapshot(snapshot, monitor.settings), START)
    refusal = RefusedRecordError("too little travel", {"stem_noise": Measured(1e-5, 1e-7)})
    entry = entry_of(monitor, VALVE, snapshot, monitor.settings, START, refusal)
    assert entry.refusal == "too little travel"
    assert entry.numbers == refusal.numbers
    assert not entry.parameters
    assert entry.friction is None
    assert entry.point() is None
    assert entry.span == (0, 499 * PERIOD)


@pytest.mark.parametrize(("name", "method"), [("best", "plant"), ("bench", "bench")])
def test_a_refusal_has_the_method_that_would_have_identified(name, method):
    monitor = FrictionMonitor(MonitorSettings(BENCH_VALVE, method=name))
    empty, refusal = monitor.buffer.snapshot(), RefusalError("no samples")
    entry = entry_of(monitor, VALVE, empty, monitor.settings, START, refusal)
    assert (entry.method, entry.span) == (method, None)


def test_neither_a_success_nor_a_refusal_or_both():
    for changes in ({"parameters": {}}, {"refusal": "why"}):
        with pytest.raises(ValueError, match="either parameters or the reason"):
            success(**changes)


@pytest.mark.parametrize("verdict", Verdict)
def test_only_what_was_measured_makes_a_trend(verdict):
    expected = DatedNumber(START, 150.0, 3.0)
    measured = verdict in (Verdict.IDENTIFIED, Verdict.WEAK)
    assert success(verdict=verdict).point() == (expected if measured else None)
    assert refused().point() is None


def test_settings_are_the_same_text_for_the_same_settings():
    one = MonitorSettings(BENCH_VALVE, IdentificationSettings(fixed={"mass": 1.6}))
    assert settings_text(one) == settings_text(MonitorSettings(BENCH_VALVE, one.identification))
    told = json.loads(settings_text(one))
    assert told["identification"]["fixed"] == {"mass": 1.6}
    assert told["valve"]["diaphragm_area"] == BENCH_VALVE.diaphragm_area
    assert told["window"] == 60.0
    endless = MonitorSettings(Valve(0.0445, 0.0))
    assert json.loads(settings_text(endless))["valve"]["travel"] is None


def test_parameters_cannot_be_changed():
    with pytest.raises(TypeError):
        success().parameters["mass"] = parameter("mass", 2.0)
