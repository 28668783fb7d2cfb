# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A bench: pressure source, simulated valve and identifier in one namespace.

``ros2 launch valve_friction_ros bench.launch.py valve:=fv_102 config:=/path/to/bench.yaml``

``identifier:=false`` starts the valve alone.
"""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from valve_friction_ros.outside_text import nearest, require_namespace, resembling

PACKAGE = "valve_friction_ros"
YES_OR_NO = ["true", "false", "True", "False"]
ARGUMENTS = {
    "valve": ("fv_101", "Namespace of the valve: letters, digits and underscores.", None),
    "identifier": ("true", "false to start the valve without its identifier.", YES_OR_NO),
    "log_level": (
        "info",
        "Of the nodes.",
        ["debug", "info", "warn", "error", "fatal"],
    ),
    "use_sim_time": ("false", "true to take time from /clock.", YES_OR_NO),
}


def require_known(context: LaunchContext) -> None:
    """Refuse a name that resembles one of the arguments; others may be of a file that includes."""
    names = {*ARGUMENTS, "config"}
    for name in set(context.launch_configurations) - names:
        if close := resembling(name, names):
            raise ValueError(f"there is no argument '{name}': {nearest(name, close)}")


def nodes(context: LaunchContext) -> list[Node]:
    """Make the nodes, with one parameter file; the tag of fv_101 is FV-101 unless that says so."""
    require_known(context)
    valve = LaunchConfiguration("valve").perform(context)
    require_namespace(valve, "valve:=fv_101")
    tag = {"valve_tag": valve.rpartition("/")[2].upper().replace("_", "-")}
    names = ["pressure_source", "simulator"]
    if LaunchConfiguration("identifier").perform(context).lower() == "true":
        names.append("identifier")
    config = LaunchConfiguration("config").perform(context)
    if not Path(config).is_file():
        raise ValueError(f"config '{config}' is not a file: give the path of a parameter file")
    time = {"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)}
    return [
        Node(
            package=PACKAGE,
            executable=name,
            name=name,
            namespace=valve,
            parameters=[tag, config, time] if name == "identifier" else [config, time],
            output="screen",
            ros_arguments=["--log-level", LaunchConfiguration("log_level")],
        )
        for name in names
    ]


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments and start the nodes."""
    default_config = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "bench_low.yaml"])
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(
                    name, default_value=default, description=description, choices=choices
                )
                for name, (default, description, choices) in ARGUMENTS.items()
            ),
            DeclareLaunchArgument(
                "config",
                default_value=default_config,
                description="Parameter file with a section for each of the three nodes.",
            ),
            OpaqueFunction(function=nodes),
        ]
    )
