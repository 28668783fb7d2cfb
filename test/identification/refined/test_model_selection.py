"""Extensions of the model: found where they are, and not demanded where they are not."""

from dataclasses import replace

import numpy as np
import pytest

from benchmark.cases import Case
from valve_friction_ros.identification import (
    PARAMETER_UNITS,
    UNITS,
    IdentificationSettings,
    Verdict,
    identify_refined,
)
from valve_friction_ros.model import (
    BENCH_VALVE,
    HIGH_FRICTION,
    Recording,
    SensorNoise,
    SineWave,
    SquareWave,
    converter_response,
    simulate,
)

SETTINGS = IdentificationSettings(assumed_mass=1.6)
NOISE = SensorNoise(28.6e-6, 165.0)


def extras(result):
    return result.parameters.keys() - UNITS.keys() - {"sliding_friction"}


def high_record(parameters=HIGH_FRICTION, seed=0, late=0.0):
    """52 s of square wave; the stem's stamps lag behind by `late` seconds."""
    time = 1e-3 * np.arange(-5000, 52_000)
    command = SquareWave().sample(np.maximum(time, 0.0))
    pressure = converter_response(command, 1e-3)
    position = simulate(BENCH_VALVE, parameters, pressure, 1e-3).position
    lag = round(1000 * late)
    kept = slice(5000, -2000 if lag < 0 else None)
    here = np.arange(time.size)[kept]
    clean = Recording(1e-3, pressure[here], position[here - lag])
    return replace(NOISE, seed=seed).applied_to(clean)


def test_what_can_be_found_has_a_unit():
    assert PARAMETER_UNITS.keys() - UNITS.keys() == {
        "stribeck_velocity",
        "coulomb_asymmetry",
        "viscous_asymmetry",
        "clock_offset",
        "sliding_friction",
    }


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("plant", ["low", "high", "graphite"])
def test_plain_valves_demand_nothing(plant, seed):
    case = Case(plant, "square", "28.6 µm", "1 kHz")
    found = identify_refined(case.record(seed), case.plant.valve, SETTINGS)
    assert extras(found) == set()
    assert not found.warnings or "published" in found.warnings[0]
    slips = plant == "graphite"
    assert (found.parameters["static_friction"].verdict is Verdict.IDENTIFIED) is slips
    assert found.misfit.describes


@pytest.mark.slow
@pytest.mark.parametrize("noise", ["28.6 µm"])
def test_stribeck_fall_is_demanded_where_it_is(noise):
    case = Case("stribeck", "square", noise, "1 kHz")
    found = identify_refined(case.record(0), case.plant.valve, SETTINGS)
    truth = case.plant.parameters
    assert extras(found) == {"stribeck_velocity"}
    for name in ("stribeck_velocity", "coulomb_friction", "static_friction"):
        one = found.parameters[name]
        assert abs(one.value - getattr(truth, name)) <= 3 * one.half_width
        assert one.value == pytest.approx(getattr(truth, name), rel=0.05)
    assert found.misfit.describes


@pytest.mark.parametrize("asymmetry", [0.2, -0.15])
def test_viscous_asymmetry(asymmetry):
    """A sine shows it; of a square wave, F_c, F_0 and k explain it as well."""
    skew = replace(HIGH_FRICTION, viscous_asymmetry=asymmetry)
    time = 1e-3 * np.arange(71_000)
    pressure = converter_response(SineWave().sample(time), 1e-3)
    position = simulate(BENCH_VALVE, skew, pressure, 1e-3).position
    found = identify_refined(
        NOISE.applied_to(Recording(1e-3, pressure, position)), BENCH_VALVE, SETTINGS
    )
    assert extras(found) == {"viscous_asymmetry"}
    assert found.values["viscous_asymmetry"] == pytest.approx(asymmetry, abs=0.01)
    assert found.values["viscous_friction"] == pytest.approx(4.48e4, rel=0.05)


def test_coulomb_asymmetry_where_the_preload_is_known():
    skew = replace(HIGH_FRICTION, coulomb_asymmetry=0.1)
    settings = replace(SETTINGS, position_bias=1.13e-3)
    found = identify_refined(high_record(skew), BENCH_VALVE, settings)
    assert extras(found) == {"coulomb_asymmetry"}
    assert found.values["coulomb_asymmetry"] == pytest.approx(0.1, abs=0.005)


def test_coulomb_asymmetry_is_preload_where_that_is_free():
    """F_c·(1 ± a) with F_0 is F_c with F_0 + a·F_c."""
    skew = replace(HIGH_FRICTION, coulomb_asymmetry=0.1)
    found = identify_refined(high_record(skew), BENCH_VALVE, SETTINGS)
    assert extras(found) == set()
    expected = HIGH_FRICTION.spring_preload + 0.1 * HIGH_FRICTION.coulomb_friction
    assert found.values["spring_preload"] == pytest.approx(expected, rel=0.02)
    assert found.values["coulomb_friction"] == pytest.approx(606.0, rel=0.01)


@pytest.mark.parametrize("late", [0.05, -0.05, 1.0])
def test_clock_offset_is_found_and_reported(late):
    found = identify_refined(high_record(late=late), BENCH_VALVE, SETTINGS)
    assert found.values["clock_offset"] == pytest.approx(late, abs=2e-3)
    side = "late" if late > 0 else "early"
    (warning,) = [one for one in found.warnings if "stamps" in one]
    assert f"ms {side} against those of the pressure" in warning
    assert found.values["coulomb_friction"] == pytest.approx(606.0, rel=0.01)


def test_stem_a_second_early_is_told_though_not_measured():
    """The search ends 0.19 s short of it, with a misfit: nothing may be called identified."""
    found = identify_refined(high_record(late=-1.0), BENCH_VALVE, SETTINGS)
    assert any("early against those of the pressure" in one for one in found.warnings)
    assert not found.misfit.describes
    assert found.parameters["coulomb_friction"].verdict is not Verdict.IDENTIFIED
