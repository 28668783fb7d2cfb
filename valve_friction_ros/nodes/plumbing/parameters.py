# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Settings as parameters of a node: declaration, checks, values, and objects built from them."""

import contextlib
import functools
import itertools
import math
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from typing import Any

from rcl_interfaces import msg, srv
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from valve_friction_ros.model.valve import Valve
from valve_friction_ros.nodes.plumbing.rclpy_private import parameter_overrides
from valve_friction_ros.outside_text import nearest, resembling
from valve_friction_ros.settings import NODE_NAMES, VALVE, Setting, is_known

_TURNS_SIGNALS = ("columns.inverted_position", "columns.opposing_pressure_column")
"""Keys of a valve file that convert the signals of a table, but have no effect on topics."""

UNSET = ("null", "None")
"""Text that ``ros2 param`` uses for an unset parameter, in its file and in its request."""


@functools.cache
def _descriptor(setting: Setting) -> ParameterDescriptor:
    """Return the ROS descriptor of a setting, shared by all nodes of the process."""
    descriptor = ParameterDescriptor(
        description=setting.description,
        additional_constraints=f"one of {', '.join(setting.choices)}" if setting.choices else "",
        read_only=setting.read_only,
        dynamic_typing=setting.default is None,
    )
    if setting.limits is not None:
        lowest, highest = setting.limits
        if isinstance(setting.default, int):
            descriptor.integer_range = [
                IntegerRange(from_value=int(lowest), to_value=int(highest), step=0)
            ]
        else:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=lowest, to_value=highest, step=0.0)
            ]
    return descriptor


def declare_parameters(node: Node, settings: Iterable[Setting]) -> None:
    """Declare `settings` on `node`; raises rclpy's parameter exceptions for a bad override.

    A number may later be set as text, because ``ros2 param load`` sends ``.nan`` and ``1e-06`` as
    text, and ``null`` of a number that is unset. A number that ``ros2 param delete`` has unset
    stays declared.

    Raises ValueError for all overrides of wrong type, range or choice, and for those with a name
    that no node of this package declares, if it was given by ``-p`` or resembles a declared name.
    Other unknown overrides, as in a file shared with other packages, are logged.
    """
    declared = tuple(settings)
    problems = [*_unknown(node, {one.name for one in declared})]
    unset = {one.name: one for one in declared if one.default is None}
    overrides = parameter_overrides(node)
    for name in [one for one in unset if one in overrides and overrides[one].value in UNSET]:
        del overrides[name]
    if problems := [*problems, *_problems(declared, overrides.values())]:
        raise ValueError("; ".join(problems))

    def check(changes: list[Parameter]) -> SetParametersResult:
        reason = "; ".join(_problems(declared, changes))
        return SetParametersResult(successful=not reason, reason=reason)

    node.declare_parameters("", [(one.name, one.default, _descriptor(one)) for one in declared])
    node.add_on_set_parameters_callback(check)  # now, as rclpy calls it for each declaration
    numbers = {
        one.name for one in declared if one.default is None or isinstance(one.default, float)
    }

    def read(change: Parameter) -> Parameter:
        if change.name in unset and change.value in UNSET:
            return Parameter(change.name)
        return _read(change) if change.name in numbers else change

    node.add_pre_set_parameters_callback(lambda changes: [read(change) for change in changes])

    def stay_declared(changes: list[Parameter]) -> None:
        for name in [one.name for one in changes if not node.has_parameter(one.name)]:
            node.declare_parameter(name, None, _descriptor(unset[name]), ignore_override=True)

    node.add_post_set_parameters_callback(stay_declared)


def _problems(settings: Iterable[Setting], changes: Iterable[Parameter]) -> Iterator[str]:
    """Yield what is wrong with each parameter by itself, with the remedy.

    rclpy tells only the first, checks no type where a parameter may be unset, and names no remedy.
    """
    known = {one.name: one for one in settings}
    for change in changes:
        if change.name not in known or change.type_ == Parameter.Type.NOT_SET:
            continue
        one, value = known[change.name], change.value
        default, (lowest, highest) = one.default, one.limits or (-math.inf, math.inf)
        wanted = Parameter("", value=math.nan if default is None else default).type_
        if isinstance(default, list | tuple):
            continue
        if change.type_ == wanted:
            if one.choices and one.spell(value) not in one.choices:
                yield f"there is no {one.name} {value!r}: choose from {', '.join(one.choices)}"
            elif one.limits and not lowest <= value <= highest:
                yield f"{one.name} must be {lowest:g} to {highest:g}, got {value:g}"
            continue
        is_whole = change.type_ == Parameter.Type.INTEGER
        remedy = {
            Parameter.Type.BOOL: "write true or false",
            Parameter.Type.DOUBLE: f"write {value}.0" if is_whole else "write a number",
            Parameter.Type.INTEGER: "write a whole number",
        }.get(wanted, f"put it in quotes, '{value}'")
        # By name, because the types of Kilted format as numbers.
        types = f"expected 'Type.{wanted.name}' got 'Type.{change.type_.name}'"
        yield f"{change.name}: {types}: {remedy}"


def _unknown(node: Node, names: Collection[str]) -> Iterator[str]:
    """Yield the problems of mistyped overrides; log other overrides that no node reads."""
    behind = (word for option, word in itertools.pairwise(sys.argv) if option in ("-p", "--param"))
    typed = {word.partition(":=")[0].rpartition(":")[2] for word in behind}  # for any node
    for name in parameter_overrides(node):
        if name in names or is_known(name):
            continue
        close = resembling(name, {*names, *NODE_NAMES})
        if close or name in typed:
            hint = nearest(name, close or sorted(names))
            yield f"{node.get_name()} has no parameter {name!r}: {hint}"
            continue
        node.get_logger().warning(
            f"no node of this package has the parameter {name!r}: it is ignored"
        )


def warn_of_columns(node: Node) -> None:
    """Warn once of keys of a valve file that convert tables, but have no effect on topics."""
    overrides = parameter_overrides(node)
    if found := [key for key in _TURNS_SIGNALS if key in overrides and overrides[key].value]:
        node.get_logger().warning(
            f"{' and '.join(found)}: the section columns applies to tables, not to topics: "
            "publish the position so that it rises with the pressure, and publish the pressure "
            "less opposing_area_ratio times the opposing pressure"
        )


def _read(parameter: Parameter) -> Parameter:
    """Convert text that is a number to a number; return other parameters unchanged."""
    if parameter.type_ == Parameter.Type.STRING:
        text = parameter.value.replace(".nan", "nan").replace(".inf", "inf")
        with contextlib.suppress(ValueError):
            return Parameter(parameter.name, value=float(text))
    return parameter


def values_of(
    node: Node, settings: Iterable[Setting], changes: Iterable[Parameter] = ()
) -> dict[str, Any]:
    """Return the values of the parameters by name after `changes`; None if unset."""
    values = {one.name: node.get_parameter_or(one.name).value for one in settings}
    for parameter in changes:
        if parameter.name in values:
            values[parameter.name] = parameter.value
    return values


def reject_invalid(
    node: Node, settings: Iterable[Setting], build: Callable[[Mapping[str, Any]], object]
) -> None:
    """Make `node` reject changes for which `build`, called with all values, raises ValueError."""
    watched = tuple(settings)
    names = {one.name for one in watched}

    def check(changes: list[Parameter]) -> SetParametersResult:
        if not any(parameter.name in names for parameter in changes):
            return SetParametersResult(successful=True)
        reason = "; ".join(_problems(watched, changes))
        if not reason:
            try:
                build(values_of(node, watched, changes))
            except ValueError as error:
                reason = str(error)
        return SetParametersResult(successful=not reason, reason=reason)

    node.add_on_set_parameters_callback(check)


def _changes(
    node: Node, messages: Iterable[msg.Parameter]
) -> Iterator[Parameter | SetParametersResult]:
    """Yield the parameters of a request, and the results of those that nobody can set.

    A quality of service for a topic that the node does not have is ignored, as it is at the start:
    the dump of a node in one namespace can then be loaded in another.
    """
    for one in messages:
        if not node.has_parameter(one.name):
            if is_ignored := one.name.startswith("qos_overrides."):
                reason = "ignored, as the node does not have this topic"
            else:
                hint = nearest(one.name, node.list_parameters([], 0).names)
                reason = f"{node.get_name()} has no parameter {one.name!r}: {hint}"
            yield SetParametersResult(successful=is_ignored, reason=reason)
            continue
        try:
            yield Parameter.from_parameter_msg(one)
        except ValueError:
            kinds = ", ".join(f"{kind.value} {kind.name.lower()}" for kind in Parameter.Type)
            reason = f"{one.name}: there is no type {one.value.type}: choose from {kinds}"
            yield SetParametersResult(successful=False, reason=reason)


def set_together(
    node: Node,
    request: srv.SetParametersAtomically.Request,
    response: srv.SetParametersAtomically.Response,
) -> srv.SetParametersAtomically.Response:
    """Answer ``~/set_parameters_atomically``: set all parameters or none."""
    changes = [*_changes(node, request.parameters)]
    wanted = [one for one in changes if isinstance(one, Parameter)]
    told = [one for one in changes if not isinstance(one, Parameter)]
    if reasons := [one.reason for one in told if not one.successful]:
        response.result = SetParametersResult(successful=False, reason="; ".join(reasons))
    else:
        response.result = node.set_parameters_atomically(wanted)
    return response


def set_each(
    node: Node, request: srv.SetParameters.Request, response: srv.SetParameters.Response
) -> srv.SetParameters.Response:
    """Answer ``~/set_parameters``: set all parameters at once, or else those that can be set.

    rclpy sets one after the other. ``ros2 param load`` so lost part of a valid file, whose limits,
    for example, contradict those before it until both are set. Here the order has no effect.
    """
    results: dict[int, SetParametersResult] = {}
    left: dict[int, Parameter] = {}
    for number, change in enumerate(_changes(node, request.parameters)):
        if isinstance(change, Parameter):
            left[number] = change
        else:
            results[number] = change
    free = [
        number for number, one in left.items() if not node.describe_parameter(one.name).read_only
    ]
    if free and node.set_parameters_atomically([left[number] for number in free]).successful:
        results |= {number: SetParametersResult(successful=True) for number in free}
        left = {number: one for number, one in left.items() if number not in free}
    has_changed = True
    while has_changed:  # a change may need another that comes later
        has_changed = False
        for number, one in [*left.items()]:
            results[number] = node.set_parameters_atomically([one])
            if results[number].successful:
                del left[number]
                has_changed = True
    response.results = [results[number] for number in range(len(request.parameters))]
    return response


def valve_from(values: Mapping[str, Any]) -> Valve:
    """Build the valve from parameter values; raises ValueError if they are impossible."""
    taken = {
        one.name: one.assumed if values[one.name] is None else values[one.name] for one in VALVE
    }
    return Valve(**taken)
