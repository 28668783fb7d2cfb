# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Stroke tests: the pressure band, the patterns, the search for the best, and how one is played."""

import itertools
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import qmc

from benchmark.planned_tests import trials
from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    expected_half_widths,
    identify,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    KarnoppParameters,
    SampledPressure,
    SensorNoise,
    SquareWave,
    Valve,
    simulate,
)
from valve_friction_ros.planning import (
    AIMS,
    Conditions,
    Limits,
    known_friction,
    plan_remarks,
    plan_test,
    unknown_friction,
)
from valve_friction_ros.planning.played_test import PlayedTest, PlayLimits, PlayPhase
from valve_friction_ros.planning.search import forecast, moved
from valve_friction_ros.planning.stroke_test import (
    SHAPES,
    Pattern,
    PressureBand,
    frictionless_reach,
    pressure_band,
    stroke,
    stroke_test,
)
from valve_friction_ros.wording import Code, said

SPRING = (2.05e5, 231.65)


def frictions(coulomb=606.0, factor=2.0, spring=SPRING, **others):
    return known_friction(coulomb, spring, 1.6, factor=factor, **others)


def test_the_smallest_friction_rests_at_the_ends_of_its_part():
    limits = Limits(0.3, 0.7, speed=5e-3)
    band = pressure_band(BENCH_VALVE, frictions(), limits)
    constant, preload = SPRING
    for share, pressure, side in ((0.3, band.low, -1), (0.7, band.high, 1)):
        force = BENCH_VALVE.actuator_force(pressure)
        rest = constant * share * BENCH_VALVE.travel + preload
        assert force == pytest.approx(rest + side * 303.0, rel=1e-12)
    assert band.rate * BENCH_VALVE.diaphragm_area / constant == pytest.approx(5e-3)


def test_a_stem_without_friction_keeps_clear_of_the_stops():
    for allowed in (False, True):
        limits = Limits(0.0, 1.0, allow_stops=allowed)
        band = pressure_band(BENCH_VALVE, frictions(), limits)
        low, high = frictionless_reach(BENCH_VALVE, frictions(), band)
        assert (low >= 0.0499 * BENCH_VALVE.travel) != allowed
        assert (high <= 0.9501 * BENCH_VALVE.travel) != allowed


def test_ranges_of_the_pressure_hold():
    narrow = replace(BENCH_VALVE, pressure_minimum=9e4)
    band = pressure_band(narrow, frictions(), Limits(pressure_maximum=1.5e5, pressure_rate=1e4))
    assert band == (9e4, 1.5e5, 1e4)


def test_a_stroke_is_that_of_the_simulated_stem():
    band = PressureBand(8e4, 1.4e5, 4e4)
    corners = [0, 5, 10, 15, 20, 25, 30]
    wave = np.interp(np.arange(3000) * 0.01, corners, [11e4, 8e4, 8e4, 14e4, 14e4, 8e4, 8e4])
    rests = simulate(BENCH_VALVE, HIGH_FRICTION, wave, 0.01).position[[999, 1999, 2999]]
    expected = stroke(BENCH_VALVE, HIGH_FRICTION, band)
    np.testing.assert_allclose(np.diff(rests), [expected, -expected], rtol=1e-6)
    assert stroke(BENCH_VALVE, HIGH_FRICTION, PressureBand(1e5, 1e5 + 1200 / 0.0445, 1e4)) == -1


@given(
    share=st.floats(0.002, 0.1),
    delay=st.floats(0.005, 0.5),
    slip=st.floats(1.0, 1.6),
    larger=st.floats(1.0, 2.0),
    shape=st.sampled_from(sorted(SHAPES)),
    part=st.tuples(st.floats(0.1, 0.4), st.floats(0.6, 0.9)),
)
def test_no_stem_of_the_range_leaves_its_part(share, delay, slip, larger, shape, part):
    coulomb = share * SPRING[0] * BENCH_VALVE.travel
    viscous = delay * SPRING[0]
    assumed = frictions(coulomb, static_friction=slip * coulomb, viscous_friction=viscous)
    try:
        band = pressure_band(BENCH_VALVE, assumed, Limits(*part))
    except RefusalError:
        return
    test = stroke_test(Pattern((shape,), (1.0,), 0.5), band, 60.0)
    if test is None:
        return
    pressure = test.excitation.sample(np.arange(0.0, test.duration, 0.01))
    least = assumed.draws[0]
    true = replace(
        least,
        coulomb_friction=least.coulomb_friction * larger,
        static_friction=least.static_friction * larger,
    )
    reach = simulate(BENCH_VALVE, true, pressure, 0.01).position / BENCH_VALVE.travel
    swing = 1e-3  # of a stem without much damping, where a ramp ends
    assert part[0] - swing <= reach.min() <= reach.max() <= part[1] + swing


def test_a_band_too_narrow_for_the_friction_is_refused_with_the_remedy():
    with pytest.raises(RefusalError) as refusal:
        pressure_band(BENCH_VALVE, frictions(factor=1.0), Limits(0.49, 0.51))
    message = str(refusal.value)
    assert "a reversal would not move the stem between 49 and 51 %" in message
    assert message.endswith("widen the part of the travel")
    assert "\n" not in message
    # Force to move: the spring's along 3 % of the travel and 2·F_c; there: 2 % and 2·F_c.
    travel = BENCH_VALVE.travel * SPRING[0]
    needed, given_ = ((1212 + part * travel) / 0.0445e3 for part in (0.03, 0.02))
    assert f"needs {needed:.4g} kPa" in message
    assert f"the band spans {given_:.4g}" in message


@pytest.mark.parametrize("lowest", [0.1, 0.4, 0.45, 0.8])
def test_a_tenth_of_the_travel_just_moves_a_medium_packing(lowest):
    """Of k·travel: 2·5 % + the least stroke of 3 % are the part of 10 % + 2·1.5 %."""
    valve = Valve(0.049257966, 0.0, 0.01905)
    frictions = unknown_friction(valve, (160451.206, 2037.73032), 1.0)
    band = pressure_band(valve, frictions, Limits(lowest, lowest + 0.1))
    assert stroke(valve, frictions.draws[1], band) == pytest.approx(0.03 * valve.travel)


def test_a_narrow_range_of_the_pressure_is_named():
    with pytest.raises(RefusalError, match=r"or the range of the pressure$"):
        pressure_band(BENCH_VALVE, frictions(), Limits(pressure_maximum=9e4))


@pytest.mark.parametrize("reference", [0.0, 101325.0])
def test_no_converter_goes_below_the_atmosphere(reference):
    """A weak preload and a large friction would need suction."""
    valve = Valve(BENCH_VALVE.diaphragm_area, reference, BENCH_VALVE.travel)
    band = pressure_band(valve, frictions(factor=1.0), Limits(0.0, 0.8, allow_stops=True))
    assert band.low == reference
    assert band.high > reference + 5e4
    with pytest.raises(RefusalError, match="pressure limits leave no usable band"):
        pressure_band(valve, frictions(factor=1.0), Limits(pressure_maximum=reference))


def test_a_valve_needs_diaphragm_and_travel():
    for valve in (Valve(travel=0.03), Valve(0.0445)):
        with pytest.raises(ValueError, match="diaphragm_area and travel"):
            pressure_band(valve, frictions(), Limits())


def test_unknown_friction_spans_the_packings_of_the_bench():
    span = unknown_friction(BENCH_VALVE, SPRING, 1.6)
    coulomb = [one.coulomb_friction for one in span.draws]
    assert coulomb[0] < 152.7
    assert coulomb[-1] > 606.0
    assert all(isinstance(one, KarnoppParameters) for one in span.draws)


@pytest.mark.parametrize(
    ("build", "given", "words"),
    [
        (Limits, {"lowest": 0.6, "highest": 0.4}, "from low to high"),
        (Limits, {"highest": 1.2}, "from low to high"),
        (Limits, {"speed": 0.0}, "speed"),
        (Limits, {"duration": -1.0}, "duration"),
        (Limits, {"pressure_rate": 0.0}, "pressure_rate"),
        (Limits, {"pressure_minimum": 2e5, "pressure_maximum": 1e5}, "pressure_minimum"),
        (frictions, {"factor": 0.5}, "factor"),
        (frictions, {"coulomb": 0.0}, "coulomb_friction"),
        (frictions, {"spring": (0.0, 0.0)}, "needs a spring"),
    ],
)
def test_impossible(build, given, words):
    with pytest.raises(ValueError, match=words):
        build(**given)


BAND = PressureBand(8e4, 1.2e5, 2e4)  # 2 s for a stroke at the largest rate


def test_two_full_cycles_corner_by_corner():
    test = stroke_test(Pattern(("full",), (1.0, 0.5), 1.0), BAND, 25.0)
    times = [0, 1, 2, 3, 5, 6, 8, 9, 13, 14, 18, 19, 20, 21]
    levels = [10, 10, 8, 8, 12, 12, 8, 8, 12, 12, 8, 8, 10, 10]
    np.testing.assert_allclose(test.times, times)
    np.testing.assert_allclose(test.pressures, np.array(levels) * 1e4)
    assert (test.cycles, test.duration) == (2, 21.0)
    assert test.largest_rate == pytest.approx(2e4)


def test_no_test_where_a_kind_of_cycle_has_no_room():
    pattern = Pattern(("full",), (1.0, 0.5), 1.0)
    assert stroke_test(pattern, BAND, 20.9) is None
    assert stroke_test(pattern, BAND, 21.0) is not None


@given(
    shapes=st.lists(st.sampled_from(sorted(SHAPES)), min_size=1, max_size=2),
    speeds=st.lists(st.floats(0.05, 1.0), min_size=1, max_size=3),
    hold=st.floats(0.0, 5.0),
    duration=st.floats(5.0, 600.0),
)
def test_limits_hold_for_every_pattern(shapes, speeds, hold, duration):
    test = stroke_test(Pattern(tuple(shapes), tuple(speeds), hold), BAND, duration)
    if test is None:
        return
    assert test.duration <= duration * (1 + 1e-9)
    assert test.pressures.min() == pytest.approx(BAND.low)
    assert test.pressures.max() == pytest.approx(BAND.high)
    assert test.largest_rate <= BAND.rate * (1 + 1e-9)
    assert test.pressures[0] == test.pressures[-1] == pytest.approx(1e5)
    assert (np.diff(test.times) > 0).all()
    assert test.cycles >= 2
    signal = test.excitation.sample(test.times)
    np.testing.assert_allclose(signal, test.pressures)


SETTINGS = IdentificationSettings(assumed_mass=1.6)
CONDITIONS = Conditions(sample_rate=25.0)
QUICK = Limits(0.2, 0.8, duration=30.0)
SEARCH_SPRING = (HIGH_FRICTION.spring_constant, HIGH_FRICTION.spring_preload)
KNOWN = frictions(viscous_friction=4.48e4, spring=SEARCH_SPRING)
KNOWN_EXACTLY = frictions(viscous_friction=4.48e4, factor=1.0, spring=SEARCH_SPRING)
LOOSE = frictions(152.7, viscous_friction=4865.0, factor=1.0, spring=SEARCH_SPRING)


def expected(signal, duration, friction, settings=SETTINGS):
    """The forecast without competitors, as the search compares."""
    motion = moved(signal, duration, BENCH_VALVE, friction, CONDITIONS)
    return forecast(motion, BENCH_VALVE, friction, CONDITIONS, settings)


def expected_of(test, friction):
    return expected(test.excitation, test.duration, friction)


@pytest.fixture(scope="module")
def plan():
    return plan_test(BENCH_VALVE, KNOWN, QUICK, CONDITIONS, SETTINGS)


def test_limits_are_kept_for_every_friction(plan):
    assert plan.test.duration <= 30.0
    fastest = QUICK.speed * SEARCH_SPRING[0] / BENCH_VALVE.diaphragm_area
    assert plan.test.largest_rate <= 1.001 * fastest
    for one in plan.forecasts:
        low, high = (place / BENCH_VALVE.travel for place in one.reach)
        assert 0.199 < low < 0.49
        assert 0.51 < high < 0.801
        assert one.top_speed <= QUICK.speed


def test_the_square_wave_of_equal_band_and_time_tells_less(plan):
    wave = SquareWave(plan.band.low, plan.band.high)
    square = expected(wave, plan.test.duration, KNOWN.draws[1])
    for name in ("coulomb_friction", "static_friction"):
        assert square.relative(name) > 2 * plan.likely.relative(name)


@cache
def exactly(friction, aim="friction"):
    """The plan for one friction, which is quicker to find than that for a range of them."""
    return plan_test(BENCH_VALVE, friction, QUICK, CONDITIONS, SETTINGS, aim)


def test_the_same_question_has_the_same_answer():
    shares, asked = [], (BENCH_VALVE, LOOSE, QUICK, CONDITIONS, SETTINGS)
    again, before = plan_test(*asked, progress=shares.append), exactly(LOOSE)
    assert again.test.pattern == before.test.pattern
    np.testing.assert_array_equal(again.test.pressures, before.test.pressures)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


def test_unknown_friction_has_a_useful_test_for_every_packing():
    unknown = unknown_friction(BENCH_VALVE, SEARCH_SPRING, 1.6)
    found = plan_test(BENCH_VALVE, unknown, Limits(duration=30.0), CONDITIONS, SETTINGS)
    moving = [one.relative("coulomb_friction") for one in found.forecasts if not one.refusal]
    assert len(moving) >= 2
    assert max(moving) < 0.2


def test_a_friction_that_holds_the_stem_is_named_and_not_refused():
    limits = Limits(0.38, 0.62, duration=30.0)
    found = plan_test(BENCH_VALVE, KNOWN, limits, CONDITIONS, SETTINGS)
    assert found.forecasts[-1].refusal
    held = "2 times larger (F_s 1212 N) may hold the stem"
    assert any(held in one for one in plan_remarks(found))


def test_an_end_that_the_atmosphere_sets_is_said(plan):
    """Against F_c = 606 N the spring alone does not bring the stem down to 2 %."""
    band = pressure_band(BENCH_VALVE, KNOWN_EXACTLY, Limits(0.02, 0.6, allow_stops=True))
    assert band.low == BENCH_VALVE.pressure_reference < plan.band.low
    for one, is_said in ((replace(plan, band=band), True), (plan, False)):
        assert ("the lower end is atmospheric" in " ".join(plan_remarks(one))) is is_said


@pytest.mark.parametrize(
    ("friction", "aim"), [(LOOSE, "friction"), (KNOWN_EXACTLY, "viscous_friction")]
)
def test_patterns_from_everywhere_tell_little_more(friction, aim):
    """A witness that knows nothing of the search: points spread over all patterns."""
    found = exactly(friction, aim)

    def loss(test):
        told = expected_of(test, friction.draws[0])
        if told.refusal:
            return 0.0
        return np.mean([-np.log1p(1 / told.relative(name)) for name in AIMS[aim]])

    mixes = [one for count in (1, 2) for one in itertools.permutations(SHAPES, count)]
    others = []
    for mix, count, hold, *speeds in qmc.Halton(6, scramble=False).random(150)[1:]:
        chosen = tuple(0.1**one for one in speeds[: 1 + int(3 * count)])
        pattern = Pattern(mixes[int(mix * len(mixes))], chosen, 0.05 * 60**hold)
        if (test := stroke_test(pattern, found.band, QUICK.duration)) is not None:
            others.append(loss(test))
    assert len(others) > 10
    assert loss(found.test) <= min(others) + 0.1  # 10 % of a half width


def test_refusals_name_what_to_relax():
    with pytest.raises(RefusalError, match=r"^5 s do not allow .* allow more time, a higher speed"):
        plan_test(BENCH_VALVE, KNOWN, Limits(duration=5.0), CONDITIONS, SETTINGS)
    with pytest.raises(ValueError, match="unknown aim 'mass'"):
        plan_test(BENCH_VALVE, KNOWN, QUICK, CONDITIONS, SETTINGS, "mass")


@pytest.mark.parametrize(
    ("true", "names"),
    [(HIGH_FRICTION, ("coulomb_friction", "viscous_friction")), (LOW_FRICTION, ())],
)
def test_forecasts_are_what_the_method_reports(true, names):
    """At the valve itself; the median of three seeds of the noise, each another one."""
    wave = SquareWave(8e4, 1.5e5, 9.0)
    record, _ = moved(wave, 40.0, BENCH_VALVE, true, Conditions(sample_rate=50.0))
    results = [
        identify(SensorNoise(10e-6, 100.0, seed).applied_to(record), BENCH_VALVE, SETTINGS)
        for seed in (77, 78, 79)
    ]
    told = expected_half_widths(
        SensorNoise(10e-6, 100.0, 0).applied_to(record),
        BENCH_VALVE,
        true,
        SETTINGS,
        start=float(record.position[0]),
    )
    for name in (*names, "sliding_friction", "spring_constant"):
        reported = np.median([one.parameters[name].half_width for one in results])
        assert 0.5 < reported / told[name] < 2.0, name


def test_calibration_and_timing_widen_a_forecast():
    def width(name, **settings):
        one = IdentificationSettings(assumed_mass=1.6, **settings)
        return expected(SquareWave(8e4, 1.5e5, 9.0), 40.0, HIGH_FRICTION, one).half_widths[name]

    name = "coulomb_friction"
    wider = np.hypot(width(name), 2 * 0.1 * 606.0)
    assert width(name, area_uncertainty=0.1) == pytest.approx(wider)
    certain = width("viscous_friction", timing_uncertainty=0.0)
    assert width("viscous_friction", timing_uncertainty=0.1) > 1.2 * certain


@pytest.mark.slow
@pytest.mark.parametrize("seed", [70_000, 70_006, 70_011])
def test_valves_that_the_planner_does_not_know(seed):
    """Other code, other physics, frictions that are wrong by a factor of 2; seeds held back."""
    (trial,) = trials(1, seed)
    assert not trial.refusal
    assert 0.19 < trial.reach[0] < trial.reach[1] < 0.81
    name = "coulomb_friction"
    assert trial.errors[name] <= trial.reported[name] < 0.2
    assert 0.3 < trial.reported[name] / trial.predicted[name] < 6.0
    assert trial.square[name] > trial.reported[name]


@pytest.mark.parametrize(("static", "is_said"), [(606.0, False), (700.0, True)])
def test_friction_that_may_fall_with_speed_is_remarked_on(static, is_said):
    found = exactly(KNOWN_EXACTLY, "viscous_friction")
    (one,) = found.forecasts
    packing = replace(one.parameters, static_friction=static)
    slipping = replace(found, forecasts=(replace(one, parameters=packing),))
    assert any("(Stribeck)" in remark for remark in plan_remarks(slipping)) is is_said


SIGNAL = SampledPressure(np.array([0.0, 1.0, 3.0, 5.0]), np.array([1e5, 1e5, 1.4e5, 1e5]))
PLAY_LIMITS = PlayLimits((0.002, 0.020), (0.9e5, 1.5e5), silence=0.5)
PLAY_STEP = 0.05


def ready():
    """A test whose signals have just come, at time 100 s."""
    test = PlayedTest(SIGNAL, PLAY_LIMITS)
    hear(test, 100.0)
    return test


def started(until=100.0):
    """A test that was started at time 100 s and has played."""
    test = ready()
    test.start(100.0)
    play(test, 100.0, until)
    return test


def hear(test, now, position=0.010, pressure=1.1e5):
    if position is not None:
        test.heard_stem(position, now)
    if pressure is not None:
        test.heard_pressure(pressure, now)


def play(test, begin, end):
    """Play with good signals; return times and set points."""
    found = []
    for now in np.arange(begin, end, PLAY_STEP):
        hear(test, now)
        found.append((now, test.step(now)))
    return np.array(found, dtype=float)


def test_nothing_is_set_before_somebody_starts_it():
    test = ready()
    assert [test.step(100.0 + k) for k in range(50)] == [None] * 50
    assert test.phase is PlayPhase.WAITING


def test_the_set_points_are_those_of_the_file_and_the_last_one_stays():
    test = started()
    found = play(test, 100.0, 110.0)
    np.testing.assert_allclose(found[:, 1], SIGNAL.sample(np.minimum(found[:, 0] - 100.0, 5.0)))
    assert test.phase is PlayPhase.ENDED
    assert str(test) == "completed"


@pytest.mark.parametrize(
    ("change", "why", "words"),
    [
        (
            {"position": 0.0201},
            Code.POSITION_BEYOND_LIMIT,
            "reached 0.0201 m, beyond its limit of 0.02",
        ),
        ({"position": 0.0019}, Code.POSITION_BEYOND_LIMIT, "beyond its limit of 0.002 m"),
        ({"position": math.nan}, Code.POSITION_BEYOND_LIMIT, "the stem reached nan m"),
        (
            {"pressure": 1.51e5},
            Code.PRESSURE_BEYOND_LIMIT,
            "151000 Pa, beyond its limit of 150000 Pa",
        ),
        ({"pressure": 0.89e5}, Code.PRESSURE_BEYOND_LIMIT, "beyond its limit of 90000 Pa"),
    ],
)
def test_a_violation_goes_back_with_the_next_set_point(change, why, words):
    """Though the sample after it is good again."""
    test = started(102.0)
    hear(test, 102.0, **change)
    hear(test, 102.01)
    assert test.step(102.02) == test.home == 1e5
    assert (test.phase, test.aborted.code) == (PlayPhase.BACK, why)
    assert words in str(test)
    hear(test, 103.0)
    assert test.step(103.0) == 1e5
    assert test.aborted.code is why


@pytest.mark.parametrize(
    ("name", "why"), [("position", Code.STEM_SILENT), ("pressure", Code.PRESSURE_SILENT)]
)
def test_a_signal_that_is_lost_goes_back_after_its_silence(name, why):
    test = started()
    now = 100.0
    while test.phase is PlayPhase.PLAYING:
        now += PLAY_STEP
        hear(test, now, **{name: None})
        test.step(now)
    assert test.aborted.code is why
    assert 100.0 + PLAY_LIMITS.silence < now <= 100.0 + PLAY_LIMITS.silence + 2 * PLAY_STEP


def test_a_player_that_stood_still_goes_back_in_place_of_a_jump():
    test = started(101.0)
    hear(test, 102.5)
    assert test.step(102.5) == test.home
    assert test.aborted.code is Code.PLAYER_STALLED


def test_it_can_be_started_again_after_each_end_and_not_while_it_plays():
    test = started()
    with pytest.raises(RefusalError, match="is running"):
        test.start(100.0)
    test.abort(said(Code.PLAYER_STOPPED))
    hear(test, 200.0)
    test.start(200.0)
    assert test.aborted is None
    assert play(test, 200.0, 204.0)[-1, 1] == pytest.approx(1e5 + 0.4e5 * 1.05 / 2, rel=1e-3)


def test_a_start_that_is_refused_leaves_the_reason_of_the_last_return():
    test = started()
    hear(test, 100.1, 0.03)
    test.step(100.1)
    told = str(test)
    assert "the stem reached 0.03 m, beyond its limit of 0.02 m" in told
    with pytest.raises(RefusalError, match=r"no stem position has been received for 9.9 s"):
        test.start(110.0)
    assert str(test) == told


@pytest.mark.parametrize(
    ("stem", "pressure", "cause"),
    [
        (None, 1.1e5, "no stem position has been received so far "),
        (0.01, None, "no pressure has been received so far "),
        (0.03, 1.1e5, "beyond its limit of 0.02 m"),
        (0.01, 2e5, "beyond its limit of 150000 Pa"),
    ],
)
def test_it_does_not_start_on_signals_that_would_end_it(stem, pressure, cause):
    test = PlayedTest(SIGNAL, PLAY_LIMITS)
    hear(test, 100.0, stem, pressure)
    with pytest.raises(RefusalError, match=cause) as refusal:
        test.start(100.0)
    assert str(refusal.value).startswith("not started: ")
    assert test.step(100.0) is None


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        (((0.02, 0.02), (0.0, 1e5)), "limits of the position"),
        (((0.0, 0.02), (0.0, math.inf)), "limits of the pressure"),
        (((0.0, 0.02), (0.0, 1e5), 0.0), "silence must be above 0 s"),
        (((0.0, 0.02), (0.0, 1e5), 1.0, 4.0), "takes 5 s, but only 4 s are allowed"),
    ],
)
def test_limits_that_end_nothing_and_a_test_that_takes_too_long(limits, message):
    with pytest.raises(ValueError, match=message):
        PlayedTest(SIGNAL, PlayLimits(*limits))
