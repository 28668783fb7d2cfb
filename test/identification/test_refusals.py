"""Records that are refused, each with what to do about it."""

from dataclasses import replace

import numpy as np
import pytest

from valve_friction_ros.identification import (
    METHODS,
    IdentificationSettings,
    RefusalError,
    identify_refined,
    identify_robust,
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
    """Both methods that the default chooses from refuse it alike."""
    for identify in (identify_refined, identify_robust):
        with pytest.raises(RefusalError, match=message):
            identify(noise.applied_to(recording), BENCH_VALVE, SETTINGS)


def test_the_healthy_record_passes(healthy):
    found = identify_refined(NOISE.applied_to(healthy), BENCH_VALVE, SETTINGS)
    assert found.values["coulomb_friction"] == pytest.approx(606.0, rel=0.01)


def test_too_little_travel():
    """0.2 mm of 28.6 mm."""
    record = recorded(SquareWave().sample(PERIOD * np.arange(26_000)))
    little = Recording(PERIOD, record.pressure, 0.01 + 0.012 * record.position)
    quiet = SensorNoise(1e-6, 100.0)
    refused(
        little, r"^too little travel: the stem moved .* mm, 0\.\d+ % of its travel; excite", quiet
    )


def test_a_stem_that_does_not_move(healthy):
    still = Recording(PERIOD, healthy.pressure, np.full(len(healthy), 0.01))
    refused(still, r"stem (did not move|moved 0\.\d+ mm).*excite the valve over several percent")


def test_one_direction_only():
    record = recorded(np.linspace(70e3, 160e3, 26_000))
    refused(record, r"^the stem moved up only \(.* mm up, .* mm down\).*one stroke each way")


@pytest.mark.parametrize(("level", "stop"), [(0.0, "lower"), (0.028575, "upper")])
def test_saturated_at_a_stop(healthy, level, stop):
    """Clipped so that the stem lies there for two thirds of the record."""
    middle = float(np.quantile(healthy.position, 2 / 3 if stop == "lower" else 1 / 3))
    clip = np.maximum if stop == "lower" else np.minimum
    position = clip(healthy.position - middle, 0.0) + level
    refused(
        Recording(PERIOD, healthy.pressure, position),
        rf"^the stem is at its {stop} stop for 6\d % of the record.*excite .* mid-travel",
    )


def test_sampling_too_slow():
    """A stem without a lag jumps from one level to the other between two samples."""
    slow = recorded(SquareWave(period=80.0).sample(1.0 * np.arange(600)), period=1.0)
    refused(slow, r"^sampling is too slow for the motion: .* apart; sample faster")


def test_pressure_of_a_dead_sensor(healthy):
    still = Recording(PERIOD, np.full(len(healthy), 1e5), healthy.position)
    refused(still, "^the pressure did not change.*check the pressure sensor", SensorNoise(10e-6))
    refused(still, r"^pressure and stem do not move together .*: check that both signals belong to")


def test_a_force_is_named_a_force(healthy):
    rest = Recording(PERIOD, np.full(26_000, 700.0), healthy.position, driven_by=Drive.FORCE)
    with pytest.raises(RefusalError, match=r"^the drive force did not change"):
        identify_refined(rest, Valve(travel=BENCH_VALVE.travel), SETTINGS)


@pytest.mark.parametrize("method", [name for name in METHODS if name != "refined"])
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
        identify_refined(short, BENCH_VALVE, SETTINGS)


def test_too_few_reversals_leave_nothing_identified():
    """One stroke up and one down: weak at best, and the reason says what to do."""
    found = identify_refined(
        NOISE.applied_to(recorded(SquareWave().sample(PERIOD * np.arange(15_600)))),
        BENCH_VALVE,
        replace(SETTINGS, fixed={"mass": 1.6}),
    )
    for name in ("coulomb_friction", "viscous_friction", "spring_constant"):
        one = found.parameters[name]
        assert one.verdict.value in ("weak", "not identifiable")
        assert one.reason.endswith("up and down")
