# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What any record shows of its valve, refused or not: noise, stops, and friction that holds it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from records import quick_record, simulated, stroked_record

from valve_friction_ros.health import (
    Baseline,
    FrictionLimits,
    FrictionMonitor,
    KnownNumbers,
    Level,
    MonitorSettings,
    RefusedRecordError,
    SlidingFriction,
    Standstill,
    StandstillCounter,
    identify_snapshot,
    standstill_finding,
    valve_numbers,
)
from valve_friction_ros.health.measured import Measured, valve_changes
from valve_friction_ros.health.standstill import held_finding, held_numbers
from valve_friction_ros.health.valve_numbers import numbers_of_refused, sensor_noises, stem_reach
from valve_friction_ros.identification import IdentificationSettings, RefusalError, identify
from valve_friction_ros.model import (
    BENCH_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    Recording,
    SensorNoise,
    SineWave,
    SquareWave,
    Valve,
    simulate,
)
from valve_friction_ros.model.recording import StampedRecord, StampedSignal
from valve_friction_ros.streams import RecordBuffer, Samples, rows_arrived

TRAVEL = BENCH_VALVE.travel
NOISES = {"drive_noise", "stem_noise"}
ENDS = {"lowest_position", "highest_position"}


def numbers(record, valve=BENCH_VALVE):
    return numbers_of_refused(record, valve, IdentificationSettings())


@pytest.fixture(scope="module")
def healthy():
    return Baseline(150.0, numbers=valve_numbers(identify(stroked_record(), BENCH_VALVE)))


def known_after(healthy, record):
    """What is known of the healthy valve after a refused record."""
    return KnownNumbers().followed_by(healthy.numbers, 0).followed_by(numbers(record), 1)


@pytest.mark.parametrize("share", [0.09, 0.12, 0.16])
def test_lost_travel(healthy, share):
    record = stroked_record(share * TRAVEL)
    with pytest.raises(RefusalError, match="no friction model reproduces"):
        identify(record, BENCH_VALVE)
    known = known_after(healthy, record)
    (finding,) = known.findings(healthy, BENCH_VALVE)
    assert "travel is lost at the lower end" in finding.message
    assert known.numbers["lower_stop"].value == pytest.approx(share * TRAVEL, abs=5e-5)
    assert "measured" not in finding.message


@pytest.mark.parametrize(("low", "high"), [(0.1, 0.75), (0.4, 0.6), (0.1, 1.15)])
def test_a_stem_that_turned_before_a_stop_shows_none_there(healthy, low, high):
    record = stroked_record(low=low, high=high)
    found = numbers(record)
    assert "lower_stop" not in found
    assert ("upper_stop" in found) == (high > 1)
    assert known_after(healthy, record).findings(healthy, BENCH_VALVE) == ()


def test_a_noise_that_has_grown(healthy):
    record = SensorNoise(1e-4, 50.0, 2).applied_to(stroked_record(0.16 * TRAVEL))
    _, noise = known_after(healthy, record).findings(healthy, BENCH_VALVE)
    assert "the noise of the stem position has grown" in noise.message


@pytest.mark.parametrize(
    ("change", "shown"),
    [
        (lambda one: one, NOISES | ENDS),
        (lambda one: replace(one, position=0.01 + 0 * one.position), NOISES),
        (lambda one: replace(one, position=0.02 - 0.5 * one.position), NOISES),
        (lambda one: replace(one, drive=8e4 + 0 * one.drive), NOISES),
        (lambda one: replace(one, position=1e3 * one.position), set()),
        (lambda one: replace(one, drive=1e3 * one.drive), set()),
        (lambda one: Recording(0.01, 1e6 * one.position, 1e-6 * one.drive), set()),
    ],
)
def test_signals_that_cannot_be_a_valves_show_nothing(change, shown):
    """Unchanged; still; inverted; a still drive; wrong units; swapped."""
    record = SensorNoise(5e-6, 50.0, 3).applied_to(quick_record())
    assert numbers(change(record)).keys() - {"lower_stop", "upper_stop"} == shown


@pytest.mark.parametrize(
    ("count", "message"),
    [(count, f"too short: {count} samples") for count in (2, 5, 29)]
    + [(count, "the stem moved only up") for count in (30, 31)],
)
def test_a_few_samples_of_a_moving_stem_are_too_few(count, message):
    """As after `clear`, while the stem moves: a refusal, not an error within what it shows."""
    record = quick_record()
    few = Recording(0.01, record.drive[200 : 200 + count], record.position[200 : 200 + count])
    assert numbers(few).keys() <= NOISES
    buffer = RecordBuffer(BENCH_VALVE, 60.0)
    times = 0.01 * np.arange(count)
    buffer.add_arrivals(rows_arrived(np.column_stack((times, few.drive, few.position))))
    with pytest.raises(RefusedRecordError, match=message):
        identify_snapshot(buffer.snapshot(), MonitorSettings(BENCH_VALVE))


def test_a_stem_that_is_seen_late_meets_no_stop():
    """A lag of 0.3 s lets the pressure rise while the stem seems to rest at its end."""
    record = stroked_record(low=0.1, high=0.75)
    late = Recording(0.01, record.drive[30:], record.position[:-30])
    assert stem_reach(late, BENCH_VALVE, math.nan).keys() == ENDS


def test_a_sticky_stem_meets_no_stop():
    """Its rests show how long it waits: F_s is three times F_c, and each level stops it anew."""
    sticky = replace(HIGH_FRICTION, static_friction=3 * HIGH_FRICTION.coulomb_friction)
    time = np.arange(6000) / 100
    levels = np.random.default_rng(5).uniform(0.15, 0.85, 16)
    pressure = 41_740.0 + 165_100.0 * np.interp(time, 4 * np.arange(16), levels)
    record = simulated(pressure, 0.01, sticky)
    assert stem_reach(record, BENCH_VALVE, math.nan).keys() == ENDS


STICKY = replace(HIGH_FRICTION, static_friction=2 * HIGH_FRICTION.coulomb_friction)
SLIP = STICKY.static_friction - STICKY.coulomb_friction
TIME = np.arange(3000) / 100


def strokes_between(low, high, seat=0.0, noise=0.0):
    """Three slow strokes between two pressures, kPa, on a stop that may have moved."""
    wave = SineWave(period=10.0).sample(TIME)
    share = (wave - wave.min()) / np.ptp(wave)
    pressure = 1e3 * (low + (high - low) * share)
    inner = replace(BENCH_VALVE, travel=TRAVEL - seat)
    moved = replace(STICKY, spring_preload=STICKY.spring_preload + STICKY.spring_constant * seat)
    position = simulate(inner, moved, pressure, 0.01).position + seat
    position = position + noise * np.random.default_rng(5).standard_normal(position.size)
    return Recording(0.01, pressure, position)


@pytest.mark.parametrize("known", [SLIP, math.nan])
@pytest.mark.parametrize("noise", [0.0, 40e-6])
def test_a_stem_that_turns_between_the_stops_meets_none(known, noise):
    found = stem_reach(strokes_between(70.0, 160.0, noise=noise), BENCH_VALVE, known)
    assert found.keys() == ENDS
    low, high = found["lowest_position"], found["highest_position"]
    assert 0.0 < low.value < high.value < TRAVEL


@pytest.mark.parametrize(
    ("known", "low", "high"), [(SLIP, -45.0, 300.0), (math.nan, -250.0, 500.0)]
)
@pytest.mark.parametrize("noise", [0.0, 40e-6])
@pytest.mark.parametrize("seat", [0.0, 2e-3])
def test_stops_are_found_where_they_are(known, low, high, noise, seat):
    """Without a known slip force, only those against which the stem is pressed by far more."""
    found = stem_reach(strokes_between(low, high, seat, noise), BENCH_VALVE, known)
    for name, place in (("lower_stop", seat), ("upper_stop", TRAVEL)):
        assert abs(found[name].value - place) <= found[name].half_width
        assert found[name].half_width < 0.01 * TRAVEL


def test_a_stem_that_waits_at_the_begin_may_have_come_from_either_side():
    """It stands at its upper end while the force grows from −F_s to F_s, and is then let down."""
    force = np.concatenate([np.linspace(-0.9, 0.9, 500), np.linspace(0.9, -4.0, 500)])
    valve = replace(BENCH_VALVE, diaphragm_area=1.0, pressure_reference=0.0)
    place = 0.02 + np.minimum(force + 1.0, 0.0) * (np.arange(1000) >= 500) * 1e-3
    found = stem_reach(Recording(0.01, 1e3 * force, place), valve, 100.0)
    assert "upper_stop" not in found


FORCE = np.interp(TIME, [0, 8, 12, 16, 20, 24, 30], [-600, 400, 400, -300, 300, -400, -600])
PLACE = np.interp(TIME, [0, 4, 8, 24, 30], [0.008, 0.008, 0.014, 0.014, 0.010])
UNIT = replace(BENCH_VALVE, diaphragm_area=1.0, pressure_reference=0.0)


@pytest.mark.parametrize("seed", range(4))
def test_a_force_that_falls_and_grows_while_the_stem_rests_proves_no_stop(seed):
    """Noise takes the stem across the limit of its end; that is no arrival with a small force."""
    noise = 40e-6 * np.random.default_rng(seed).standard_normal(TIME.size)
    assert stem_reach(Recording(0.01, FORCE, PLACE + noise), UNIT, 50.0).keys() == ENDS


@pytest.mark.parametrize("seed", range(4))
def test_the_last_bit_of_a_converter_proves_none_either(seed):
    """Stamps that jitter hide it from the samples on the grid: they lie between two codes."""
    random = np.random.default_rng(seed)
    own = TIME + 3e-3 * random.uniform(-1.0, 1.0, TIME.size)
    wander = np.convolve(random.standard_normal(TIME.size), np.full(100, 0.1), "same")
    seen = np.interp(own, TIME, PLACE) + 1e-5 * wander
    seen = 50e-6 * np.round(seen / 50e-6 + 0.5)
    stamped = StampedRecord(StampedSignal(TIME, FORCE), StampedSignal(own, seen))
    record = Recording(0.01, FORCE, np.interp(TIME, own, seen), stamped=stamped)
    assert stem_reach(record, UNIT, 50.0).keys() == ENDS


def waves(position_noise, pressure_noise, rate=200.0, period=8.0, seed=3, colour=0.0, stroke=1.0):
    draw = np.random.default_rng(seed)
    time = np.arange(round(60 * rate)) / rate
    wave = np.sin(2 * np.pi * time / period)
    white = draw.standard_normal((2, time.size))
    if colour:
        for step in range(1, time.size):
            white[:, step] = colour * white[:, step - 1] + white[:, step]
    return Recording(
        1 / rate,
        1e5 + 5e4 * stroke * wave + pressure_noise * white[0],
        0.015 + 0.01 * stroke * wave + position_noise * white[1],
    )


@pytest.mark.parametrize("rate", [50.0, 1000.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_white_noise_is_found_with_its_interval(rate, seed):
    found = sensor_noises(waves(1e-5, 100.0, rate, seed=seed))
    for name, true in (("stem_noise", 1e-5), ("drive_noise", 100.0)):
        assert abs(found[name].value - true) < max(2 * found[name].half_width, 0.03 * true)
        assert found[name].half_width < 0.1 * true


def test_what_depends_on_rate_or_motion_is_no_noise():
    """A signal that moves more from sample to sample; noise with a memory; a short record."""
    assert sensor_noises(waves(1e-5, 100.0, rate=5.0, period=2.0)) == {}
    assert sensor_noises(waves(1e-5, 100.0, colour=0.95)) == {}
    short = waves(1e-5, 100.0)
    assert sensor_noises(Recording(0.005, short.pressure[:150], short.position[:150])) == {}


def test_no_noise_is_found_below_the_resolution():
    found = sensor_noises(waves(0.0, 0.0, rate=1000.0))["stem_noise"]
    assert found.value == found.half_width == pytest.approx(0.5e-4 * 0.02, rel=0.01)


@pytest.mark.parametrize("strokes", [(0.2, 1.0), (1.0, 0.2)])
def test_one_noise_seen_over_unlike_strokes_has_not_grown(strokes):
    """The resolution grows with the stroke; here from below the noise to above it."""
    healthy, now = (
        sensor_noises(waves(0.7e-6, 100.0, stroke=stroke, seed=seed))
        for seed, stroke in enumerate(strokes)
    )
    ratio = valve_changes(now, healthy)["stem_noise"]
    assert ratio.holds(1.0)
    assert ratio.low < 2.0


def test_a_noise_above_a_former_resolution_has_surely_grown():
    healthy, now = sensor_noises(waves(0.0, 100.0)), sensor_noises(waves(2e-5, 100.0))
    ratio = valve_changes(now, healthy)["stem_noise"]
    assert 9.0 < ratio.low < 10.0
    assert ratio.high == math.inf


WAY = 0.02
ACTUATOR = Valve(diaphragm_area=0.05, pressure_reference=0.0, travel=WAY)
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


def test_the_range_is_that_of_the_means_of_blocks_after_which_the_stem_stood_still():
    """The fourth block has no later one that is complete; the first one begins the standstill."""
    noise = np.tile([500.0, -500.0], 3 * BLOCK - BLOCK // 2)
    pressures = blocks(1.0e5, 1.3e5, 0.9e5, 2.0e5, 3.0e5) + noise
    found = given(StandstillCounter(WAY), pressures, blocks(*5 * [0.01]))
    assert (found.lowest_pressure, found.highest_pressure) == (0.9e5, 1.3e5)
    assert (found.since, found.position) == (BEGIN * 10**9, pytest.approx(0.01))


def test_parts_of_any_size_say_the_same():
    pressures = np.random.default_rng(5).integers(100_000, 200_000, 100).astype(float)
    place = 2.0**-7  # its sums are exact
    whole = given(StandstillCounter(WAY), pressures, np.full(100, place))
    counter = StandstillCounter(WAY)
    for first in range(0, 100, 7):
        part = pressures[first : first + 7]
        given(counter, part, np.full(part.size, place), first)
    assert counter.standstill == whole


@pytest.mark.parametrize("place", [0.01011, 0.00989])
def test_a_stem_that_has_moved_begins_anew(place):
    """The pressure that has moved it does not count, and neither does what was before."""
    counter = StandstillCounter(WAY)
    assert given(counter, blocks(1e5, 2e5, 2e5, 2e5), blocks(*4 * [0.01])) is not None
    assert given(counter, blocks(9e5, 3e5), blocks(place, place), 4 * BLOCK) is None
    found = given(counter, blocks(2.0e5, 2.1e5, 1e5), blocks(*3 * [place]), 6 * BLOCK)
    assert (found.lowest_pressure, found.highest_pressure) == (2e5, 3e5)


def test_a_stem_that_swings_does_not_stand_still():
    swing = 0.01 + 0.0003 * np.tile([1.0, -1.0], 25)
    assert given(StandstillCounter(WAY), np.linspace(1e5, 2e5, 50), swing) is None


def test_a_pressure_without_positions_does_not_count():
    """A stem sensor that is silent says nothing of the stem."""
    counter = StandstillCounter(WAY)
    given(counter, blocks(*4 * [1e5]), blocks(*4 * [0.01]))
    stamps = (BEGIN + 40 + np.arange(100)) * 10**9
    counter.add(Samples(stamps, np.linspace(1e5, 9e5, 100)), Samples(stamps[:0], np.empty(0)))
    assert counter.standstill.highest_pressure == 1e5


def test_a_clock_that_is_set_back_begins_anew():
    counter = StandstillCounter(WAY)
    given(counter, blocks(1e5, 2e5, 1e5), blocks(0.01, 0.01, 0.01), 1000)
    assert given(counter, blocks(1e5), blocks(0.01), 0) is None


@pytest.mark.parametrize(("change", "is_found"), [(8.39e3, False), (8.41e3, True)])
def test_found_from_twice_the_baseline_on(change, is_found):
    """Twice 105 N, the upper end, just hold 420 N from end to end: 8.4 kPa on 0.05 m²."""
    still = Standstill(10**9, 0.01, 1e5, 1e5 + change)
    found = standstill_finding(still, ACTUATOR, HEALTHY, 2.0)
    assert (found is not None) is is_found


UNKNOWN_WAY = Baseline(coulomb_friction=100.0, half_width=5.0)


@pytest.mark.parametrize(
    ("place", "baseline"),
    [*((place, HEALTHY) for place in (0.0, 5e-4, 0.0175, 0.0195, -1e-3)), (0.01, UNKNOWN_WAY)],
)
def test_nothing_is_said_outside_the_way_of_the_baseline_or_near_its_ends(place, baseline):
    assert standstill_finding(Standstill(1, place, 0.0, 1e5), ACTUATOR, baseline, 2.0) is None


def test_static_friction_of_the_baseline_counts():
    sticky = Baseline(100.0, 5.0, numbers={**REACH, "static_friction": Measured(300.0, 20.0)})
    still = Standstill(1, 0.01, 1e5, 1.2e5)  # 500 N
    assert standstill_finding(still, ACTUATOR, sticky, 2.0) is None
    found = standstill_finding(still, ACTUATOR, HEALTHY, 2.0)
    assert found.friction_ratio == pytest.approx(500 / 105)
    assert (
        "from 10.0 mm since 1970-01-01 00:00 UTC although its pressure changed by 20 kPa"
    ) in str(found)


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
        numbers = held_numbers(self.recording(0.009), ACTUATOR)
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
        numbers = held_numbers(self.recording(0.009), ACTUATOR)
        found = held_finding(numbers, baseline, ACTUATOR, FrictionLimits())
        assert (found and found.level) == level
        if found:
            assert found.friction_ratio == pytest.approx(0.984 * 600.0 / healthy, rel=1e-3)

    @pytest.mark.parametrize("place", [0.0002, 0.0178, 0.0195])
    def test_at_an_end_the_stem_may_rest_on_a_stop(self, place):
        numbers = held_numbers(self.recording(place), ACTUATOR)
        assert held_finding(numbers, HEALTHY, ACTUATOR, FrictionLimits()) is None

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
        numbers = held_numbers(self.recording(place), ACTUATOR)
        numbers["held_position"] = Measured(place, 0.0)
        found = held_finding(numbers, baseline, ACTUATOR, FrictionLimits())
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
            held_numbers(self.recording(0.009), ACTUATOR), baseline, ACTUATOR, FrictionLimits()
        )
        assert found.friction_ratio == pytest.approx(590.4 / 440.0, rel=1e-3)

    def test_the_monitor_forgets_it_with_the_next_record(self):
        monitor = FrictionMonitor(MonitorSettings(ACTUATOR))
        monitor.baseline = Baseline(coulomb_friction=250.0, half_width=5.0, numbers=REACH)
        assert monitor.held is None
        buffer = RecordBuffer(ACTUATOR, 60.0)
        still = self.recording(0.009)
        buffer.add_arrivals(rows_arrived(np.column_stack((self.TIME, still.drive, still.position))))
        with pytest.raises(RefusedRecordError, match="did not move") as refused:
            identify_snapshot(buffer.snapshot(), monitor.settings)
        monitor.learn(refused.value.numbers, 1)
        assert "static friction is at least 591 N, 2.32 times" in monitor.held.message
        monitor.learn({"drive_noise": Measured(1.0, 0.1)}, 2)
        assert monitor.held is None
