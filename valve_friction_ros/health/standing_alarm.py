# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""An alarm on friction that stands until a record surely shows its end."""

from dataclasses import replace

from valve_friction_ros.health.diagnosis import (
    Diagnosis,
    FrictionLimits,
    FrictionState,
    Side,
    StandingAlarm,
)
from valve_friction_ros.health.levels import Level, StatusSignal
from valve_friction_ros.wording import Code, said

_LESSER = {Side.HIGH: FrictionState.GROWN, Side.LOW: FrictionState.FALLEN}
"""What is left of an alarm that a record has surely ended as an ERROR, and not as a WARN."""


def raised(diagnosis: Diagnosis, time: int) -> StandingAlarm | None:
    """Return the alarm on the friction that a record, identified at a time, ns, raises, if any."""
    if diagnosis.state.side is None:
        return None
    dated = said(Code.DATED, of=diagnosis.statement, time=time)
    return StandingAlarm(diagnosis.level, diagnosis.status_signal, diagnosis.state, dated, time)


def followed(
    alarm: StandingAlarm, latest: Diagnosis, limits: FrictionLimits
) -> StandingAlarm | None:
    """Return what the next record leaves of an alarm.

    Parameters
    ----------
    alarm : StandingAlarm
        An alarm of an earlier record.
    latest : Diagnosis
        What the next record says by itself.
    limits : FrictionLimits
        Bounds of the friction.

    Returns
    -------
    StandingAlarm or None
        The same, where that record leaves its level possible; a lesser one where it surely ends the
        ERROR and not the WARN; None where it surely ends both, or is an alarm as severe by itself.
    """
    side = alarm.state.side
    if side is None:
        return None
    left = min(alarm.level, latest.possible(side, limits))
    if left is Level.OK or (latest.state.side is side and latest.state.level >= left):
        return None
    return limited(alarm, left)


def limited(alarm: StandingAlarm, level: Level) -> StandingAlarm:
    """Return an alarm of a level, WARN or more, at most."""
    if alarm.level <= level or alarm.state.side is None:
        return alarm
    signal, state = StatusSignal.MAINTENANCE_REQUIRED, _LESSER[alarm.state.side]
    return replace(alarm, level=level, status_signal=signal, state=state)


def standing(alarm: StandingAlarm | None, latest: Diagnosis) -> Diagnosis:
    """Return what is said of a valve whose latest record has not ended an alarm.

    It is the alarm with its date, and what the latest record says, whose ratio it has.
    """
    if alarm is None:
        return latest
    code = Code.STANDS_UNCOMPARED if latest.ratio is None else Code.STANDS_UNCERTAIN
    is_worse = latest.level > alarm.level
    level, signal = (
        (latest.level, latest.status_signal) if is_worse else (alarm.level, alarm.status_signal)
    )
    return Diagnosis(
        level,
        signal,
        said(code, alarm=alarm.statement, latest=latest.statement),
        latest.ratio,
        alarm.state,
        alarm=alarm,
        latest=latest,
    )
