# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A stem that stands still: the friction that follows from the force balance alone."""

import numpy as np
import pytest

from valve_friction_ros.health import (
    Baseline,
    FrictionLimits,
    FrictionMonitor,
    Level,
    MonitorSettings,
    RefusedRecordError,
    SlidingFriction,
    Standstill,
    StandstillCounter,
    identify_snapshot,
    standstill_finding,
)
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.standstill import held_finding, held_numbers
from valve_friction_ros.model import (
    BENCH_VALVE,
    LOW_FRICTION,
    Recording,
    SquareWave,
    Valve,
    simulate,
)
from valve_friction_ros.streams import RecordBuffer, Samples, rows_arrived

TRAVEL = 0.02
VALVE = Valve(diaphragm_area=0.05, pressure_reference=0.0, travel=TRAVEL)
REACH = {
    "lowest_position": Measured(0.0, 1e-5),
    "highest_position": Measured(0.018, 1e-5),
}
HEALTHY = Baseline(coulomb_friction=100.0, half_width=5.0, numbers=REACH)
BLOCK = 10
BEGIN = 1_700_000_000


def given(counter, pressures, positions, second=0):
    """Give a value of each signal for every second, and return the standstill."""
    stamps = (BEGIN + second + np.arange(len(pressures))) * 10**9
    counter.add(Samples(stamps, np.array(pressures)), Samples(stamps, np.array(positions)))
    return counter.standstill


def blocks(*values):
    return np.repeat(np.array(values, dtype=float), BLOCK)


def test_half_of_the_change_of_force_is_the_least_friction():
    """10 kPa on 0.05 m² are 500 N, which 250 N of friction just hold from end to end."""
    assert Standstill(0, 0.01, 1e5, 1.1e5).least_friction(VALVE) == pytest.approx(250.0)


def test_the_range_is_that_of_the_means_of_blocks_after_which_the_stem_stood_still():
    """The fourth block has no later one that is complete; the first one begins the standstill."""
    noise = np.tile([500.0, -500.0], 3 * BLOCK - BLOCK // 2)
    pressures = blocks(1.0e5, 1.3e5, 0.9e5, 2.0e5, 3.0e5) + noise
    found = given(StandstillCounter(TRAVEL), pressures, blocks(*5 * [0.01]))
    assert (found.lowest_pressure, found.highest_pressure) == (0.9e5, 1.3e5)
    assert (found.since, found.position) == (BEGIN * 10**9, pytest.approx(0.01))


def test_parts_of_any_size_say_the_same():
    pressures = np.random.default_rng(5).integers(100_000, 200_000, 100).astype(float)
    place = 2.0**-7  # its sums are exact
    whole = given(StandstillCounter(TRAVEL), pressures, np.full(100, place))
    counter = StandstillCounter(TRAVEL)
    for first in range(0, 100, 7):
        part = pressures[first : first + 7]
        given(counter, part, np.full(part.size, place), first)
    assert counter.standstill == whole


@pytest.mark.parametrize("place", [0.01011, 0.00989])
def test_a_stem_that_has_moved_begins_anew(place):
    """The pressure that has moved it does not count, and neither does what was before."""
    counter = StandstillCounter(TRAVEL)
    assert given(counter, blocks(1e5, 2e5, 2e5, 2e5), blocks(*4 * [0.01])) is not None
    assert given(counter, blocks(9e5, 3e5), blocks(place, place), 4 * BLOCK) is None
    found = given(counter, blocks(2.0e5, 2.1e5, 1e5), blocks(*3 * [place]), 6 * BLOCK)
    assert (found.lowest_pressure, found.highest_pressure) == (2e5, 3e5)


def test_a_stem_that_swings_does_not_stand_still():
    swing = 0.01 + 0.0003 * np.tile([1.0, -1.0], 25)
    assert given(StandstillCounter(TRAVEL), np.linspace(1e5, 2e5, 50), swing) is None


def test_a_pressure_without_positions_does_not_count():
    """A stem sensor that is silent says nothing of the stem."""
    counter = StandstillCounter(TRAVEL)
    given(counter, blocks(*4 * [1e5]), blocks(*4 * [0.01]))
    stamps = (BEGIN + 40 + np.arange(100)) * 10**9
    counter.add(Samples(stamps, np.linspace(1e5, 9e5, 100)), Samples(stamps[:0], np.empty(0)))
    assert counter.standstill.highest_pressure == 1e5


def test_a_clock_that_is_set_back_begins_anew():
    counter = StandstillCounter(TRAVEL)
    given(counter, blocks(1e5, 2e5, 1e5), blocks(0.01, 0.01, 0.01), 1000)
    assert given(counter, blocks(1e5), blocks(0.01), 0) is None


@pytest.mark.parametrize(("change", "is_found"), [(8.39e3, False), (8.41e3, True)])
def test_found_from_twice_the_baseline_on(change, is_found):
    """Twice 105 N, the upper end, needs 420 N or 8.4 kPa."""
    still = Standstill(10**9, 0.01, 1e5, 1e5 + change)
    found = standstill_finding(still, VALVE, HEALTHY, 2.0)
    assert (found is not None) is is_found


@pytest.mark.parametrize("place", [0.0, 0.0005, 0.0175, 0.018, 0.0195, -0.001])
def test_nothing_is_said_near_the_ends_of_the_way_of_the_baseline(place):
    assert standstill_finding(Standstill(1, place, 0.0, 1e5), VALVE, HEALTHY, 2.0) is None


def test_nothing_is_said_where_that_way_is_not_known():
    without = Baseline(coulomb_friction=100.0, half_width=5.0)
    assert standstill_finding(Standstill(1, 0.01, 0.0, 1e5), VALVE, without, 2.0) is None


def test_static_friction_of_the_baseline_counts():
    sticky = Baseline(100.0, 5.0, numbers={**REACH, "static_friction": Measured(300.0, 20.0)})
    still = Standstill(1, 0.01, 1e5, 1.2e5)  # 500 N
    assert standstill_finding(still, VALVE, sticky, 2.0) is None
    found = standstill_finding(still, VALVE, HEALTHY, 2.0)
    assert found.friction_ratio == pytest.approx(500 / 105)
    assert "at 10.0 mm since 1970-01-01 00:00 UTC while its pressure changed by 20 kPa" in str(
        found
    )


def test_a_healthy_simulated_valve_is_never_stuck(bench_record):
    """In each standstill of the bench valve, ten times slower, the force is within its friction."""
    record = bench_record("low", SquareWave(), 20.8)
    counter = StandstillCounter(BENCH_VALVE.travel)
    stamps = BEGIN * 10**9 + np.round(1e11 * record.time).astype(np.int64)
    seen = 0
    for part in np.array_split(np.arange(stamps.size), 400):
        pressures = Samples(stamps[part], record.pressure[part])
        counter.add(pressures, Samples(stamps[part], record.position[part]))
        if still := counter.standstill:
            seen += 1
            assert still.least_friction(BENCH_VALVE) <= LOW_FRICTION.static_friction + 1
    assert seen > 10


class TestHeldInATest:
    """A record that is refused as the stem did not move still bounds its friction."""

    TIME = np.arange(0.0, 40.0, 0.05)
    ASKED = 1e5 + 1.2e4 * np.sin(2 * np.pi * TIME / 40.0)

    def recording(self, position):
        return Recording(0.05, self.ASKED, np.full(self.TIME.size, position))

    def test_half_of_the_swing_of_the_force_is_the_least_friction(self):
        """24 kPa on 0.05 m² are 1200 N, means over two seconds miss 1.6 % of them."""
        numbers = held_numbers(self.recording(0.009), VALVE)
        assert numbers["held_position"].value == pytest.approx(0.009)
        assert numbers["held_friction"].value == pytest.approx(600.0 * 0.984, rel=1e-3)

    def test_a_stem_that_follows_bounds_nothing_that_is_not_true(self):
        """Moved by sliding friction alone, it stands still only where that holds it."""
        pressure = BENCH_VALVE.pressure_reference + 5e4 + 4e4 * np.sin(0.5 * self.TIME)
        position = simulate(BENCH_VALVE, LOW_FRICTION, pressure, 0.05).position
        numbers = held_numbers(Recording(0.05, pressure, position), BENCH_VALVE)
        held = numbers.get("held_friction", Measured(0.0, 0.0))
        assert held.value < LOW_FRICTION.static_friction

    @pytest.mark.parametrize(
        ("healthy", "level"), [(500.0, None), (400.0, Level.WARN), (250.0, Level.ERROR)]
    )
    def test_the_limits_are_those_of_the_friction(self, healthy, level):
        baseline = Baseline(coulomb_friction=healthy, half_width=0.0, numbers=REACH)
        numbers = held_numbers(self.recording(0.009), VALVE)
        found = held_finding(numbers, baseline, VALVE, FrictionLimits())
        assert (found and found.level) == level
        if found:
            assert found.friction_ratio == pytest.approx(0.984 * 600.0 / healthy, rel=1e-3)

    @pytest.mark.parametrize("place", [0.0002, 0.0178, 0.0195])
    def test_at_an_end_the_stem_may_rest_on_a_stop(self, place):
        numbers = held_numbers(self.recording(place), VALVE)
        assert held_finding(numbers, HEALTHY, VALVE, FrictionLimits()) is None

    @pytest.mark.parametrize(
        ("balance", "least"), [(-1000.0, 590.4), (0.0, 590.4), (200.0, 390.4), (700.0, None)]
    )
    @pytest.mark.parametrize("upper", [True, False])
    def test_a_partial_stroke_from_an_end_bounds_it_by_the_push_inwards(
        self, balance, least, upper
    ):
        """The force is 5000 ± 590 N. Where it lies beyond the spring outwards, a stop may bear it.

        At the upper end the force falls, at the lower one it rises, to move the stem.
        """
        place, outwards = (0.0178, 1.0) if upper else (0.0002, -1.0)
        spring = {
            "spring_constant": Measured(1e5, 0.0),
            "spring_preload": Measured(5000.0 - outwards * balance - 1e5 * place, 0.0),
        }
        baseline = Baseline(coulomb_friction=200.0, half_width=0.0, numbers=REACH | spring)
        numbers = held_numbers(self.recording(place), VALVE)
        numbers["held_position"] = Measured(place, 0.0)
        found = held_finding(numbers, baseline, VALVE, FrictionLimits())
        if least is None:
            assert found is None
        else:
            assert found.friction_ratio == pytest.approx(least / 200.0, rel=1e-3)

    def test_static_friction_of_the_baseline_is_its_slip_above_the_sliding_friction(self):
        """F_c, known badly, hides nothing: 590 N are 1.34 times 400 + 10 + 20 + 10 N."""
        numbers = REACH | {
            "coulomb_friction": Measured(400.0, 200.0),
            "slip_force": Measured(20.0, 10.0),
        }
        baseline = Baseline(sliding=SlidingFriction(400.0, 10.0, 1e-3), numbers=numbers)
        found = held_finding(
            held_numbers(self.recording(0.009), VALVE), baseline, VALVE, FrictionLimits()
        )
        assert found.friction_ratio == pytest.approx(590.4 / 440.0, rel=1e-3)

    def test_the_monitor_forgets_it_with_the_next_record(self):
        monitor = FrictionMonitor(MonitorSettings(VALVE))
        monitor.baseline = Baseline(coulomb_friction=250.0, half_width=5.0, numbers=REACH)
        assert monitor.held is None
        buffer = RecordBuffer(VALVE, 60.0)
        still = self.recording(0.009)
        buffer.add_arrivals(rows_arrived(np.column_stack((self.TIME, still.drive, still.position))))
        with pytest.raises(RefusedRecordError, match="did not move") as refused:
            identify_snapshot(buffer.snapshot(), monitor.settings)
        monitor.learn(refused.value.numbers, 1)
        assert "static friction is at least 591 N, 2.32 times" in monitor.held.message
        monitor.learn({"drive_noise": Measured(1.0, 0.1)}, 2)
        assert monitor.held is None
