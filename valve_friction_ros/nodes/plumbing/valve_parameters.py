"""The parameters that describe a valve and its friction, shared by the nodes."""

from collections.abc import Mapping
from typing import Any

from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION, KarnoppParameters, Valve
from valve_friction_ros.nodes.plumbing.parameters import ParameterSpec
from valve_friction_ros.streams.joint_position import DEFAULT_JOINT

__all__ = [
    "JOINT",
    "KARNOPP_PARAMETERS",
    "VALVE_PARAMETERS",
    "karnopp_parameters_from",
    "valve_from",
]

JOINT = ParameterSpec(
    "joint",
    DEFAULT_JOINT,
    "Name of the stem's joint in stem_state [-]; empty: the first joint",
    read_only=True,
)

VALVE_PARAMETERS = (
    ParameterSpec(
        "diaphragm_area", BENCH_VALVE.force_per_drive, "Diaphragm area S_a [m²]", (1e-6, 1e3)
    ),
    ParameterSpec(
        "pressure_reference",
        BENCH_VALVE.pressure_reference,
        "Pressure without force P_ref [Pa]: 101325 for an absolute sensor, 0 for a gauge sensor",
        (-1e9, 1e9),
    ),
    ParameterSpec(
        "travel",
        BENCH_VALVE.travel,
        "Stem travel between its stops [m]; .inf: no stops. Above zero",
    ),
    ParameterSpec(
        "pressure_minimum",
        BENCH_VALVE.pressure_minimum,
        "Lowest pressure the sensor can read [Pa]; below it a sample is rejected. -.inf: none",
    ),
    ParameterSpec(
        "pressure_maximum",
        BENCH_VALVE.pressure_maximum,
        "Highest pressure the sensor can read [Pa]; above it a sample is rejected. .inf: none",
    ),
)

KARNOPP_PARAMETERS = (
    ParameterSpec("mass", LOW_FRICTION.mass, "Mass of the moving parts m [kg]", (1e-6, 1e6)),
    ParameterSpec(
        "viscous_friction",
        LOW_FRICTION.viscous_friction,
        "Viscous friction coefficient F_v [N·s/m]",
        (0.0, 1e9),
    ),
    ParameterSpec(
        "coulomb_friction",
        LOW_FRICTION.coulomb_friction,
        "Coulomb friction F_c [N], not above static_friction",
        (0.0, 1e9),
    ),
    ParameterSpec(
        "static_friction",
        LOW_FRICTION.static_friction,
        "Static friction F_s [N], not below coulomb_friction",
        (0.0, 1e9),
    ),
    ParameterSpec(
        "spring_constant", LOW_FRICTION.spring_constant, "Spring constant k [N/m]", (0.0, 1e12)
    ),
    ParameterSpec(
        "spring_preload",
        LOW_FRICTION.spring_preload,
        "Spring force at the closed stop F_0 [N]",
        (-1e9, 1e9),
    ),
    ParameterSpec(
        "limit_velocity",
        LOW_FRICTION.limit_velocity,
        "Speed DV at which the stem comes to rest [m/s]; 0: the exact limit",
        (0.0, 1e3),
    ),
)


def valve_from(values: Mapping[str, Any]) -> Valve:
    """Build the valve from parameter values; raises ValueError for an impossible one."""
    return Valve(**{spec.name: values[spec.name] for spec in VALVE_PARAMETERS})


def karnopp_parameters_from(values: Mapping[str, Any]) -> KarnoppParameters:
    """Build the model from parameter values; raises ValueError for an impossible one."""
    return KarnoppParameters(**{spec.name: values[spec.name] for spec in KARNOPP_PARAMETERS})
