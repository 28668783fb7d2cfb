"""Copies of mappings that nobody can change: Python neither copies nor pickles those."""

import copyreg
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

__all__ = ["frozen"]


def frozen(mapping: Mapping[Any, Any]) -> MappingProxyType[Any, Any]:
    """Return a copy of a mapping that nobody can change."""
    return MappingProxyType(dict(mapping))


# Results and settings hold such mappings, and go to other processes, to joblib and to Dask.
copyreg.pickle(MappingProxyType, lambda one: (frozen, (dict(one),)))
