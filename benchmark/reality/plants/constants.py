# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A plant as plain numbers, the form in which compiled code takes it."""

from typing import NamedTuple

import numpy as np

from benchmark.reality.plants.parameters import Friction, Law, Plant

STEPS = {
    Law.MOREAU: 5e-6,
    Law.KARNOPP: 5e-6,
    Law.LATCHED: 5e-6,
    Law.LUGRE: 4e-6,
    Law.MAXWELL: 2.5e-6,
}
"""Time step of each law, s."""

ELEMENTS = 6
"""Springs of the Maxwell law."""

_BRISTLE_DAMPING = 0.7
"""Damping ratio of stem and bristle before sliding."""


class Constants(NamedTuple):
    """Numbers of a plant in SI units; see `Body` and `Friction` for their meaning."""

    mass: float
    spring: float
    preload: float
    spring_curve: float
    area: float
    area_change: float
    pressure_reference: float
    flow_force: float
    flow_exponent: float
    travel: float
    lowest: float
    highest: float
    volume_lag: float
    coulomb: float
    static: float
    viscous: float
    stribeck_velocity: float
    limit_velocity: float
    asymmetry: float
    along_change: float
    along_bend: float
    record_change: float
    record_bend: float
    stiffness: float
    bristle_damping: float


def _stiffness(friction: Friction) -> float:
    if friction.law in (Law.LUGRE, Law.MAXWELL):
        return friction.static / friction.presliding
    return 0.0


def constants(plant: Plant) -> Constants:
    """Return the numbers of a plant."""
    body, friction = plant.body, plant.friction
    stiffness = _stiffness(friction)
    return Constants(
        mass=body.mass,
        spring=body.spring,
        preload=body.preload,
        spring_curve=body.spring_curve,
        area=body.area,
        area_change=body.area_change,
        pressure_reference=body.pressure_reference,
        flow_force=body.flow_force,
        flow_exponent=body.flow_exponent,
        travel=body.travel,
        lowest=body.seat,
        highest=body.travel - body.top,
        volume_lag=body.volume_lag,
        coulomb=friction.coulomb,
        static=friction.static,
        viscous=friction.viscous,
        stribeck_velocity=friction.stribeck_velocity,
        limit_velocity=friction.limit_velocity,
        asymmetry=friction.asymmetry,
        along_change=friction.along_travel.change,
        along_bend=friction.along_travel.bend,
        record_change=friction.in_record.change,
        record_bend=friction.in_record.bend,
        stiffness=stiffness,
        bristle_damping=2 * _BRISTLE_DAMPING * float(np.sqrt(stiffness * body.mass)),
    )
