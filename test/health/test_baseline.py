# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What can be a baseline, and what is refused; moves in service that are one, and are diagnosed."""

import dataclasses
import math
from dataclasses import replace

import pytest
from service import SECOND, START, VALVE, changing_at, made_moves

from valve_friction_ros.evidence import evidence_of
from valve_friction_ros.health import (
    Baseline,
    BaselineLack,
    FrictionLimits,
    Lack,
    Level,
    SlidingFriction,
    StatusSignal,
    baseline_by_evidence,
    diagnosis_by_evidence,
    reference_by_evidence,
    why_not_compared,
)
from valve_friction_ros.health.baseline import GOOD_SHARE, LARGEST_SHARE
from valve_friction_ros.identification import IdentificationSettings, RefusalError


@pytest.mark.parametrize(
    ("kind", "numbers", "name"),
    [
        *((Baseline, (one,), "baseline_coulomb_friction") for one in (0.0, -1.0, math.nan)),
        *((Baseline, (100.0, one), "half_width") for one in (-1.0, math.nan, math.inf)),
        (SlidingFriction, (0.0, 1.0, 1e-3), "sliding_friction"),
        (SlidingFriction, (1.0, -1.0, 1e-3), "half_width"),
        (SlidingFriction, (1.0, 1.0, 0.0), "sliding_speed"),
    ],
)
def test_impossible_numbers(kind, numbers, name):
    with pytest.raises(ValueError, match=f"^{name} must"):
        kind(*numbers)


def test_there_is_one_friction_at_least():
    with pytest.raises(ValueError, match="needs a Coulomb friction or a sliding friction"):
        Baseline()


def test_it_is_told_on_one_line():
    sliding = SlidingFriction(205.5, 3.25, 9.5e-3)
    assert str(Baseline(152.7)) == "Coulomb friction 152.7 N"
    assert str(Baseline(152.7, 2.0, sliding)) == (
        "Coulomb friction 152.7 ± 2.0 N, sliding friction 205.5 ± 3.2 N at 9.5 mm/s"
    )
    assert str(Baseline(sliding=sliding)) == "sliding friction 205.5 ± 3.2 N at 9.5 mm/s"


class TestOfAResult:
    @pytest.fixture
    def known(self, with_values, friction):
        """Function of half widths, N: a result with F_c 100 N and 200 N of sliding friction."""

        def build(coulomb, sliding, speed=8e-3):
            found = with_values(
                coulomb_friction=friction(100.0, coulomb),
                sliding_friction=friction(200.0, sliding, "sliding_friction"),
            )
            return dataclasses.replace(found, sliding_speed=speed)

        return build

    def test_what_is_known_too_badly_is_left_out(self, known):
        """At a half width of 13 % a friction serves, beyond it does not."""
        sliding = SlidingFriction(200.0, 26.0, 8e-3)
        assert Baseline.of(known(13.0, 26.0)) == Baseline(100.0, 13.0, sliding)
        assert Baseline.of(known(13.1, 26.0)) == Baseline(sliding=sliding)
        assert Baseline.of(known(13.0, 26.1)) == Baseline(100.0, 13.0)
        assert Baseline.of(known(13.0, 26.0, speed=math.nan)) == Baseline(100.0, 13.0)

    def test_known_worse_one_serves_the_sliding_friction_first(self, known):
        """At a half width of 33 % one serves where none is known to 13 %, beyond it none."""
        sliding = SlidingFriction(200.0, 66.0, 8e-3)
        assert Baseline.of(known(13.1, 66.0)) == Baseline(sliding=sliding)
        assert Baseline.of(known(33.0, 66.1)) == Baseline(100.0, 33.0)
        assert Baseline.of(known(13.0, 66.0)) == Baseline(100.0, 13.0)

    def test_without_any_of_use_it_is_refused(self, known):
        vague = known(35.0, 80.0)
        with pytest.raises(RefusalError) as refusal:
            Baseline.of(vague)
        assert str(refusal.value) == (
            "this result cannot be the baseline: Coulomb friction is known to ±35 %, but a "
            "baseline requires ±33 %; sliding friction is known to ±40 %, but a baseline requires "
            "±33 %: record more strokes, some fast and some slow, and state timing_uncertainty "
            "(--timing-uncertainty) if the clocks and lags of both signals are known"
        )
        lacks = tuple(
            BaselineLack(name, Lack.PRECISION, share, LARGEST_SHARE)
            for name, share in (("coulomb_friction", 0.35), ("sliding_friction", 0.4))
        )
        assert refusal.value.lacks == Baseline.lacks(vague) == lacks
        assert Baseline.lacks(known(35.0, 66.0)) == Baseline.lacks(known(33.0, 80.0)) == ()

    def test_what_a_wide_one_cannot_show_is_said(self):
        assert Baseline(100.0, 13.0).remark == Baseline(100.0).remark == ""
        assert Baseline(100.0, 13.0, SlidingFriction(200.0, 66.0, 8e-3)).remark == ""
        words = "it is known to ±33 %: only growth to 2 times or more is certain to be"
        assert Baseline(sliding=SlidingFriction(200.0, 66.0, 8e-3)).remark.startswith(words)
        assert Baseline(100.0, 33.0).remark.startswith(words)

    def test_growth_is_declared_with_the_widest_baseline(self):
        """1.5·exp(−√2·0.13) is 1.248: the limit of the first alarm, but for the rounding."""
        for growth, share in ((1.5, GOOD_SHARE), (2.0, LARGEST_SHARE)):
            found = growth * math.exp(-math.sqrt(2) * share)
            assert found == pytest.approx(1.25, rel=5e-3)


LIMITS = FrictionLimits()
EXACT = IdentificationSettings(timing_uncertainty=0.005)


def evidence(friction, hours=2.0, settings=EXACT):
    return evidence_of(made_moves(hours, friction), VALVE, settings)


def baseline(value=300.0):
    return Baseline(sliding=SlidingFriction(value, 10.0, 1.25e-3))


STEADY = evidence(lambda _: 300.0)
GROWN = evidence(lambda _: 450.0)


@pytest.mark.parametrize(
    ("now", "level", "signal", "words"),
    [
        (300.0, Level.OK, StatusSignal.GOOD, "friction normal"),
        (450.0, Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown"),
        (750.0, Level.ERROR, StatusSignal.FAILURE, "excess friction"),
        (90.0, Level.ERROR, StatusSignal.OUT_OF_SPECIFICATION, "friction collapsed"),
    ],
)
def test_limits_are_those_of_an_identification(now, level, signal, words):
    found = diagnosis_by_evidence(evidence(lambda _: now), VALVE, baseline(), LIMITS)
    assert (found.level, found.status_signal) == (level, signal)
    assert found.message.startswith(words)
    assert "moves in service since 2023-11-14" in found.message
    assert found.ratio.value == pytest.approx(now / 300.0, rel=0.05)


def test_an_alarm_says_when_friction_changed():
    """And with which doubt: the date is an interval that holds the truth."""
    grown = evidence(changing_at(3.0), hours=3.7)
    assert grown.change.earliest <= START + 3 * 3600 * SECOND <= grown.change.latest
    first = reference_by_evidence(STEADY)
    for healthy, reference in ((baseline(), None), (None, first)):
        found = diagnosis_by_evidence(grown, VALVE, healthy, LIMITS, reference)
        assert found.level is Level.WARN
        assert "; the change occurred between 2023-11-15" in found.message
    steady = diagnosis_by_evidence(STEADY, VALVE, baseline(), LIMITS)
    assert "the change occurred" not in steady.message


class TestReference:
    """Friction when the moves were first combined, where no baseline can be compared."""

    FIRST = reference_by_evidence(STEADY)

    def found(self, now, healthy=None, reference=FIRST):
        return diagnosis_by_evidence(now, VALVE, healthy, LIMITS, reference)

    def test_the_alarm_stays_when_the_change_has_left_the_ledger(self):
        assert GROWN.change is None
        found = self.found(GROWN)
        assert (found.level, found.status_signal) == (Level.WARN, StatusSignal.MAINTENANCE_REQUIRED)
        assert "times its value up to 2023-11-15" in found.message
        assert "no baseline: call ~/set_baseline while it is healthy" in found.message
        assert found.ratio.value == pytest.approx(1.5, rel=0.05)

    def test_slow_growth_ends_in_an_error(self):
        grown = evidence(lambda hour: 300.0 * (1 + hour / 13), hours=18.0)
        assert self.found(grown).level is Level.ERROR

    def test_a_second_change_does_not_hide_the_first(self):
        def friction(hour):
            return 300.0 if hour < 3 else 480.0 if hour < 6 else 450.0

        assert self.found(evidence(friction, hours=9.0)).level is Level.WARN

    def test_the_same_friction_is_normal_and_none_is_not_compared(self):
        assert self.found(STEADY).level is Level.OK
        assert self.found(STEADY, reference=None) is None
        assert self.found(evidence(lambda _: 300.0, hours=0.2)) is None

    @pytest.mark.parametrize(
        ("healthy", "words"),
        [
            (Baseline(600.0), "has no sliding friction"),
            (Baseline(sliding=SlidingFriction(300.0, 10.0, 6e-3)), "taken at 6 mm/s"),
        ],
    )
    def test_it_stands_in_for_a_baseline_that_cannot_be_compared(self, healthy, words):
        now = evidence(lambda _: 900.0)
        found = self.found(now, healthy)
        assert found.level is Level.ERROR
        assert "the baseline cannot be compared: call ~/set_baseline" in found.message
        assert words in str(why_not_compared(now, healthy))

    def test_a_baseline_that_can_be_compared_counts(self):
        assert self.found(GROWN, baseline(450.0)).level is Level.OK
        assert why_not_compared(GROWN, baseline()) is why_not_compared(GROWN, None) is None

    @pytest.mark.parametrize("reference", [None, FIRST], ids=["none", "of other speeds"])
    def test_a_change_is_an_alarm_where_nothing_can_be_compared(self, reference):
        """A stem that sticks more moves faster."""
        moves = made_moves(4.0, changing_at(2.0))
        for one in moves[600:]:
            object.__setattr__(one, "speed", 2.5 * one.speed)
        found = self.found(evidence_of(moves, VALVE, EXACT), reference=reference)
        assert found.level is Level.WARN
        assert found.message.startswith("friction has grown: sliding friction at 3.")
        assert "its value before the change between 2023-11-1" in found.message
        assert found.ratio.low <= 1.5 <= found.ratio.high
        small = evidence(changing_at(2.0, after=350.0), hours=4.0)
        assert small.change is not None
        assert self.found(small, reference=None) is None

    @pytest.mark.parametrize(
        ("second", "third", "level"), [(150.0, 300.0, Level.OK), (360.0, 440.0, Level.WARN)]
    )
    def test_changes_are_judged_together(self, second, third, level):
        """A packing adjusted after a fall is healthy; twice a fifth more is an alarm."""

        def friction(hour):
            return 300.0 if hour < 3 else second if hour < 6 else third

        now = evidence(friction, hours=9.0)
        assert len(now.changes) == 2
        found = self.found(now, reference=None)
        assert found.level is level
        assert found.ratio.low <= third / 300.0 <= found.ratio.high

    def test_one_that_is_first_known_after_a_change_is_that_of_before(self):
        grown = evidence(changing_at(2.0), hours=4.0)
        late = reference_by_evidence(grown)
        assert abs(late.sliding.value - 300.0) < late.sliding.half_width < 30.0
        assert late.time == grown.change.earliest
        assert self.found(GROWN, reference=late).level is Level.WARN

    def test_one_that_is_first_known_after_two_changes_is_that_of_before_both(self):
        def friction(hour):
            return 300.0 if hour < 3 else 390.0 if hour < 9 else 510.0

        grown = evidence(friction, hours=9.8)
        first, second = grown.changes
        assert grown.change is second
        late = reference_by_evidence(grown)
        assert abs(late.sliding.value - 300.0) < late.sliding.half_width < 60.0
        assert late.time == first.earliest


def test_a_negative_friction_points_to_the_signals():
    found = diagnosis_by_evidence(evidence(lambda _: -300.0), VALVE, baseline(), LIMITS)
    assert found.level is Level.WARN
    assert "check the direction of both signals" in found.message


class TestBaseline:
    def test_of_moves(self):
        one = baseline_by_evidence(STEADY)
        assert one.coulomb_friction is None
        assert one.sliding.value == pytest.approx(300.0, rel=0.02)

    def test_too_few(self):
        few = evidence(lambda _: 300.0, hours=0.2)
        with pytest.raises(RefusalError, match=r"cannot be the baseline yet: .* moves up and"):
            baseline_by_evidence(few)
        assert reference_by_evidence(few) is None

    def test_too_wide(self):
        wide = evidence(lambda _: 50.0, settings=IdentificationSettings(timing_uncertainty=0.1))
        with pytest.raises(RefusalError, match=r"known to .* a baseline requires"):
            baseline_by_evidence(wide)

    @pytest.mark.parametrize(("share", "serves"), [(0.13, True), (0.131, False)])
    def test_moves_go_on_until_they_are_a_good_one(self, share, serves):
        """Of a record 33 % would serve; more moves come by themselves."""
        found = STEADY
        one = found.parameters["sliding_friction"]
        one = replace(one, half_width=share * one.value, uncalibrated=None)
        found = replace(found, parameters={**found.parameters, "sliding_friction": one})
        assert (reference_by_evidence(found) is not None) is serves
