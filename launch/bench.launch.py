"""A bench: pressure source, simulated valve and identifier in one namespace.

``ros2 launch valve_friction_ros bench.launch.py valve:=fv_102 config:=/path/to/bench.yaml``

``identifier:=false`` starts the valve alone.
"""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PACKAGE = "valve_friction_ros"


def nodes(context: LaunchContext) -> list[Node]:
    """Make the nodes, with one parameter file; the tag of fv_101 is FV-101 unless that says so."""
    valve = LaunchConfiguration("valve").perform(context)
    tag = {"valve_tag": valve.rpartition("/")[2].upper().replace("_", "-")}
    names = ["pressure_source", "simulator"]
    if LaunchConfiguration("identifier").perform(context).lower() in {"true", "1"}:
        names.append("identifier")
    config = LaunchConfiguration("config").perform(context)
    if not Path(config).is_file():
        raise ValueError(f"config '{config}' is no file: give the path of a parameter file")
    return [
        Node(
            package=PACKAGE,
            executable=name,
            name=name,
            namespace=valve,
            parameters=[tag, config] if name == "identifier" else [config],
            output="screen",
        )
        for name in names
    ]


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments and start the nodes."""
    default_config = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "bench_low.yaml"])
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "valve",
                default_value="fv_101",
                description="Namespace of the valve: letters, digits and underscores.",
            ),
            DeclareLaunchArgument(
                "config",
                default_value=default_config,
                description="Parameter file with a section for each of the three nodes.",
            ),
            DeclareLaunchArgument(
                "identifier",
                default_value="true",
                description="false to start the valve without its identifier.",
            ),
            OpaqueFunction(function=nodes),
        ]
    )
