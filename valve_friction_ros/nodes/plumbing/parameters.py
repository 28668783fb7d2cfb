"""Declaration of node parameters, each with a description, a unit and a range."""

import contextlib
import itertools
import math
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from valve_friction_ros.records.spelling import nearest, resembling
from valve_friction_ros.records.valve_keys import NODE_NAMES, is_known

__all__ = [
    "ParameterSpec",
    "declare_parameters",
    "optional",
    "reject_invalid",
    "values_of",
    "warn_of_columns",
]

_TURNS_SIGNALS = ("columns.inverted_position", "columns.opposing_pressure_column")
"""Keys of a valve file that change the signals of a table, and which topics do not have."""


@dataclass(frozen=True)
class ParameterSpec:
    """One parameter of a node: its default, which fixes its type, and a description with its unit.

    `limits` are the lowest and the highest value. A parameter that may be nan ("not given") has
    none, because ROS counts nan as outside any range; the value types check it all the same. A
    `read_only` parameter can only be given at start. `choices` are the values that a text may have;
    any, if empty.
    """

    name: str
    default: bool | int | float | str | list[str]
    description: str
    limits: tuple[float, float] | None = None
    read_only: bool = False
    choices: tuple[str, ...] = ()

    @cached_property
    def descriptor(self) -> ParameterDescriptor:
        """The ROS description of this parameter, which all nodes of the process share."""
        descriptor = ParameterDescriptor(
            description=self.description,
            additional_constraints=f"one of {', '.join(self.choices)}" if self.choices else "",
            read_only=self.read_only,
        )
        if self.limits is not None:
            lowest, highest = self.limits
            if isinstance(self.default, int):
                descriptor.integer_range = [
                    IntegerRange(from_value=int(lowest), to_value=int(highest), step=0)
                ]
            else:
                descriptor.floating_point_range = [
                    FloatingPointRange(from_value=lowest, to_value=highest, step=0.0)
                ]
        return descriptor


def declare_parameters(node: Node, specs: Iterable[ParameterSpec]) -> None:
    """Declare `specs` on `node`; raises rclpy's parameter exceptions for a bad override.

    A number may be set later as its text, because ``ros2 param load`` sends ``.nan`` and ``1e-06``
    as texts. Raises ValueError for an override whose name no node of this package has, if it was
    given by ``-p`` or resembles one; others, as in a file that nodes of several packages share, are
    logged.
    """
    declared = tuple(specs)
    _require_known(node, {spec.name for spec in declared})
    for spec in declared:
        node.declare_parameter(spec.name, spec.default, spec.descriptor)
    numbers = {spec.name for spec in declared if isinstance(spec.default, float)}

    def read_numbers(changes: list[Parameter]) -> list[Parameter]:
        return [_read(change) if change.name in numbers else change for change in changes]

    node.add_pre_set_parameters_callback(read_numbers)


def _typed_names(arguments: Sequence[str]) -> set[str]:
    """Return the names that stand behind ``-p``, in any node's favour."""
    behind = (word for option, word in itertools.pairwise(arguments) if option in ("-p", "--param"))
    return {word.partition(":=")[0].rpartition(":")[2] for word in behind}


def _require_known(node: Node, names: Collection[str]) -> None:
    """Refuse overrides that nothing would ever read."""
    overrides = getattr(node, "_parameter_overrides", {})  # rclpy offers no other way to them
    typed = _typed_names(sys.argv)
    for name in overrides:
        if name in names or is_known(name):
            continue
        close = resembling(name, {*names, *NODE_NAMES})
        if close or name in typed:
            hint = nearest(name, close or sorted(names))
            raise ValueError(f"{node.get_name()} has no parameter {name!r}: {hint}")
        node.get_logger().warning(
            f"no node of this package has the parameter {name!r}: it is ignored"
        )


def warn_of_columns(node: Node) -> None:
    """Warn, once, of what a valve file says of its tables and topics must have by themselves."""
    overrides = getattr(node, "_parameter_overrides", {})
    if found := [key for key in _TURNS_SIGNALS if key in overrides and overrides[key].value]:
        node.get_logger().warning(
            f"{' and '.join(found)}: the section columns is of tables and is not applied to "
            "topics: publish the position as it rises with the pressure, and the pressure less "
            "opposing_area_ratio times the opposing one"
        )


def _read(parameter: Parameter) -> Parameter:
    """Return a number for a text that is one; else the parameter as it is."""
    if parameter.type_ == Parameter.Type.STRING:
        text = parameter.value.replace(".nan", "nan").replace(".inf", "inf")
        with contextlib.suppress(ValueError):
            return Parameter(parameter.name, value=float(text))
    return parameter


def values_of(
    node: Node, specs: Iterable[ParameterSpec], changes: Iterable[Parameter] = ()
) -> dict[str, Any]:
    """Values of the parameters by name, as they would be after `changes`."""
    values = {spec.name: node.get_parameter(spec.name).value for spec in specs}
    for parameter in changes:
        if parameter.name in values:
            values[parameter.name] = parameter.value
    return values


def optional(value: float) -> float | None:
    """Turn the nan that stands for "not given" into None."""
    return None if math.isnan(value) else value


def reject_invalid(
    node: Node,
    specs: Iterable[ParameterSpec],
    build: Callable[[Mapping[str, Any]], object],
) -> None:
    """Have `node` reject any change with which `build`, fed all values, raises ValueError."""
    watched = tuple(specs)
    names = {spec.name for spec in watched}

    def check(changes: list[Parameter]) -> SetParametersResult:
        if not any(parameter.name in names for parameter in changes):
            return SetParametersResult(successful=True)
        try:
            build(values_of(node, watched, changes))
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(check)
