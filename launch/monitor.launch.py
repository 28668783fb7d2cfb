"""An identifier for each valve of a list, each in the valve's namespace.

``ros2 launch valve_friction_ros monitor.launch.py valves:=fv_101,fv_102
pressure_topic:='/plant/{valve}/pressure' stem_topic:='/plant/{valve}/stem'``
"""

import re
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

PACKAGE = "valve_friction_ros"
NAMESPACE = re.compile(r"/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)


def valve_names(text: str) -> list[str]:
    """Split a list of valves at commas and spaces; refuse what ROS takes for no namespace."""
    names = text.replace(",", " ").split()
    if not names:
        raise ValueError("no valve given: name at least one, as in valves:=fv_101,fv_102")
    for name in names:
        if not NAMESPACE.fullmatch(name):
            raise ValueError(
                f"valve '{name}' is no ROS namespace: use letters, digits and underscores, "
                "as in valves:=fv_101,fv_102"
            )
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise ValueError(f"valve '{repeated[0]}' is listed twice: name each valve once")
    return names


def identifiers(context: LaunchContext) -> list[Node]:
    """Make an identifier for each valve; ``{valve}`` in a topic stands for the valve's name."""
    config = LaunchConfiguration("config").perform(context)
    if not Path(config).is_file():
        raise ValueError(f"config '{config}' is no file: give the path of a parameter file")
    pressure = LaunchConfiguration("pressure_topic").perform(context)
    stem = LaunchConfiguration("stem_topic").perform(context)
    use_sim_time = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    return [
        Node(
            package=PACKAGE,
            executable="identifier",
            name="identifier",
            namespace=valve,
            parameters=[config, {"use_sim_time": use_sim_time}],
            remappings=[
                ("actuator_pressure", pressure.replace("{valve}", valve.strip("/"))),
                ("stem_state", stem.replace("{valve}", valve.strip("/"))),
            ],
            output="screen",
        )
        for valve in valve_names(LaunchConfiguration("valves").perform(context))
    ]


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments and start the identifiers."""
    default_config = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "monitor.yaml"])
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "valves",
                default_value="fv_101",
                description="Namespaces of the valves, separated by commas.",
            ),
            DeclareLaunchArgument(
                "config",
                default_value=default_config,
                description="Parameter file for the identifiers.",
            ),
            DeclareLaunchArgument(
                "pressure_topic",
                default_value="actuator_pressure",
                description="Actuator pressure, sensor_msgs/FluidPressure; may contain {valve}.",
            ),
            DeclareLaunchArgument(
                "stem_topic",
                default_value="stem_state",
                description="Stem position, sensor_msgs/JointState; may contain {valve}.",
            ),
            DeclareLaunchArgument(
                "use_sim_time",
                default_value="false",
                description="true to take time from /clock, as when a bag is played.",
            ),
            OpaqueFunction(function=identifiers),
        ]
    )
