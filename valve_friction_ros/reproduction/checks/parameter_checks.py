"""Comparison of identified with expected parameters."""

from collections.abc import Iterator

from valve_friction_ros.model import KarnoppParameters
from valve_friction_ros.reproduction.checks.check import Check, within

__all__ = ["NOTATION", "TOLERANCES", "parameter_checks"]

NOTATION = {
    "mass": ("m", "kg"),
    "spring_constant": ("k", "N/m"),
    "viscous_friction": ("F_v", "N·s/m"),
    "coulomb_friction": ("F_c", "N"),
    "static_friction": ("F_s", "N"),
}
"""Symbol and unit of the parameters of Table 1, in its order."""

TOLERANCES = {
    "mass": 0.1,
    "spring_constant": 0.01,
    "viscous_friction": 0.05,
    "coulomb_friction": 0.05,
    "static_friction": 0.05,
}
"""Shares of the paper's value within which a parameter counts as reproduced.

Chosen before the comparison: the scatter of Table 1 between its own two packings, per parameter."""


def parameter_checks(
    item: int,
    place: str,
    wanted: KarnoppParameters,
    found: dict[str, float],
    reasons: dict[str, str],
) -> Iterator[Check]:
    """Compare each identified with its expected parameter, with the reason of a mismatch."""
    for name, value in found.items():
        symbol, unit = NOTATION[name]
        yield within(
            item,
            f"{place}, {symbol}",
            getattr(wanted, name),
            value,
            TOLERANCES[name],
            unit,
            why=reasons.get(
                name, "the noise of this run biases the method by more than the tolerance"
            ),
        )
