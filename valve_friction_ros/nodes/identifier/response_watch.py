# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Response of the stem in service to its pressure and to ``stem_command``."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from time import monotonic
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node
from sensor_msgs.msg import JointState

from valve_friction_ros import history as database
from valve_friction_ros.health.diagnosis import dead_band
from valve_friction_ros.health.friction_monitor import FrictionMonitor
from valve_friction_ros.health.levels import Finding, Level, StatusSignal
from valve_friction_ros.health.standstill import Standstill, StandstillCounter, standstill_finding
from valve_friction_ros.history.status_values import number_text
from valve_friction_ros.nodes.identifier.history_writer import HistoryWriter
from valve_friction_ros.nodes.plumbing.messages import positions_in, readable
from valve_friction_ros.nodes.plumbing.polled_subscription import PolledSubscription
from valve_friction_ros.nodes.plumbing.qos import stream
from valve_friction_ros.response import (
    SIZES,
    ResponseLimits,
    ResponseMonitor,
    ResponseSummary,
    StepAnswer,
    response_findings,
)
from valve_friction_ros.streams import Arrivals, Kind, Samples, utc_second
from valve_friction_ros.wording import Code, said

_PATIENCE = 60.0
"""Time, s, for which commands arrive but are all unusable, before this is a finding."""


_SILENCE = 1.0
"""Time without messages, s, after which the quality of service is suspected."""

_EVERY = 0.5
"""Time span of the samples processed at once, s: each call costs as much as a thousand samples."""

_WRITE_EVERY = 5.0
"""Time between two writes, s. If the node is killed, this time and an unfinished move are lost."""

_MOST_WAITING = 20_000
"""Largest number of samples processed at once, whatever their stamps."""


class ResponseWatch:
    """Follows ``stem_command``; without commands it reports only results of earlier runs."""

    def __init__(self, node: Node, monitor: FrictionMonitor, history: HistoryWriter) -> None:
        self._node, self._friction, self._history = node, monitor, history
        self._polled = PolledSubscription(
            node, JointState, "stem_command", stream(), raw=True, is_optional=True
        )
        self._drop()
        self._monitor: ResponseMonitor | None = None
        self._travel = math.nan
        self._written_at = monotonic()
        travel = monitor.settings.valve.travel
        if earlier := history.look_up(database.read_answers, travel):
            self._begin(earlier)
        self._problem = self._standing = self._wrong = ""
        self._unusable: tuple[float, float] | None = None

    def _begin(self, earlier: Sequence[StepAnswer] = ()) -> ResponseMonitor:
        self._travel = self._friction.settings.valve.travel
        self._monitor = ResponseMonitor(self._travel, earlier)
        return self._monitor

    def _drop(self) -> None:
        self._commands: list[Samples] = []
        self._arrivals: list[Arrivals] = []
        self._held = 0

    def take(self, arrivals: Arrivals) -> None:
        """Take commands and samples of pressure and stem position."""
        self._take_commands()
        if self._monitor is None and not self._commands:
            return
        if arrivals.stamps.size:
            self._arrivals.append(arrivals)
            self._held += arrivals.stamps.size
        elapsed = 0
        if self._arrivals:
            elapsed = abs(int(self._arrivals[-1].stamps[-1]) - int(self._arrivals[0].stamps[0]))
        if elapsed >= _EVERY * 1e9 or self._held >= _MOST_WAITING:
            self._standing = ""
            if not elapsed:
                self._standing = (
                    f"the time stamps of {self._held} samples do not advance: fill in "
                    "header.stamp, or let simulated time run"
                )
            self._work()

    def _take_commands(self) -> None:
        messages = self._polled.take()
        if not messages:
            return
        try:
            found_in = positions_in([one.message for one in messages], "")
        except RuntimeError:
            kept = readable(messages, JointState)
            found_in = positions_in([one.message for one in kept], "")
        given = found_in.samples(Kind.POSITION)
        given = Samples(*(part[np.isfinite(given.values)] for part in given))
        travel = self._friction.settings.valve.travel
        unit = self._value("command_unit")
        wrong = ""
        metres = given.values
        good: NDArray[np.bool_] = np.zeros(metres.size, np.bool_)
        if not math.isfinite(travel):
            wrong = "the travel of the valve is unknown: set travel"
        elif not good.size:
            wrong = "a command is not a number"
        else:
            metres = metres * (travel / 100 if unit == "%" else 1.0)
            # Positioners accept slightly more than 0 to 100 %.
            good = np.abs(metres - travel / 2) <= travel
            if not good.all():
                place = float(given.values[~good][0])
                wrong = f"{place:g} {unit} is not a valid stem position: check command_unit"
        if good.any():
            self._commands.append(Samples(given.stamps[good], metres[good]))
            self._held += int(good.sum())
            self._wrong = wrong
        else:
            self._note(wrong, is_used=False)

    def _note(self, problem: str, is_used: bool) -> None:
        """Remember the problem of the commands received now, and since when none was usable."""
        self._problem, now = problem, monotonic()
        first, _ = self._unusable or (now, now)
        self._unusable = None if is_used else (first, now)

    def _value(self, name: str) -> Any:
        return self._node.get_parameter(name).value

    def _work(self) -> None:
        """Process the collected samples; a new travel, or no samples, starts afresh."""
        travel = self._friction.settings.valve.travel
        if travel != self._travel:
            self.close()
        if not math.isfinite(travel):
            self._drop()
            self._monitor = None
            return
        monitor = self._monitor
        if monitor is None or travel != self._travel:
            monitor = self._begin()
        command = Samples.joined(*self._commands)
        arrived = Arrivals.joined(self._arrivals)
        self._drop()
        monitor.take(command, arrived)
        if command.stamps.size:
            why = self._standing or _clock_problem(monitor.clock_offset)
            self._note(why or self._wrong, is_used=not why)

    @property
    def summary(self) -> ResponseSummary | None:
        """Summary of the evaluated responses; None without any command."""
        return None if self._monitor is None else self._monitor.summary

    def renew(self) -> None:
        """Start afresh with a new packing; the stored renewal does this in the file."""
        self.close()
        if self._monitor is not None:
            self._begin()

    def close(self) -> None:
        """Queue unwritten data; the thread of the writer finishes them."""
        self._written_at = monotonic()
        if self._monitor is not None and (moves := self._monitor.drain()):
            valve, travel, days = self._history.valve, self._travel, self._value("history_days")
            self._history.keep_soon(
                lambda file: database.keep_answers(file, valve, travel, moves, days)
            )

    def findings(self) -> Sequence[Finding]:
        """Return the problems of the responses."""
        self._follow_publishers()
        findings: list[Finding] = []
        first, last = self._unusable or (0.0, 0.0)
        if last - first >= _PATIENCE:
            unusable = said(Code.COMMANDS_UNUSABLE, problem=self._problem)
            findings.append(Finding(Level.WARN, StatusSignal.CHECK_FUNCTION, unusable))
        if self._monitor is not None:
            limits = ResponseLimits(
                self._value("deviation_limit") / 100,
                self._value("dead_time_limit"),
                self._value("t86_limit"),
            )
            findings += response_findings(
                self._monitor.summary, limits, self._monitor.hunting, self._dead_band()
            )
        return findings

    def _dead_band(self) -> float:
        """Return the dead band of the latest identification over the travel; nan if unknown."""
        estimate = self._friction.estimate
        return math.nan if estimate is None else dead_band(estimate, self._friction.settings.valve)

    def _follow_publishers(self) -> None:
        """Adapt the quality of service; forget a command that is no longer published."""
        silence = self._polled.silence()
        if silence > _SILENCE:
            self._polled.follow_publishers()
        is_silent = silence > self._value("input_timeout")
        if not is_silent or self._node.count_publishers(self._polled.topic):
            return
        self._problem, self._unusable = "", None
        if self._monitor is not None:
            self._monitor.forget()

    def values(self) -> Mapping[str, str]:
        """Return the figures of the latest moves."""
        if monotonic() - self._written_at >= _WRITE_EVERY:
            self.close()
        monitor = self._monitor
        why = self._standing or self._problem
        problem = {"stem_command problem": why} if why else {}
        if monitor is None:
            return problem
        return {
            **problem,
            **_deviation_values(monitor),
            **_move_values(monitor.summary, monitor.left_out),
        }


def _clock_problem(offset: float) -> str:
    """Describe how far the clock of the command is ahead of or behind the stem; '' if equal."""
    if not offset:
        return ""
    side = "ahead of" if offset > 0 else "behind"
    return (
        f"its time stamps are {abs(offset):.4g} s {side} those of stem_state: synchronise the "
        "clocks, and fill in header.stamp"
    )


def _number(value: float) -> str:
    return f"{value:.4g}"


def _deviation_values(monitor: ResponseMonitor) -> dict[str, str]:
    sizes, signed = monitor.deviation()
    values = {
        "command deviation mean [%]": _number(100 * signed),
        "command deviation magnitude [%]": _number(100 * sizes.median),
        "command deviation 95th percentile [%]": _number(100 * sizes.high),
    }
    if (swing := monitor.hunting) is not None:
        values["hunting period [s]"] = _number(swing.period)
        values["hunting amplitude [%]"] = _number(100 * swing.amplitude)
    return values


def _move_values(summary: ResponseSummary, left_out: int) -> dict[str, str]:
    values = {"moves": str(len(summary.moves))}
    if summary.moves:
        for name, one in (("since", summary.moves[0]), ("until", summary.moves[-1])):
            values[f"moves {name} [time]"] = utc_second(one.stamp)
    values |= {
        "moves ignored": str(len(summary.ignored)),
        "changes left out": str(left_out),
        "largest ignored step [%]": _number(100 * summary.largest_ignored),
        "smallest answered step [%]": _number(100 * summary.smallest_answered),
    }
    for name, spread, scale, unit in (
        ("dead_time", summary.dead_time, 1, "s"),
        ("T63", summary.t63, 1, "s"),
        ("T86", summary.t86, 1, "s"),
        ("overshoot", summary.overshoot, 100, "%"),
        ("steady_error", summary.steady_error, 100, "%"),
    ):
        values[f"{name} [{unit}]"] = _number(scale * spread.median)
        values[f"{name} low [{unit}]"] = _number(scale * spread.low)
        values[f"{name} high [{unit}]"] = _number(scale * spread.high)
    for (low, high), (moved, count) in zip(pairwise(SIZES), summary.by_size, strict=True):
        if count:
            bounds = f"{100 * low:g} to {100 * high:g} %" if high < 1 else f"above {100 * low:g} %"
            values[f"moved by steps of {bounds}"] = f"{moved} of {count}"
    for which in ("dead_time", "T86", "deviation"):
        values[f"{which} cause"] = summary.cause(which.lower()).name.lower()
    return values


class StandstillWatch:
    """Finds a seized stem without a ``stem_command``; a `Watch`."""

    def __init__(self, monitor: FrictionMonitor) -> None:
        self._monitor = monitor
        self._travel = math.nan
        self._counter: StandstillCounter | None = None

    def take(self, arrivals: Arrivals) -> None:
        """Follow pressure and stem position, if the travel is known."""
        valve = self._monitor.settings.valve
        if valve.travel != self._travel:
            self._travel = valve.travel
            self._counter = StandstillCounter(valve.travel) if math.isfinite(valve.travel) else None
        if self._counter is None:
            return
        pressure, position = arrivals.samples(Kind.PRESSURE), arrivals.samples(Kind.POSITION)
        in_range = np.isfinite(pressure.values) & valve.sensor_reads(pressure.values)
        known = np.isfinite(position.values)
        self._counter.add(
            Samples(pressure.stamps[in_range], pressure.values[in_range]),
            Samples(position.stamps[known], position.values[known]),
        )

    def findings(self) -> Sequence[Finding]:
        """Return a finding if the stem is held, in service or in the latest test."""
        still, baseline = self._standstill(), self._monitor.baseline
        settings, found = self._monitor.settings, None
        if still is not None and baseline is not None:
            factor = settings.limits.error_ratio
            found = standstill_finding(still, settings.valve, baseline, factor)
        found = found or self._monitor.held
        return [] if found is None else [found]

    def values(self) -> Mapping[str, str]:
        """Return since when the stem has been at rest, and the static friction this requires."""
        still = self._standstill()
        if still is None:
            return {}
        return {
            "standstill since [time]": utc_second(still.since),
            "standstill static_friction at least [N]": number_text(
                still.least_friction(self._monitor.settings.valve)
            ),
        }

    def _standstill(self) -> Standstill | None:
        return None if self._counter is None else self._counter.standstill
