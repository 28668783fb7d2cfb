# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""One factor by which spring and friction have changed alike: a scale, rather than the valve."""

from collections.abc import Mapping
from dataclasses import replace

from valve_friction_ros.health.diagnosis import Diagnosis
from valve_friction_ros.health.levels import Level, StatusSignal
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.valve_limits import ValveLimits
from valve_friction_ros.model.drive import Drive
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.wording import Code, Statement, said

_COMMON_SHARE = 0.3
"""Share by which the upper end of a ratio may lie above the lower, to speak for a common factor."""


def drive_scale(valve: Valve) -> Statement:
    """Return what scales all forces of a valve alike."""
    code = Code.AREA_AND_SCALE if valve.driven_by is Drive.PRESSURE else Code.SCALE
    return said(code, drive=valve.driven_by.name)


def spring_change(changes: Mapping[str, Measured], limits: ValveLimits) -> Measured | None:
    """Return the ratio of the spring constants where it is surely beyond its bound."""
    change, share = changes.get("spring_constant"), limits.spring_change
    return change if change is not None and change.beyond(1 - share, 1 + share) else None


def common_factor(changes: Mapping[str, Measured], limits: ValveLimits) -> Measured | None:
    """Return the factor by which all forces have changed, as by another scale of the drive.

    None where the spring constant has not surely changed, or the frictions not by its factor.
    """
    spring, coulomb = spring_change(changes, limits), changes.get("coulomb_friction")
    if spring is None or coulomb is None or coulomb.holds(1.0) or not _is_narrow(coulomb):
        return None
    others = [changes.get(name) for name in ("static_friction", "viscous_friction")]
    known = [one for one in others if one is not None and _is_narrow(one)]
    return spring if all(one.agrees_with(spring) for one in (coulomb, *known)) else None


def _is_narrow(ratio: Measured) -> bool:
    """Return whether a ratio is known well enough to speak for a common factor."""
    return ratio.low > 0 and ratio.high / ratio.low < 1 + _COMMON_SHARE


def explains(factor: Measured | None, diagnosis: Diagnosis) -> bool:
    """Return whether a common factor explains what a diagnosis finds on the friction."""
    ratio = diagnosis.ratio
    if factor is None or ratio is None or diagnosis.level < Level.WARN:
        return False
    return ratio.agrees_with(factor)


def qualified(diagnosis: Diagnosis, factor: Measured | None, valve: Valve) -> Diagnosis:
    """Return a diagnosis that says so where a common factor explains what it finds.

    The level stays, as nothing proves that the friction is healthy; the signal is to check the
    function.
    """
    if not explains(factor, diagnosis) or diagnosis.statement.code is Code.SCALED:
        return diagnosis
    statement = said(Code.SCALED, scale=drive_scale(valve), of=diagnosis.statement)
    return replace(diagnosis, status_signal=StatusSignal.CHECK_FUNCTION, statement=statement)
