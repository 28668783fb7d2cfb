"""The diagnosis by the moves of a valve in service, and the baseline that they can be."""

import contextlib
import math
from dataclasses import dataclass

from valve_friction_ros.evidence import Evidence
from valve_friction_ros.health.baseline import LARGEST_SHARE, Baseline, SlidingFriction
from valve_friction_ros.health.comparison import LARGEST_SPEED_RATIO, Ratio, compared
from valve_friction_ros.health.diagnosis import (
    Diagnosis,
    FrictionLimits,
    FrictionState,
    against,
)
from valve_friction_ros.health.levels import Level, StatusSignal
from valve_friction_ros.identification import SLIDING, RefusalError
from valve_friction_ros.identification.trust.rounding import percentage, two_digits
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.streams import utc_minute

__all__ = [
    "Reference",
    "baseline_by_evidence",
    "diagnosis_by_evidence",
    "reference_by_evidence",
    "why_not_compared",
]


@dataclass(frozen=True)
class Reference:
    """Friction of a valve when its moves were first combined, since its packing was renewed.

    Attributes
    ----------
    sliding : SlidingFriction
        What the moves said.
    time : int
        End of the last of them, ns since 1970 (UTC).
    """

    sliding: SlidingFriction
    time: int


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


def reference_by_evidence(evidence: Evidence) -> Reference | None:
    """Return what the moves say as reference; None where they could not be a baseline.

    Where friction has changed before it was known well enough, it is carried back over all changes.
    """
    with contextlib.suppress(RefusalError):
        sliding, changes = baseline_by_evidence(evidence).sliding, evidence.changes
        if sliding is None:
            return None
        if not changes:
            return Reference(sliding, evidence.until)
        value = sliding.value / math.prod(one.ratio for one in changes)
        shares = (0.5 * math.log(one.high / one.low) for one in changes)
        width = value * math.hypot(sliding.half_width / sliding.value, *shares)
        return Reference(SlidingFriction(value, width, sliding.speed), changes[0].earliest)
    return None


def diagnosis_by_evidence(
    evidence: Evidence,
    valve: Valve,
    baseline: Baseline | None,
    limits: FrictionLimits,
    reference: Reference | None = None,
) -> Diagnosis | None:
    """Compare the friction of the moves with the baseline, or else with the reference.

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
    reference : Reference, optional
        Friction when the moves were first combined, for a valve without a baseline, or with one
        that cannot be compared (`why_not_compared`). Where this cannot be compared either, as a
        stem that sticks more moves at other speeds, a declared change is an alarm by itself.

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
        impossible = FrictionState.IMPOSSIBLE
        return Diagnosis(Level.WARN, StatusSignal.CHECK_FUNCTION, message, None, impossible)
    if not evidence.is_known:
        return None
    effect = f"by {_moves(evidence)}{_effect(evidence, valve)}"
    found = None if baseline is None else _compared(evidence, baseline)
    if found is not None:
        return against(found, limits, effect)
    if reference is not None:
        found = _compared(evidence, Baseline(sliding=reference.sliding))
    if reference is None or found is None:
        return _by_change(evidence, limits, effect)
    what = "no baseline" if baseline is None else "the baseline cannot be compared"
    healthy = (
        f"what it was until {utc_minute(reference.time)}, when the moves of this valve were first "
        f"combined ({what}: call ~/set_baseline while it is healthy)"
    )
    return against(found, limits, effect, healthy)


def _by_change(evidence: Evidence, limits: FrictionLimits, effect: str) -> Diagnosis | None:
    """Judge a declared change by itself; None where it is no alarm, for it says little else."""
    change = evidence.change
    if change is None:
        return None
    ratio = Ratio(change.ratio, change.low, change.high, SLIDING, evidence.sliding_speed)
    healthy = (
        f"what it was before it changed, between {utc_minute(change.earliest)} and "
        f"{utc_minute(change.latest)} (no baseline and no first moves to compare with: call "
        "~/set_baseline while it is healthy)"
    )
    found = against(ratio, limits, effect, healthy)
    return found if found.state.side is not None else None


def _compared(evidence: Evidence, baseline: Baseline) -> Ratio | None:
    found = compared(evidence.parameters, evidence.sliding_speed, baseline)
    return None if found is None else found.ratio


def why_not_compared(evidence: Evidence, baseline: Baseline | None) -> str:
    """Return why known evidence is not compared with a baseline; empty if it is."""
    if baseline is None or not evidence.is_known or _compared(evidence, baseline) is not None:
        return ""
    if baseline.sliding is None:
        return (
            "not compared with the baseline, which has no sliding friction, and moves in service "
            "determine no other: call ~/set_baseline while the valve is healthy"
        )
    return (
        f"not compared with the baseline, which belongs to {1e3 * baseline.sliding.speed:.2g} "
        f"mm/s, and the moves to {1e3 * evidence.sliding_speed:.2g} mm/s, beyond a factor of "
        f"{LARGEST_SPEED_RATIO:g}: call ~/set_baseline while the valve is healthy"
    )


def _moves(evidence: Evidence) -> str:
    return f"{evidence.moves} moves in service since {utc_minute(evidence.since)}"


def _effect(evidence: Evidence, valve: Valve) -> str:
    band = evidence.parameters["dead_band"]
    share = valve.share_of_travel(band.value)
    if not band.half_width < 0.5 * band.value or math.isnan(share):
        return ""
    width = two_digits(100 * valve.share_of_travel(band.half_width))
    return f"; the stem ignores reversals smaller than {100 * share:.3g} ± {width} % of its travel"
