# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A machine without a spring: no force returns its stem, so the force balance answers alone."""

import gzip
import json
import math
from pathlib import Path

import numpy as np
import pytest

from valve_friction_ros.identification import (
    IdentificationSettings,
    Verdict,
    identify,
)
from valve_friction_ros.model import Drive, Recording, Valve
from valve_friction_ros.model.recording import StampedRecord, StampedSignal

DATA = next(
    (
        up / "shared" / "data"
        for up in Path(__file__).resolve().parents
        if (up / "shared" / "data").is_dir()
    ),
    Path(),
)
HALF_LOOPS = DATA / "cylinders" / "half_loops.json"
PERIOD = 1e-3
STEPS = 10
TRUTH = {
    "mass": 20.0,
    "coulomb_friction": 12.0,
    "viscous_friction": 60.0,
    "spring_preload": 2.0,
}
SPRINGLESS = {"spring_constant": 0.0}


def reference(duration):
    """Moves of 0.12 m and shorter, some with 2.5 m/s², with rests between."""
    generator = np.random.default_rng(5)
    place, speed, target, pause, places = 0.0, 0.0, 0.06, 0, []
    for _ in range(round(duration / PERIOD)):
        away = target - place
        wanted = math.copysign(min(0.25, math.sqrt(4.0 * abs(away))), away)
        speed += min(max(wanted - speed, -2.5e-3), 2.5e-3)
        place += speed * PERIOD
        if abs(away) < 5e-4 and abs(speed) < 0.05:
            pause += 1
        if pause > 100:
            pause, target = 0, -math.copysign(generator.uniform(0.02, 0.06), target)
        places.append(place)
    return np.array(places)


def recorded(friction_along=0.0, backlash=0.0, noise=2e-7, seed=0, duration=16.0):
    """Simulate a machine in a position loop; the force of a sample is held until the next."""
    generator = np.random.default_rng(seed)
    wanted = reference(duration)
    sensor = noise * generator.standard_normal(wanted.size)
    mass, coulomb, viscous, offset = TRUTH.values()
    motor = mass if not backlash else 0.5 * mass
    step = PERIOD / STEPS
    gain, damping = mass * 35.0**2, 1.4 * mass * 35.0
    place, speed, load, load_speed = float(wanted[0]), 0.0, float(wanted[0]), 0.0
    before, smooth = place, 0.0
    force, position = np.empty(wanted.size), np.empty(wanted.size)
    for sample in range(wanted.size):
        seen = place + sensor[sample]
        smooth += 0.2 * ((seen - before) / PERIOD - smooth)
        rate = (wanted[sample] - wanted[max(sample - 1, 0)]) / PERIOD
        pull = gain * (wanted[sample] - seen) + damping * (rate - smooth)
        before = position[sample] = seen
        force[sample] = pull
        for _ in range(STEPS):
            contact = 0.0
            if backlash:
                gap = place - load
                if abs(gap) > backlash:
                    contact = 2e5 * (gap - math.copysign(backlash, gap))
                    contact += 600.0 * (speed - load_speed)
                load_speed += step / (mass - motor) * contact
                load += step * load_speed
            speed += step / motor * (pull - offset - viscous * speed - contact)
            bound = step / motor * coulomb * (1 + friction_along * place / 0.06)
            speed = math.copysign(max(abs(speed) - bound, 0.0), speed)
            place += step * speed
    return Recording(PERIOD, force, position, driven_by=Drive.FORCE)


def mean_friction(record):
    """Return the work of friction over the distance: F_c and F_v at the mean speed, m/s."""
    speed = np.abs(np.gradient(record.position, PERIOD))
    mean = np.sum(speed**2) / np.sum(speed)
    return TRUTH["coulomb_friction"] + TRUTH["viscous_friction"] * mean


def identified(record, **fixed):
    settings = IdentificationSettings(fixed={**SPRINGLESS, **fixed})
    return identify(record, Valve(), settings)


@pytest.fixture(scope="module")
def record():
    return recorded()


@pytest.fixture(scope="module")
def result(record):
    return identified(record)


class TestSimulatedMachine:
    @pytest.mark.parametrize("noise", [2e-7, 3e-6])
    def test_every_parameter_is_found(self, noise):
        """What the sliding friction is made of stays weak: nothing but the forces says it."""
        result = identified(recorded(noise=noise, seed=1))
        for name, truth in TRUTH.items():
            one = result.parameters[name]
            assert abs(one.value - truth) <= one.half_width, name
            is_split = name in ("coulomb_friction", "viscous_friction")
            assert one.verdict is (Verdict.WEAK if is_split else Verdict.IDENTIFIED), name
        assert not [warning for warning in result.warnings if "does not describe" in warning]

    def test_sliding_friction(self, record, result):
        """It is told at which speed, too."""
        one, truth = result.parameters["sliding_friction"], mean_friction(record)
        assert abs(one.value - truth) <= one.half_width < 0.05 * truth
        assert 12.0 + 60.0 * result.sliding_speed == pytest.approx(truth, rel=0.02)

    def test_no_stem_is_simulated(self, result):
        shown = result.to_dict()
        assert result.stem is None
        assert result.misfit.unit == "N"
        assert shown["systematic_misfit"] is None
        assert shown["model_describes"] is True

    def test_known_parameters_leave_the_balance(self, record):
        """The sliding friction is the known part of it and the rest together."""
        found = identified(record, mass=20.0, viscous_friction=60.0).parameters
        assert found["mass"].verdict is found["viscous_friction"].verdict is Verdict.FIXED
        for name, truth in (
            ("coulomb_friction", 12.0),
            ("sliding_friction", mean_friction(record)),
        ):
            assert abs(found[name].value - truth) <= found[name].half_width, name

    @pytest.mark.parametrize("along", [0.3, -0.3])
    def test_friction_along_the_travel_leaves_its_mean(self, along):
        """The moves are even about the middle, where friction is as without the change."""
        record = recorded(friction_along=along)
        found, truths = identified(record).parameters, {"sliding_friction": mean_friction(record)}
        for name in ("mass", "viscous_friction", "sliding_friction"):
            one, truth = found[name], {**TRUTH, **truths}[name]
            assert abs(one.value - truth) <= one.half_width, name

    @pytest.mark.parametrize("backlash", [1e-4, 1e-3])
    def test_backlash_leaves_the_mass_and_the_sliding_friction(self, backlash):
        record = recorded(backlash=backlash)
        found = identified(record).parameters
        for name, truth in (("mass", 20.0), ("sliding_friction", mean_friction(record))):
            one = found[name]
            assert abs(one.value - truth) <= one.half_width, name

    def test_much_backlash_leaves_open_what_the_sliding_friction_is_made_of(self):
        result = identified(recorded(backlash=1e-3))
        for name in ("coulomb_friction", "viscous_friction"):
            assert result.parameters[name].verdict is not Verdict.IDENTIFIED, name

    def test_a_bench_without_a_spring(self, record):
        settings = IdentificationSettings(fixed=SPRINGLESS)
        plant, bench = (identify(record, Valve(), settings, one) for one in ("plant", "bench"))
        one, other = (each.parameters["sliding_friction"] for each in (plant, bench))
        assert abs(one.value - other.value) < other.half_width < 0.1 * other.value


@pytest.mark.skipif(
    not (DATA / "emps" / "emps_identification.csv").is_file(),
    reason="the benchmark record is not the project's to distribute; it is not here",
)
def test_electro_mechanical_positioning_system():
    """The published values, by inverse dynamics and least squares."""
    path = DATA / "emps" / "emps_identification.csv"
    time, force, position = np.loadtxt(path, delimiter=",", skiprows=1, unpack=True)
    period = float(np.median(np.diff(time)))
    found = identified(Recording(period, force, position, driven_by=Drive.FORCE)).parameters
    for name, published, share in (
        ("mass", 95.1089, 0.02),
        ("viscous_friction", 203.5034, 0.03),
        ("coulomb_friction", 20.3935, 0.03),
    ):
        one = found[name]
        assert one.value == pytest.approx(published, rel=share), name
        assert abs(one.value - published) <= one.half_width, name


@pytest.mark.skipif(
    not HALF_LOOPS.is_file(),
    reason="the recordings of the cylinders are not the project's to distribute; not here",
)
def test_pneumatic_cylinders():
    """The sliding friction is half the loop that a person reads off the plot; nine records."""
    half_loops = json.loads(HALF_LOOPS.read_text())
    assert len(half_loops) == 9
    narrow = 0
    for name, half in half_loops.items():
        with gzip.open(HALF_LOOPS.with_name(f"{name}.csv.gz")) as table:
            time, force, position = np.loadtxt(table, delimiter=",", skiprows=1, unpack=True)
        time, first = np.unique(time, return_index=True)
        stamped = StampedRecord(
            StampedSignal(time, force[first]), StampedSignal(time, position[first]), Drive.FORCE
        )
        period = stamped.drive.period
        grid = np.arange(time[0], time[-1], period)
        drive, stem = (np.interp(grid, time, one[first]) for one in (force, position))
        record = Recording(period, drive, stem, driven_by=Drive.FORCE, stamped=stamped)
        one = identified(record).parameters["sliding_friction"]
        assert one.value == pytest.approx(half["half_loop_n"], rel=0.1), name
        narrow += one.half_width <= 0.1 * one.value
    assert narrow >= 8
