"""Why the published method finds other numbers, in words."""

import math

from valve_friction_ros.identification import Parameter, Result
from valve_friction_ros.reports.identification_tables import words_of, written

__all__ = ["published_words"]

_UNKNOWN = "samples faster than a threshold δv"


def published_words(result: Result) -> str:
    """Return why published values and values differ, and where they do; empty without any."""
    beside = [one for one in result.parameters.values() if not math.isnan(one.published)]
    if not beside or result.method in ("published", "signature"):
        return ""
    evidence = result.evidence
    samples = _UNKNOWN
    if "threshold" in evidence:
        samples = f"samples faster than δv = {evidence['threshold']:.3g} m/s"
    words = (
        "Published method: the regression of the paper, for comparison. It uses derivatives of "
        f"the smoothed position, and only {samples}. Noise, smoothing, lags and slow sliding bias "
        f"it; it has no interval, and gives a number also where the record determines none. "
        f"{_how_else(result)}Where the two differ, use the value."
    )
    outside = [one for one in beside if _differs(one)]
    if not outside:
        return f"{words} Here every published value that has an interval lies within it."
    told = "; ".join(
        f"{words_of(one.name)}: {written(one.published)} against {written(one.value)} {one.unit}"
        for one in outside
    )
    return f"{words} Published values beyond the interval here: {told}."


def _how_else(result: Result) -> str:
    """Say how the value is found, where that is known of the method."""
    if result.stem is not None:
        samples = f"over all samples{_counts_with(result)}"
        return f"The value fits the simulated stem to the measured one, {samples}. "
    if result.method in ("refined", "robust"):
        return "The value averages force and friction as the acceleration, over all samples. "
    return ""


def _counts_with(result: Result) -> str:
    if "uncertainty_budget" not in result.evidence:
        return ""
    return " and at rest too, and counts with lags, noise and imperfections of the sensors"


def _differs(one: Parameter) -> bool:
    return one.half_width > 0 and abs(one.published - one.value) > one.half_width
