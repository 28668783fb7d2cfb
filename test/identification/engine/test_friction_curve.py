# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Friction over speed without a simulation: what it recovers, and what it may not say."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from records import assert_held
from scipy.signal import lfilter

from valve_friction_ros.identification.engine import balance_posterior, friction_curve
from valve_friction_ros.identification.engine.balance_regression import Regression
from valve_friction_ros.identification.engine.coordinates import sensor_span, zero_drift
from valve_friction_ros.identification.engine.friction_curve import (
    FrictionCurve,
    checked_by_curve,
    curve_evidence,
    curve_numbers,
    friction_curves,
)
from valve_friction_ros.identification.engine.intervals import Estimated
from valve_friction_ros.identification.engine.lags import LagPrior
from valve_friction_ros.identification.engine.sliding_averages import (
    MeasuredSignal,
    Work,
    _lengths,
    _Path,
    _path,
    averaged_twice,
    averages_of,
    force_and_stem,
    turns_of,
)
from valve_friction_ros.identification.engine.verdicts import curve_verdicts
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.verdict import Verdict
from valve_friction_ros.model import Drive, KarnoppParameters, StemState, Valve, advance, simulate
from valve_friction_ros.model.recording import StampedRecord, StampedSignal

PERIOD = 1e-3
TIME = np.arange(40_000) * PERIOD
NO_LAG = LagPrior(0.0)
BALANCE = ("coulomb_friction", "viscous_friction", "spring_constant", "spring_preload")
SLIDING = "sliding_friction"


@pytest.mark.parametrize(("lags", "least"), [([0.0, 0.019], 0.0), ([0.0, 0.021], 0.1)])
def test_averaging_times_that_contradict_each_other_leave_other_lags_possible(lags, least):
    (found,) = friction_curve._believed([np.array([0.0, -800.0])], lags)
    assert np.exp(found[1]) == pytest.approx(least)
    assert np.exp(found[0]) == pytest.approx(1.0 + least)


def drawn(seed, slip=False):
    """Draw a valve from the smallest to the largest, and a packing in proportion to it."""
    generator = np.random.default_rng(seed)
    area, spring, travel, dry, delay = np.exp(
        generator.uniform(*np.log([[4e-3, 2e4, 8e-3, 0.01, 0.02], [0.12, 2e6, 0.08, 0.2, 0.3]]))
    )
    dry, preload = dry * spring * travel, 0.3 * generator.random() * spring * travel
    static = dry * generator.uniform(1.15, 2.0) if slip else dry
    stribeck = 0.02 * travel * generator.uniform(0.3, 1.0) if slip else 0.0
    packing = KarnoppParameters(
        50 * area, spring * delay, dry, static, spring, preload, stribeck_velocity=stribeck
    )
    return Valve(area, 41_740.0, travel), packing


def moved(valve, packing, place, noise=0.0, late=0.0, seed=0):
    """Simulate a stem that a friction compensation takes about to `place`, a share of travel."""
    wanted = valve.travel * place
    push = np.tanh(np.gradient(wanted, PERIOD) / (2e-3 * valve.travel))
    force = packing.spring_constant * wanted + packing.spring_preload
    force += 1.3 * packing.static_friction * push
    pressure = valve.pressure_reference + force / valve.diaphragm_area
    position = simulate(valve, packing, pressure, PERIOD).position
    white = np.random.default_rng(seed).standard_normal((2, TIME.size))
    drive = pressure + noise * np.ptp(pressure) * white[0]
    stem = position + noise * valve.travel * white[1]
    return StampedRecord(
        StampedSignal(TIME, drive),
        StampedSignal(TIME + late, stem),
    )


def spring_force(seed):
    """Force of a drawn valve's spring over the travel, N."""
    valve, packing = drawn(seed)
    return packing.spring_constant * valve.travel


WAVES = 0.5 + 0.2 * np.sin(0.7 * TIME) + 0.15 * np.sin(1.9 * TIME + 1.0)
LEVELS = np.convolve(
    np.repeat(np.random.default_rng(3).uniform(0.15, 0.85, 14), 3000)[: TIME.size + 799],
    np.hanning(800) / np.sum(np.hanning(800)),
    "valid",
)


class TestRecovery:
    @pytest.mark.parametrize("seed", range(6))
    @pytest.mark.parametrize("place", [WAVES, LEVELS], ids=["waves", "levels"])
    def test_what_a_noiseless_record_holds(self, seed, place):
        """Averages obey the law of the samples, so only interpolation is left as an error."""
        valve, packing = drawn(seed)
        curves = friction_curves(moved(valve, packing, place), valve, NO_LAG)
        numbers = curve_numbers(curves)
        assert list(numbers) == list(dict.fromkeys(n for one in curves for n in one.numbers))
        for name in BALANCE:
            assert numbers[name].value == pytest.approx(getattr(packing, name), rel=5e-4), name
        for curve in curves:
            law = packing.coulomb_friction * np.sign(curve.speed)
            law += packing.viscous_friction * curve.speed
            np.testing.assert_allclose(curve.friction, law, atol=5e-3 * np.abs(law).max())

    @pytest.mark.parametrize("seed", range(6))
    def test_stick_slip(self, seed):
        """The stem moves faster than the Stribeck speed, so F_c shows itself."""
        valve, packing = drawn(seed, slip=True)
        curves = friction_curves(moved(valve, packing, WAVES), valve, NO_LAG)
        numbers = curve_numbers(curves)
        for name in ("spring_constant", "spring_preload"):
            assert numbers[name].value == pytest.approx(getattr(packing, name), rel=5e-3), name
        dry = numbers["coulomb_friction"]
        assert abs(dry.value - packing.coulomb_friction) <= dry.half_width
        assert dry.half_width < 0.2 * dry.value
        for curve in curves:
            one = curve.numbers[SLIDING]
            steady = packing.coulomb_friction + packing.viscous_friction * curve.sliding_speed
            assert steady < one.value + one.half_width
            assert one.value < packing.static_friction + packing.viscous_friction * curve.speed[-1]

    @pytest.mark.parametrize("seed", range(4))
    def test_a_fall_beyond_the_speeds_of_the_record_stays_open(self, seed):
        """The stem goes 2 mm/s at most: what looks like F_c holds most of the slip force."""
        valve, packing = drawn(seed)
        static = 1.6 * packing.coulomb_friction
        packing = replace(packing, static_friction=static, stribeck_velocity=4e-3)
        place = 0.5 + (np.sin(0.7 * TIME) + 0.5 * np.sin(1.9 * TIME + 1.0)) * 1.2e-3 / valve.travel
        numbers = curve_numbers(friction_curves(moved(valve, packing, place), valve, NO_LAG))
        assert_held(numbers, {name: getattr(packing, name) for name in BALANCE[:2]})

    def test_known_parameters_stay_out(self):
        valve, packing = drawn(1)
        fixed = {name: getattr(packing, name) for name in ("viscous_friction", "spring_constant")}
        record = moved(valve, packing, WAVES)
        for curve in friction_curves(record, valve, NO_LAG, fixed):
            assert not fixed.keys() & curve.numbers.keys()
            dry = curve.numbers["coulomb_friction"].value
            assert dry == pytest.approx(packing.coulomb_friction, rel=1e-3)

    def test_noise_of_the_velocity_does_not_bias_its_friction(self):
        """Errors of one factor that the other does not share average out; they would draw F_v to 0.

        Ten records: three standard errors of their mean, and far less than plain least squares.
        """
        valve, packing = drawn(0)
        found, plain = [], []
        for seed in range(10):
            record = moved(valve, packing, WAVES, 1e-3, seed=seed)
            curve = friction_curves(record, valve, NO_LAG)[0]
            found.append(curve.law["viscous_friction"] / packing.viscous_friction - 1)
            plain.append(attenuated(record, valve, curve) / packing.viscous_friction - 1)
        assert np.mean(plain) < -3 * np.std(plain)
        assert abs(np.mean(found)) < 3 * np.std(found) / np.sqrt(10)
        assert abs(np.mean(found)) < 0.2 * abs(np.mean(plain))

    @pytest.mark.parametrize("late", [-0.02, 0.02])
    def test_a_lag_is_found_on_random_levels(self, late):
        valve, packing = drawn(2)
        record = moved(valve, packing, LEVELS, 1e-4, late)
        curves = friction_curves(record, valve)
        assert [curve.lag for curve in curves] == pytest.approx([late] * len(curves), abs=3e-3)
        assert_held(curve_numbers(curves), {name: getattr(packing, name) for name in BALANCE})


def attenuated(record, valve, curve):
    """Return F_v by least squares of the signals averaged alike, in which noise is in both."""
    length = round(curve.averaging_time / PERIOD)
    position = averaged_twice(record.position.value, length)
    force = averaged_twice(valve.actuator_force(record.drive.value), length)
    velocity = np.gradient(position, PERIOD)
    slides = np.abs(velocity) > 0.1 * np.abs(velocity).max()
    columns = np.column_stack([np.sign(velocity), velocity, position, np.ones(position.size)])
    size = np.abs(columns).max(axis=0)
    return (np.linalg.lstsq(columns[slides] / size, force[slides], rcond=None)[0] / size)[1]


class TestDistance:
    RESTS = np.repeat([0.0, 2e-3, 0.0, 2e-3, 0.0, 2e-3, 0.0], 2500)
    STEM = np.convolve(np.pad(RESTS, 50, mode="edge"), np.full(101, 1 / 101), "valid")
    FRICTION = 100.0 * np.sign(np.gradient(STEM))

    @pytest.mark.parametrize("seed", range(5))
    def test_a_sensor_that_wanders_makes_no_strokes(self, seed):
        """Over seconds of rest its excursions reach 5 % of the range, and would add a fifth."""
        white = np.random.default_rng(seed).standard_normal(self.STEM.size)
        share = np.exp(-0.01)
        wander = 2e-5 * np.sqrt(1 - share**2) * lfilter([1.0], [1.0, -share], white)
        pressed = np.where(self.FRICTION == 0.0, np.nan, self.FRICTION)
        held = np.flatnonzero(np.isfinite(pressed))
        last = held[np.maximum(np.searchsorted(held, np.arange(pressed.size), "right") - 1, 0)]
        path = _path([self.STEM + wander] * 2, pressed[last], 0.0)
        assert path.distance == pytest.approx(12e-3, rel=0.05)
        lengths = _lengths(
            self.STEM + wander, self.STEM + wander, turns_of(self.STEM + wander, 6e-5)
        )
        assert np.sum(lengths) > 1.15 * path.distance

    @given(st.floats(0.04, 0.08), st.integers(1, 5))
    def test_short_strokes_against_friction_are_strokes(self, share, count):
        """Exact: with the force of friction in all of them, nothing is left out."""
        places = [0.0, 1.0, *[1.0 - share, 1.0] * count, 0.0]
        stem = 1e-2 * np.interp(np.linspace(0, len(places) - 1, 2000 * len(places)),
                                np.arange(len(places)), places)  # fmt: skip
        path = _path([stem, stem], 50.0 * np.sign(np.gradient(stem)), 0.0)
        assert path.distance == pytest.approx(1e-2 * (2.0 + 2.0 * share * count), rel=0.03)

    @pytest.mark.parametrize("seed", range(4))
    def test_a_swing_faster_than_the_averages(self, seed):
        """Strokes of a ninth of a second on a slow wave, as of a positioner that hunts."""
        valve, packing = drawn(seed)
        place = 0.5 + 0.3 * np.sin(0.7 * TIME) + 0.15 * np.sin(27.0 * TIME)
        stem = valve.travel * place
        velocity = np.gradient(stem, PERIOD)
        friction = packing.coulomb_friction * np.sign(velocity)
        friction += packing.viscous_friction * velocity
        force = friction + packing.spring_constant * stem + packing.spring_preload
        pressure = valve.pressure_reference + force / valve.diaphragm_area
        record = StampedRecord(StampedSignal(TIME, pressure), StampedSignal(TIME, stem))
        truth = np.sum(friction * velocity) / np.sum(np.abs(velocity))
        for curve in friction_curves(record, valve, NO_LAG):
            assert curve.averaging_time < 0.1
            assert curve.numbers[SLIDING].value == pytest.approx(truth, rel=0.02)


class TestRareImperfections:
    """One slow stroke each way: a drifting zero looks like friction that changes along the travel.

    Both together, against each other, leave nothing but less friction.
    """

    RAMP = np.interp(TIME, [2, 20, 38], [0.1, 0.9, 0.1])

    def of(self, seed, drift=0.0):
        """Return the sliding friction of a drawn valve, and the truth; drift: a share a minute."""
        valve, packing = drawn(seed)
        record = moved(valve, packing, self.RAMP, 2e-4, seed=seed)
        span = valve.diaphragm_area * np.max(record.drive.value - valve.pressure_reference)
        zero = drift * span / valve.diaphragm_area * (TIME - TIME[-1] / 2) / 60.0
        drive = replace(record.drive, value=record.drive.value + zero)
        curves = friction_curves(replace(record, drive=drive), valve, NO_LAG)
        truth = packing.coulomb_friction + packing.viscous_friction * curves[0].sliding_speed
        return curve_numbers(curves)[SLIDING], truth

    @pytest.mark.parametrize("seed", range(4))
    @pytest.mark.parametrize("drift", [-2e-3, 0.0, 2e-3])
    def test_the_interval_holds_the_truth(self, seed, drift):
        one, truth = self.of(seed, drift)
        assert abs(one.value - truth) <= one.half_width

    def test_what_the_record_speaks_against_widens_nothing(self, monkeypatch):
        """With all imperfections, a drift leaves the smallest friction open by far more."""
        seed = min(range(20), key=lambda one: drawn(one)[1].coulomb_friction / spring_force(one))
        narrow, truth = self.of(seed)
        monkeypatch.setattr(balance_posterior, "_RARE", ())
        wide, _ = self.of(seed)
        assert narrow.half_width < 0.6 * wide.half_width
        assert abs(narrow.value - truth) <= narrow.half_width


class TestPoorMotion:
    def test_partial_stroke_from_the_stop(self):
        """Ten percent down and back, once, by an actuator that takes some time to fill."""
        valve, packing = drawn(3)
        ramp = np.interp(TIME, [10, 15, 17, 22], [1.05, 0.9, 0.9, 1.05])
        filling = np.hanning(1600) / np.sum(np.hanning(1600))
        ramp = np.convolve(np.pad(ramp, 800, mode="edge"), filling, "same")[800:-800]
        curves = friction_curves(moved(valve, packing, ramp, 2e-5), valve)
        one, speed = curve_numbers(curves)[SLIDING], curves[0].sliding_speed
        truth = packing.coulomb_friction + packing.viscous_friction * speed
        assert abs(one.value - truth) <= one.half_width < 0.1 * truth

    def test_hunting_loop(self):
        """An integrating controller and stick-slip: the stem rests, and jumps for 40 ms."""
        valve = Valve(0.0445, 41_740.0, 0.028575)
        packing = KarnoppParameters(1.6, 2e4, 300.0, 500.0, 2.05e5, 230.0, stribeck_velocity=1e-3)
        state, pressure, integral, rows = StemState(0.0137), 106e3, 0.0, []
        for _ in range(30_000):
            error = 0.0142 - state.position
            integral += 2e-3 * error
            after = 106e3 + 2e6 * error + 2e7 * integral
            state = advance(state, valve, packing, (pressure, after), 2e-3)
            pressure = after
            rows.append((pressure, state.position, state.velocity))
        drive, stem, velocity = np.array(rows).T
        assert np.count_nonzero(np.diff(np.sign(stem - np.mean(stem)))) >= 8
        truth = np.average(packing.sliding_friction(np.abs(velocity)), weights=np.abs(velocity))
        time, white = 0.01 * np.arange(6000), np.random.default_rng(0).standard_normal((2, 6000))
        record = StampedRecord(
            StampedSignal(time, drive[::5] + 50.0 * white[0]),
            StampedSignal(time, stem[::5] + 3e-6 * white[1]),
        )
        one = curve_numbers(friction_curves(record, valve))[SLIDING]
        assert abs(one.value - truth) <= one.half_width < 0.1 * truth

    def test_an_actuator_of_another_valve_leaves_work_that_scatters(self):
        """A random walk does some work on any stem, in each stroke another one."""
        valve, packing = drawn(1)
        record = moved(valve, packing, WAVES, 1e-4)
        for seed in range(5):
            walk = np.cumsum(np.random.default_rng(seed).standard_normal(TIME.size))
            drive = StampedSignal(TIME, 1e5 + 2e4 * walk / np.ptp(walk))
            curves = friction_curves(StampedRecord(drive, record.position), valve)
            one = curve_numbers(curves)[SLIDING]
            assert one.half_width > 0.4 * abs(one.value), seed

    def test_one_direction_has_no_friction(self):
        valve, packing = drawn(4)
        rising = np.linspace(0.1, 0.9, TIME.size)
        assert friction_curves(moved(valve, packing, rising), valve) == []
        assert curve_numbers([]) == curve_evidence([]) == {}


def number(value, half_width):
    return Estimated(value, half_width, half_width / 2)


def curve(**numbers):
    nothing = np.empty(0)
    return FrictionCurve(
        0.1, nothing, nothing, nothing, numbers, 0.0, 0.0, 0.0, 1.0, True, 1.0, 0.0
    )


class TestNumbersOfSeveralAveragingTimes:
    SPRING = number(2e5, 1.0)

    def of(self, *pairs):
        curves = [curve(friction=number(*one), spring_constant=self.SPRING) for one in pairs]
        return curve_numbers(curves)["friction"]

    def test_the_one_that_knows_best_gives_the_value(self):
        found = self.of((100.0, 20.0), (110.0, 6.0))
        assert found.value == 110.0
        assert found.half_width == pytest.approx(np.hypot(np.hypot(6.0, 2 * 5.0), 0.015 * 110))

        far = self.of((100.0, 10.0), (300.0, 60.0))  # one that knows far less does not widen it
        assert far.half_width == pytest.approx(np.hypot(10.0, 1.5))

    def test_none_is_narrower_than_a_force_balance_can_be(self):
        """Least of all where no second averaging time confirms it, or no spring returns it."""
        assert self.of((100.0, 1e-9), (100.0, 1e-9)).half_width == pytest.approx(1.5)
        assert self.of((100.0, 1e-9)).half_width == pytest.approx(6.0)
        machine = curve_numbers([curve(friction=number(100.0, 1e-9))] * 2)["friction"]
        assert machine.half_width == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("spring", "verdict"), [(2.0, Verdict.IDENTIFIED), (30.0, Verdict.WEAK), (999.0, Verdict.WEAK)]
)
def test_a_preload_is_no_surer_than_the_spring_that_it_lies_along(spring, verdict):
    """A loop that hunts over 2 mm says little of what the spring does without its compression."""
    numbers = {"spring_constant": number(100.0, spring), "spring_preload": number(1e3, 20.0)}
    found = curve_verdicts(numbers, IdentificationSettings(), 0.0)["spring_preload"]
    assert (found.verdict, bool(found.reason)) == (verdict, verdict is Verdict.WEAK)
    given = IdentificationSettings(fixed={"spring_constant": 100.0})
    known = curve_verdicts({"spring_preload": numbers["spring_preload"]}, given, 0.0)
    assert known["spring_preload"].verdict is Verdict.IDENTIFIED


COULOMB, VISCOUS, SPRING = BALANCE[:3]


@pytest.mark.parametrize(
    ("name", "simulated", "balanced", "follows", "slip_force", "expected"),
    [
        # the sharper one, unless both exclude each other, or the stem is not followed
        (SLIDING, (100.0, 9.0), (104.0, 3.0), True, 0.0, (104.0, 3.0)),
        (SLIDING, (100.0, 2.0), (104.0, 3.0), True, 0.0, (100.0, 2.0)),
        (SLIDING, (100.0, 9.0), (120.0, 3.0), True, 0.0, (100.0, 9.0)),
        (SLIDING, (100.0, 2.0), (101.0, 3.0), False, 0.0, (101.0, 3.0)),
        (SLIDING, (100.0, 2.0), (120.0, 3.0), False, 0.0, (120.0, 20.0)),
        (SLIDING, (100.0, 9.0), (-5.0, 200.0), False, 0.0, (100.0, 9.0)),
        # a spring that only transients know: a third of the difference, 3, and 4 are 5
        (SPRING, (100.0, 4.0), (100.0, 30.0), True, 0.0, (100.0, 4.0)),
        (SPRING, (100.0, 4.0), (109.0, 30.0), True, 0.0, (100.0, 5.0)),
        ("spring_preload", (100.0, 4.0), (109.0, 30.0), True, 0.0, (100.0, 5.0)),
        # what friction is made of: widths, difference and 0.3 of the slip force: 3, 4 and 12
        (COULOMB, (100.0, 4.0), (109.0, 3.0), True, 0.0, (100.0, 5.0)),
        (COULOMB, (100.0, 9.0), (104.0, 3.0), True, 0.0, (104.0, 5.0)),
        (COULOMB, (100.0, 2.0), (104.0, 3.0), False, 0.0, (104.0, 5.0)),
        (COULOMB, (100.0, 4.0), (109.0, 3.0), True, 40.0, (100.0, 5.0)),
        (COULOMB, (100.0, 9.0), (104.0, 3.0), False, 40.0, (104.0, 13.0)),
    ],
)
def test_a_simulation_is_checked(name, simulated, balanced, follows, slip_force, expected):
    ours, theirs = {name: number(*simulated)}, {name: number(*balanced)}
    found = checked_by_curve(ours, theirs, follows, slip_force)[name]
    assert (found.value, found.half_width) == pytest.approx(expected)


@pytest.mark.parametrize(("viscous", "width"), [((50.0, 49.0), 4.0), ((50.0, 51.0), 5.0)])
def test_a_dry_friction_beside_an_unknown_viscous_one_is_known_less(viscous, width):
    """A third of what both differ, 3, and the half width of 4 are 5."""
    ours = {COULOMB: number(100.0, 4.0), VISCOUS: number(*viscous)}
    found = checked_by_curve(ours, {COULOMB: number(109.0, 30.0)}, follows=True)[COULOMB]
    assert (found.value, found.half_width) == (100.0, pytest.approx(width))


def test_a_slow_sensor_that_the_simulation_excludes_is_no_rival():
    """A rival counts far beyond the interval: by more than two half widths."""
    ours = replace(number(100.0, 9.0), rival=100.0)
    theirs = replace(number(104.0, 3.0), rival=60.0)
    assert theirs.has_rival
    assert not replace(theirs, rival=98.5).has_rival
    assert not number(104.0, 3.0).has_rival
    assert not checked_by_curve({SLIDING: ours}, {SLIDING: theirs}, True)[SLIDING].has_rival
    assert checked_by_curve({SLIDING: ours}, {SLIDING: theirs}, False)[SLIDING].has_rival


@pytest.mark.parametrize(
    ("viscous", "follows", "expected"),
    [
        (number(1000.0, 900.0), True, (100.0, 10.0)),
        (number(1000.0, 9900.0), True, (190.0, 6.0)),
        (number(1000.0, 900.0), False, (190.0, 6.0)),
    ],
    ids=["the signal is late", "unknown", "no such stem"],
)
def test_a_simulation_that_excludes_the_viscous_friction_knows_a_signal_late(
    viscous, follows, expected
):
    """190 N where the stem is delayed, 100 N where the signal is; the simulation has 92 N."""
    ours = {SLIDING: number(92.0, 107.0), VISCOUS: viscous}
    theirs = {
        SLIDING: replace(number(190.0, 6.0), rival=100.0),
        VISCOUS: number(10_000.0, 500.0),
    }
    found = checked_by_curve(ours, theirs, follows)[SLIDING]
    assert (found.value, found.half_width) == pytest.approx(expected)


@pytest.mark.parametrize(("width", "expected"), [(99.0, (395.0, 3.0)), (101.0, (385.0, 25.0))])
def test_a_simulation_that_knows_no_friction_knows_no_spring(width, expected):
    ours = {SLIDING: number(100.0, width), SPRING: number(395.0, 3.0)}
    theirs = {SLIDING: number(100.0, 90.0), SPRING: number(385.0, 25.0)}
    found = checked_by_curve(ours, theirs, follows=True)[SPRING]
    half_width = math.hypot(expected[1], friction_curve._PULL * 10.0)
    assert (found.value, found.half_width) == (expected[0], pytest.approx(half_width))


class TestDistanceUnderNoiseThatLasts:
    """Noise that averages share lengthens each stroke at its ends, without any work."""

    @pytest.mark.parametrize(
        ("work", "distance", "deviation"),
        [(100.0, 10.0, 0.5), (103.0, 10.3, 0.2), (105.0, 10.5, 0)],
    )
    def test_what_is_longer_is_believed_as_far_as_it_does_work(self, work, distance, deviation):
        found = _Path(10.5, 0.0, 4, work).beside(_Path(10.0, 0.0, 4, 100.0))
        assert found[:3] == pytest.approx((distance, deviation, 4))

    @pytest.mark.parametrize("seed", range(6))
    def test_friction_of_small_strokes(self, seed):
        """Strokes of 1 mm, noise of 12 µm that lasts 30 ms: 3 % of the distance is not motion."""
        time = np.arange(0.0, 60.0, 2e-3)
        wave = 0.5 * math.pi * time
        position = 5e-4 * np.sin(wave)
        force = 1e5 * position + 80.0 * np.tanh(40.0 * np.cos(wave))
        decay = math.exp(-2e-3 / 0.03)
        white = math.sqrt(1.0 - decay**2) * np.random.default_rng(seed).standard_normal(time.size)
        stem = position + 12e-6 * lfilter([1.0], [1.0, -decay], white)
        record = StampedRecord(StampedSignal(time, force), StampedSignal(time, stem), Drive.FORCE)
        curves = friction_curves(record, Valve(), NO_LAG)
        one = curve_numbers(curves)[SLIDING]
        assert abs(one.value - 80.0) < one.half_width < 0.15 * 80.0
        mean_speed = 5e-4 * 0.5 * math.pi * math.pi / 4.0
        assert curves[0].sliding_speed == pytest.approx(mean_speed, rel=0.1)


class TestMeanSpeed:
    """∫|v|·|dx| / ∫|dx| of a sensor's samples."""

    @staticmethod
    def of(time, position, distance):
        stem = MeasuredSignal.of(StampedSignal(time, position), 1.0, 0.0)
        return stem.mean_speed(np.ones(time.size, dtype=bool), distance)

    @given(
        jump=st.floats(1e-3, 2e-2),
        slow=st.floats(1e-4, 5e-3),
        period=st.floats(2e-3, 0.2),
        noise=st.floats(0.0, 2e-5),
        seed=st.integers(0, 2**32 - 1),
    )
    def test_jumps_and_ramps_whatever_the_sampling(self, jump, slow, period, noise, seed):
        """20 s of a ramp, jumps from sample to sample down and up, with a rest after each."""
        time = np.arange(0.0, 60.0, period)
        position = slow * np.minimum(time, 20.0)
        position[(time > 30.0) & (time < 40.0)] -= jump
        noisy = position + noise * np.random.default_rng(seed).standard_normal(time.size)
        distance = 20.0 * slow + 2.0 * jump
        expected = (20.0 * slow**2 + 2.0 * jump**2 / period) / distance
        assert self.of(time, noisy, distance) == pytest.approx(expected, rel=0.15)

        assert self.of(time, np.full(time.size, 0.01), 1.0) == 0.0  # at rest

    @pytest.mark.parametrize("apart", [1e-9, 1e-5])
    def test_two_stamps_that_nearly_coincide_make_no_stem_fast(self, apart):
        """Jumps of 5 mm within 10 ms; the samples of one are stamped almost at once."""
        time = np.arange(0.0, 20.0, 0.01)
        position = 5e-3 * (np.floor(time) % 2)
        usual = self.of(time, position, 19 * 5e-3)
        time[100] = time[99] + apart
        assert self.of(time, position, 19 * 5e-3) == pytest.approx(usual, rel=0.1)


@pytest.mark.parametrize("slower", [1, 10])
def test_noise_of_the_force_in_its_work(slower):
    """A pressure that is sampled ten times as slowly has its noise in ten times as many moves."""
    time = np.arange(0.0, 40.0, 0.005)
    stem = StampedSignal(time, 0.01 * np.sin(0.5 * math.pi * time))
    force, deviation = 80.0 * np.cos(0.5 * math.pi * time)[::slower], 4.0

    def work(noise, seed):
        white = noise * np.random.default_rng(seed).standard_normal(force.size)
        drive = StampedSignal(time[::slower], force + white)
        signals = force_and_stem(StampedRecord(drive, stem, Drive.FORCE), Valve())
        return Work.of(*signals, averages_of(*signals, Valve(), 0.12, LagPrior()), LagPrior())

    found = [work(deviation, seed) for seed in range(30)]
    scatter = np.std([np.interp(0.0, one.lags, one.by_lag) for one in found])
    foreseen = np.median([one.noise for one in found]) ** 2 - work(0.0, 0).noise ** 2
    assert math.sqrt(foreseen) == pytest.approx(scatter, rel=0.3)


class TestConverterOfTheForce:
    """A force that stays within one step of its converter throughout each stroke."""

    STEP, FRICTION = 10.0, 8.0

    def balanced(self, noise: float):
        """Regress a machine without a spring that goes to and fro, at ±8 N of friction."""
        time = np.arange(0.0, 40.0, 0.005)
        position = 0.01 * np.sin(0.5 * math.pi * time)
        force = self.FRICTION * np.sign(np.cos(0.5 * math.pi * time))
        force = force + noise * np.random.default_rng(0).standard_normal(time.size)
        force[0] = 0.0
        seen = self.STEP * np.rint(force / self.STEP)
        record = StampedRecord(
            StampedSignal(time, seen), StampedSignal(time, position), Drive.FORCE
        )
        return curve_numbers(friction_curves(record, Valve(), fixed={"spring_constant": 0.0}))

    def test_what_is_hidden_within_a_step_is_in_the_interval(self):
        """Each direction is off by a part of the step, evenly: by 1/√24 of it are both together."""
        one = self.balanced(noise=0.0)[SLIDING]
        assert one.value == pytest.approx(self.STEP, rel=0.02)
        assert one.rounding == pytest.approx(1.96 * self.STEP / math.sqrt(24.0), rel=0.05)
        assert abs(one.value - self.FRICTION) < one.half_width < 0.5 * self.STEP

    def test_a_stem_without_a_sure_speed_has_that_of_its_averages(self):
        """No chance is left to divide by: the halves of the samples may disagree on all motion."""
        work, averages = SimpleNamespace(rounding=3.0), SimpleNamespace(speed=0.5)
        for sliding_speed, expected in ((2.0, 3.0), (0.0, 12.0)):
            one = SimpleNamespace(work=work, averages=averages, sliding_speed=sliding_speed)
            assert Regression.rounding(one, "viscous_friction") == expected

    def test_noise_that_carries_the_force_across_steps_lifts_it(self):
        one = self.balanced(noise=self.STEP)[SLIDING]
        assert abs(one.value - self.FRICTION) < one.half_width
        assert one.rounding < 0.02 * self.STEP


def test_the_zero_drifts_with_the_range_of_the_sensor_whatever_the_stroke():
    """A tenth of the travel at 9 kN: the sensor is the same as that of a full stroke."""
    full, partial = np.array([1000.0, 9000.0]), np.array([8200.0, 9000.0])
    assert sensor_span(full) == sensor_span(partial) == sensor_span(-partial) == 9000.0
    assert sensor_span(np.array([-500.0, 500.0])) == 1000.0
    assert zero_drift(sensor_span(partial), minutes=2.0) == pytest.approx(18.0)
