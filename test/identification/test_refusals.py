# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Records that are refused, each with what to do about it."""

from dataclasses import replace

import numpy as np
import pytest

from valve_friction_ros.identification import (
    METHODS,
    IdentificationSettings,
    RefusalError,
    Verdict,
    identify_bench,
    identify_plant,
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

SETTINGS = IdentificationSettings(assumed_mass=1.6)
NOISE = SensorNoise(10e-6, 100.0)
PERIOD = 1e-3


def recorded(command, parameters=HIGH_FRICTION, period=PERIOD):
    pressure = converter_response(np.asarray(command, dtype=float), period)
    position = simulate(BENCH_VALVE, parameters, pressure, period).position
    return Recording(period, pressure, position)


@pytest.fixture(scope="module")
def healthy():
    return recorded(SquareWave().sample(PERIOD * np.arange(26_000)))


def refused(recording, message, noise=NOISE):
    """Refuse it with the same words by both profiles."""
    for identify in (identify_bench, identify_plant):
        with pytest.raises(RefusalError, match=message):
            identify(noise.applied_to(recording), BENCH_VALVE, SETTINGS)


def test_the_healthy_record_passes(healthy):
    found = identify_bench(NOISE.applied_to(healthy), BENCH_VALVE, SETTINGS)
    assert found.values["coulomb_friction"] == pytest.approx(606.0, rel=0.01)


def answered(recording, truth):
    """Identify with the default; each number that it gives holds its truth."""
    result = identify_plant(recording, BENCH_VALVE, SETTINGS)
    sliding = truth["coulomb_friction"] + truth["viscous_friction"] * result.sliding_speed
    for name, true in {**truth, "sliding_friction": sliding}.items():
        one = result.parameters[name]
        if one.verdict is Verdict.NOT_IDENTIFIABLE:
            assert abs(true) <= one.magnitude_bound, name
        else:
            assert abs(one.value - true) <= one.half_width, name
    return result


TRUTH = {
    name: getattr(HIGH_FRICTION, name)
    for name in ("coulomb_friction", "viscous_friction", "spring_constant", "spring_preload")
}


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
    refused(still, r"stem (did not move|moved 0\.\d+ mm).*excite the valve over several percent")


def test_one_direction_only():
    record = recorded(np.linspace(70e3, 160e3, 26_000))
    refused(record, r"^the stem moved up only \(.* mm up, .* mm down\).*one stroke each way")


@pytest.mark.parametrize("rest", [20e3, 230e3], ids=["lower", "upper"])
def test_pressed_onto_a_stop(rest):
    """For more than half of the record; the motion between tells the friction."""
    phase = (PERIOD * np.arange(52_000) // 6.5).astype(int) % 3
    record = NOISE.applied_to(recorded(np.where(phase == 1, 120e3, rest)))
    sliding = answered(record, TRUTH).parameters["sliding_friction"]
    assert sliding.half_width < 0.1 * sliding.value


def test_sampling_too_slow():
    """A stem without a lag jumps from one level to the other between two samples."""
    slow = recorded(SquareWave(period=80.0).sample(1.0 * np.arange(600)), period=1.0)
    refused(slow, r"^sampling is too slow for the motion: .* apart; sample faster")


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
        with pytest.raises(ValueError, match="leave the diaphragm_area of the valve out"):
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


def test_position_counted_the_wrong_way(healthy):
    turned = Recording(PERIOD, healthy.pressure, 0.028575 - healthy.position)
    refused(turned, r"^the stem moves against the pressure: invert the position")


def test_a_record_that_is_too_short(healthy):
    short = Recording(PERIOD, healthy.pressure[:30], healthy.position[:30])
    with pytest.raises(RefusalError):
        identify_bench(short, BENCH_VALVE, SETTINGS)
