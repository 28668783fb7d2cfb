# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The identifiers of a plant's valves, each in its valve's namespace, in one process.

``ros2 launch valve_friction_ros monitor.launch.py valves:=fv_101,fv_102
pressure_topic:='/plant/{valve}/pressure' stem_topic:='/plant/{valve}/stem'``

In place of the list, ``valves:=plant.yaml`` names a file: a list of valves, or each with topics::

    fv_101: {pressure_topic: /plant/p101, stem_topic: /plant/x101}
    fv_102:

``dashboard:=true`` starts the dashboard beside them.
"""

import re
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from valve_friction_ros.outside_text import NAMESPACE, nearest, require_namespace, resembling

PACKAGE = "valve_friction_ros"
TOPIC = re.compile("~?" + NAMESPACE.pattern, re.ASCII)
INPUTS = {"pressure_topic": "actuator_pressure", "stem_topic": "stem_state"}
"""Arguments, and keys of a file of valves, with the name that each remaps."""


class PlantValve(NamedTuple):
    """A valve of the plant: its namespace, and its topics by argument."""

    namespace: str
    topics: dict[str, str]

    def remappings(self, within: str) -> list[tuple[str, str]]:
        """Remap the inputs, whose names begin with `within`."""
        return [(within + INPUTS[argument], topic) for argument, topic in self.topics.items()]

    def qualities(self, reliability: str) -> dict[str, str]:
        """Return the parameters that override the reliability of the inputs."""
        if reliability == "auto":
            return {}
        names = [topic if topic.startswith("/") else f"{self.namespace}/{topic}"
                 for topic in self.topics.values()]  # fmt: skip
        return {f"qos_overrides.{name}.subscription.reliability": reliability for name in names}


def listed(text: str) -> list[tuple[str, Any]]:
    """Return the valves of a list, or of a YAML file, with what the file says of each."""
    if not text.endswith((".yaml", ".yml")):
        found: Any = text.replace(",", " ").split()
    else:
        if not Path(text).is_file():
            raise ValueError(f"valves '{text}' is not a file: give its path, or a list of valves")
        try:
            found = yaml.safe_load(Path(text).read_text(encoding="utf-8")) or []
        except (yaml.YAMLError, UnicodeDecodeError) as error:
            reason = " ".join(str(error).split())
            raise ValueError(f"valves '{text}' cannot be read as YAML: {reason}") from None
        if not isinstance(found, list | dict):
            raise ValueError(f"valves '{text}' holds no valves: write a line such as 'fv_101:'")
    if not found:
        raise ValueError("no valve given: give at least one, as in valves:=fv_101,fv_102")
    if isinstance(found, dict):
        return [(str(name), topics or {}) for name, topics in found.items()]
    return [(str(name), {}) for name in found]


def plant_valves(text: str, usual: dict[str, str]) -> list[PlantValve]:
    """Read the valves; ``{valve}`` in a topic stands for the valve's name."""
    valves: dict[str, PlantValve] = {}
    for name, given in listed(text):
        require_namespace(name, "valves:=fv_101,fv_102")
        if not isinstance(given, dict) or (unknown := sorted(map(str, set(given) - set(INPUTS)))):
            what = f"the unknown key '{unknown[0]}'" if isinstance(given, dict) else f"'{given}'"
            raise ValueError(
                f"valve '{name}' has {what}: use {' and '.join(INPUTS)}; put parameters of single "
                "valves into the config"
            )
        place = name.strip("/")
        topics = {
            key: str("" if topic is None else topic).replace("{valve}", place)
            for key, topic in {**usual, **given}.items()
        }
        for key, topic in topics.items():
            if not TOPIC.fullmatch(topic):
                raise ValueError(
                    f"{key} '{topic}' of valve '{name}' is not a topic name: use letters, digits, "
                    f"underscores and slashes, and {{valve}} for the name of the valve"
                )
        if f"/{place}" in valves:
            raise ValueError(f"valve '{name}' is listed twice: name each valve once")
        valves[f"/{place}"] = PlantValve(f"/{place}", topics)
    return list(valves.values())


def require_known(context: LaunchContext) -> None:
    """Refuse a name that resembles one of the arguments; others may be of a file that includes."""
    names = {*ARGUMENTS, "config"}
    for name in set(context.launch_configurations) - names:
        if close := resembling(name, names):
            raise ValueError(f"there is no argument '{name}': {nearest(name, close)}")


def identifiers(context: LaunchContext) -> list[Node]:
    """Make one process for all valves, or one for each."""

    def argument(name: str) -> str:
        return str(LaunchConfiguration(name).perform(context))

    require_known(context)
    if not Path(argument("config")).is_file():
        raise ValueError(
            f"config '{argument('config')}' is not a file: give the path of a parameter file"
        )
    valves = plant_valves(argument("valves"), {name: argument(name) for name in INPUTS})
    use_sim_time = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    shared = {"use_sim_time": use_sim_time}
    for valve in valves:
        shared |= valve.qualities(argument("reliability"))
    common = {
        "package": PACKAGE,
        "output": "screen",
        "respawn": LaunchConfiguration("respawn"),
        "respawn_delay": 2.0,
        "ros_arguments": ["--log-level", argument("log_level")],
    }
    if argument("one_process").lower() == "true":
        remappings = [rule for one in valves for rule in one.remappings(f"{one.namespace}/")]
        names = {"valves": [valve.namespace for valve in valves]}
        parameters = [argument("config"), shared | names]
        return [
            Node(executable="identifiers", parameters=parameters, remappings=remappings, **common)
        ]
    return [
        Node(
            executable="identifier",
            name="identifier",
            namespace=valve.namespace,
            parameters=[argument("config"), shared],
            remappings=valve.remappings(""),
            **common,
        )
        for valve in valves
    ]


def dashboard(context: LaunchContext) -> list[Node]:
    """Make the dashboard, if it is asked for."""
    if str(LaunchConfiguration("dashboard").perform(context)).lower() != "true":
        return []
    time = {"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)}
    return [
        Node(
            package=PACKAGE,
            executable="dashboard",
            name="dashboard",
            output="screen",
            parameters=[LaunchConfiguration("config"), time],
            respawn=LaunchConfiguration("respawn"),
            respawn_delay=2.0,
            ros_arguments=["--log-level", LaunchConfiguration("log_level")],
        )
    ]


YES_OR_NO = ["true", "false", "True", "False"]
ARGUMENTS = {
    "valves": (
        "fv_101",
        "Namespaces of the valves, separated by commas, or a YAML file of valves.",
        None,
    ),
    "pressure_topic": (
        "actuator_pressure",
        "Actuator pressure, sensor_msgs/FluidPressure; may contain {valve}.",
        None,
    ),
    "stem_topic": (
        "stem_state",
        "Stem position, sensor_msgs/JointState; may contain {valve}.",
        None,
    ),
    "one_process": ("true", "false to start a process for each valve.", YES_OR_NO),
    "dashboard": (
        "false",
        "true to start the dashboard too, on http://127.0.0.1:8080/.",
        YES_OR_NO,
    ),
    "respawn": (
        "true",
        "false to leave a process stopped once it has ended by itself.",
        YES_OR_NO,
    ),
    "log_level": ("info", "Of the nodes.", ["debug", "info", "warn", "error", "fatal"]),
    "use_sim_time": (
        "false",
        "true to take time from /clock, as when a bag is played.",
        YES_OR_NO,
    ),
    "reliability": (
        "auto",
        "Of the inputs: best_effort never holds up a publisher; the others take what is published.",
        ["auto", "reliable", "best_effort"],
    ),
}


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments and start the identifiers."""
    default_config = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "monitor.yaml"])
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
                description="Parameter file for the identifiers.",
            ),
            OpaqueFunction(function=identifiers),
            OpaqueFunction(function=dashboard),
        ]
    )
