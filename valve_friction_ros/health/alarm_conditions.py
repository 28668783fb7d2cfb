# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""When the condition of an alarm comes and goes, with hysteresis against flicker.

A number with an interval is judged by it. It reaches a level as `friction_state` defines, and
leaves it once the whole interval lies on the other side of the limit: the width of the interval is
the hysteresis. A condition without an interval, such as a missing input, is delayed.
"""

import math
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from statistics import NormalDist
from types import MappingProxyType

from valve_friction_ros.health.alarms import NO_CONDITION, AlarmKind, Condition
from valve_friction_ros.health.comparison import Ratio
from valve_friction_ros.health.diagnosis import (
    Diagnosis,
    FrictionLimits,
    FrictionState,
    Side,
)
from valve_friction_ros.health.levels import Finding, Level, by_severity
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.model.checks import equal_by_fields
from valve_friction_ros.wording import Code, quoted, said, sentence

_YEAR = 365.25 * 86_400e9
_A_YEAR = 0.01
"""False changes of level per year of a friction at its limit, over all its looks. Chosen: an
unchanged valve then raises at most one alarm per year, even half an interval from the limit."""
_TAIL = 0.025
"""Probability that a number lies above its 95 % interval."""
_SURELY = 1.5
"""Half widths from which friction has clearly changed, as in `friction_state`."""
_NORMAL = NormalDist()
_QUANTILE = _NORMAL.inv_cdf(1 - _TAIL)


def widening(elapsed: float) -> float:
    """Return how much wider than at 95 % an interval must be for a look to change an alarm.

    Each look may err, and more frequent looks err more often. A look may therefore use up only the
    share of a year's false changes that belongs to the time since the previous look, `elapsed`, ns.
    It never uses more than its 95 % interval allows.
    """
    if not elapsed > 0:
        return math.inf
    share = min(_TAIL, _A_YEAR * elapsed / _YEAR)
    return -_NORMAL.inv_cdf(share) / _QUANTILE


def held_level(
    held: Level, ratio: Ratio, side: Side, limits: FrictionLimits, wider: float = 1.0
) -> Level:
    """Return the level of a side after a look at the friction, `held` before it.

    It is the level nearest to `held` between the sure level and the possible level. A level is
    possible where part of the interval of the ratio lies beyond its limit. The interval is widened
    by a factor in its logarithm (`widening`): at a `wider` of 1 the sure level agrees with
    `friction_state`, and beyond it a warning demands as much more as an error.
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


@dataclass(frozen=True)
class FrictionHold:
    """The conditions that the looks at the friction of a valve have shown so far, on both sides.

    A look is an identification, or the moves in service up to a time. The newer of the two decides,
    so that either can raise an alarm and clear it.

    Attributes
    ----------
    conditions : mapping of Side to Condition
        The condition on each side.
    until : int or None
        Time of the latest look, ns since 1970 (UTC); None before the first look of this run.
    basis : object
        What the friction is compared with. A new baseline, limit or packing resets the conditions.
    """

    conditions: Mapping[Side, Condition] = field(default_factory=dict)
    until: int | None = None
    basis: Hashable = None

    def __post_init__(self) -> None:
        """Complete the conditions of both sides and make them read-only."""
        both = {side: self.conditions.get(side, NO_CONDITION) for side in Side}
        object.__setattr__(self, "conditions", MappingProxyType(both))

    def based_on(self, basis: Hashable) -> "FrictionHold":
        """Change the basis of comparison; a new basis resets the conditions.

        The first basis of a run keeps the conditions of an earlier run.
        """
        if self.basis is None:
            return replace(self, basis=basis)
        return self if basis == self.basis else FrictionHold(basis=basis)

    def looked(
        self, diagnosis: Diagnosis, time: int, limits: FrictionLimits, elapsed: int | None = None
    ) -> "FrictionHold":
        """Take a look at the friction at a time, ns.

        A diagnosis that compares nothing leaves the conditions as they are. A look that repeats by
        itself gives the time since the previous one, `elapsed`, ns, and needs more certainty the
        more often it repeats (`widening`). A record that somebody asked for is judged by its 95 %
        interval, as its diagnosis is.
        """
        own = diagnosis.own
        if own.ratio is None and own.state.side is None:
            return self
        wider = 1.0 if elapsed is None else widening(elapsed)
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
                statement = own.statement
                if own.state.side is not side:
                    active = quoted(before.message)
                    statement = said(Code.STANDS_UNCERTAIN, alarm=active, latest=statement)
                signal = FrictionState.moved(side, level).status_signal
                shown[side] = Condition(level, signal, sentence(statement))
        return replace(self, conditions=shown, until=max(time, self.until or time))


def farthest(now: Mapping[str, Measured], healthy: Mapping[str, Measured]) -> dict[str, Measured]:
    """Return each number of a valve at the end of its interval that is farthest from healthy.

    A change that these do not show is clearly absent, and the alarm on the whole valve ends.
    """
    found = dict(now)
    for name in now.keys() & healthy.keys():
        value, width = now[name].value, now[name].half_width
        side = math.copysign(width, value - healthy[name].value)
        found[name] = Measured(value + side, 0.0)
    return found


def shown_by(findings: Iterable[Finding]) -> Condition:
    """Return the condition of several findings: the highest level, and all messages."""
    some = [one for one in by_severity(findings) if one.level > Level.OK]
    if not some:
        return NO_CONDITION
    return Condition(some[0].level, some[0].status_signal, "; ".join(one.message for one in some))


@equal_by_fields
@dataclass(frozen=True)
class Delay:
    """On-delay and off-delay of a condition without an interval.

    Attributes
    ----------
    rise, fall : float
        On-delay and off-delay, s: how long a level must last before it is shown, or dropped.
    shown : Condition
        The condition shown now.
    since : float or None
        When the level began to differ from the one shown, s; None while both agree.
    """

    rise: float
    fall: float
    shown: Condition = NO_CONDITION
    since: float | None = None

    def seen(self, condition: Condition, now: float) -> "Delay":
        """Take the present condition at `now`, s of a monotonic clock."""
        if condition.level == self.shown.level:
            return self if self.since is None else replace(self, since=None)
        since = now if self.since is None else self.since
        wait = self.rise if condition.level > self.shown.level else self.fall
        if now - since >= wait:
            return replace(self, shown=condition, since=None)
        return replace(self, since=since)
