# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Validation of value types: checks whose messages name the rule, and frozen mappings.

Python neither copies nor pickles a read-only mapping; those of `frozen` can be copied and pickled.
"""

import copyreg
import math
from collections.abc import Mapping
from dataclasses import fields
from decimal import Decimal
from types import MappingProxyType
from typing import Any, TypeVar

_Type = TypeVar("_Type", bound=type[Any])


def equal_by_fields(data: _Type) -> _Type:
    """Decorate a dataclass of numbers that may be nan: it compares its fields as one tuple.

    A tuple takes each object, and so `math.nan`, to be equal to itself. The comparison of a
    dataclass does not since Python 3.13: two equal ones with a nan would differ.
    """
    names = tuple(one.name for one in fields(data) if one.compare)

    def numbers(one: object) -> tuple[object, ...]:
        return tuple(getattr(one, name) for name in names)

    def equal(self: object, other: object) -> Any:
        is_alike = other.__class__ is self.__class__
        return numbers(self) == numbers(other) if is_alike else NotImplemented

    data.__eq__ = equal  # type: ignore[assignment]
    return data


def frozen(mapping: Mapping[Any, Any]) -> MappingProxyType[Any, Any]:
    """Return a read-only copy of a mapping."""
    return MappingProxyType(dict(mapping))


# Results and settings hold such mappings, and go to other processes, to joblib and to Dask.
copyreg.pickle(MappingProxyType, lambda one: (frozen, (dict(one),)))


A_VALVE = "vf.Valve(...), or the valve of vf.read_valve_file(...)"
A_MODEL = "a result, or vf.KarnoppParameters(...)"
"""What to give for a valve, and for a model."""


def require_type(name: str, given: object, remedy: str, *kinds: type) -> None:
    """Raise TypeError with the remedy if an argument is of none of these types."""
    if not isinstance(given, kinds):
        known = " or ".join(kind.__name__ for kind in kinds)
        raise TypeError(
            f"{name} must be of type {known}, got {type(given).__name__}: give {remedy}"
        )


def require_whole(name: str, value: int, least: int = 0) -> int:
    """Return `value` as an int, or raise ValueError if it is no whole number or below the least."""
    if isinstance(value, bool) or not hasattr(value, "__index__") or value < least:
        raise ValueError(f"{name} must be a whole number of at least {least}, got {value!r}")
    return int(value)


def require_finite(name: str, value: float) -> float:
    """Return `value` as a float, or raise ValueError if it is not a finite number."""
    if isinstance(value, (bool, str, Decimal)):
        raise ValueError(f"{name} must be a number, got {value!r}")
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be a number, got {value!r}") from None
    if not math.isfinite(number):
        raise ValueError(f"{name} must be finite, got {number}")
    return number


def require_non_negative(name: str, value: float) -> float:
    """Return `value` as a float, or raise ValueError if it is negative or not finite."""
    number = require_finite(name, value)
    if number < 0:
        raise ValueError(f"{name} must not be negative, got {number:g}")
    return number


def require_positive(name: str, value: float) -> float:
    """Return `value` as a float, or raise ValueError if it is not finite and above zero."""
    number = require_finite(name, value)
    if number <= 0:
        raise ValueError(f"{name} must be above zero, got {number:g}")
    return number
