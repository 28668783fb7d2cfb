"""From identified numbers to a model that can be simulated, with what stands in for the missing."""

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import NamedTuple

from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.units import CLOCK_OFFSET, UNITS
from valve_friction_ros.model.karnopp_parameters import KarnoppParameters

__all__ = ["IdentifiedModel", "identified_model"]

_NEEDED = ("coulomb_friction", "spring_constant")
_NAMES = tuple(field.name for field in fields(KarnoppParameters))


class IdentifiedModel(NamedTuple):
    """A model to simulate, and what was used in place of numbers that were not identifiable.

    Attributes
    ----------
    parameters : KarnoppParameters
        The model.
    notes : tuple of str
        One sentence for each number that was not identified.
    """

    parameters: KarnoppParameters
    notes: tuple[str, ...]


def identified_model(
    values: Mapping[str, float], known: Mapping[str, float] | None = None
) -> IdentifiedModel:
    """Build a model from identified values, of which some may be missing.

    Parameters
    ----------
    values : mapping of str to float
        Identified values by name, nan where one is not identifiable.
    known : mapping of str to float, optional
        Nominal values that stand in, such as those of a valve file. Without one, the mass is the
        assumed one of `IdentificationSettings`, F_s is F_c, and F_v is 2·√(k·m), the least with
        which the stem does not swing.

    Returns
    -------
    IdentifiedModel
        The model and notes.

    Raises
    ------
    RefusalError
        If F_c or k is missing, or F_0 is and not known either.
    ValueError
        If a value is impossible; the message names it.
    """
    nominal = known or {}
    found = {name: value for name, value in values.items() if math.isfinite(value)}
    for name in _NEEDED:
        if name not in found:
            raise RefusalError(
                f"the estimate has no {name}, without which there is no model: identify a record "
                "that tells it"
            )
    notes = []
    if found.get("viscous_friction", 0.0) < 0:
        notes.append(f"viscous_friction is negative ({found.pop('viscous_friction'):.4g} N·s/m)")
    if "spring_preload" not in found and "spring_preload" not in nominal:
        raise RefusalError(
            "the estimate has no spring_preload: give it in the valve file, or identify a record "
            "that tells it"
        )
    mass = found.get("mass", nominal.get("mass", IdentificationSettings().assumed_mass))
    substitutes = {
        "mass": (mass, "assumed"),
        "viscous_friction": (
            2 * math.sqrt(found["spring_constant"] * mass),
            "the least with which the stem does not swing",
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
            "taken equal to it"
        )
        found["static_friction"] = found["coulomb_friction"]
    if found.get(CLOCK_OFFSET):
        notes.append(
            f"{CLOCK_OFFSET} is left out: it belongs to the clocks of the identified record"
        )
    model = {name: value for name, value in found.items() if name in _NAMES}
    return IdentifiedModel(KarnoppParameters(**model), tuple(notes))
