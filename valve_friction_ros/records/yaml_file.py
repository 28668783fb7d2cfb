"""YAML files of bounded size and depth, without repeated keys."""

from pathlib import Path
from typing import Any

import yaml

from valve_friction_ros.records.unreadable import cause_of

__all__ = ["read_yaml"]

_LARGEST = 1_000_000
"""Most bytes of a file. Chosen: a valve file has some hundred; PyYAML reads 0.1 MB a second."""


class _StrictLoader(yaml.SafeLoader):
    """Refuses a repeated key; YAML would silently take the last value."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Build a mapping; refuse a repeated key."""
        seen = set()
        keys = (key for key, _ in node.value if isinstance(key, yaml.ScalarNode))
        for key in keys:
            if key.value in seen:
                raise yaml.MarkedYAMLError(
                    problem=f"{key.value[:60]} is given twice", problem_mark=key.start_mark
                )
            seen.add(key.value)
        return super().construct_mapping(node, deep)


def read_yaml(path: Path) -> Any:
    """Read a YAML file; raises ValueError, with the file and the cause, if that fails."""
    try:
        with path.open("rb") as stream:
            content = stream.read(_LARGEST + 1)
        if len(content) > _LARGEST:
            raise ValueError(f"more than {_LARGEST // 1000} kB: give the file of one valve")
        return yaml.load(content.decode("utf-8-sig"), _StrictLoader)  # noqa: S506 - is safe
    except yaml.YAMLError as error:
        raise ValueError(f"{path}: not YAML: {' '.join(str(error).split())[:300]}") from None
    except RecursionError:
        raise ValueError(f"{path}: not YAML of a valve: it is nested too deeply") from None
    except (OSError, ValueError) as error:
        cause = cause_of(error)
        raise ValueError(f"{path}: cannot be read: {cause}") from None
