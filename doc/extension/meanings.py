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
