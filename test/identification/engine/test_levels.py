# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Slowly sampled records: the friction by levels, and what a lag of one sample makes of moves."""

import math
from dataclasses import replace

import numpy as np
import pytest

from valve_friction_ros.identification import Parameter, RefusalError, Verdict, identify
from valve_friction_ros.identification.engine.fitted_record import fitted_record
from valve_friction_ros.identification.engine.levels import curve_of_levels
from valve_friction_ros.identification.engine.verdicts import doubted_by_sampling
from valve_friction_ros.identification.settings import SLIDING, IdentificationSettings
from valve_friction_ros.model import Drive, Recording, Valve
from valve_friction_ros.model.recording import StampedRecord, StampedSignal

FRICTION, SPRING, PRELOAD = 120.0, 30e3, 400.0
VALVE = Valve(travel=0.06)
LEVELS = 400.0 + np.array([0.0, 400.0, 800.0, 1100.0, 700.0, 300.0, 0.0])
"""Forces at which a staircase rests, N."""


def staircase(
    period=1.0,
    late=0.0,
    ramp=20.0,
    rest=60.0,
    rounds=3,
    noise=0.0,
    back=0.0,
    within=0.0,
    scatter=0.0,
    seed=5,
) -> StampedRecord:
    """Return a stem that follows a staircase of its force quasi-statically, sampled by `period`.

    It is recorded `late`. At each level the force goes `back`, N, `within` a time of the rest, s.
    """
    times, forces, draws = [0.0, rest], [LEVELS[0]] * 2, np.random.default_rng(seed)
    for level in np.tile(LEVELS[1:], rounds):
        held = level - math.copysign(back, level - forces[-1])
        times += [times[-1] + ramp + one for one in (0.0, within, rest)]
        forces += [level, held, held]
    fine = np.arange(0.0, times[-1], 0.05)
    force = np.interp(fine, times, forces)
    moves = np.searchsorted(times[1::3], fine)
    unlike = (scatter * draws.standard_normal(len(times)))[moves]
    stem, place = np.empty_like(fine), (force[0] - PRELOAD - FRICTION) / SPRING
    for at, one in enumerate(force):
        free = (one - PRELOAD) / SPRING
        held = (FRICTION + unlike[at]) / SPRING
        place = min(max(place, free - held), free + held)
        stem[at] = place
    time = np.arange(0.0, times[-1], period)
    shaken = noise * draws.standard_normal((2, time.size))
    return StampedRecord(
        StampedSignal(time, np.interp(time, fine, force) + shaken[0]),
        StampedSignal(time, 0.02 + np.interp(time - late, fine, stem) + 1e-5 * shaken[1]),
        Drive.FORCE,
    )


def recording(record: StampedRecord) -> Recording:
    """Return a recording with its own stamps."""
    drive, position = record.drive, record.position
    return Recording(
        drive.period, drive.value, position.value, driven_by=record.driven_by, stamped=record
    )


def friction_of(record: StampedRecord):
    """Return the friction by the levels of a record."""
    return curve_of_levels(record, VALVE).numbers[SLIDING]


class TestLevels:
    @pytest.mark.parametrize("late", [0.0, 3.0, -3.0])
    @pytest.mark.parametrize("period", [0.5, 2.0, 5.0])
    def test_of_a_staircase(self, period, late):
        """The friction itself, whatever the lag, to 6 % and what a still signal may hide."""
        found = friction_of(staircase(period, late))
        assert found.value == pytest.approx(FRICTION, rel=5e-3)
        assert 0.06 * FRICTION < found.half_width < 0.085 * FRICTION

    @pytest.mark.parametrize("period", [0.2, 0.5, 2.0])
    def test_noise(self, period):
        """The mean over many levels."""
        found = friction_of(staircase(period, noise=3.0))
        assert abs(found.value - FRICTION) < found.half_width < 0.15 * FRICTION

    @pytest.mark.parametrize("rounds", [1, 4])
    def test_interval(self, rounds):
        """It includes the truth in 95 % of draws, from three levels in each direction on."""
        inside = []
        for seed in range(100):
            found = friction_of(staircase(5.0, rounds=rounds, scatter=12.0, seed=seed))
            inside.append(abs(found.value - FRICTION) < found.half_width)
        assert np.mean(inside) > 0.9

    def test_speed_of_the_moves(self):
        """The rate of the force over the spring: 20 or 15 N/s over 30 N/mm."""
        curve = curve_of_levels(staircase(), VALVE)
        assert curve.sliding_speed == pytest.approx(6.1e-4, rel=0.15)

    def test_none(self):
        """Of a faster record, too few levels, an inverted stem, or without a spring."""
        once = staircase(rounds=1)
        assert curve_of_levels(once, VALVE) is not None
        assert curve_of_levels(staircase(0.1, rounds=1), VALVE) is None
        assert curve_of_levels(staircase(ramp=80.0, rest=5.0), VALVE) is None
        few = [
            StampedSignal(one.time[:300], one.value[:300]) for one in (once.drive, once.position)
        ]
        assert curve_of_levels(StampedRecord(*few, Drive.FORCE), VALVE) is None
        stem = once.position
        inverted = replace(once, position=StampedSignal(stem.time, 0.05 - stem.value))
        assert curve_of_levels(inverted, VALVE) is None
        loose = replace(
            once, drive=StampedSignal(stem.time, once.drive.value - SPRING * stem.value)
        )
        assert curve_of_levels(loose, VALVE) is None

    @pytest.mark.parametrize("within", [2.0, 10.0, 60.0])
    def test_a_force_that_goes_back_is_no_level(self, within):
        """Its friction is not reported, or the interval includes it."""
        assert curve_of_levels(staircase(back=60.0, within=within), VALVE) is None
        for back in (6.0, 15.0, 30.0):
            curve = curve_of_levels(staircase(back=back, within=within), VALVE)
            if curve is not None:
                found = curve.numbers[SLIDING]
                assert abs(found.value - FRICTION) < found.half_width
        assert curve_of_levels(staircase(back=3.0, within=within), VALVE) is not None

    def test_a_level_after_a_gap_has_no_side(self):
        """The stem may have come from anywhere."""
        whole = staircase(rounds=4)
        is_kept = (whole.drive.time < 170.0) | (whole.drive.time > 470.0)
        parts = [
            StampedSignal(one.time[is_kept], one.value[is_kept])
            for one in (whole.drive, whole.position)
        ]
        found = friction_of(StampedRecord(*parts, Drive.FORCE))
        assert found.value == pytest.approx(FRICTION, rel=5e-3)
        assert found.half_width < 0.085 * FRICTION


class TestSlowRecord:
    def test_levels_confirm(self):
        """Moves and levels of a synchronous record agree."""
        result = identify(recording(staircase()), VALVE)
        found = result.parameters[SLIDING]
        assert found.verdict is Verdict.IDENTIFIED
        assert found.value == pytest.approx(FRICTION, rel=0.02)
        assert any("friction near rest of 120 ± 7" in one for one in result.findings)

    @pytest.mark.parametrize("late", [-2.0, 2.0, 4.0])
    def test_late_stem(self, late):
        """The levels hold; the interval includes what the moves show, and all friction is weak.

        The moves are off by the rate of the force times the lag: 300 to 400 N in 20 s.
        """
        found = identify(recording(staircase(late=late)), VALVE).parameters
        for name in (SLIDING, "coulomb_friction", "viscous_friction"):
            assert found[name].verdict is not Verdict.IDENTIFIED
        assert found[SLIDING].value == pytest.approx(FRICTION, rel=0.02)
        assert found[SLIDING].half_width == pytest.approx(abs(late) * 375.0 / 20.0, rel=0.15)

    def test_stated_as_synchronous(self):
        """There the moves need no check."""
        settings = IdentificationSettings(timing_uncertainty=0.0)
        found = identify(recording(staircase(late=2.0)), VALVE, settings=settings)
        moves = found.parameters[SLIDING]
        assert moves.value == pytest.approx(FRICTION + 2.0 * 375.0 / 20.0, rel=0.05)
        assert "levels" not in moves.reason

    def test_jumps_between_samples(self):
        """A record whose moves are too fast for its samples is not refused if it has levels."""
        found = identify(recording(staircase(period=4.0, ramp=1.0)), VALVE)
        assert found.parameters[SLIDING].verdict is Verdict.WEAK
        assert found.parameters[SLIDING].value == pytest.approx(FRICTION, rel=0.05)
        assert found.parameters[SLIDING].reason.startswith("it is the friction near rest")
        assert any("too slow for the motion" in one for one in found.warnings)
        with pytest.raises(RefusalError, match="too slow for the motion"):
            identify(recording(staircase(period=4.0, ramp=1.0, rest=11.0)), VALVE)


def ramps(late=0.0) -> StampedRecord:
    """Return ramps without a rest."""
    return staircase(late=late, rest=0.0, ramp=40.0, rounds=4)


class TestLagOfASample:
    def test_unstated(self):
        """Without levels, a friction that a lag of one sample would move is weak."""
        found = identify(recording(ramps()), VALVE).parameters[SLIDING]
        assert found.verdict is Verdict.WEAK
        assert "recorded a sample (1 s) late would change the sliding friction by" in found.reason
        assert abs(found.value - FRICTION) < found.half_width

    @pytest.mark.parametrize(
        ("verdict", "half_width", "change", "reason"),
        [
            (Verdict.IDENTIFIED, 5.0, 5.0, ""),
            (Verdict.IDENTIFIED, 5.0, -6.0, "one signal recorded a sample (1 s) late"),
            (Verdict.WEAK, 5.0, 6.0, "noise; one signal recorded a sample (1 s) late"),
            (Verdict.NOT_IDENTIFIABLE, math.nan, 0.0, ""),
        ],
    )
    def test_doubt(self, verdict, half_width, change, reason):
        """Of a number that is known better than the change; F_c then shares it."""
        before = "noise" if verdict is Verdict.WEAK else ""
        sliding = Parameter(SLIDING, 100.0, half_width / 2, half_width, verdict, before)
        coulomb = Parameter("coulomb_friction", 90.0, 2.0, 4.0, Verdict.IDENTIFIED)
        spring = Parameter("spring_constant", 3e4, 10.0, 20.0, Verdict.IDENTIFIED)
        given = {one.name: one for one in (sliding, coulomb, spring)}
        found = doubted_by_sampling(given, change, 1.0)
        assert found["spring_constant"] is spring
        if not reason:
            assert found == given
            return
        assert found[SLIDING].verdict is found["coulomb_friction"].verdict is Verdict.WEAK
        assert found[SLIDING].reason.startswith(reason)
        assert f"by {abs(change):g} N" in found["coulomb_friction"].reason

    @pytest.mark.parametrize(
        ("interval", "reproduced", "verdict"),
        [
            (1.0, 0.61, Verdict.IDENTIFIED),
            (1.0, 0.59, Verdict.NOT_IDENTIFIABLE),
            (0.1, 0.59, Verdict.IDENTIFIED),
        ],
    )
    def test_a_balance_that_hardly_reproduces_the_force(self, interval, reproduced, verdict):
        """Of a slow record: its moves are faster than its samples."""
        sliding = Parameter(SLIDING, 100.0, 2.5, 5.0, Verdict.IDENTIFIED)
        coulomb = Parameter("coulomb_friction", 90.0, 2.0, 4.0, Verdict.IDENTIFIED)
        given = {one.name: one for one in (sliding, coulomb)}
        found = doubted_by_sampling(given, 0.0, interval, reproduced)
        assert found[SLIDING].verdict is verdict
        if verdict is Verdict.NOT_IDENTIFIABLE:
            assert "reproduces only 59 % of the force" in found[SLIDING].reason
            assert found["coulomb_friction"].verdict is Verdict.WEAK

    def test_stated_as_synchronous(self):
        settings = IdentificationSettings(timing_uncertainty=0.0)
        found = identify(recording(ramps()), VALVE, settings=settings).parameters[SLIDING]
        assert found.verdict is Verdict.IDENTIFIED
        assert abs(found.value - FRICTION) < found.half_width

    @pytest.mark.parametrize("late", [-1.5, 0.8, 1.5])
    def test_stated(self, late):
        """The interval includes the truth behind a lag of a second, if one is stated."""
        settings = IdentificationSettings(timing_uncertainty=1.0)
        found = identify(recording(ramps(late)), VALVE, settings=settings).parameters[SLIDING]
        assert abs(found.value - FRICTION) < found.half_width


def test_few_positions_are_told_from_few_in_common():
    with pytest.raises(RefusalError, match="only 90 positions, a repeated value taken once"):
        fitted_record(staircase(6.0, rounds=1), VALVE)
    once = staircase(rounds=1)
    later = replace(once, drive=StampedSignal(once.drive.time + 510.0, once.drive.value))
    with pytest.raises(RefusalError, match="overlap in only 30 positions"):
        fitted_record(later, VALVE)
