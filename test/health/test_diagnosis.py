# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Verdicts at their limits, and what they say."""

import math
from dataclasses import replace

import pytest

from valve_friction_ros.health import (
    Baseline,
    FrictionLimits,
    FrictionState,
    Level,
    SlidingFriction,
    StatusSignal,
    dead_band,
    dead_band_half_width,
    diagnose,
)
from valve_friction_ros.identification import (
    IdentificationSettings,
    Parameter,
    Verdict,
    identify_bench,
)
from valve_friction_ros.identification.trust.verdict import Misfit
from valve_friction_ros.model import BENCH_VALVE, Valve

BASELINE = Baseline(128.0)


def known(name, value, half_width):
    return Parameter(name, value, half_width / 2, half_width, Verdict.IDENTIFIED)


class TestDeadBand:
    @pytest.mark.parametrize(("coulomb", "static"), [(100.0, 156.0), (128.0, None)])
    def test_is_the_smallest_answered_reversal_over_the_travel(
        self, with_values, unknown, coulomb, static
    ):
        """(100 + 156 N)/2048 N/m is a quarter of 0.5 m; without a slip jump F_s is F_c."""
        found = with_values(
            coulomb_friction=coulomb,
            static_friction=static or unknown("static_friction"),
            spring_constant=2048.0,
        )
        assert dead_band(found, Valve(1.0, travel=0.5)) == 0.25

    @pytest.mark.parametrize("spring", [0.0, -1.0])
    def test_there_is_none_without_a_spring(self, with_values, spring):
        found = with_values(spring_constant=spring)
        assert math.isnan(dead_band(found, BENCH_VALVE))
        assert math.isnan(dead_band_half_width(found, BENCH_VALVE))

    @pytest.mark.parametrize("name", ["coulomb_friction", "spring_constant"])
    def test_there_is_none_without_what_it_is_made_of(self, with_values, unknown, name):
        found = with_values(static_friction=942.0, **{name: unknown(name)})
        assert math.isnan(dead_band(found, BENCH_VALVE))

    @pytest.mark.parametrize(
        ("static", "spring_width", "share"),
        [((900.0, 48.0), 41.0, math.hypot(60 / 1500, 41 / 2050)), (None, 0.0, 0.02)],
    )
    def test_its_interval(self, with_values, unknown, static, spring_width, share):
        """Errors of F_c and F_s as one, 60/1500; of the spring, 41/2050; these two independent.

        Without a slip jump F_s is F_c, with its error; a fixed spring has none.
        """
        found = with_values(
            coulomb_friction=known("coulomb_friction", 600.0, 12.0),
            static_friction=(
                known("static_friction", *static) if static else unknown("static_friction")
            ),
            spring_constant=known("spring_constant", 2050.0, spring_width),
        )
        valve = Valve(1.0, travel=0.5)
        wanted = dead_band(found, valve) * share
        assert dead_band_half_width(found, valve) == pytest.approx(wanted, rel=1e-12)

    def test_there_is_no_share_without_stops(self, result):
        assert math.isnan(dead_band(result, Valve(1.0)))


FAILURE = (Level.ERROR, StatusSignal.FAILURE, "excess friction")
MAINTENANCE = (Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown")
NORMAL = (Level.OK, StatusSignal.GOOD, "friction normal")
FALLEN = (Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has fallen")
COLLAPSED = (
    Level.ERROR,
    StatusSignal.OUT_OF_SPECIFICATION,
    "friction collapsed, the packing may leak",
)
SHARE = 2.0**-5
"""Half width over the value in these tests: the ratio's interval reaches e^(1/32), 3.17 %."""


class TestLevels:
    @pytest.mark.parametrize(
        ("ratio", "verdict"),
        [
            (50.0, FAILURE),
            (2.0, FAILURE),
            (math.nextafter(2.0, 0), MAINTENANCE),
            (1.25, MAINTENANCE),
            (math.nextafter(1.25, 0), NORMAL),
            (1.0, NORMAL),
            (math.nextafter(0.8, 1), NORMAL),
            (0.8, FALLEN),
            (math.nextafter(0.5, 1), FALLEN),
            (0.5, COLLAPSED),
            (2.0**-20, COLLAPSED),
        ],
    )
    def test_a_certain_ratio_at_and_beside_the_limits(self, with_values, ratio, verdict):
        """The baseline is a power of two, so the ratio comes back as it was."""
        found = diagnose(
            with_values(coulomb_friction=ratio * BASELINE.coulomb_friction), BENCH_VALVE, BASELINE
        )
        level, signal, words = verdict
        assert (found.level, found.status_signal) == (level, signal)
        assert found.ratio.interval == (ratio, ratio, ratio)
        compared = (
            f"{words}: Coulomb friction is {ratio:.2f} ({ratio:.2f} to {ratio:.2f}) "
            "times its baseline; "
        )
        assert found.message.startswith(compared)

    @pytest.mark.parametrize(
        ("ratio", "verdict"),
        [
            (2.0 * math.exp(SHARE) * (1 + 1e-9), FAILURE),
            (2.0 * math.exp(SHARE) * (1 - 1e-9), MAINTENANCE),
            (2.0, MAINTENANCE),
            (1.25 * (1 + 1e-9), MAINTENANCE),
            (1.25, MAINTENANCE),
            (1.25 * (1 - 1e-9), NORMAL),
            (0.8 * (1 + 1e-9), NORMAL),
            (0.8 * (1 - 1e-9), FALLEN),
            (0.5, FALLEN),
            (0.5 * math.exp(-SHARE) * (1 + 1e-9), FALLEN),
            (0.5 * math.exp(-SHARE) * (1 - 1e-9), COLLAPSED),
        ],
    )
    @pytest.mark.parametrize("of_the_baseline", [False, True])
    def test_only_a_whole_interval_passes_the_limit_of_an_error(
        self, with_values, friction, ratio, verdict, of_the_baseline
    ):
        """Doubt about the baseline holds an alarm back as doubt about the friction does."""
        healthy = BASELINE.coulomb_friction
        now = friction(ratio * healthy, 0.0 if of_the_baseline else SHARE * ratio * healthy)
        baseline = Baseline(healthy, SHARE * healthy if of_the_baseline else 0.0)
        found = diagnose(with_values(coulomb_friction=now), BENCH_VALVE, baseline)
        level, signal, words = verdict
        assert (found.level, found.status_signal) == (level, signal)
        assert found.message.startswith(f"{words}: ")
        assert found.ratio.low == pytest.approx(ratio * math.exp(-SHARE), rel=1e-12)
        assert found.ratio.high == pytest.approx(ratio * math.exp(SHARE), rel=1e-12)

    @pytest.mark.parametrize(
        ("ratio", "share", "state"),
        [
            # 2.5·e^-0.693 = 1.250 is the limit; ln 2.5 = 0.916 is 1.5 times 0.611.
            (2.5, 0.692, FrictionState.GROWN),
            (2.5, 0.694, FrictionState.UNCLEAR),
            # ln 1.5 = 0.405 is 1.5 times 0.2703, and 1.5·e^-0.27 = 1.145 is not beyond the limit.
            (1.5, 0.2702, FrictionState.GROWN),
            (1.5, 0.2704, FrictionState.UNCLEAR),
            (1 / 1.5, 0.2702, FrictionState.FALLEN),
            (1 / 1.5, 0.2704, FrictionState.UNCLEAR),
        ],
    )
    def test_a_vague_estimate_raises_no_alarm(self, with_values, friction, ratio, share, state):
        vague = friction(ratio * 128.0, share * ratio * 128.0)
        found = diagnose(with_values(coulomb_friction=vague), BENCH_VALVE, BASELINE)
        assert found.state is state
        if state is FrictionState.UNCLEAR:
            assert found.state.side is None
            assert found.message.endswith(
                "identify it again from a longer record with more strokes to be sure"
            )

    def test_limits_of_the_user(self, with_values):
        limits = FrictionLimits(warn_ratio=1.125, error_ratio=1.25, low_ratio=0.875)
        found = [
            diagnose(
                with_values(coulomb_friction=ratio * 128.0), BENCH_VALVE, BASELINE, limits
            ).level
            for ratio in (0.875, 1.0, 1.125, 1.25)
        ]
        assert found == [Level.ERROR, Level.OK, Level.WARN, Level.ERROR]

    @pytest.mark.parametrize(
        ("warn", "low", "low_warn"),
        [(1.25, 0.5, 0.8), (2.0, 0.25, 0.5), (2.0, 0.64, 0.8), (4.0, 0.25, 0.5)],
    )
    def test_the_low_side_has_a_warning_as_the_high_side_has(self, warn, low, low_warn):
        """The inverse of `warn_ratio`, or halfway to `low_ratio` by logarithm if nearer to 1."""
        assert FrictionLimits(warn, 10.0, low).low_warn_ratio == low_warn

    def test_numbers_and_letters_of_the_standards(self):
        """diagnostic_msgs counts OK, WARN, ERROR from 0; NE 107 has F, C, S, M."""
        assert [level.value for level in (Level.OK, Level.WARN, Level.ERROR)] == [0, 1, 2]
        assert [signal.value for signal in StatusSignal] == ["", "F", "C", "S", "M"]


class TestUnknownFriction:
    @pytest.mark.parametrize("baseline", [None, BASELINE, Baseline(1e-6), Baseline(1e6)])
    def test_never_alarms(self, with_values, unknown, baseline):
        result = with_values(
            coulomb_friction=unknown(), sliding_friction=unknown("sliding_friction")
        )
        found = diagnose(result, BENCH_VALVE, baseline)
        assert (found.level, found.status_signal, found.ratio) == (*NORMAL[:2], None)
        assert found.message == (
            "Coulomb friction is not identifiable: the record does not determine it"
        )

    @pytest.mark.parametrize(("bound", "collapsed"), [(1.5, True), (57.0, True), (57.1, False)])
    def test_too_small_to_be_identified_has_collapsed(self, with_values, unknown, bound, collapsed):
        """Half of the least that the baseline can be, 128 − 14 N, is 57 N."""
        vanished = replace(unknown(), withheld=(0.0, bound))
        result = with_values(coulomb_friction=vanished)
        found = diagnose(result, BENCH_VALVE, Baseline(128.0, 14.0))
        assert found.ratio is None
        if collapsed:
            assert (found.level, found.status_signal) == COLLAPSED[:2]
            assert found.message == (
                "friction collapsed, the packing may leak: Coulomb friction is too small to be "
                f"identified (at most {bound:.2g} N); its baseline is 128 N"
            )
        else:
            assert found.level == Level.OK
        assert diagnose(result, BENCH_VALVE).level == Level.OK

    def test_the_sliding_friction_is_told_where_it_is_known(self, with_values, unknown, friction):
        sliding = friction(205.5, 3.0, "sliding_friction")
        result = with_values(coulomb_friction=unknown(), sliding_friction=sliding)
        found = diagnose(result, BENCH_VALVE)
        assert found.message == "no baseline yet; sliding friction 205.5 ± 3.0 N"
        found = diagnose(result, BENCH_VALVE, BASELINE)
        assert (found.level, found.ratio) == (Level.OK, None)
        assert found.message == (
            "no comparison with the baseline (Coulomb friction 128 N): Coulomb friction is not "
            "identifiable: the record does not determine it; the baseline has no sliding friction: "
            "set it again; sliding friction 205.5 ± 3.0 N"
        )

    @pytest.mark.parametrize("baseline", [None, BASELINE])
    def test_below_zero_is_a_fault_of_the_signals(self, with_values, friction, baseline):
        """As of a drive whose sign is turned; no packing has it, so nothing is compared."""
        found = diagnose(with_values(coulomb_friction=friction(-20.0, 3.0)), BENCH_VALVE, baseline)
        assert (found.level, found.status_signal) == (Level.WARN, StatusSignal.CHECK_FUNCTION)
        assert found.ratio is None
        assert found.message == (
            "Coulomb friction is −20.0 ± 3.0 N, but friction cannot be negative: check the "
            "direction of both signals"
        )

    def test_zero_is_a_friction_without_an_interval_of_its_ratio(self, with_values):
        """0 times the baseline; without an interval no error counts as passed."""
        found = diagnose(with_values(coulomb_friction=0.0), BENCH_VALVE, BASELINE)
        assert (found.level, found.status_signal) == FALLEN[:2]
        assert found.ratio.value == 0.0
        assert found.message.startswith("friction has fallen: ")


class TestSlidingFriction:
    """A baseline of 200 ± 4 N at 8 mm/s, and no F_c of use."""

    SLIDING = SlidingFriction(200.0, 4.0, 8e-3)

    @pytest.fixture
    def slid(self, with_values, friction):
        """Function of a sliding friction, its half width and speed: a result with a vague F_c."""

        def build(value, half_width=4.0, speed=8e-3, **changes):
            sliding = friction(value, half_width, "sliding_friction")
            vague = replace(friction(160.0, 100.0), verdict=Verdict.WEAK)
            changes = {"coulomb_friction": vague, "sliding_friction": sliding, **changes}
            return replace(with_values(**changes), sliding_speed=speed)

        return build

    @pytest.mark.parametrize("coulomb", [None, 160.0])
    @pytest.mark.parametrize(
        ("value", "verdict"),
        [(500.0, FAILURE), (300.0, MAINTENANCE), (200.0, NORMAL), (80.0, COLLAPSED)],
    )
    def test_it_raises_the_alarm_that_the_coulomb_friction_hides(
        self, slid, value, verdict, coulomb
    ):
        found = diagnose(slid(value), BENCH_VALVE, Baseline(coulomb, 0.0, self.SLIDING))
        level, signal, words = verdict
        assert (found.level, found.status_signal) == (level, signal)
        told = f"{words}: sliding friction at 8 mm/s is {value / 200:.2f} ("
        assert found.message.startswith(told)
        assert found.to_dict()["ratio_of"] == "sliding_friction"
        assert found.to_dict()["ratio_speed"] == 8e-3

    @pytest.mark.parametrize(
        ("value", "speed", "state"),
        [
            (900.0, 4e-3, FrictionState.EXCESS),
            (400.0, 4e-3, FrictionState.GROWN),
            (200.0, 4e-3, FrictionState.UNCLEAR),
            (150.0, 4e-3, FrictionState.NORMAL),
            (60.0, 4e-3, FrictionState.FALLEN),
            (20.0, 4e-3, FrictionState.COLLAPSED),
            (800.0, 2e-3, FrictionState.EXCESS),  # that no speed explains
            (30.0, 2e-3, FrictionState.FALLEN),  # all viscous, it would be 120 N
            (20.0, 2e-3, FrictionState.COLLAPSED),
        ],
    )
    def test_at_another_speed_it_takes_more_to_be_sure(self, slid, unknown, value, speed, state):
        """Of an unknown F_v: at 8 mm/s 400 N would be an ERROR, as would 60 N."""
        result = slid(value, speed=speed, coulomb_friction=unknown(), viscous_friction=unknown())
        result = replace(result, evidence={})
        found = diagnose(result, BENCH_VALVE, Baseline(sliding=self.SLIDING))
        assert (found.state, found.ratio.speed) == (state, 8e-3)

    def test_at_speeds_too_far_apart_it_says_so(self, slid, unknown):
        result = slid(120.0, speed=2e-3, viscous_friction=unknown())
        found = diagnose(result, BENCH_VALVE, Baseline(sliding=self.SLIDING))
        assert (found.level, found.ratio, found.lacks_comparison) == (Level.OK, None, True)
        assert "the stem slid at 2 mm/s, but at 8 mm/s in the baseline" in found.message
        assert "set it again" not in found.message

    def test_too_small_to_be_identified_it_has_collapsed(self, slid, unknown):
        """Half of 196 N is 98 N; at 4 mm/s, 49 N may be 98 N at twice the speed."""
        baseline = Baseline(sliding=self.SLIDING)
        for bound, speed, level in (
            (98.0, 8e-3, Level.ERROR),
            (98.1, 8e-3, Level.OK),
            (49.0, 4e-3, Level.ERROR),
            (49.1, 4e-3, Level.OK),
        ):
            none = replace(unknown("sliding_friction"), withheld=(0.0, bound))
            result = slid(1.0, speed=speed, sliding_friction=none, coulomb_friction=unknown())
            found = diagnose(result, BENCH_VALVE, baseline)
            assert found.level == level
            assert ("sliding friction is too small" in found.message) is (level == Level.ERROR)

    def test_a_coulomb_friction_lost_to_viscous_friction_is_no_collapse(self, slid, unknown):
        vanished = replace(unknown(), withheld=(0.0, 10.0))
        baseline = Baseline(128.0, 0.0, self.SLIDING)
        assert diagnose(slid(200.0, coulomb_friction=vanished), BENCH_VALVE, baseline).level == 0
        less = diagnose(slid(150.0, coulomb_friction=vanished), BENCH_VALVE, baseline)
        assert less.message.startswith("friction collapsed, the packing may leak: Coulomb ")


class TestModelDoubt:
    DOUBT = "the Karnopp model does not describe this valve (misfit 98 µm); "

    @pytest.fixture
    def doubted(self, with_values):
        """Function of a Coulomb friction: an result whose model misses the stem by 98 µm."""

        def build(coulomb_friction, systematic=98e-6):
            misfit = Misfit(0.98, 99e-6, systematic, 98e-6 - 1e-12)
            return replace(with_values(coulomb_friction=coulomb_friction), misfit=misfit)

        return build

    @pytest.mark.parametrize("ratio", [1.0, 1.5, 3.0, 0.25])
    def test_is_said_and_changes_nothing_else(self, with_values, doubted, ratio):
        found = diagnose(doubted(ratio * 128.0), BENCH_VALVE, BASELINE)
        sure = diagnose(with_values(coulomb_friction=ratio * 128.0), BENCH_VALVE, BASELINE)
        assert found.message == self.DOUBT + sure.message
        assert replace(found, statement=sure.statement, doubt=None) == sure

    def test_a_tolerated_misfit_is_no_doubt(self, doubted):
        found = diagnose(doubted(128.0, systematic=97e-6), BENCH_VALVE, BASELINE)
        assert found.message.startswith("friction normal: ")

    def test_a_machine_without_a_spring_has_none(self, with_values):
        found = replace(with_values(coulomb_friction=128.0), misfit=None)
        assert diagnose(found, BENCH_VALVE, BASELINE).level == Level.OK


class TestWords:
    def test_the_consequence_is_the_dead_band(self, with_values, unknown):
        """2·606 N over 2.05e5 N/m and 28.575 mm is 20.69 %; 3.9686·e^∓0.01 is 3.93 to 4.01."""
        found = diagnose(
            with_values(
                coulomb_friction=known("coulomb_friction", 606.0, 6.06),
                static_friction=unknown("static_friction"),
                spring_constant=2.05e5,
            ),
            BENCH_VALVE,
            Baseline(152.7),
        )
        assert found.message == (
            "excess friction: Coulomb friction is 3.97 (3.93 to 4.01) times its baseline; "
            "the stem ignores reversals smaller than 21 % of its travel"
        )

    def test_without_a_baseline(self, with_values, unknown):
        found = diagnose(
            with_values(
                coulomb_friction=152.7,
                static_friction=unknown("static_friction"),
                spring_constant=2.05e5,
            ),
            BENCH_VALVE,
        )
        assert (found.level, found.status_signal, found.ratio) == (*NORMAL[:2], None)
        assert found.message == (
            "no baseline yet; the stem ignores reversals smaller than 5.2 % of its travel: good "
            "by the limits for a first survey"
        )

    def test_without_a_travel_the_friction_itself_is_told(self, with_values, friction):
        found = diagnose(
            with_values(coulomb_friction=friction(20.3935, 0.4)), Valve(1.0), Baseline(20.0)
        )
        assert found.message == (
            "friction normal: Coulomb friction is 1.02 (1.00 to 1.04) times its baseline; "
            "Coulomb friction 20.39 ± 0.40 N"
        )


class TestLimits:
    @pytest.mark.parametrize(
        ("name", "values"),
        [("low_ratio", (0.0, 1.0)), ("warn_ratio", (1.0, 2.0)), ("error_ratio", (1.25,))],
    )
    def test_out_of_order(self, name, values):
        for value in (*values, math.nan):
            with pytest.raises(ValueError, match=r"^limits must satisfy 0 < low_ratio < 1 < warn"):
                FrictionLimits(**{name: value})


class TestCalibration:
    """The same area and sensors on both sides scale both frictions alike."""

    def test_it_does_not_change_the_comparison(self, loose_record, tight_record):
        """Bit for bit, though it makes every friction weak."""
        ratios, baselines = [], []
        for share in (0.0, 0.1):
            given = IdentificationSettings(assumed_mass=1.6, drive_scale_uncertainty=share)
            records = loose_record, tight_record
            healthy, grown = (identify_bench(one, BENCH_VALVE, given) for one in records)
            baselines.append(Baseline.of(healthy))
            ratios.append(diagnose(grown, BENCH_VALVE, baselines[-1]).ratio)
        assert grown.parameters["coulomb_friction"].verdict is Verdict.WEAK
        assert grown.parameters["sliding_friction"].verdict is Verdict.WEAK
        assert baselines[0] == baselines[1]
        assert repr(ratios[0]) == repr(ratios[1])
        assert ratios[0].low > 1.25
