# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A model to simulate from identified values; substitutes replace what was not identified."""

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import NamedTuple

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.units import UNITS
from valve_friction_ros.model.karnopp_parameters import KarnoppParameters

_NEEDED = ("coulomb_friction", "spring_constant")
_NAMES = tuple(field.name for field in fields(KarnoppParameters))


class IdentifiedModel(NamedTuple):
    """A model to simulate, and the substitutes for values that were not identified.

    Attributes
    ----------
    parameters : KarnoppParameters
        The model.
    notes : tuple of str
        One sentence for each substitute.
    """

    parameters: KarnoppParameters
    notes: tuple[str, ...]


def identified_model(
    values: Mapping[str, float], known: Mapping[str, float] | None = None
) -> IdentifiedModel:
    """Build a model from identified values; substitutes replace missing values.

    Parameters
    ----------
    values : mapping of str to float
        Identified values by name; nan where a value is not identifiable.
    known : mapping of str to float, optional
        Nominal values to substitute, such as those of a valve file. Without a nominal value the
        mass is `IdentificationSettings.assumed_mass`, F_s is F_c, and F_v is 2·√(k·m), critical
        damping: the smallest F_v without oscillation.

    Returns
    -------
    IdentifiedModel
        The model and notes.

    Raises
    ------
    RefusalError
        If F_c or k is missing, or if F_0 is missing and has no nominal value.
    ValueError
        If a value is impossible; the message names it.
    """
    nominal = known or {}
    found = {name: value for name, value in values.items() if math.isfinite(value)}
    for name in _NEEDED:
        if name not in found:
            raise RefusalError(
                f"{name} was not identified, and a model needs it: identify a record that "
                "determines it"
            )
    notes = []
    if found.get("viscous_friction", 0.0) < 0:
        notes.append(f"viscous_friction is negative ({found.pop('viscous_friction'):.4g} N·s/m)")
    if "spring_preload" not in found and "spring_preload" not in nominal:
        raise RefusalError(
            "spring_preload was not identified, and a model needs it: name it in the valve file, "
            "or identify a record that determines it"
        )
    mass = found.get("mass", nominal.get("mass", IdentificationSettings().assumed_mass))
    substitutes = {
        "mass": (mass, "assumed"),
        "viscous_friction": (
            2 * math.sqrt(found["spring_constant"] * mass),
            "critical damping, the smallest value without oscillation",
        ),
        "static_friction": (found["coulomb_friction"], "the coulomb_friction"),
        "spring_preload": (0.0, ""),
    }
    for name, (value, why) in substitutes.items():
        if name not in found:
            found[name] = nominal.get(name, value)
            source = "of the valve file" if name in nominal else why
            notes.append(f"{name} is not identified: {found[name]:.6g} {UNITS[name]}, {source}")
    if found["static_friction"] < found["coulomb_friction"]:
        notes.append(
            f"static_friction ({found['static_friction']:.6g} N) lies below coulomb_friction: "
            "the model takes F_s equal to F_c"
        )
        found["static_friction"] = found["coulomb_friction"]
    model = {name: value for name, value in found.items() if name in _NAMES}
    return IdentifiedModel(KarnoppParameters(**model), tuple(notes))
