# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The valve signature and the paper's model 2, and the onset of motions, known beforehand."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from valve_friction_ros.identification import (
    IdentificationSettings,
    RefusalError,
    Verdict,
    identify_signature,
)
from valve_friction_ros.identification.signature.valve_signature import fit_onset, valve_signature
from valve_friction_ros.model import (
    BENCH_VALVE,
    IsaSteps,
    Recording,
    SensorNoise,
    SineWave,
    SquareWave,
    TriangleWave,
    converter_response,
    simulate,
)

PACKINGS = ["low", "high", "graphite"]
NOISES = [None, SensorNoise(28.6e-6, 165.0, seed=3)]
FIVE_STROKES = 150.0
WITH_INTERVAL = (
    "viscous_friction",
    "coulomb_friction",
    "static_friction",
    "spring_constant",
    "spring_preload",
)


@pytest.fixture(scope="module", params=PACKINGS)
def bench(request, benches):
    return request.param, benches[request.param]


@pytest.fixture(scope="module", params=NOISES, ids=["clean", "noisy"])
def signature(request, bench, bench_record):
    """Name, bench and signature of five strokes of the default triangle."""
    name, plant = bench
    record = bench_record(name, TriangleWave(), FIVE_STROKES, request.param)
    return name, plant, valve_signature(record, plant.valve)


def test_spring_constant_and_bias(signature):
    _, plant, found = signature
    truth = plant.parameters
    assert found.spring_constant == pytest.approx(truth.spring_constant, rel=2e-3)
    bias = truth.spring_preload / truth.spring_constant
    assert found.position_bias == pytest.approx(bias, abs=0.05e-3)
    assert found.standard_errors["spring_constant"] < 1e-3 * truth.spring_constant


def test_points_are_where_static_friction_gives_way(signature):
    """(11) and (12), with the true k and F_0."""
    _, plant, found = signature
    truth = plant.parameters
    assert (len(found.upward_points), len(found.downward_points)) == (3, 2)
    for side, points in ((1, found.upward_points), (-1, found.downward_points)):
        for point in points:
            assert point.force == plant.valve.actuator_force(np.array([point.drive]))[0]
            pull = point.force - truth.spring_constant * point.position - truth.spring_preload
            assert side * pull == pytest.approx(truth.static_friction, rel=0.03)


def test_dead_zone_is_twice_the_sliding_friction(signature):
    _, plant, found = signature
    truth = plant.parameters
    speed = np.mean([np.mean(np.abs(stroke.sliding.velocity)) for stroke in found.strokes])
    friction = truth.coulomb_friction + truth.viscous_friction * speed
    width = 2 * friction / plant.valve.diaphragm_area
    assert found.dead_zone == pytest.approx(width, rel=5e-3)
    assert 0 < found.dead_zone_share < 1


@pytest.mark.parametrize("noise", NOISES, ids=["clean", "noisy"])
def test_every_interval_holds_the_truth(bench, bench_record, noise):
    name, plant = bench
    record = bench_record(name, TriangleWave(), FIVE_STROKES, noise)
    found = identify_signature(record, plant.valve, IdentificationSettings(assumed_mass=1.6))
    for parameter in WITH_INTERVAL:
        low, high = found.parameters[parameter].interval
        assert low < getattr(plant.parameters, parameter) < high, parameter
    assert found.parameters["spring_constant"].verdict is Verdict.IDENTIFIED
    assert found.parameters["static_friction"].verdict is Verdict.IDENTIFIED
    friction = found.parameters["coulomb_friction"]
    if name == "high":  # no jump
        assert friction.value == found.values["static_friction"]
    assert friction.verdict is Verdict.WEAK  # 1.2 mm/s says nothing about faster
    assert friction.reason.startswith("valid at 1.2 mm/s")
    assert friction.half_width < 0.05 * friction.value
    mass = found.parameters["mass"]
    assert (mass.verdict, mass.reason[-17:]) == (Verdict.NOT_IDENTIFIABLE, "1.6 kg is assumed")
    assert found.model.mass == 1.6
    noise_level = noise.position if noise else 0.0
    assert found.rms == pytest.approx(noise_level, abs=15e-6)
    assert found.fit > 0.995
    assert (found.estimate, found.misfit) == (None, None)


class TestGiven:
    @pytest.fixture(scope="class")
    def record(self, bench_record):
        return bench_record("high", TriangleWave(), FIVE_STROKES)

    def test_values_stay(self, record):
        fixed = {"mass": 1.75, "spring_constant": 2e5, "coulomb_friction": 600.0}
        found = identify_signature(record, BENCH_VALVE, IdentificationSettings(fixed=fixed))
        for name, value in fixed.items():
            parameter = found.parameters[name]
            assert (parameter.verdict, parameter.value) == (Verdict.FIXED, value)

    def test_coulomb_friction_moves_the_viscous_one(self, record):
        """(19): 6.9 N less of F_c are 6.9 N more of F_v·ẋ."""
        free = identify_signature(record, BENCH_VALVE)
        less = free.values["coulomb_friction"] - 6.9
        settings = IdentificationSettings(fixed={"coulomb_friction": less})
        found = identify_signature(record, BENCH_VALVE, settings)
        strokes = free.signature.strokes
        inverse = np.mean([np.mean(1 / np.abs(one.sliding.velocity)) for one in strokes])
        more = found.values["viscous_friction"] - free.values["viscous_friction"]
        assert more == pytest.approx(6.9 * inverse, rel=1e-9)

    def test_no_spring(self, record):
        settings = IdentificationSettings(fixed={"spring_constant": 0.0})
        with pytest.raises(RefusalError, match="needs a spring: use the method plant or bench"):
            identify_signature(record, BENCH_VALVE, settings)


@pytest.mark.parametrize("noise", NOISES, ids=["clean", "noisy"])
class TestRefusals:
    @pytest.mark.parametrize(
        ("excitation", "duration"),
        [
            (SquareWave(), 52.0),
            (SineWave(), 106.5),
            (IsaSteps(), 370.0),
            (TriangleWave(period=10.4), 52.0),
        ],
        ids=["square", "sine", "isa", "fast triangle"],
    )
    def test_no_constant_speed(self, bench_record, excitation, duration, noise):
        record = bench_record("high", excitation, duration, noise)
        with pytest.raises(RefusalError) as refusal:
            identify_signature(record, BENCH_VALVE)
        message = str(refusal.value)
        assert "needs a stem that slides at a constant speed" in message
        assert "slow triangular pressure wave, such as a period of 60 s" in message

    @pytest.mark.parametrize(
        ("period", "duration", "cause"),
        [
            (200.0, 99.0, "the record has 1 up and 0 down"),
            (60.0, 59.0, "the record has 1 up and 1 down"),
        ],
        ids=["one way", "one period"],
    )
    def test_too_few_strokes(self, bench_record, period, duration, cause, noise):
        record = bench_record("high", TriangleWave(period=period), duration, noise)
        with pytest.raises(RefusalError, match=f"{cause}: drive the valve with a slow triangular"):
            identify_signature(record, BENCH_VALVE)

    def test_a_record_that_begins_in_a_stroke_is_served(self, bench_record, noise):
        """The first stroke has no breakaway, and takes no part."""
        whole = bench_record("high", TriangleWave(), FIVE_STROKES + 30.0, noise)
        late = Recording(whole.sample_period, whole.pressure[15_000:], whole.position[15_000:])
        found = identify_signature(late, BENCH_VALVE)
        assert found.signature.strokes[0].breakaway is None
        assert found.values["static_friction"] == pytest.approx(606.0, rel=0.02)


class TestContradictions:
    """Given values that the record belies."""

    @pytest.fixture(scope="class")
    def record(self, bench_record):
        return bench_record("high", TriangleWave(), FIVE_STROKES)

    @pytest.mark.parametrize(
        ("fixed", "cause"),
        [
            (
                {"spring_constant": 1500.0},
                "a negative static friction, -.* N: check",
            ),
            ({"spring_preload": 9000.0}, "does not reproduce the record"),
        ],
    )
    def test_refused(self, record, fixed, cause):
        with pytest.raises(RefusalError, match=cause):
            identify_signature(record, BENCH_VALVE, IdentificationSettings(fixed=fixed))

    def test_too_large_a_coulomb_friction_leaves_no_viscous_one(self, record):
        settings = IdentificationSettings(fixed={"coulomb_friction": 700.0})
        found = identify_signature(record, BENCH_VALVE, settings)
        viscous = found.parameters["viscous_friction"]
        assert viscous.verdict is Verdict.NOT_IDENTIFIABLE
        assert viscous.reason.startswith("its estimate is negative (-")
        assert found.model.viscous_friction > 0
        assert any("viscous_friction is not identified" in note for note in found.warnings)


def test_slow_sampling_and_a_converter_without_lag(benches):
    """100 Hz, and corners of the pressure that are sharp."""
    time = np.arange(15_000) / 100
    for lag in (0.0, 1.3):
        pressure = converter_response(TriangleWave().sample(time), 0.01, lag)
        position = simulate(*benches["high"], pressure, 0.01).position
        found = identify_signature(Recording(0.01, pressure, position), BENCH_VALVE)
        assert found.values["coulomb_friction"] == pytest.approx(606.0, rel=5e-3)
        assert math.isclose(found.values["viscous_friction"], 4.48e4, rel_tol=0.05)


TIME = np.arange(2000) * 1e-3
REST = 5e-3


def motion(onset, lag, speed, jump=0.0, growth=0.0):
    """Position of a stem without inertia under a force that grows from the onset on."""
    since = np.maximum(TIME - onset, 0.0)
    fade = 1 - np.exp(-since / lag)
    steady = since - lag * fade
    return (
        REST
        + speed * (steady + growth * (since**2 / 2 - lag * steady))
        + np.sign(speed) * jump * lag * fade
    )


@settings(max_examples=20)
@given(
    onset=st.floats(0.7, 1.2),
    lag=st.floats(0.02, 0.4),
    speed=st.floats(1e-4, 1e-2),
    way=st.sampled_from([1.0, -1.0]),
    growth=st.floats(-0.2, 0.2),
)
def test_growing_force(onset, lag, speed, way, growth):
    found = fit_onset(TIME, motion(onset, lag, way * speed, growth=growth), onset + 0.05, growth)
    assert found.time == pytest.approx(onset, abs=1e-4)
    assert found.level == pytest.approx(REST, abs=1e-3 * speed)
    assert found.jump_speed == 0.0


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("lag", [0.1, 0.34])
def test_slip_jump(way, lag):
    found = fit_onset(TIME, motion(0.9, lag, way * 1.2e-3, jump=4e-3), 0.8)
    assert found.time == pytest.approx(0.9, abs=1e-5)
    assert found.level == pytest.approx(REST, abs=1e-9)
    assert found.jump_speed == pytest.approx(4e-3, rel=1e-4)


def test_noise_moves_the_onset_by_less_than_a_threshold_would():
    """A threshold of four deviations would be passed 0.2 s late."""
    noise = 28.6e-6 * np.random.default_rng(0).standard_normal((10, TIME.size))
    errors = [fit_onset(TIME, motion(0.9, 0.22, 1.2e-3) + one, 1.0).time - 0.9 for one in noise]
    assert np.sqrt(np.mean(np.square(errors))) < 0.02
