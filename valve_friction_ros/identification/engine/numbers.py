# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Reported numbers at a point of the fit, and their derivatives by its coordinates."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from valve_friction_ros.identification.engine.broad_model import BroadModel
from valve_friction_ros.identification.engine.coordinates import Coordinates
from valve_friction_ros.identification.engine.imperfections import TIMING, sensor_span
from valve_friction_ros.identification.trust.sliding import mean_over_distance, mean_speed

RECTANGLE = 1.0 / math.sqrt(3.0)
"""Standard deviation of a rectangular distribution over its half width."""

_MOVING = 0.02
"""Share of the top speed above which the averaged stem moves."""

ASYMMETRY = 0.05
"""Standard deviation of the share by which F_c is larger upward: it has the effect of a change of
F_0, and no record can separate the two."""


@dataclass(frozen=True)
class ReportedNumber:
    """A number at one point of the fit.

    Attributes
    ----------
    value : float
        SI unit.
    gradient : mapping of str to float
        Its derivatives by the coordinates.
    definition : float
        Standard deviation due to the definition where the quantity has no single value: a friction
        that changes along the travel, the constant of a curved spring.
    """

    value: float
    gradient: Mapping[str, float]
    definition: float


def _sliding(model: BroadModel, at: Coordinates, asymmetry: float) -> ReportedNumber:
    """Return ∫|F_friction|·|dx| / ∫|dx| of the simulated stem."""
    slow = model.record.slow
    velocity = model.simulate(at).velocity
    speed = np.abs(velocity)
    mean = mean_speed(speed)
    place, age = mean_over_distance(slow.place, speed), mean_over_distance(slow.age, speed)
    low = mean_over_distance(slow.slowness, speed)
    dry, viscous = at["coulomb_friction"], at["viscous_friction"]
    falling = 0.0
    if at["stribeck_velocity"] > 0:
        falling = mean_over_distance(np.exp(-((speed / at["stribeck_velocity"]) ** 2)), speed)
    share = 1 + at["along_travel"] * place + at["in_record"] * age + at["at_low_speed"] * low
    value = dry * share + viscous * mean + at["slip_force"] * falling
    gradient = {
        "coulomb_friction": share,
        "viscous_friction": mean,
        "along_travel": place * dry,
        "in_record": age * dry,
        "at_low_speed": dry * low,
        "slip_force": falling,
    }
    net = abs(float(np.sum(velocity))) / max(float(np.sum(speed)), np.finfo(float).tiny)
    return ReportedNumber(value, gradient, asymmetry * dry * net)


def reported_numbers(
    model: BroadModel, at: Coordinates, asymmetry: float = ASYMMETRY
) -> dict[str, ReportedNumber]:
    """Return all reported numbers at a point of the fit.

    `asymmetry` is the standard deviation of the share by which F_c is larger upward.

    A friction that changes by ±a over the travel or over the record, or that is larger by a at low
    speed, has no single value; the number is then taken to lie anywhere within ±a. The same
    applies to a spring whose constant changes by ±4c over the measured range.
    """
    slow = model.record.slow
    dry, spring = at["coulomb_friction"], at["spring_constant"]
    static = dry + at["slip_force"]
    friction = RECTANGLE * math.hypot(at["along_travel"], at["in_record"], at["at_low_speed"])
    curve = abs(at["curvature"]) + abs(at["cubic"])
    stiffness = RECTANGLE * 4.0 * curve * spring
    middle = 0.5 * (slow.lowest + slow.highest)
    seat = -2.0 * middle / slow.range
    bow = RECTANGLE * curve * spring * slow.range * max(abs(seat**2 - 1 / 3), 2 / 3)
    drift = RECTANGLE * abs(at["drift"]) * sensor_span(model.record.force)
    preload = math.hypot(bow, stiffness * abs(middle), drift, asymmetry * dry)
    static_gradient = {"coulomb_friction": 1.0, "slip_force": 1.0}
    numbers = {
        "mass": ReportedNumber(at["mass"], {"mass": 1.0}, 0.0),
        "viscous_friction": ReportedNumber(
            at["viscous_friction"], {"viscous_friction": 1.0}, friction * at["viscous_friction"]
        ),
        "coulomb_friction": ReportedNumber(dry, {"coulomb_friction": 1.0}, friction * dry),
        "static_friction": ReportedNumber(static, static_gradient, friction * static),
        "spring_constant": ReportedNumber(spring, {"spring_constant": 1.0}, stiffness),
        "spring_preload": ReportedNumber(at["spring_preload"], {"spring_preload": 1.0}, preload),
        "sliding_friction": _sliding(model, at, asymmetry),
    }
    if at["stribeck_velocity"] > 0:
        speed = at["stribeck_velocity"]
        numbers["stribeck_velocity"] = ReportedNumber(speed, {"stribeck_velocity": 1.0}, 0.0)
    return numbers


def found_sizes(_: BroadModel, at: Coordinates) -> dict[str, ReportedNumber]:
    """Return imperfections at a point of the fit that may be compared with those of another record.

    The ``lag`` of the stem behind the pressure, s, is the sum of all timing; ``slip_force`` is
    F_s − F_c, N; ``viscous_asymmetry`` is the share by which F_v is larger upward.
    """
    lag = sum(at[name] for name in TIMING)
    return {
        "lag": ReportedNumber(lag, dict.fromkeys(TIMING, 1.0), 0.0),
        "slip_force": ReportedNumber(at["slip_force"], {"slip_force": 1.0}, 0.0),
        "viscous_asymmetry": ReportedNumber(
            at["viscous_asymmetry"], {"viscous_asymmetry": 1.0}, 0.0
        ),
    }


def loop_friction(model: BroadModel, at: Coordinates) -> float:
    """Return the work of friction over the distance by the measured signals alone, N.

    The work of the actuator less what the spring keeps: ∫(F − k·x − F_0)·dx / ∫|dx|. The spring is
    taken from the fit, and matters only if the stem does not end where it began. No model of the
    friction is used.
    """
    slow = model.record.slow
    position = slow.lowest + 0.5 * (slow.place + 1.0) * slow.range
    moved = np.where(slow.speed > _MOVING * np.quantile(slow.speed, 0.98), slow.velocity, 0.0)
    surplus = slow.force - at["spring_constant"] * position - at["spring_preload"]
    return float(np.sum(surplus * moved) / np.sum(np.abs(moved)))
