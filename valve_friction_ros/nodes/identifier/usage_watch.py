# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Usage of the valve: derivation from the stem position, storage, display and limits."""

import contextlib
import math
import time
import uuid
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rclpy.node import Node

from valve_friction_ros import history as database
from valve_friction_ros.health.friction_monitor import FrictionMonitor
from valve_friction_ros.health.levels import Finding, Level, StatusSignal
from valve_friction_ros.history import HistoryError
from valve_friction_ros.history.status_values import number_text
from valve_friction_ros.nodes.identifier.history_writer import HistoryWriter
from valve_friction_ros.streams import Arrivals, Kind, utc_day
from valve_friction_ros.usage import (
    LimitState,
    Pace,
    Usage,
    UsageCounter,
    UsageLimits,
    UsedDay,
    ValveUsage,
    limit_states,
    warned_limits,
)
from valve_friction_ros.wording import numbered

if TYPE_CHECKING:
    from valve_friction_ros.history import HistoryFile

_WRITE_EVERY = 60.0
"""Time between two writes, s of the stamps or of silence. A killed node loses this time."""
_MOST_DAYS = 62
"""Largest number of single days of this run in memory."""


class UsageWatch:
    """Accumulates the usage of the valve; a `Watch`.

    The usage of this run is stored under its own name, so that it can be rewritten without being
    added twice. The stored usage of earlier runs is added to it.
    """

    def __init__(self, node: Node, monitor: FrictionMonitor, history: HistoryWriter) -> None:
        self._node, self._monitor, self._history = node, monitor, history
        self._run = uuid.uuid4().hex
        self._counter: UsageCounter | None = None
        self._counted_with: tuple[float, float] | None = None
        self._own: dict[tuple[int, int], Usage] = {}
        self._unwritten: dict[tuple[int, int], Usage] = {}
        self._written: dict[tuple[int, int], Usage] = {}
        self._written_stamp: int | None = None
        self._written_at = time.monotonic()
        found = history.look_up(database.read_usage)
        self._earlier = None if found is None else found.condensed()
        self._found_late: ValveUsage | None = None
        self._renewal = 0 if found is None else found.renewal
        self._total = self._since_renewal = Usage()
        self._pace: Pace | None = None
        self._warned: set[tuple[int, str, float]] = set()
        """Packing, name and value of each limit that has warned."""
        self.follow_parameters()
        self._add_up()
        self._remember_warnings()

    def follow_parameters(self) -> None:
        """Use the present travel and dead band."""
        travel = self._monitor.settings.valve.travel
        wanted = travel, float(self._node.get_parameter("counting_dead_band").value)
        if wanted == self._counted_with:
            return
        self._gather(is_end=True)
        self._counted_with = wanted
        self._counter = UsageCounter(*wanted) if math.isfinite(travel) else None

    def take(self, arrivals: Arrivals) -> None:
        """Process positions, and write periodically."""
        if self._counter is None:
            return
        samples = arrivals.samples(Kind.POSITION)
        self._counter.add(samples)
        if samples.stamps.size:
            newest = int(samples.stamps[-1])
            if self._written_stamp is None:
                self._written_stamp = int(samples.stamps[0])
            if abs(newest - self._written_stamp) >= _WRITE_EVERY * 1e9:
                self._written_stamp = newest
                self._keep()

    def findings(self) -> Sequence[Finding]:
        """Return the limits that are reached or close."""
        self._gather()
        return [
            Finding(Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, state.statement)
            for state in self.limits()
            if state.warns
        ]

    def values(self) -> Mapping[str, str]:
        """Return the usage since the packing was renewed, and the total usage."""
        self._gather()
        if time.monotonic() - self._written_at >= _WRITE_EVERY and self._unwritten:
            self._keep()
        if self._counter is None:
            return {"usage": "not counted, because the travel is not finite: set travel"}
        used, everything = self._since_renewal, self._total
        at_travel = self._node.get_parameter("air_to").value == "close"
        values = {
            "packing_renewed [date]": utc_day(self._renewal) if self._renewal else "not known",
            "travelled_distance [m]": number_text(used.distance),
            "travelled_distance in all [m]": number_text(everything.distance),
            "reversals": str(used.reversals),
            "reversals in all": str(everything.reversals),
            "strokes": number_text(used.strokes(self._monitor.settings.valve.travel)),
            "breakaways": str(used.breakaways),
            "time_watched [s]": number_text(used.time_watched / 1e9),
            "time_watched in all [s]": number_text(everything.time_watched / 1e9),
            "time_near_seat [s]": number_text(used.time_near_seat(at_travel) / 1e9),
            "travel_histogram [s]": ", ".join(f"{one / 1e9:.6g}" for one in used.histogram),
            "counting_dead_band [mm]": f"{1e3 * self._counter.band:.4g}",
        }
        if self._counter.is_raised:
            values["counting_dead_band reason"] = (
                "above counting_dead_band, because of the noise or resolution of the sensor"
            )
        if self._earlier is None and self._history.path is not None:
            values["usage"] = "for this run only, because the history cannot be read"
        if self._pace is not None:
            values["travelled_distance pace [m/day]"] = number_text(self._pace.distance)
            values["reversals pace [1/day]"] = number_text(self._pace.reversals)
        for state in self.limits():
            if state.expected is not None:
                values[f"{state.name}_expected [date]"] = utc_day(state.expected)
        return values

    def usage(self) -> ValveUsage:
        """Return the usage of the valve, including earlier runs."""
        self._gather()
        own = (UsedDay(day, renewal, one) for (renewal, day), one in self._own.items())
        earlier = () if self._earlier is None else self._earlier.days
        return ValveUsage.of((*earlier, *own), self._renewal)

    async def reset(self) -> str:
        """Start afresh with a new packing; return the usage of the old packing."""
        self._gather(is_end=True)
        used, since = self._since_renewal, self._renewal
        self._renewal = now = self._node.get_clock().now().nanoseconds
        self._add_up()  # before others see the new packing, during the write of its renewal

        def renew(file: "HistoryFile") -> None:
            self._write(file)
            database.keep_renewal(file, self._history.valve, now)

        await self._history.keep_change(renew)
        answer = (
            f"the packing is counted from {utc_day(now)}; the previous packing, "
            f"{f'of {utc_day(since)}' if since else 'of unknown age'}: {used.distance:.3g} m of "
            f"travel, {numbered(used.reversals, 'reversal')}, "
            f"{numbered(used.breakaways, 'breakaway')} in "
            f"{used.time_watched / 3600e9:.3g} h monitored; its moves are no longer used as "
            f"evidence{self._history.reservation}"
        )
        self._node.get_logger().info(answer)
        return answer

    def close(self) -> None:
        """Queue the usage for storage; the thread of the writer finishes this."""
        self._gather(is_end=True)
        self._keep()

    def limits(self) -> tuple[LimitState, ...]:
        """Return the state of each limit of the packing; a limit that has warned stays warned."""
        now = self._node.get_clock().now().nanoseconds
        states = [
            state._replace(has_warned=(self._renewal, state.name, state.limit) in self._warned)
            for state in limit_states(self._since_renewal, self._pace, self._limits, now)
        ]
        self._warned = {(self._renewal, one.name, one.limit) for one in states if one.warns}
        return tuple(states)

    @property
    def _limits(self) -> UsageLimits:
        return UsageLimits(
            self._node.get_parameter("travel_limit").value,
            self._node.get_parameter("reversal_limit").value,
        )

    def _remember_warnings(self) -> None:
        """Find the limits that have warned in earlier runs."""
        warned, now = warned_limits(self.usage(), self._limits), self._renewal
        states = limit_states(Usage(), None, self._limits, now)
        self._warned |= {(now, one.name, one.limit) for one in states if one.name in warned}

    def _gather(self, is_end: bool = False) -> None:
        """Add the usage of the counter, at the end including its incomplete block."""
        if self._found_late is not None and self._earlier is None:
            self._join(self._found_late)
        if self._counter is None:
            return
        if is_end:
            self._counter.flush()
        for day, more in self._counter.drain().items():
            key = self._renewal, day
            self._own[key] = self._unwritten[key] = self._own.get(key, Usage()) + more
            self._total += more
            self._since_renewal += more

    def _join(self, earlier: ValveUsage) -> None:
        """Continue from earlier runs that could not be read at the start."""
        self._earlier = earlier
        self._renewal = self._renewal or earlier.renewal
        for found in (self._own, self._unwritten):
            for renewal, day in [key for key in found if key[0] == 0]:
                found[earlier.renewal, day] = found.pop((renewal, day))
        self._add_up()
        self._remember_warnings()

    def _add_up(self) -> None:
        usage = self.usage()
        self._total, self._since_renewal = usage.total, usage.since_renewal
        self._pace = usage.pace()

    def _keep(self) -> None:
        self._gather()
        self._written_at = time.monotonic()
        for key, one in self._written.items():
            if self._unwritten.get(key) is one:
                del self._unwritten[key]
        self._condense()
        self._pace = self.usage().pace()
        if self._unwritten:
            self._history.keep_soon(self._write)

    def _condense(self) -> None:
        if len(self._own) > _MOST_DAYS and self._earlier is not None:
            old = [key for key in self._own if key not in self._unwritten][: -_MOST_DAYS // 2]
            days = [UsedDay(day, renewal, self._own[renewal, day]) for renewal, day in old]
            self._earlier = ValveUsage.of((*self._earlier.days, *days), self._renewal).condensed()
            for key in old:
                del self._own[key]

    def _write(self, file: "HistoryFile") -> None:
        """Write the usage of this run since the last write, in the thread of the writer."""
        valve, rows = self._history.valve, dict(self._unwritten)
        if self._earlier is None and self._found_late is None:
            with contextlib.suppress(HistoryError):
                self._found_late = database.read_usage(file, valve.name).condensed()
                return  # the next write knows the packing
        days = [UsedDay(day, renewal, usage) for (renewal, day), usage in rows.items()]
        database.keep_usage(file, valve, self._run, days)
        self._written = rows
