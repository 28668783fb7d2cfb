# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What people say of topics, keys and columns; their names and types come from the code."""

from collections.abc import Collection, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import yaml

__all__ = ["meanings", "require_all"]


@cache
def meanings() -> Mapping[str, Any]:
    """Return the texts of ``meanings.yaml``."""
    text = Path(__file__).with_name("meanings.yaml").read_text(encoding="utf-8")
    return yaml.safe_load(text)


def require_all(what: str, declared: Collection[str], said: Collection[str]) -> None:
    """Raise ValueError if something declared has no meaning, or a meaning nothing declared."""
    mute, idle = sorted(set(declared) - set(said)), sorted(set(said) - set(declared))
    if mute:
        raise ValueError(f"{what} without a meaning in doc/extension/meanings.yaml: {mute}")
    if idle:
        raise ValueError(
            f"{what} that doc/extension/meanings.yaml explains, and no code has: {idle}"
        )
