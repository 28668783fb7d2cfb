# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Diagnosis and baseline from the moves of a valve in service."""

import contextlib
import math
from collections.abc import Sequence
from dataclasses import dataclass

from valve_friction_ros.evidence.estimate import Evidence, FrictionChange
from valve_friction_ros.health.baseline import (
    GOOD_SHARE,
    Baseline,
    BaselineLack,
    BaselineRefusalError,
    Lack,
    SlidingFriction,
)
from valve_friction_ros.health.comparison import Ratio, compared
from valve_friction_ros.health.diagnosis import Diagnosis, FrictionLimits, FrictionState, against
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.settings import SLIDING
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.wording import Code, Statement, percentage, said

_LARGEST_SPEED_RATIO = 2.0
"""Largest ratio of the speeds of moves and baseline, either way, at which they are compared.

Beyond it, earlier moves are a better reference than a baseline at another speed. Chosen."""


@dataclass(frozen=True)
class Reference:
    """Friction from the first combined moves of a valve with its present packing.

    Attributes
    ----------
    sliding : SlidingFriction
        Sliding friction of these moves, or carried back to before the first change.
    time : int
        End of the last of these moves, or start of the first change, ns since 1970 (UTC).
    """

    sliding: SlidingFriction
    time: int


def baseline_by_evidence(evidence: Evidence) -> Baseline:
    """Return the sliding friction of the moves as the baseline.

    Raises BaselineRefusalError if it is not known to `GOOD_SHARE`.
    """
    one = evidence.parameters[SLIDING].without_calibration
    lack = lack_of_moves(evidence)
    if lack is None:
        return Baseline(sliding=SlidingFriction(one.value, one.half_width, evidence.sliding_speed))
    if lack.lack is Lack.VALUE:
        message = f"moves in service cannot be the baseline yet: {one.reason}"
    elif lack.lack is Lack.SIZE:
        message = (
            f"a sliding friction of {one.value:.4g} N cannot be a baseline: check the direction of "
            "both signals"
        )
    else:
        message = (
            "moves in service cannot be the baseline yet: sliding friction is known to "
            f"±{percentage(one.half_width / one.value)}, but a baseline requires "
            f"±{percentage(GOOD_SHARE)}: leave the valve in service, and set timing_uncertainty "
            "if the clocks and lags of both signals are known"
        )
    raise BaselineRefusalError(message, lack)


def lack_of_moves(evidence: Evidence) -> BaselineLack | None:
    """Return what the moves in service lack as a baseline, or None."""
    one = evidence.parameters[SLIDING].without_calibration
    return BaselineLack.found("moves", one, GOOD_SHARE)


def reference_by_evidence(evidence: Evidence) -> Reference | None:
    """Return the reference from the moves, or None where they cannot be a baseline.

    If friction changed before it was known well enough, it is carried back over all changes.
    """
    with contextlib.suppress(RefusalError):
        sliding, changes = baseline_by_evidence(evidence).sliding, evidence.changes
        if sliding is None:
            return None
        if not changes:
            return Reference(sliding, evidence.until)
        ratio, share = _overall(changes)
        value = sliding.value / ratio
        width = value * math.hypot(sliding.half_width / sliding.value, share)
        return Reference(SlidingFriction(value, width, sliding.speed), changes[0].earliest)
    return None


def _overall(changes: Sequence[FrictionChange]) -> tuple[float, float]:
    """Return the ratio over all changes, and half the width of the interval of its logarithm."""
    shares = (0.5 * math.log(one.high / one.low) for one in changes)
    return math.prod(one.ratio for one in changes), math.hypot(*shares)


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
        Friction of the first combined moves, for a valve without a comparable baseline
        (`why_not_compared`). If the reference is not comparable either, for example because a stem
        that sticks more moves at other speeds, the declared changes raise an alarm by themselves.

    Returns
    -------
    Diagnosis or None
        None where there is nothing to compare.
    """
    one = evidence.parameters[SLIDING]
    if one.value < 0:
        below = said(Code.MOVES_BELOW_ZERO, moves=_by_moves(evidence, None), value=one.value)
        return Diagnosis.of(FrictionState.IMPOSSIBLE, below)
    if not evidence.is_known:
        return None
    effect = _by_moves(evidence, _dead_band(evidence, valve))
    found = None if baseline is None else _compared(evidence, baseline)
    if found is not None:
        return against(found, limits, _dated(effect, evidence))
    if reference is not None:
        found = _compared(evidence, Baseline(sliding=reference.sliding))
    if reference is None or found is None:
        return _by_changes(evidence, limits, effect, alone=baseline is None and reference is None)
    has_baseline = baseline is not None
    healthy = said(Code.FIRST_MOVES, time=reference.time, has_baseline=has_baseline)
    return against(found, limits, _dated(effect, evidence), healthy)


def _dated(effect: Statement, evidence: Evidence) -> Statement:
    """Add the time of the last change of friction, where the moves still show it."""
    change = evidence.change
    if change is None:
        return effect
    return said(Code.CHANGED, of=effect, earliest=change.earliest, latest=change.latest)


def _by_changes(
    evidence: Evidence, limits: FrictionLimits, effect: Statement, alone: bool
) -> Diagnosis | None:
    """Judge the declared changes by themselves; return None unless they are an alarm.

    Friction is compared with its value before the first change: a second one may undo it. That is
    reported if the changes stand `alone`, so that nothing else can have raised the alarm it ends.
    """
    changes = evidence.changes
    if not changes:
        return None
    value, share = _overall(changes)
    ends = value, value * math.exp(-share), value * math.exp(share)
    ratio = Ratio.between(*ends, of=SLIDING, speed=evidence.sliding_speed)
    first = changes[0]
    healthy = said(Code.BEFORE_CHANGE, earliest=first.earliest, latest=first.latest)
    found = against(ratio, limits, effect, healthy)
    is_undone = alone and len(changes) > 1
    return found if is_undone or found.state.side is not None else None


def _compared(evidence: Evidence, baseline: Baseline) -> Ratio | None:
    speed, healthy = evidence.sliding_speed, baseline.sliding
    if healthy is not None and not (
        1 / _LARGEST_SPEED_RATIO <= healthy.speed / speed <= _LARGEST_SPEED_RATIO
    ):
        return None
    found = compared(evidence.parameters, speed, baseline)
    return None if found is None else found.ratio


def why_not_compared(evidence: Evidence, baseline: Baseline | None) -> Statement | None:
    """Return why known evidence is not comparable with a baseline, or None if it is."""
    if baseline is None or not evidence.is_known or _compared(evidence, baseline) is not None:
        return None
    if baseline.sliding is None:
        return said(Code.BASELINE_WITHOUT_SLIDING)
    return said(
        Code.BASELINE_AT_OTHER_SPEED,
        healthy=baseline.sliding.speed,
        speed=evidence.sliding_speed,
        factor=_LARGEST_SPEED_RATIO,
    )


def _by_moves(evidence: Evidence, dead_band: Statement | None) -> Statement:
    return said(Code.BY_MOVES, moves=evidence.moves, since=evidence.since, dead_band=dead_band)


def _dead_band(evidence: Evidence, valve: Valve) -> Statement | None:
    band = evidence.parameters["dead_band"]
    share = valve.share_of_travel(band.value)
    if not band.half_width < 0.5 * band.value or math.isnan(share):
        return None
    half_width = valve.share_of_travel(band.half_width)
    return said(Code.DEAD_BAND_INTERVAL, share=share, half_width=half_width)
