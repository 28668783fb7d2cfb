# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Entry points of the nodes, which can be interrupted even before a node is imported."""

import contextlib
import importlib
import os
import signal
import sys
from functools import partial


def _end(*_: object) -> None:
    os._exit(0)


def lack_of_ros(error: ImportError) -> str:
    """Return the line that says that ROS 2 is missing; raises `error` if something else is."""
    name = (error.name or "").partition(".")[0]
    if not (name.startswith(("rcl", "builtin_interfaces")) or name.endswith(("_msgs", "_srvs"))):
        raise error
    return f"ROS 2 is needed ({error}): source it, or use the environment of `make venv`"


def _start(node: str) -> int:
    """Import and run a node; Ctrl-C or SIGTERM during the import ends the process at once."""
    # An exception raised during an import may be swallowed there.
    for request in (signal.SIGINT, signal.SIGTERM):
        signal.signal(request, _end)
    try:
        module = importlib.import_module(f"valve_friction_ros.nodes.{node}")
    except ImportError as error:
        sys.stderr.write(f"{node.partition('.')[0]}: {lack_of_ros(error)}\n")
        return 2
    if {"-h", "--help"} & set(sys.argv[1:]):
        # A reader that stops early, such as `head`, ends the program silently.
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
        print(_help_text(node.split(".", maxsplit=1)[0], str(module.__doc__)))  # noqa: T201
        return 0
    if rest := _not_of_ros():
        print(  # noqa: T201
            f"cannot start: {rest[0]!r} is not a ROS argument: write --ros-args before all -r, -p "
            "and --params-file; see --help",
            file=sys.stderr,
        )
        return 2
    exit_code: int = module.main()
    # Everything is closed: Python would need another second to tear down its modules.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(exit_code)


def _not_of_ros() -> list[str]:
    """Return the arguments that ROS does not read; none if it will refuse the others."""
    from rclpy.utilities import remove_ros_args  # noqa: PLC0415 - slow to import

    with contextlib.suppress(RuntimeError):
        return [*remove_ros_args(sys.argv)[1:]]
    return []


def _help_text(name: str, purpose: str) -> str:
    """Return the usage of the executable `name` and the meaning of its parameters."""
    import yaml  # noqa: PLC0415 - slow to import

    from valve_friction_ros.settings import NODES  # noqa: PLC0415

    lines = [
        f"usage: {name} [--ros-args [-r __ns:=/fv_101] [-p NAME:=VALUE] [--params-file FILE]]",
        "",
        purpose,
        "",
        "Ctrl-C stops it. Parameters and their defaults, as written in a FILE:",
    ]
    for one in NODES[name]:
        if one.default is None:
            taken = "" if one.assumed is None else f"; {one.assumed:g} is assumed and reported"
            lines.append(f"  # {one.name}:  # {one.description}; unset{taken}")
            continue
        default = yaml.safe_dump(one.default, default_flow_style=True).splitlines()[0]
        lines.append(f"  {one.name}: {default}  # {one.description}")
    return "\n".join(lines)


dashboard = partial(_start, "dashboard")
identifier = partial(_start, "identifier.node")
identifiers = partial(_start, "identifiers")
simulator = partial(_start, "simulator")
stroke_player = partial(_start, "stroke_player")
pressure_source = partial(_start, "pressure_source")
