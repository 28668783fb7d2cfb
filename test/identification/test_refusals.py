# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Records that are refused, each with what to do about it, and each limit from both sides."""

import math
from dataclasses import replace

import numpy as np
import pytest
from records import TIGHT, assert_held

from valve_friction_ros.identification import (
    METHODS,
    IdentificationSettings,
    RefusalError,
    identify_bench,
    identify_plant,
)
from valve_friction_ros.identification.refusal import LittleMotionError
from valve_friction_ros.identification.trust.excitation import (
    _followed,
    require_enough_samples,
    require_motion,
    require_related_signals,
    require_travel,
    require_two_directions,
    require_unbroken,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    HIGH_FRICTION,
    Drive,
    Recording,
    SensorNoise,
    SquareWave,
    Valve,
    converter_response,
    simulate,
)
from valve_friction_ros.model.recording import StampedRecord, StampedSignal
from valve_friction_ros.signals import measured, position_noise

SETTINGS = IdentificationSettings(assumed_mass=1.6)
SENSORS = SensorNoise(10e-6, 100.0)
PERIOD = 1e-3


def recorded(command, parameters=HIGH_FRICTION, period=PERIOD):
    pressure = converter_response(np.asarray(command, dtype=float), period)
    position = simulate(BENCH_VALVE, parameters, pressure, period).position
    return Recording(period, pressure, position)


@pytest.fixture(scope="module")
def healthy():
    return recorded(SquareWave().sample(PERIOD * np.arange(26_000)))


def refused(recording, message, noise=SENSORS):
    """Refuse it with the same words by both profiles."""
    for identify in (identify_bench, identify_plant):
        with pytest.raises(RefusalError, match=message):
            identify(noise.applied_to(recording), BENCH_VALVE, SETTINGS)


def answered(recording, truth):
    """Identify with the default; each number that it gives holds its truth."""
    result = identify_plant(recording, BENCH_VALVE, SETTINGS)
    sliding = truth["coulomb_friction"] + truth["viscous_friction"] * result.sliding_speed
    assert_held(result.parameters, {**truth, "sliding_friction": sliding})
    return result


def test_little_travel(healthy):
    """0.2 mm of 28.6 mm, which is the whole travel of a spring and a dashpot 83 times as stiff."""
    share, start = 0.012, 0.01
    record = SensorNoise(1e-6, 100.0).applied_to(
        Recording(PERIOD, healthy.pressure, start + share * healthy.position)
    )
    spring = HIGH_FRICTION.spring_constant / share
    truth = {
        "coulomb_friction": HIGH_FRICTION.coulomb_friction,
        "viscous_friction": HIGH_FRICTION.viscous_friction / share,
        "spring_constant": spring,
        "spring_preload": HIGH_FRICTION.spring_preload - spring * start,
    }
    assert answered(record, truth).parameters["sliding_friction"].half_width < 100.0


def test_a_stem_that_does_not_move(healthy):
    still = Recording(PERIOD, healthy.pressure, np.full(len(healthy), 0.01))
    refused(still, r"stem (did not move|moved 0\.\d+ mm).*move the valve over several percent")


def test_one_direction_only():
    record = recorded(np.linspace(70e3, 160e3, 26_000))
    refused(record, r"^the stem moved only up \(.* mm up, .* mm down\).*stroke in each direction")


@pytest.mark.parametrize("rest", [20e3, 230e3], ids=["lower", "upper"])
def test_pressed_onto_a_stop(rest):
    """For more than half of the record; the motion between tells the friction."""
    phase = (PERIOD * np.arange(52_000) // 6.5).astype(int) % 3
    record = SENSORS.applied_to(recorded(np.where(phase == 1, 120e3, rest)))
    sliding = answered(record, TIGHT).parameters["sliding_friction"]
    assert sliding.half_width < 0.1 * sliding.value


def test_sampling_too_slow():
    """A stem without a lag jumps from one level to the other between two samples."""
    slow = recorded(SquareWave(period=80.0).sample(1.0 * np.arange(600)), period=1.0)
    refused(slow, r"^sampling is too slow for the motion: .* apart; sample faster")


def test_sampling_too_slow_because_only_changes_are_sent():
    """It advised to sample faster a source that sends each change."""
    time = np.cumsum(1.0 + np.random.default_rng(2).exponential(12.0, 80))
    up = np.arange(80) % 2
    signals = [
        StampedSignal(time, low + up * (high - low)) for low, high in ((7e4, 16e4), (5e-3, 2e-2))
    ]
    grid = np.arange(time[0], time[-1], 10.0)
    values = [np.interp(grid, one.time, one.value) for one in signals]
    record = Recording(10.0, *values, stamped=StampedRecord(*signals))
    slow = "^the stem jumps from sample to sample, .*: export it without compression, sample faster"
    with pytest.raises(RefusalError, match=slow):
        identify_plant(record, BENCH_VALVE, SETTINGS)


def test_pressure_of_a_dead_sensor(healthy):
    still = Recording(PERIOD, np.full(len(healthy), 1e5), healthy.position)
    refused(still, "^the pressure did not change.*check the pressure sensor", SensorNoise(10e-6))
    refused(still, r"^pressure and stem do not move together .*: check that both signals belong to")


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["drift", "walk", "other"])
def test_pressure_of_another_valve_or_of_none(healthy, kind, seed):
    """Whatever it does, no number is made of it."""
    generator = np.random.default_rng(seed)
    size = len(healthy)
    pressure = (
        1e5
        + {
            "drift": 50.0 * generator.standard_normal(size) + np.linspace(0.0, 2e3, size),
            "walk": np.cumsum(20.0 * generator.standard_normal(size)),
            "other": np.repeat(generator.uniform(-5e4, 8e4, size // 2000), 2000)[:size],
        }[kind]
    )
    record = SensorNoise(10e-6, 100.0).applied_to(Recording(PERIOD, pressure, healthy.position))
    with pytest.raises(RefusalError):
        identify_plant(record, BENCH_VALVE, SETTINGS)


def test_a_force_is_named_a_force(healthy):
    rest = Recording(PERIOD, np.full(26_000, 700.0), healthy.position, driven_by=Drive.FORCE)
    with pytest.raises(RefusalError, match=r"^the drive force did not change"):
        identify_bench(rest, Valve(travel=BENCH_VALVE.travel), SETTINGS)


@pytest.mark.parametrize("method", METHODS)
def test_a_force_on_a_diaphragm(healthy, method):
    """The valve of a force has no diaphragm, and that of a pressure has one."""
    force = replace(healthy, driven_by=Drive.FORCE)
    for recording, valve in ((force, BENCH_VALVE), (healthy, Valve(travel=BENCH_VALVE.travel))):
        with pytest.raises(ValueError, match="omit diaphragm_area"):
            METHODS[method](recording, valve)


def test_signals_that_are_swapped():
    """Pressure in place of metres is far outside the travel."""
    record = recorded(SquareWave().sample(PERIOD * np.arange(26_000)))
    swapped = Recording(PERIOD, record.position, record.pressure)
    refused(
        swapped,
        r"^the stem position runs from .*: check that the signals are not swapped, .* unit \(m\)",
    )


def test_the_wrong_valve():
    """A stem that moves to the tune of another valve's pressure."""
    here = recorded(SquareWave().sample(PERIOD * np.arange(52_000)))
    there = recorded(SquareWave(period=7.3).sample(PERIOD * np.arange(52_000)))
    mixed = Recording(PERIOD, there.pressure, here.position)
    refused(
        mixed,
        r"^pressure and stem do not move together \(.* 0 % of the pressure.*to this valve",
    )


def test_a_pressure_that_is_too_slow_for_the_moves():
    """One value a minute, at random: as if it belonged to another valve."""
    time = np.arange(6000) / 2.0
    pressure = np.random.default_rng(4).uniform(6e4, 2e5, 51)
    minutes = StampedSignal(60.0 * np.arange(51), pressure)
    stem = StampedSignal(time, 0.014 + 0.01 * np.sin(time / 3.0))
    record = Recording(
        0.5,
        np.interp(time, minutes.time, pressure),
        stem.value,
        stamped=StampedRecord(minutes, stem),
    )
    message = r"^pressure and .* it; a pressure every 60 s does not show shorter moves$"
    with pytest.raises(RefusalError, match=message):
        identify_plant(record, BENCH_VALVE, SETTINGS)


def test_position_counted_the_wrong_way(healthy):
    turned = Recording(PERIOD, healthy.pressure, 0.028575 - healthy.position)
    refused(turned, r"^the stem moves against the pressure: invert the position")


VALVE = Valve(0.0445, travel=0.02)
OPEN_ENDED = Valve(0.0445)


def record(position, pressure=None, period=0.1):
    position = np.asarray(position, dtype=float)
    return Recording(period, np.zeros(position.size) if pressure is None else pressure, position)


def refusal(requirement, *arguments):
    with pytest.raises(RefusalError) as caught:
        requirement(*arguments)
    return str(caught.value)


def triangle(up, down):
    """A noiseless stem that moves `up`, then `down`, at one speed."""
    turn = round(1000 * up / (up + down))
    return np.concatenate([np.linspace(0, up, turn), np.linspace(up, up - down, 1000 - turn)])


def test_ten_windows_are_enough():
    require_enough_samples(record(np.zeros(30)), 3)
    assert refusal(require_enough_samples, record(np.zeros(29)), 3) == (
        f"the record is too short: 29 samples ({record(np.zeros(29)).duration:.3g} s), "
        "at least 30 are needed; record longer or sample faster"
    )


def test_a_gap_is_refused_in_its_own_words():
    require_unbroken(record([0.0, 1e-3]))
    broken = Recording(0.1, [0.0, 0.0], [0.0, 1e-3], gap="gap of 2 s: use another record")
    assert refusal(require_unbroken, measured(broken)) == "gap of 2 s: use another record"


@pytest.mark.parametrize(("share", "moves"), [(1.01, True), (0.99, False)])
def test_motion_is_ten_times_the_noise(share, moves):
    """White noise on a ramp whose ends are told apart by 10 deviations, more or less."""
    noise = np.random.default_rng(0).uniform(-1e-5, 1e-5, 400)
    noise[[0, -1]] = 1e-5 * np.array([-1, 1])

    def ramp(rise):
        return noise + np.linspace(0, rise, 400)

    # The ramp does not touch the second differences, so the noise is the same for any of them.
    span = 10 * position_noise(noise) * share
    position = ramp(span - 2e-5)
    assert np.ptp(position) == pytest.approx(span, rel=1e-9)
    if moves:
        require_motion(record(position))
    else:
        assert refusal(require_motion, record(position)).startswith(
            f"the stem did not move: its position spans {span * 1e6:.3g} µm with "
            f"{position_noise(noise) * 1e6:.3g} µm of noise; "
        )


def test_a_stem_that_jumps_between_samples_did_move():
    """A stem that swings over half of its travel in the time of a few samples is no stem at rest.

    That is no lack of motion, which would be no fault of a valve.
    """
    swinging = record(0.01 * np.sin(2.3 * np.arange(400)))
    with pytest.raises(RefusalError, match="jumps from sample to sample") as caught:
        require_motion(swinging, 0.04)
    assert not isinstance(caught.value, LittleMotionError)
    assert "did not move" in refusal(require_motion, swinging, 4.0)


def test_a_loop_that_hunts_in_the_time_of_the_average_moves_both_ways():
    """31 samples at 10 Hz are a whole period of it, in which all averages are alike."""
    require_two_directions(record(0.01 * np.sin(2 * np.pi * np.arange(620) / 31)), 31, 0.04)


@pytest.mark.parametrize("window", [1, 10])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_fiftieth_of_the_way_goes_back(window, sign):
    """Averages over the window make each way a window's step shorter at most."""
    require_two_directions(record(sign * triangle(0.97, 0.03)), window)
    text = refusal(require_two_directions, record(sign * triangle(0.985, 0.015)), window)
    assert text.startswith(f"the stem moved only {'up' if sign > 0 else 'down'} (")


def test_a_way_back_that_may_be_elastic_is_none():
    """A fourteenth of the way goes back: 0.3 % of the travel of 1 m are 3 mm, of 10 m 30 mm."""
    there_and_back = record(triangle(0.28, 0.02))
    require_two_directions(there_and_back, 1, 1.0)
    assert "down)" in refusal(require_two_directions, there_and_back, 1, 10.0)
    require_two_directions(there_and_back, 1, math.inf)


def test_turns_within_the_noise_are_none():
    """A rising stem with white noise: averages over 25 samples keep a fifth of it."""
    noise = 1e-3 * np.random.default_rng(1).standard_normal(5000)
    text = refusal(require_two_directions, record(noise + np.linspace(0, 0.05, 5000)), 25)
    assert "0 mm down" in text
    # Turns of 5 mm, far beyond 10 · 1 mm/√25, count however noisy the stem is.
    turns = np.repeat([0.0, 5e-3] * 20, 125) + np.linspace(0, 0.2, 5000)
    require_two_directions(record(noise + turns), 25)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("noise", [2e-6, 2e-5, 6e-5])
def test_the_noise_of_an_interpolated_record_is_no_way_back(noise, seed):
    """A stem that opens in half an hour, scanned every 2 s and exported once a second."""
    generator = np.random.default_rng(seed)
    scans = np.arange(0.37, 2200.0, 2.0)
    stem = np.interp(scans, [250.0, 2100.0], [0.0, 0.016])
    stem = stem + noise * generator.standard_normal(scans.size)
    exported = record(np.interp(np.arange(1.0, 2190.0), scans, stem), period=1.0)
    text = refusal(require_two_directions, exported, 31, 0.032)
    assert text.startswith("the stem moved only up (1")


def test_a_stem_that_yields_both_ways_did_not_slide():
    assert refusal(require_two_directions, record(triangle(1e-4, 1e-4)), 1, 0.04) == (
        "the stem moved over 0.1 mm only, no more than a packing may yield before it slides: move "
        "the valve over several percent of its travel"
    )


@pytest.mark.parametrize(
    ("lowest", "highest", "passes"),
    [
        (-0.001, 0.021, True),
        (0.0, 0.0002, True),
        (-0.00101, 0.0105, False),
        (0.01, 0.02101, False),
        (0.01, 0.01021, True),
        (0.01, 0.01019, False),
    ],
)
def test_the_stem_stays_within_a_twentieth_and_moves_a_hundredth(lowest, highest, passes):
    stem = record([lowest, highest])
    require_travel(stem, OPEN_ENDED)
    if passes:
        require_travel(stem, VALVE)
    else:
        refusal(require_travel, stem, VALVE)


def test_what_is_said_of_the_travel():
    assert refusal(require_travel, record([0.01, 0.0100999]), VALVE) == (
        "too little travel: the stem moved 0.0999 mm, 0.5 % of its travel; move it over several "
        "percent of the travel"
    )
    assert "moved 0.19 mm, 0.95 % of" in refusal(require_travel, record([0, 1.9e-4]), VALVE)


def strokes(scatter=0.0, slope=2e6, friction=1e4):
    """Pressure = slope · position ± friction, sampled like its blocks; scatter on the pressure."""
    position = 0.01 + 0.005 * np.sin(np.linspace(0, 6 * np.pi, 301))
    middle = 0.5 * (position[1:] + position[:-1])
    pressure = slope * position + friction * np.sign(np.gradient(position))
    noise = np.random.default_rng(0).standard_normal(position.size)
    assert middle.size == 300
    return record(position, pressure + scatter * noise)


@pytest.mark.parametrize(("share", "counts"), [(0.045, False), (0.055, True)])
def test_a_twentieth_of_the_top_speed_is_motion(share, counts):
    """A creep in which the pressure does anything."""
    clean = strokes(friction=0.0)
    creep = share * np.abs(np.diff(clean.position)).max() * np.arange(1, 101)
    found = _followed(
        record(
            np.concatenate([clean.position, clean.position[-1] + creep]),
            np.concatenate([clean.pressure, 1e5 * np.random.default_rng(1).random(100)]),
        )
    )
    assert (found[:2] != pytest.approx(_followed(clean)[:2], rel=1e-9)) is counts


def strokes_explaining(share):
    """Strokes with as much scatter as leaves this share of the pressure explained."""
    scatter = 1e4
    for _ in range(40):  # more scatter explains less
        found = _followed(strokes(scatter))[1]
        scatter *= np.sqrt(found / share)
    assert found == pytest.approx(share, abs=0.005)
    return strokes(scatter)


def test_a_tenth_of_the_pressure_must_be_explained():
    require_related_signals(strokes_explaining(0.12))
    text = refusal(require_related_signals, strokes_explaining(0.08))
    assert "direction of the moving stem explain 8 % of the pressure" in text


def turned_over(upright):
    """The same with a position that grows the other way."""
    return record(0.02 - upright.position, upright.pressure)


def test_no_position_is_inverted_whose_loop_dissipates():
    """Of a hunting loop with slip jumps the slope may have either sign."""
    require_related_signals(strokes(slope=-2e6))


@pytest.mark.parametrize("frequency", [1.0, 6.05, 8.3])
def test_a_mass_that_swings_against_the_pressure_dissipates(frequency):
    """Its inertia reverses the pressure; above 5 Hz averages over 0.1 s see a wrong loop."""
    angle = 2.0 * math.pi * frequency * 1e-3 * np.arange(20_000)
    swinging = record(0.01 + 0.01 * np.sin(angle), 1e4 - 4e4 * np.sin(angle - 0.2), period=1e-3)
    assert _followed(swinging).dissipates
    assert not _followed(turned_over(swinging)).dissipates


def test_where_less_than_half_is_explained_the_sign_is_chance():
    require_related_signals(turned_over(strokes_explaining(0.48)))
    turned = turned_over(strokes_explaining(0.52))
    assert "moves against the pressure" in refusal(require_related_signals, turned)


def test_the_jumps_of_a_stem_that_sticks_are_no_slow_sampling():
    """A third of the range between two samples upward; the way down is slow."""
    position = np.concatenate([np.linspace(0, 0.01, 4), np.linspace(0.01, 0, 101)[1:]])
    position = np.concatenate([position, np.linspace(0, 0.004, 50)])
    require_related_signals(record(position, 1e6 * position + 1e4, period=2.0))


@pytest.mark.parametrize(("samples", "share"), [(11, None), (9, 11), (3, 33)])
def test_a_stroke_has_ten_samples(samples, share):
    stroke = np.linspace(0, 0.01, samples + 1)
    position = np.concatenate([*[stroke, stroke[::-1]] * 5, np.zeros(50)])
    stem = record(position, 1e6 * position + 1e4, period=2.0)
    if share is None:
        require_related_signals(stem)
    else:
        assert refusal(require_related_signals, stem) == (
            f"sampling is too slow for the motion: the stem moves {share} % of its range between "
            "two samples, 2 s apart; sample faster, or check the stem sensor for a glitch"
        )


def test_a_stroke_of_few_stored_values_is_compressed():
    steps = np.repeat(np.linspace(0, 0.01, 5), 20)
    position = np.concatenate([steps, steps[::-1]] * 3)
    text = refusal(require_related_signals, record(position, 1e6 * position + 1e4, period=1.0))
    assert text.endswith(
        "25 % of its range between two samples, 1 s apart; export it without compression, sample "
        "faster, or check the stem sensor for a glitch"
    )
