# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Travel stops that have moved since the baseline."""

from collections.abc import Iterator, Mapping

from valve_friction_ros.health.levels import Finding, Level, StatusSignal
from valve_friction_ros.health.measured import Measured
from valve_friction_ros.health.valve_changes import difference
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.wording import Code, Statement, said

_SIDES = {
    "lower_stop": ("lowest_position", -1.0),
    "upper_stop": ("highest_position", 1.0),
}


def stop_findings(
    now: Mapping[str, Measured], healthy: Mapping[str, Measured], valve: Valve, share: float
) -> Iterator[Finding]:
    """Find stops that have surely moved by more than a share of the travel.

    A stop that only the present record met is compared with how far the stem went in that of the
    baseline: where it went further, travel has been lost. Where the stem has gone beyond a stop of
    the baseline, that has moved outward. A stop that has stayed excludes the zero of the position
    sensor for the other, and leaves its span; where only one was met, it may be either.
    """
    bound = share * valve.travel
    moved = _moved(now, healthy, bound)
    changes = list(moved.values())
    if len(changes) == len(_SIDES) and changes[0].agrees_with(changes[1]):
        yield _finding(said(Code.STOPS_MOVED_ALIKE, change=changes[0].interval), *moved)
        return
    sensor = "BOTH" if len(moved) == len(_SIDES) else "EITHER"
    if any(name in now and name in healthy for name in _SIDES.keys() - moved.keys()):
        sensor = "SPAN"
    for name, change in moved.items():
        end, side = _SIDES[name]
        is_lost = side * change.value < 0
        code = Code.TRAVEL_LOST if is_lost else Code.STOP_MOVED_OUTWARD
        statement = said(code, stop=name, change=change.interval, sensor=sensor)
        yield _finding(statement, name if is_lost or name in now else end)


def _moved(
    now: Mapping[str, Measured], healthy: Mapping[str, Measured], bound: float
) -> dict[str, Measured]:
    """Return the changes of the stops that have surely moved by more than a bound, m."""
    moved = {}
    for name, (end, side) in _SIDES.items():
        if name not in now:
            if end in now and name in healthy:
                change = difference(now[end], healthy[name])
                if change.times(side).beyond(-float("inf"), bound):
                    moved[name] = change
        elif name in healthy:
            change = difference(now[name], healthy[name])
            if change.beyond(-bound, bound):
                moved[name] = change
        elif end in healthy:
            change = difference(now[name], healthy[end])
            if change.times(side).beyond(-bound, float("inf")):
                moved[name] = change
    return moved


def _finding(statement: Statement, *numbers: str) -> Finding:
    return Finding(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, statement, numbers)
