"""Checks of the value types; their messages name the value and its rule."""

import math

__all__ = ["require_finite", "require_non_negative", "require_positive"]


def require_finite(name: str, value: float) -> float:
    """Return `value` as a float, or raise ValueError if it is not a finite number."""
    if isinstance(value, (bool, str)):
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
