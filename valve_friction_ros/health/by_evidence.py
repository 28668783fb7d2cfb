"""The diagnosis by the moves of a valve in service, and the baseline that they can be."""

import math
from datetime import datetime, timezone

from valve_friction_ros.evidence import Change, Evidence
from valve_friction_ros.health.baseline import LARGEST_SHARE, Baseline, SlidingFriction
from valve_friction_ros.health.comparison import compared
from valve_friction_ros.health.diagnosis import Diagnosis, FrictionLimits, against
from valve_friction_ros.health.levels import Level, StatusSignal
from valve_friction_ros.identification import SLIDING, RefusalError
from valve_friction_ros.identification.trust.rounding import percentage, two_digits
from valve_friction_ros.model.valve import Valve

__all__ = ["baseline_by_evidence", "diagnosis_by_evidence"]


def baseline_by_evidence(evidence: Evidence) -> Baseline:
    """Return the sliding friction of the moves as baseline.

    Raises RefusalError if it is not known to `LARGEST_SHARE`.
    """
    one = evidence.parameters[SLIDING].without_calibration
    if math.isnan(one.value):
        raise RefusalError(f"the moves in service are no baseline yet: {one.reason}")
    if one.value <= 0:
        raise RefusalError(
            f"a sliding friction of {one.value:.4g} N cannot be a baseline: check the direction of "
            "both signals"
        )
    if one.half_width > LARGEST_SHARE * one.value:
        raise RefusalError(
            f"the moves in service are no baseline yet: sliding friction is known to "
            f"±{percentage(one.half_width / one.value)}, and a baseline needs "
            f"±{percentage(LARGEST_SHARE)}: let the valve work on, and state a timing_uncertainty "
            "if the clocks and lags of both signals are known"
        )
    return Baseline(sliding=SlidingFriction(one.value, one.half_width, evidence.sliding_speed))


def diagnosis_by_evidence(
    evidence: Evidence, valve: Valve, baseline: Baseline | None, limits: FrictionLimits
) -> Diagnosis | None:
    """Compare the friction of the moves with the baseline.

    Without a baseline for it, a declared change of friction is compared with the limits instead.

    Parameters
    ----------
    evidence : Evidence
        The moves since the last change.
    valve : Valve
        Gives the travel.
    baseline : Baseline or None
        Friction of the healthy valve.
    limits : FrictionLimits
        Bounds of the ratio.

    Returns
    -------
    Diagnosis or None
        None where there is nothing to compare.
    """
    one = evidence.parameters[SLIDING]
    if one.value < 0:
        message = (
            f"by {_moves(evidence)}, sliding friction is {one.value:.4g} N, and friction is above "
            "zero: check the direction of both signals"
        )
        return Diagnosis(Level.WARN, StatusSignal.CHECK_FUNCTION, message, None)
    found = None
    if baseline is not None and evidence.is_known:
        found = compared(evidence.parameters, evidence.sliding_speed, baseline)
    if found is not None:
        return against(found.ratio, limits, f"by {_moves(evidence)}{_effect(evidence, valve)}")
    if evidence.change is None or baseline is not None:
        return None
    return _by_change(evidence.change, limits)


def _by_change(change: Change, limits: FrictionLimits) -> Diagnosis | None:
    words = (
        f"{change.ratio:.2f} ({change.low:.2f} to {change.high:.2f}) times what it was before "
        f"{_date(change.earliest)}, by the moves in service"
    )
    if change.low >= limits.warn_ratio:
        message = f"friction has grown to {words}: check the packing"
        return Diagnosis(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, message, None)
    if change.high <= limits.low_ratio:
        message = f"friction has fallen to {words}: check the packing, which may leak"
        return Diagnosis(Level.WARN, StatusSignal.OUT_OF_SPECIFICATION, message, None)
    return None


def _moves(evidence: Evidence) -> str:
    return f"{evidence.moves} moves in service since {_date(evidence.since)}"


def _effect(evidence: Evidence, valve: Valve) -> str:
    band = evidence.parameters["dead_band"]
    share = valve.share_of_travel(band.value)
    if not band.half_width < 0.5 * band.value or math.isnan(share):
        return ""
    width = two_digits(100 * valve.share_of_travel(band.half_width))
    return f"; the stem ignores reversals smaller than {100 * share:.3g} ± {width} % of its travel"


def _date(time: int) -> str:
    return f"{datetime.fromtimestamp(time / 1e9, timezone.utc):%Y-%m-%d %H:%M} UTC"
