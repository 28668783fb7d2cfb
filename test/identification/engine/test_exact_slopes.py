# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Derivatives carried along with the simulated stem, beside finite differences.

Drawn valves of very different sizes, with and without stick-slip, with all imperfections. Where an
event lies between the two simulations of a difference, no difference is a derivative: what counts
are the cells in which those of two steps agree.
"""

import numpy as np
import pytest

from valve_friction_ros.identification.engine.broad_model import ABSENT, BroadModel
from valve_friction_ros.identification.engine.coordinates import MAIN, physical, straight
from valve_friction_ros.identification.engine.driven_stem import (
    Course,
    Place,
    read_slopes,
    read_stem,
)
from valve_friction_ros.identification.engine.fitted_record import fitted_record
from valve_friction_ros.identification.engine.method import stamped_record
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, Recording, simulate

NAMES = Place._fields
PERIOD, STEPS = 0.005, 2400
TIME = PERIOD * np.arange(STEPS)
RELATIVE = {
    "coulomb_friction": 1e-6,
    "viscous_friction": 1e-5,
    "spring_constant": 1e-6,
    "spring_preload": 1e-6,
    "mass": 1e-4,
    "slip_force": 1e-6,
    "stribeck_velocity": 3e-6,
}
"""Steps of the differences over the size of a coordinate; one over the size of what it scales."""

WIDER = 300.0
"""Step of the differences over those, where chords approximate a friction that falls."""


class Plant:
    """A drawn valve, what drives it, and where its sensor is read."""

    def __init__(self, seed, slips):
        rng = np.random.default_rng(seed)
        area = 10 ** rng.uniform(np.log10(0.004), np.log10(0.12))
        spring = 10 ** rng.uniform(np.log10(2e4), np.log10(2e6))
        force = area * 1e5 * (0.6 + 0.3 * np.sin(2 * np.pi * TIME / 5.3))
        force += area * 1.2e4 * np.sin(2 * np.pi * TIME / 0.87 + rng.uniform(0, 6))
        self.span = float(np.ptp(force))
        phase = 2 * np.pi * TIME / 5.3
        anew, leaving = np.full(STEPS, np.nan), np.zeros(STEPS)
        anew[1500] = force[1500] / spring * 1.01
        stroke = self.span / spring
        # With a travel that the stem oversteps it also meets a stop.
        travel = float(force.max() / spring - 0.1 * stroke) if seed % 2 else np.inf
        self.course = Course(
            PERIOD,
            travel,
            stroke,
            self.span,
            force,
            np.sin(phase),
            np.linspace(-1.0, 1.0, STEPS),
            np.exp(-3.0 * np.abs(np.cos(phase))),
            anew,
            leaving,
        )
        dry = self.span * 10 ** rng.uniform(-2.0, -1.0)
        self.at = {
            **ABSENT,
            "coulomb_friction": dry,
            "viscous_friction": spring * 10 ** rng.uniform(-2.5, -1.3),
            "spring_constant": spring,
            "spring_preload": 0.1 * self.span,
            "start_position": force[0] / spring - 0.1 * stroke,
            "delay": 0.013,
            "stem_lag": 0.02,
            "force_lag": 0.015 if seed % 3 else -0.01,
            "along_travel": 0.05,
            "in_record": -0.03,
            "at_low_speed": 0.08,
            "curvature": 0.01,
            "cubic": -0.005,
            "drift": 0.002,
            "presliding": 0.05 * dry / spring,
            "viscous_asymmetry": 0.1,
            "mass": 1.5 * area / 0.0445,
            "slip_force": 0.3 * dry if slips else 0.0,
            "limit_velocity": 0.003 * stroke if slips and seed % 2 else 0.0,
        }
        self.seed = seed
        self.cells = np.sort(rng.uniform(0, STEPS - 2, 2000))
        self.stroke = stroke

    def falls(self):
        """Let the friction fall with the speed."""
        share = 10 ** np.random.default_rng(self.seed).uniform(-2.0, -1.0)
        slip = 0.6 * self.at["coulomb_friction"]
        new = {"slip_force": slip, "limit_velocity": 0.0, "stribeck_velocity": share * self.stroke}
        self.at |= new

    def readings(self, at):
        found = np.empty(self.cells.size)
        read_stem(self.course, Place(**at), self.cells, found)
        return found

    def slopes(self):
        coordinates = np.array([Place._fields.index(name) for name in NAMES])
        found = np.empty((self.cells.size, len(NAMES)))
        room = np.empty((2, STEPS, len(NAMES)))
        read_slopes(
            self.course,
            Place(**self.at),
            coordinates,
            np.eye(len(NAMES)),
            self.cells,
            room,
            found,
        )
        return dict(zip(NAMES, found.T, strict=True))

    def step(self, name):
        if name in RELATIVE:
            return RELATIVE[name] * self.at[name]
        if name in ("start_position", "presliding"):
            return 1e-7 * self.stroke
        return 1e-6 * self.stroke if name == "limit_velocity" else 1e-6

    def difference(self, name, step):
        high, low = ({**self.at, name: self.at[name] + way * step} for way in (1, -1))
        return (self.readings(high) - self.readings(low)) / (2 * step)


@pytest.mark.parametrize("slips", [False, True])
@pytest.mark.parametrize("seed", range(8))
def test_they_are_those_of_differences(seed, slips):
    plant = Plant(seed, slips)
    exact = plant.slopes()
    for name in NAMES:
        if plant.at[name] == 0.0:
            continue  # at its bound
        step = plant.step(name)
        difference, finer = plant.difference(name, step), plant.difference(name, 0.5 * step)
        largest = np.abs(difference).max()
        smooth = np.abs(difference - finer) <= 1e-5 * largest
        assert smooth.mean() > 0.95, name
        assert exact[name][smooth] == pytest.approx(
            difference[smooth], rel=0, abs=2e-5 * largest
        ), name


@pytest.mark.parametrize("seed", [0, 2, 4, 5, 6, 7])
def test_where_friction_falls_with_speed(seed):
    """But for where chords begin and end, which the differences see, too.

    In 1 and 3 a jump is over within a hundredth of a step, and its end is known to no difference.
    """
    plant = Plant(seed, slips=True)
    plant.falls()
    exact = plant.slopes()
    for name in NAMES:
        if plant.at[name] == 0.0:
            continue  # at its bound
        difference = plant.difference(name, WIDER * plant.step(name))
        error = np.abs(exact[name] - difference)
        usual = error <= np.quantile(error, 0.9)
        size = np.abs(difference)[usual].sum()
        share = 0.2 if name in ("mass", "stribeck_velocity") else 0.05
        assert error[usual].sum() <= share * size + 1e-9 * usual.sum(), name


@pytest.mark.parametrize("name", ["delay", "stem_lag", "force_lag", "presliding"])
def test_from_zero_upwards(name):
    plant = Plant(4, slips=True)
    plant.at |= {"delay": 0.0, "stem_lag": 0.0, "force_lag": 0.0, "presliding": 0.0}
    step = plant.step(name)
    higher = plant.readings({**plant.at, name: step})
    difference = (higher - plant.readings(plant.at)) / step
    largest = np.abs(difference).max()
    wrong = np.abs(plant.slopes()[name] - difference) > 1e-4 * largest
    assert wrong.mean() < 0.01


def test_a_derivative_that_has_decayed_is_zero():
    """A start long ago does not matter; numbers below 1e-308 would slow the processor down."""
    plant = Plant(0, slips=False)
    course = plant.course._replace(
        travel=np.inf, force=plant.span * (1.0 + TIME), anew=np.full(STEPS, np.nan)
    )
    plant.course = course
    plant.at["force_lag"] = plant.at["delay"] = 0.0
    by_start = np.abs(plant.slopes()["start_position"])
    assert by_start[0] > 0.1
    assert by_start[-1] == 0.0
    assert by_start[by_start > 0.0].min() > 1e-110


@pytest.fixture(scope="module")
def model():
    time = np.arange(2000) / 100
    pressure = 6.5e4 + 4e4 * np.sin(2 * np.pi * time / 9) + 1e4 * np.sin(2 * np.pi * time / 2.3)
    stem = simulate(BENCH_VALVE, LOW_FRICTION, pressure, 0.01).position
    noise = np.random.default_rng(0).standard_normal((2, time.size))
    recording = Recording(0.01, pressure + 20 * noise[0], stem + 2e-6 * noise[1])
    record = fitted_record(stamped_record(recording)[0], BENCH_VALVE)
    return BroadModel(record, LOW_FRICTION.spring_constant)


TRUTH = {
    **ABSENT,
    "mass": LOW_FRICTION.mass,
    "coulomb_friction": LOW_FRICTION.coulomb_friction,
    "viscous_friction": LOW_FRICTION.viscous_friction,
    "spring_constant": LOW_FRICTION.spring_constant,
    "spring_preload": LOW_FRICTION.spring_preload,
    "slip_force": 0.5 * LOW_FRICTION.coulomb_friction,
}


class TestSensitivity:
    def test_by_straight_coordinates(self, model):
        at = {**TRUTH, "start_position": model.record.start}
        names = (*MAIN, "slip_force", "delay", "mass")
        readings = model.readings(at)
        exact = model.sensitivity(at, names, readings)
        assert exact.shape == (2, len(names), model.record.position.size)
        centre = straight(at, names)
        for row, name in enumerate(names):
            step = 0.1 * model.step(at, name) if name in MAIN else 0.001 * model.step(at, name)
            high, low = (
                model.readings(physical({**centre, name: centre[name] + way * step}, names))
                for way in (1, -1)
            )
            difference = (high - low) / (2 * step)
            largest = np.abs(difference).max()
            wrong = np.abs(exact[:, row] - difference) > 1e-3 * largest
            assert wrong.mean() < 0.02, name

    def test_what_is_not_there_yet_may_come(self, model):
        """The exact derivative by a slip force of zero is zero, so a fit would leave it there."""
        at = {**TRUTH, "start_position": model.record.start, "slip_force": 0.0}
        found = model.sensitivity(at, ("coulomb_friction", "slip_force"), model.readings(at))
        assert np.abs(found[:, 1]).max() > 0.1

    def test_by_a_pressure_without_noise(self):
        """Both halves agree: the stem is simulated once, and both have its derivatives."""
        time = np.arange(2000) / 100
        pressure = 6.5e4 + 4e4 * np.sin(2 * np.pi * time / 9)
        stem = simulate(BENCH_VALVE, LOW_FRICTION, pressure, 0.01).position
        record = fitted_record(stamped_record(Recording(0.01, pressure, stem))[0], BENCH_VALVE)
        model = BroadModel(record, LOW_FRICTION.spring_constant)
        at, names = {**TRUTH, "start_position": record.start}, ("coulomb_friction", "slip_force")
        assert len(model.halves) == 1
        for at["slip_force"] in (0.0, 50.0):
            readings = model.readings(at)
            assert np.abs(readings[0] - stem[1:]).max() < 1e-3
            np.testing.assert_array_equal(*readings)
            np.testing.assert_array_equal(*model.sensitivity(at, names, readings))

    @pytest.mark.parametrize("endless", [np.inf, np.nan, -1e200])
    def test_a_derivative_without_bounds_is_none(self, model, monkeypatch, endless):
        """At each event of a stem that sticks and slips without end, it may have grown."""
        at, names = {**TRUTH, "start_position": model.record.start}, ("coulomb_friction", "mass")
        slopes = model.sensitivity(at, names, model.readings(at))
        overflown = slopes.copy()
        overflown[0, 1, 700:] = endless
        monkeypatch.setattr(BroadModel, "_exact_slopes", lambda *_: overflown.copy())
        found = model.sensitivity(at, names, model.readings(at))
        np.testing.assert_array_equal(found, np.where(overflown == slopes, slopes, 0.0))
