"""What a node prints for ``--help``."""

from collections.abc import Iterable

import yaml

from valve_friction_ros.nodes.plumbing.parameters import ParameterSpec

__all__ = ["help_text"]


def help_text(name: str, purpose: str, specs: Iterable[ParameterSpec]) -> str:
    """Say how the executable `name` is run, and what its parameters mean."""
    lines = [
        f"usage: {name} [--ros-args [-r __ns:=/fv_101] [-p NAME:=VALUE] [--params-file FILE]]",
        "",
        purpose,
        "",
        "Ctrl-C stops it. Parameters and their defaults, as they are written in a FILE:",
    ]
    for spec in specs:
        default = yaml.safe_dump(spec.default, default_flow_style=True).splitlines()[0]
        lines.append(f"  {spec.name}: {default}  # {spec.description}")
    return "\n".join(lines)
