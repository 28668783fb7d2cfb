# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""When a valve shows an alarm, and when it shows it no longer, so that no alarm flickers.

What has an interval is judged by it: a level is reached as `friction_state` says, and left where
the whole interval lies on the other side of its limit, so that the width of the interval is the
hysteresis. What has none, as a missing input, is held for a time.
"""

import math
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from statistics import NormalDist
from types import MappingProxyType

from valve_friction_ros.health.alarms import NO_CONDITION, AlarmKind, Condition
from valve_friction_ros.health.comparison import Ratio
from valve_friction_ros.health.diagnosis import Diagnosis, FrictionLimits, Side
from valve_friction_ros.health.levels import Finding, Level, StatusSignal, by_severity
from valve_friction_ros.health.measured import Measured

_YEAR = 365.25 * 86_400e9
_A_YEAR = 0.01
"""False changes a year that a friction at its limit may make, by whichever of its looks. Chosen: a
valve that stays as it is then raises at most one alarm a year, also half an interval from it."""
_TAIL = 0.025
"""Probability that a number lies above its 95 % interval."""
_SURELY = 1.5
"""Half widths by which friction has surely changed, as in `friction_state`."""
_NORMAL = NormalDist()
_QUANTILE = _NORMAL.inv_cdf(1 - _TAIL)


def widening(elapsed: float) -> float:
    """Return how much wider than at 95 % an interval must be for a look to change an alarm.

    Each look may err, and a valve that is looked at more often errs more often. So a look may use
    up the share of a year's false changes that belongs to the time since the look before it, ns;
    never more than its 95 % interval allows.
    """
    if not elapsed > 0:
        return math.inf
    share = min(_TAIL, _A_YEAR * elapsed / _YEAR)
    return -_NORMAL.inv_cdf(share) / _QUANTILE


def held_level(
    held: Level, ratio: Ratio, side: Side, limits: FrictionLimits, wider: float = 1.0
) -> Level:
    """Return the level of a side after a look at the friction.

    Parameters
    ----------
    held : Level
        The level before it.
    ratio : Ratio
        Friction over its baseline with its 95 % interval.
    side : Side
        The side of the baseline.
    limits : FrictionLimits
        The limits of the levels.
    wider : float
        How much wider the interval is taken, in its logarithm (`widening`).

    Returns
    -------
    Level
        The level nearest to `held` among those from that which is surely reached to that which is
        possible, as part of the interval lies beyond its limit. At a width of 1 the sure one is
        that of `friction_state`; a wider interval takes as much more from a warning as from an
        error.
    """
    if not (ratio.value > 0 and ratio.low > 0) or math.isinf(wider):
        return held
    is_high = side is Side.HIGH
    warn, error = (
        (limits.warn_ratio, limits.error_ratio)
        if is_high
        else (1 / limits.low_warn_ratio, 1 / limits.low_ratio)
    )
    change = math.log(ratio.value) if is_high else -math.log(ratio.value)
    half_width = 0.5 * math.log(ratio.high / ratio.low)
    least, most = change - wider * half_width, change + wider * half_width
    has_grown = change > _SURELY * wider * half_width and least + half_width >= math.log(warn)
    sure = (least >= math.log(error)) + (least >= math.log(warn) or has_grown)
    possible = (most >= math.log(error)) + (most >= math.log(warn))
    return Level(min(max(held, sure), possible))


ALARM_OF_SIDE = {Side.HIGH: AlarmKind.FRICTION_HIGH, Side.LOW: AlarmKind.FRICTION_LOW}
"""The alarm on each side of the baseline."""

_BY_SIDE = {
    (Side.HIGH, Level.WARN): StatusSignal.MAINTENANCE_REQUIRED,
    (Side.HIGH, Level.ERROR): StatusSignal.FAILURE,
    (Side.LOW, Level.WARN): StatusSignal.MAINTENANCE_REQUIRED,
    (Side.LOW, Level.ERROR): StatusSignal.OUT_OF_SPECIFICATION,
}


@dataclass(frozen=True)
class FrictionHold:
    """What the looks at the friction of a valve have shown so far, of both sides.

    A look is an identification, or the moves in service up to a time; whichever is newer counts,
    so that each of the two raises an alarm and clears it.

    Attributes
    ----------
    conditions : mapping of Side to Condition
        What the valve shows of each side.
    until : int or None
        Time up to which its friction was looked at, ns since 1970 (UTC); None: never in this run.
    basis : object
        What the friction is compared with: another baseline, limit or packing begins anew.
    """

    conditions: Mapping[Side, Condition] = field(default_factory=dict)
    until: int | None = None
    basis: Hashable = None

    def __post_init__(self) -> None:
        """Hold a condition of each side, behind a view that cannot be written."""
        both = {side: self.conditions.get(side, NO_CONDITION) for side in Side}
        object.__setattr__(self, "conditions", MappingProxyType(both))

    def based_on(self, basis: Hashable) -> "FrictionHold":
        """Compare with something else from now on; what was shown by the former is forgotten.

        The first basis of a run leaves what an earlier run has shown.
        """
        if self.basis is None:
            return replace(self, basis=basis)
        return self if basis == self.basis else FrictionHold(basis=basis)

    def looked(
        self, diagnosis: Diagnosis, time: int, limits: FrictionLimits, elapsed: int | None = None
    ) -> "FrictionHold":
        """Take a look at the friction of a time, ns; one of before the latest look changes nothing.

        A diagnosis that compares nothing leaves the conditions as they are. The time since the look
        before, ns, is `elapsed`, where stamps do not tell: a record may be played again.
        """
        if elapsed is None and self.until is not None:
            elapsed = time - self.until
            if elapsed <= 0:
                return self
        own = diagnosis.own
        if own.ratio is None and own.state.side is None:
            return self
        wider = 1.0 if elapsed is None or self.until is None else widening(elapsed)
        shown = {}
        for side, before in self.conditions.items():
            if own.ratio is not None:
                level = held_level(before.level, own.ratio, side, limits, wider)
            else:
                level = own.level if side is own.state.side else Level.OK
            if level == before.level:
                shown[side] = before
            elif level is Level.OK:
                shown[side] = NO_CONDITION
            else:
                shown[side] = Condition(level, _BY_SIDE[side, level], own.message)
        return replace(self, conditions=shown, until=time)


def farthest(now: Mapping[str, Measured], healthy: Mapping[str, Measured]) -> dict[str, Measured]:
    """Return the numbers of a valve at the ends of their intervals that are farthest from healthy.

    What is not found by these is surely not there, so that an alarm on the whole valve ends.
    """
    found = dict(now)
    for name in now.keys() & healthy.keys():
        value, width = now[name].value, now[name].half_width
        side = math.copysign(width, value - healthy[name].value)
        found[name] = Measured(value + side, 0.0)
    return found


def shown_by(findings: Iterable[Finding]) -> Condition:
    """Return what findings show together: the level of the most severe, and all they say."""
    some = [one for one in by_severity(findings) if one.level > Level.OK]
    if not some:
        return NO_CONDITION
    return Condition(some[0].level, some[0].status_signal, "; ".join(one.message for one in some))


@dataclass(frozen=True)
class Delay:
    """A condition without an interval, which is held for a time.

    Attributes
    ----------
    rise, fall : float
        Time, s, for which a level must be there, or gone, until it is shown, or not any more.
    shown : Condition
        What is shown now.
    since : float or None
        From when it has been otherwise, s; None while it is as shown.
    """

    rise: float
    fall: float
    shown: Condition = NO_CONDITION
    since: float | None = None

    def seen(self, condition: Condition, now: float) -> "Delay":
        """Take the condition of now, s of a clock that does not go back."""
        if condition.level == self.shown.level:
            return self if self.since is None else replace(self, since=None)
        since = now if self.since is None else self.since
        wait = self.rise if condition.level > self.shown.level else self.fall
        if now - since >= wait:
            return replace(self, shown=condition, since=None)
        return replace(self, since=since)
