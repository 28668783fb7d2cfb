"""The band of pressures: exact at its ends, and kept by every stem."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION, KarnoppParameters, Valve, simulate
from valve_friction_ros.planning import Limits, known_friction, unknown_friction
from valve_friction_ros.planning.pressure_band import (
    PressureBand,
    frictionless_reach,
    pressure_band,
    stroke,
)
from valve_friction_ros.planning.stroke_test import SHAPES, Pattern, stroke_test

SPRING = (2.05e5, 231.65)


def frictions(coulomb=606.0, factor=2.0, **others):
    return known_friction(coulomb, SPRING, 1.6, factor=factor, **others)


def test_the_smallest_friction_rests_at_the_ends_of_its_part():
    limits = Limits(0.3, 0.7, speed=5e-3)
    band = pressure_band(BENCH_VALVE, frictions(), limits)
    constant, preload = SPRING
    for share, pressure, side in ((0.3, band.low, -1), (0.7, band.high, 1)):
        force = BENCH_VALVE.actuator_force(pressure)
        rest = constant * share * BENCH_VALVE.travel + preload
        assert force == pytest.approx(rest + side * 303.0, rel=1e-12)
    assert band.rate * BENCH_VALVE.diaphragm_area / constant == pytest.approx(5e-3)


def test_a_stem_without_friction_keeps_clear_of_the_stops():
    for allowed in (False, True):
        limits = Limits(0.0, 1.0, allow_stops=allowed)
        band = pressure_band(BENCH_VALVE, frictions(), limits)
        low, high = frictionless_reach(BENCH_VALVE, frictions(), band)
        assert (low >= 0.0499 * BENCH_VALVE.travel) != allowed
        assert (high <= 0.9501 * BENCH_VALVE.travel) != allowed


def test_ranges_of_the_pressure_hold():
    narrow = replace(BENCH_VALVE, pressure_minimum=9e4)
    band = pressure_band(narrow, frictions(), Limits(pressure_maximum=1.5e5, pressure_rate=1e4))
    assert band == (9e4, 1.5e5, 1e4)


def test_a_stroke_is_that_of_the_simulated_stem():
    band = PressureBand(8e4, 1.4e5, 4e4)
    corners = [0, 5, 10, 15, 20, 25, 30]
    wave = np.interp(np.arange(3000) * 0.01, corners, [11e4, 8e4, 8e4, 14e4, 14e4, 8e4, 8e4])
    rests = simulate(BENCH_VALVE, HIGH_FRICTION, wave, 0.01).position[[999, 1999, 2999]]
    expected = stroke(BENCH_VALVE, HIGH_FRICTION, band)
    np.testing.assert_allclose(np.diff(rests), [expected, -expected], rtol=1e-6)
    assert stroke(BENCH_VALVE, HIGH_FRICTION, PressureBand(1e5, 1e5 + 1200 / 0.0445, 1e4)) == -1


@given(
    share=st.floats(0.002, 0.1),
    delay=st.floats(0.005, 0.5),
    slip=st.floats(1.0, 1.6),
    larger=st.floats(1.0, 2.0),
    shape=st.sampled_from(sorted(SHAPES)),
    part=st.tuples(st.floats(0.1, 0.4), st.floats(0.6, 0.9)),
)
def test_no_stem_of_the_range_leaves_its_part(share, delay, slip, larger, shape, part):
    coulomb = share * SPRING[0] * BENCH_VALVE.travel
    assumed = known_friction(
        coulomb,
        SPRING,
        1.6,
        static_friction=slip * coulomb,
        viscous_friction=delay * SPRING[0],
        factor=2.0,
    )
    limits = Limits(*part)
    try:
        band = pressure_band(BENCH_VALVE, assumed, limits)
    except RefusalError:
        return
    test = stroke_test(Pattern((shape,), (1.0,), 0.5), band, 60.0)
    if test is None:
        return
    pressure = test.excitation.sample(np.arange(0.0, test.duration, 0.01))
    least = assumed.draws[0]
    true = replace(
        least,
        coulomb_friction=least.coulomb_friction * larger,
        static_friction=least.static_friction * larger,
    )
    reach = simulate(BENCH_VALVE, true, pressure, 0.01).position / BENCH_VALVE.travel
    swing = 1e-3  # of a stem without much damping, where a ramp ends
    assert part[0] - swing <= reach.min() <= reach.max() <= part[1] + swing


def test_a_band_too_narrow_for_the_friction_is_refused_with_the_remedy():
    with pytest.raises(RefusalError) as refusal:
        pressure_band(BENCH_VALVE, frictions(factor=1.0), Limits(0.49, 0.51))
    message = str(refusal.value)
    assert "a reversal would not move the stem between 49 and 51 %" in message
    assert message.endswith("widen the part of the travel")
    assert "\n" not in message
    # Force to move: the spring's along 3 % of the travel and 2·F_c; there: 2 % and 2·F_c.
    travel = BENCH_VALVE.travel * SPRING[0]
    needed, given_ = ((1212 + part * travel) / 0.0445e3 for part in (0.03, 0.02))
    assert f"needs {needed:.4g} kPa" in message
    assert f"there are {given_:.4g}" in message


def test_a_narrow_range_of_the_pressure_is_named():
    with pytest.raises(RefusalError, match=r"or the range of the pressure$"):
        pressure_band(BENCH_VALVE, frictions(), Limits(pressure_maximum=9e4))


@pytest.mark.parametrize("reference", [0.0, 101325.0])
def test_no_converter_goes_below_the_atmosphere(reference):
    """A weak preload and a large friction would need suction."""
    valve = Valve(BENCH_VALVE.diaphragm_area, reference, BENCH_VALVE.travel)
    band = pressure_band(valve, frictions(factor=1.0), Limits(0.0, 0.8, allow_stops=True))
    assert band.low == reference
    assert band.high > reference + 5e4
    with pytest.raises(RefusalError, match="pressure limits leave no band"):
        pressure_band(valve, frictions(factor=1.0), Limits(pressure_maximum=reference))


def test_limits_that_leave_no_band_are_named():
    with pytest.raises(RefusalError, match=r"pressure limits leave no band: .* 300 kPa to 250 kPa"):
        pressure_band(BENCH_VALVE, frictions(), Limits(pressure_minimum=3e5))


def test_a_valve_needs_diaphragm_and_travel():
    for valve in (Valve(travel=0.03), Valve(0.0445)):
        with pytest.raises(ValueError, match="diaphragm_area and travel"):
            pressure_band(valve, frictions(), Limits())


def test_unknown_friction_spans_the_packings_of_the_bench():
    span = unknown_friction(BENCH_VALVE, SPRING, 1.6)
    coulomb = [one.coulomb_friction for one in span.draws]
    assert coulomb[0] < 152.7
    assert coulomb[-1] > 606.0
    assert all(isinstance(one, KarnoppParameters) for one in span.draws)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"lowest": 0.6, "highest": 0.4}, "must rise"),
        ({"highest": 1.2}, "must rise"),
        ({"speed": 0.0}, "speed"),
        ({"duration": -1.0}, "duration"),
        ({"pressure_rate": 0.0}, "pressure_rate"),
        ({"pressure_minimum": 2e5, "pressure_maximum": 1e5}, "pressure_minimum"),
    ],
)
def test_impossible_limits(changes, words):
    with pytest.raises(ValueError, match=words):
        Limits(**changes)


def test_impossible_frictions():
    with pytest.raises(ValueError, match="factor"):
        frictions(factor=0.5)
    with pytest.raises(ValueError, match="coulomb_friction"):
        frictions(coulomb=0.0)
    with pytest.raises(ValueError, match="one spring"):
        known_friction(100.0, (0.0, 0.0), 1.0)
