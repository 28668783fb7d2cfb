"""Verdicts of a refined model: each reason to doubt it, one at a time."""

import math
from dataclasses import replace

import numpy as np
import pytest
from problems import FREE, perfect_problem, true_coordinates

from valve_friction_ros.identification import IdentificationSettings, Verdict
from valve_friction_ros.identification.refined.output_error import SLIP
from valve_friction_ros.identification.refined.refinement import refine
from valve_friction_ros.identification.refined.verdicts import refinement_verdicts
from valve_friction_ros.identification.trust.limits import FALL_SPEED, FEWEST_STROKES
from valve_friction_ros.identification.trust.misfit import Misfit
from valve_friction_ros.identification.trust.uncertainty import worst_case
from valve_friction_ros.model import (
    BENCH_VALVE,
    HIGH_FRICTION,
    Recording,
    SquareWave,
    TriangleWave,
    converter_response,
    simulate,
)

FRICTION = ("viscous_friction", "coulomb_friction")
SPRING = ("spring_constant", "spring_preload")
GOOD = Misfit(fit=1.0, rms=1e-6, systematic=1e-6, tolerated=4e-6)
BAD = Misfit(fit=0.9, rms=9e-5, systematic=9e-5, tolerated=4e-6)


@pytest.fixture(scope="module")
def refined(bench_trajectory):
    """Function of excitation, duration and noise (m): a refinement of the high-friction valve."""

    def run(excitation, duration, names=FREE, noise=0.0, **settings):
        pressure, motion = bench_trajectory("high", excitation, duration)
        scatter = noise * np.random.default_rng(0).standard_normal(pressure.size)
        recording = Recording(1e-3, pressure, motion.position + scatter)
        problem = perfect_problem(BENCH_VALVE, recording, **settings)
        return refine(problem, true_coordinates(HIGH_FRICTION, motion.position[0]), names)

    return run


@pytest.fixture(scope="module")
def square(refined):
    return refined(SquareWave(), 41.6)


def verdicts(refinement, misfit=GOOD, **settings):
    return refinement_verdicts(refinement, misfit, IdentificationSettings(**settings))


def test_no_doubt(square):
    found = verdicts(square)
    assert square.top_speed > FALL_SPEED
    for name in (*FRICTION, *SPRING):
        assert found[name].verdict is Verdict.IDENTIFIED
        # A clean record leaves no scatter: the narrowest interval that is ever shown.
        finest = 2e-4 if name == "spring_constant" else 5e-4
        assert found[name].half_width == pytest.approx(finest * found[name].value, rel=1e-6)


def test_static_friction_without_a_slip_jump(square):
    one = verdicts(square)["static_friction"]
    assert one.verdict is Verdict.NOT_IDENTIFIABLE
    assert np.isnan(one.value)
    assert one.reason == "no slip jump in the record: F_s cannot be separated from F_c"


def test_mass_that_is_not_seen(square):
    one = verdicts(square)["mass"]
    assert one.verdict is Verdict.NOT_IDENTIFIABLE
    assert one.reason == "inertia is too small a part of the force to measure; 1.75 kg is assumed"


def test_misfit_doubts_the_friction_and_widens_every_interval(square):
    found = verdicts(square, BAD)
    bound = worst_case(square.equation.curvature, square.simulated.size, BAD.excess)
    for name in FRICTION:
        assert found[name].verdict is not Verdict.IDENTIFIED
        assert found[name].reason == (
            "the Karnopp model does not describe this valve: 90 µm of misfit are not noise"
        )
    index = square.names.index("spring_constant")
    width = found["spring_constant"].half_width
    assert width == pytest.approx(np.sqrt(bound[index, index]), rel=0.01)


def test_slow_record_cannot_tell_how_far_the_friction_falls(refined):
    slow = refined(TriangleWave(), 120.0)
    assert slow.top_speed < FALL_SPEED
    found = verdicts(slow)
    for name in FRICTION:
        assert found[name].verdict is Verdict.WEAK
        assert found[name].reason == (
            f"valid up to {slow.top_speed * 1e3:.2g} mm/s, the top speed of the record: "
            "friction may fall further up to 6.5 mm/s; record faster strokes"
        )
    assert {found[name].verdict for name in SPRING} == {Verdict.IDENTIFIED}


def test_few_strokes_are_weak_whatever_else(refined):
    short = refined(SquareWave(), 15.0)  # up and down
    found = verdicts(short, BAD)
    for name in (*FRICTION, *SPRING):
        assert found[name].verdict is not Verdict.IDENTIFIED
        assert found[name].reason == (
            f"only 2 strokes: record at least {FEWEST_STROKES}, up and down"
        )


def test_fixed_parameters(refined):
    names = tuple(name for name in FREE if name != "viscous_friction")
    fixed = {"viscous_friction": 4.48e4, "mass": 1.75, "static_friction": 606.0}
    found = verdicts(refined(SquareWave(), 41.6, names, static_friction=606.0), fixed=fixed)
    for name, value in fixed.items():
        assert (found[name].verdict, found[name].value) == (Verdict.FIXED, value)
        assert found[name].half_width == 0.0
    assert found["coulomb_friction"].verdict is Verdict.IDENTIFIED


def test_preload_from_the_bias_has_the_spring_s_interval(refined):
    bias = 1.13e-3
    names = tuple(name for name in FREE if name != "spring_preload")
    refinement = refined(SquareWave(), 41.6, names, 3e-4, position_bias=bias)
    found = verdicts(refinement, position_bias=bias)
    spring, preload = found["spring_constant"], found["spring_preload"]
    assert preload.value == pytest.approx(bias * spring.value, rel=1e-12)
    assert preload.standard_error == pytest.approx(bias * spring.standard_error, rel=1e-12)
    assert preload.half_width == pytest.approx(bias * spring.half_width, rel=1e-12)


def test_static_friction_adds_slip_and_coulomb_friction(bench_trajectory, benches):
    """Var(F_c + slip) takes their covariance along."""
    pressure, motion = bench_trajectory("graphite", SquareWave(), 41.6)
    valve, parameters = benches["graphite"]
    noise = 30e-6 * np.random.default_rng(0).standard_normal(pressure.size)
    recording = Recording(1e-3, pressure, motion.position + noise)
    problem = perfect_problem(valve, recording)
    refinement = refine(problem, true_coordinates(parameters, motion.position[0]), (*FREE, SLIP))
    found = verdicts(refinement)
    from valve_friction_ros.identification.trust.uncertainty import block_covariance, stroke_length

    covariance = block_covariance(refinement.equation, stroke_length(refinement.simulated)).matrix
    a, b = refinement.names.index("coulomb_friction"), refinement.names.index(SLIP)
    expected = covariance[a, a] + covariance[b, b] + 2 * covariance[a, b]
    one = found["static_friction"]
    assert one.standard_error == pytest.approx(np.sqrt(expected), rel=1e-9)
    assert one.value == pytest.approx(parameters.static_friction, rel=0.01)


def test_an_assumed_mass_widens_what_it_moves():
    """An error anywhere within the mass's own size: rectangular, so of deviation size/√3.

    A 100 kg stem, refined once more with the mass one percent off to either side: the
    coordinates move by a hundredth of what the whole mass does to them.
    """
    heavy = replace(HIGH_FRICTION, mass=100.0)
    pressure = converter_response(SquareWave().sample(5e-3 * np.arange(8321)), 5e-3)
    position = simulate(BENCH_VALVE, heavy, pressure, 5e-3).position
    problem = perfect_problem(BENCH_VALVE, Recording(5e-3, pressure, position))
    truth = true_coordinates(heavy, position[0])
    light, more = (refine(problem, {**truth, "mass": mass}, FREE) for mass in (99.0, 101.0))
    refinement = refine(problem, truth, FREE)
    found, known = verdicts(refinement), verdicts(refinement, fixed={"mass": 100.0})
    for name in (*FRICTION, *SPRING):
        moved = 50 * abs(more.coordinates[name] - light.coordinates[name])
        assert found[name].half_width == pytest.approx(1.959964 / math.sqrt(3) * moved, rel=0.02)
        assert known[name].half_width < 0.7 * found[name].half_width
    free = refine(problem, truth, (*FREE, "mass"))
    assert (
        verdicts(free)["coulomb_friction"].half_width < 0.7 * found["coulomb_friction"].half_width
    )
