"""Moves combined: intervals that hold, changes that are found, and what is no change."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from service import PRELOAD, SPRING, START, VALVE, made_moves

from valve_friction_ros.evidence import MOST_MOVES, Moves, evidence_of
from valve_friction_ros.evidence.balance import balance_of
from valve_friction_ros.evidence.series import series_of
from valve_friction_ros.identification import IdentificationSettings, Verdict

HOUR = 3600e9
EXACT = IdentificationSettings(timing_uncertainty=0.0)


def constant(value):
    return lambda _: value


def by_the_hour(moves, settings=None):
    return evidence_of(moves, VALVE, settings)


class TestEstimate:
    @pytest.mark.parametrize("seed", range(5))
    def test_an_hour_gives_what_is_true(self, seed):
        found = by_the_hour(made_moves(1.0, constant(300.0), seed))
        expected = {
            "sliding_friction": 300.0,
            "static_friction": 300.0,
            "spring_constant": SPRING,
            "spring_preload": PRELOAD,
            "dead_band": 600.0 / SPRING,
        }
        for name, value in expected.items():
            one = found.parameters[name]
            assert abs(one.value - value) <= one.half_width, name
        sliding = found.parameters["sliding_friction"]
        assert sliding.value == pytest.approx(300.0, rel=0.02)
        assert sliding.half_width < 0.1 * 300.0
        assert found.change is None
        assert found.since == START

    def test_few_moves_are_withheld_with_their_number(self):
        found = by_the_hour(made_moves(0.1, constant(300.0)))
        one = found.parameters["sliding_friction"]
        assert math.isnan(one.value)
        assert one.verdict is Verdict.NOT_IDENTIFIABLE
        assert "moves up and" in one.reason
        assert "let the valve work on" in one.reason
        assert not found.is_known

    def test_none_at_all(self):
        found = by_the_hour([])
        assert (found.moves, found.since, found.until) == (0, 0, 0)
        assert not found.is_known

    def test_coulomb_friction_is_not_split_off(self):
        found = by_the_hour(made_moves(1.0, constant(300.0)))
        assert math.isnan(found.values["coulomb_friction"])

    def test_a_lag_of_the_signals_is_in_the_interval(self):
        """100 N/s by 0.04 s are 4 N, and twice that at 95 %."""
        moves = made_moves(1.0, constant(300.0))
        plain, exact = (
            by_the_hour(moves, one).parameters["sliding_friction"].half_width
            for one in (None, EXACT)
        )
        assert math.sqrt(plain**2 - exact**2) == pytest.approx(8.0, rel=0.02)

    def test_calibration_widens_and_can_be_left_out(self):
        moves = made_moves(1.0, constant(300.0))
        settings = IdentificationSettings(area_uncertainty=0.05)
        one = by_the_hour(moves, settings).parameters["sliding_friction"]
        bare = by_the_hour(moves).parameters["sliding_friction"]
        assert one.without_calibration.half_width == pytest.approx(bare.half_width)
        added = math.sqrt(one.half_width**2 - bare.half_width**2)
        assert added == pytest.approx(2 * 0.05 * bare.value)

    def test_a_known_spring_is_used(self):
        """Set points that hardly leave their place say little of the spring."""
        moves = made_moves(1.0, constant(300.0), low=0.484, high=0.516)
        settings = IdentificationSettings(fixed={"spring_constant": SPRING})
        free, known = by_the_hour(moves), by_the_hour(moves, settings)
        assert free.parameters["dead_band"].verdict is Verdict.WEAK
        assert known.parameters["spring_constant"].verdict is Verdict.FIXED
        one = known.parameters["dead_band"]
        assert one.value == pytest.approx(600.0 / SPRING, rel=0.03)
        assert one.half_width < 0.1 * one.value

    def test_without_a_spring_there_is_no_dead_band(self):
        """Places within 2 % of the travel: friction that bends with the speed hides it."""
        moves = made_moves(1.0, constant(900.0), step=0.01 * VALVE.travel, low=0.49, high=0.51)
        settings = IdentificationSettings(fixed={"spring_constant": SPRING})
        free, known = (by_the_hour(moves, one).parameters["dead_band"] for one in (None, settings))
        assert free.verdict is Verdict.NOT_IDENTIFIABLE
        assert "fixed.spring_constant" in free.reason
        assert known.value == pytest.approx(1800.0 / SPRING, rel=0.03)

    def test_outliers_hardly_count(self):
        moves = made_moves(1.0, constant(300.0))
        for place in range(5, 300, 40):
            object.__setattr__(moves[place], "force", moves[place].force + 2000.0)
        one = by_the_hour(moves).parameters["sliding_friction"]
        assert one.value == pytest.approx(300.0, rel=0.03)

    @pytest.mark.parametrize("period", [300.0, 3600.0])
    def test_weeks_of_a_quiet_valve_cost_no_more_than_hours_of_a_busy_one(self, period):
        moves = made_moves(MOST_MOVES * period / 3600, constant(300.0), period=period)
        assert balance_of(Moves.of(moves), 0.04, VALVE.travel).values.size <= 70
        found = by_the_hour(moves).parameters["sliding_friction"]
        assert found.value == pytest.approx(300.0, rel=0.02)

    @settings(max_examples=15, deadline=None)
    @given(st.floats(0.01, 100.0))
    def test_forces_in_another_scale_give_numbers_in_that_scale(self, scale):
        moves = made_moves(1.0, constant(300.0))
        larger = made_moves(1.0, constant(300.0))
        for one in larger:
            for name in ("force", "force_rate", "onset_force", "onset_rate"):
                object.__setattr__(one, name, scale * getattr(one, name))
        before, after = by_the_hour(moves), by_the_hour(larger)
        for name in ("sliding_friction", "static_friction", "spring_constant"):
            first, second = before.parameters[name], after.parameters[name]
            assert second.value == pytest.approx(scale * first.value, rel=1e-6)
            assert second.half_width == pytest.approx(scale * first.half_width, rel=1e-3)


class TestChange:
    def test_half_more_is_declared_within_an_hour(self):
        def friction(hour):
            return 450.0 if hour >= 3.0 else 300.0

        found = by_the_hour(made_moves(3.95, friction))
        change = found.change
        assert change.low <= 1.5 <= change.high
        assert change.earliest <= START + 3.0 * HOUR <= change.latest
        assert change.latest - change.earliest < HOUR
        one = found.parameters["sliding_friction"]
        assert one.value == pytest.approx(450.0, rel=0.03)
        assert found.since >= START + 2.8 * HOUR

    def test_it_is_found_as_soon_after_a_week_as_after_a_day(self):
        """A move every 150 s: 24 moves, and a date that is as narrow as the blocks."""

        def friction(hour):
            return 450.0 if hour >= 168.0 else 300.0

        moves = made_moves(169.0, friction, period=150.0, noise=12.0)
        change = by_the_hour(moves[-MOST_MOVES:]).change
        assert change.low <= 1.5 <= change.high
        assert change.earliest <= START + 168.0 * HOUR <= change.latest
        assert change.latest - change.earliest < 2 * HOUR

    @pytest.mark.parametrize("minutes", range(0, 60, 7))
    def test_its_date_and_ratio_hold_as_soon_as_it_is_declared(self, minutes):
        """Wherever in a block it lies; a block that holds both frictions tells neither."""

        def friction(hour):
            return 450.0 if hour >= 2 + minutes / 60 else 300.0

        for hours in (0.4, 0.5, 0.6):
            change = by_the_hour(made_moves(2 + minutes / 60 + hours, friction)).change
            if change is not None:
                assert change.low <= 1.5 <= change.high
                at = START + (2 + minutes / 60) * HOUR
                assert change.earliest <= at <= change.latest
        assert change is not None

    def test_a_fall_too(self):
        found = by_the_hour(made_moves(4.0, lambda hour: 120.0 if hour >= 3.0 else 300.0))
        assert found.change.ratio == pytest.approx(0.4, rel=0.05)

    def test_the_past_is_let_go_while_friction_creeps_up(self):
        """10 % in an hour: no step, yet the estimate is never a tenth behind."""
        for hours in (4.0, 6.0, 8.0):
            found = by_the_hour(made_moves(hours, lambda hour: 300.0 * (1 + 0.05 * hour)))
            now = 300.0 * (1 + 0.05 * hours)
            assert found.parameters["sliding_friction"].value == pytest.approx(now, rel=0.1)

    @pytest.mark.parametrize("seed", range(10))
    def test_what_is_no_change(self, seed):
        """Preload that drifts with the day, a viscous friction, and new ranges of the set point."""
        moves = made_moves(
            10.0,
            constant(300.0),
            seed,
            offset=lambda hour: 60.0 * math.sin(hour / 4),
            viscous=4e4,
            noise=12.0,
        )
        middle = 0.5 * VALVE.travel
        moves = [
            one
            for one in moves
            if (0.5 * (one.start + one.stop) > middle) == bool(int((one.end - START) // HOUR) % 2)
        ]
        assert len(moves) > 1000
        found = by_the_hour(moves)
        assert found.change is None
        assert abs(
            found.parameters["sliding_friction"].value - 300.0 - 4e4 * found.sliding_speed
        ) < (found.parameters["sliding_friction"].half_width)

    def test_faster_moves_are_no_change(self):
        slow = made_moves(4.0, constant(300.0), viscous=8e4)
        for one in slow[600:]:
            way, more = one.direction, 8e4 * one.speed
            object.__setattr__(one, "speed", 2 * one.speed)
            object.__setattr__(one, "force", one.force + way * more)
        assert by_the_hour(slow).change is None

    def test_the_series_is_that_of_the_blocks(self):
        series = series_of(Moves.of(made_moves(2.0, constant(300.0))), VALVE.travel)
        assert series.friction == pytest.approx(300.0, rel=0.02)
        assert 10 <= series.friction.size <= 12
