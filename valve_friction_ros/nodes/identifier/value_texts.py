"""Figures of a valve as values of its diagnostics."""

import math

from valve_friction_ros.health import Ratio

__all__ = ["number_text", "ratio_values"]


def number_text(value: float | None) -> str:
    """Write a number; nan where there is none."""
    return f"{math.nan if value is None else value:.9g}"


def ratio_values(ratio: Ratio | None, prefix: str = "") -> dict[str, str]:
    """Return the values of a friction over its baseline, their keys after `prefix`."""
    if ratio is None:
        return {}
    return {
        f"{prefix}friction_ratio": number_text(ratio.value),
        f"{prefix}friction_ratio low": number_text(ratio.low),
        f"{prefix}friction_ratio high": number_text(ratio.high),
        f"{prefix}friction_ratio of": ratio.what,
    }
