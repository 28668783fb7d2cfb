"""A machine without a spring: the averaged force balance, its intervals and its test."""

import math
from pathlib import Path

import numpy as np
import pytest

from valve_friction_ros.identification import (
    IdentificationSettings,
    Verdict,
    identify,
    identify_published,
)
from valve_friction_ros.model import Drive, Recording, Valve

DATA = Path(__file__).resolve().parents[4] / "shared" / "data" / "emps"
PUBLISHED_MASS = 95.1089
PERIOD = 1e-3
STEPS = 10
TRUTH = {
    "mass": 20.0,
    "coulomb_friction": 12.0,
    "viscous_friction": 60.0,
    "spring_preload": 2.0,
}


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


def identified(record, window=None):
    settings = IdentificationSettings(derivative_window=window, fixed={"spring_constant": 0.0})
    return identify(record, Valve(), settings)


@pytest.fixture(scope="module")
def record():
    return recorded()


class TestWindows:
    @pytest.mark.parametrize("window", [None, 11, 21, 31, 51])
    def test_every_window_gives_the_truth(self, record, window):
        found = identified(record, window)
        for name, truth in TRUTH.items():
            one = found.parameters[name]
            assert abs(one.value - truth) <= one.half_width, (name, one.value, one.half_width)
            assert one.half_width < 0.02 * truth, name
            assert one.verdict is Verdict.IDENTIFIED
        assert found.misfit.describes
        assert not [warning for warning in found.warnings if "does not describe" in warning]

    def test_without_the_averaging_a_long_window_is_wrong(self, record):
        """The published regression averages the acceleration only."""
        settings = IdentificationSettings(derivative_window=51, fixed={"spring_constant": 0.0})
        mass = identify_published(record, Valve(), settings).parameters["mass"].value
        assert mass > 1.02 * TRUTH["mass"]

    def test_a_short_window_of_a_noisy_record_is_wide(self):
        """Noise of the acceleration draws the mass towards zero: the interval reaches the truth."""
        mass = identified(recorded(noise=3e-6, seed=1), 11).parameters["mass"]
        assert abs(mass.value / TRUTH["mass"] - 1) > 5e-3
        assert abs(mass.value - TRUTH["mass"]) <= mass.half_width

    def test_the_window_is_chosen_by_the_interval(self):
        noisy = recorded(noise=3e-6, seed=2)
        chosen = identified(noisy)
        width = chosen.parameters["mass"].half_width
        assert chosen.derivative_window % 2 == 1
        assert width < identified(noisy, 11).parameters["mass"].half_width


class TestModel:
    @pytest.mark.parametrize("along", [0.3, -0.3])
    def test_friction_along_the_travel_is_doubted(self, along):
        found = identified(recorded(friction_along=along))
        assert found.parameters["coulomb_friction"].verdict is not Verdict.IDENTIFIED
        assert found.parameters["mass"].verdict is not Verdict.IDENTIFIED
        (doubt,) = [each for each in found.warnings if "does not describe" in each]
        assert "along the travel" in doubt
        assert found.parameters["mass"].reason == doubt

    def test_a_small_backlash_is_in_the_interval(self):
        mass = identified(recorded(backlash=1e-4)).parameters["mass"]
        assert abs(mass.value - TRUTH["mass"]) <= mass.half_width

    def test_backlash_is_doubted(self):
        found = identified(recorded(backlash=1e-3))
        assert any("does not describe" in each for each in found.warnings)
        assert found.parameters["mass"].verdict is not Verdict.IDENTIFIED

    def test_a_small_change_is_not_doubted(self):
        found = identified(recorded(friction_along=0.05))
        assert not [each for each in found.warnings if "does not describe" in each]
        assert found.parameters["mass"].verdict is Verdict.IDENTIFIED

    def test_the_misfit_is_a_force(self, record):
        found = identified(record)
        shown = found.to_dict()
        assert found.misfit.unit == "N"
        assert shown["systematic_misfit"] is None
        assert shown["model_describes"] is True
        assert found.stem is None


def test_sliding_friction_holds_the_truth(record):
    """F_c + F_v·v at the mean speed over the distance, which the result tells."""
    result = identified(record)
    one = result.parameters["sliding_friction"]
    truth = TRUTH["coulomb_friction"] + TRUTH["viscous_friction"] * result.sliding_speed
    assert abs(one.value - truth) <= one.half_width
    assert 0 < one.half_width < 0.2 * truth
    velocity = np.abs(np.gradient(record.position, PERIOD))
    assert result.sliding_speed == pytest.approx(np.sum(velocity**2) / np.sum(velocity), rel=0.02)


def test_fixed_values_leave_the_balance(record):
    settings = IdentificationSettings(
        fixed={"spring_constant": 0.0, "mass": 20.0, "viscous_friction": 60.0}
    )
    found = identify(record, Valve(), settings).parameters
    assert found["mass"].verdict is found["viscous_friction"].verdict is Verdict.FIXED
    assert found["coulomb_friction"].value == pytest.approx(12.0, rel=2e-3)


@pytest.mark.parametrize("name", ["emps_identification.csv", "emps_pulses.csv"])
@pytest.mark.parametrize("window", [11, 15, 21, 31, 41, 51])
def test_real_machine(name, window):
    """The published mass lies in a narrow interval, whatever the window."""
    path = DATA / name
    if not path.is_file():
        pytest.skip("the benchmark record is not the project's to distribute; it is not here")
    time, force, position = np.loadtxt(path, delimiter=",", skiprows=1, unpack=True)
    record = Recording(float(np.median(np.diff(time))), force, position, driven_by=Drive.FORCE)
    mass = identified(record, window).parameters["mass"]
    assert mass.verdict is Verdict.IDENTIFIED
    assert abs(mass.value - PUBLISHED_MASS) <= mass.half_width < 0.035 * PUBLISHED_MASS
