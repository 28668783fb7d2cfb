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

from valve_friction_ros.identification import RefusalError, Verdict, identify
from valve_friction_ros.identification.engine.levels import curve_of_levels
from valve_friction_ros.identification.settings import SLIDING, IdentificationSettings
from valve_friction_ros.identification.trust.uncertainty import NORMAL_QUANTILE
from valve_friction_ros.model import Drive, Recording, Valve
from valve_friction_ros.model.recording import StampedRecord, StampedSignal

FRICTION, SPRING, PRELOAD = 120.0, 30e3, 400.0
VALVE = Valve(travel=0.06)
LEVELS = 400.0 + np.array([0.0, 400.0, 800.0, 1100.0, 700.0, 300.0, 0.0])
"""Forces at which a staircase rests, N."""


def staircase(
    period=1.0, late=0.0, ramp=20.0, rest=60.0, rounds=3, noise=0.0, creep=0.0
) -> StampedRecord:
    """Return a stem that follows a staircase of its force quasi-statically, sampled by `period`.

    It is recorded `late`; in each rest the force goes back by `creep`, N, in most of the time.
    """
    times, forces = [0.0], [LEVELS[0]]
    for level in np.tile(LEVELS[1:], rounds):
        back = level - math.copysign(creep, level - forces[-1])
        times += [times[-1] + ramp, times[-1] + ramp + rest]
        forces += [level, back]
    fine = np.arange(0.0, times[-1], 0.05)
    force = np.interp(fine, times, forces)
    stem, place = np.empty_like(fine), (force[0] - PRELOAD - FRICTION) / SPRING
    for at, one in enumerate(force):
        free = (one - PRELOAD) / SPRING
        place = min(max(place, free - FRICTION / SPRING), free + FRICTION / SPRING)
        stem[at] = place
    time = np.arange(0.0, times[-1], period)
    shaken = noise * np.random.default_rng(5).standard_normal((2, time.size))
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
        of_record = NORMAL_QUANTILE * found.record
        assert found.half_width == pytest.approx(math.hypot(0.06 * found.value, of_record))
        assert 0.15 * 0.01 * 1100.0 < of_record < 0.05 * FRICTION

    def test_noise(self):
        """The mean over many levels."""
        found = friction_of(staircase(noise=3.0))
        assert abs(found.value - FRICTION) < found.half_width < 0.15 * FRICTION

    def test_none(self):
        """Of a faster record, too few levels, an inverted stem, or a force that creeps."""
        assert curve_of_levels(staircase(0.1, rounds=1), VALVE) is None
        assert curve_of_levels(staircase(ramp=80.0, rest=5.0), VALVE) is None
        once = staircase(rounds=1)
        few = [
            StampedSignal(one.time[:300], one.value[:300]) for one in (once.drive, once.position)
        ]
        assert curve_of_levels(StampedRecord(*few, Drive.FORCE), VALVE) is None
        stem = once.position
        inverted = replace(once, position=StampedSignal(stem.time, 0.05 - stem.value))
        assert curve_of_levels(inverted, VALVE) is None
        assert curve_of_levels(staircase(creep=100.0), VALVE) is None


class TestSlowRecord:
    def test_levels_confirm(self):
        """Moves and levels of a synchronous record agree."""
        found = identify(recording(staircase()), VALVE).parameters[SLIDING]
        assert found.verdict is Verdict.IDENTIFIED
        assert found.value == pytest.approx(FRICTION, rel=0.02)

    @pytest.mark.parametrize("late", [2.0, 4.0])
    def test_late_stem(self, late):
        """The levels hold; the interval includes what the moves show, and the verdict is weak."""
        found = identify(recording(staircase(late=late)), VALVE).parameters[SLIDING]
        assert found.verdict is Verdict.WEAK
        assert found.value == pytest.approx(FRICTION, rel=0.02)
        moves = float(found.reason.split(" show ")[1].split(" N")[0])
        assert found.half_width == pytest.approx(moves - found.value, rel=0.05)

    def test_jumps_between_samples(self):
        """A record whose moves are too fast for its samples is not refused if it has levels."""
        found = identify(recording(staircase(period=4.0, ramp=1.0)), VALVE)
        assert found.parameters[SLIDING].verdict is Verdict.WEAK
        assert found.parameters[SLIDING].value == pytest.approx(FRICTION, rel=0.05)
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
