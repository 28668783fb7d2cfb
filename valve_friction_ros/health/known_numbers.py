# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The newest measurement of each number of a valve, and the changes that they show."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.levels import Finding
from valve_friction_ros.health.measured import DatedNumber, Measured, valve_changes
from valve_friction_ros.health.valve_diagnosis import ValveLimits, common_factor, diagnose_numbers
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.wording import Code, said

_ENDS = (("lowest_position", "lower_stop", -1.0), ("highest_position", "upper_stop", 1.0))


@dataclass(frozen=True)
class KnownNumbers:
    """The newest measurement of each number of a valve.

    A record that does not show a number leaves its earlier value: nothing was repaired.

    Attributes
    ----------
    dated : mapping of str to DatedNumber
        The numbers by name.
    latest : int or None
        Time of the latest record, ns; None without one.
    """

    dated: Mapping[str, DatedNumber] = field(default_factory=dict)
    latest: int | None = None

    @property
    def numbers(self) -> dict[str, Measured]:
        """The numbers, whatever their age."""
        return {name: one.number for name, one in self.dated.items()}

    @property
    def of_latest(self) -> dict[str, Measured]:
        """The numbers of the latest record alone."""
        return {n: one.number for n, one in self.dated.items() if one.time == self.latest}

    def only_latest(self) -> "KnownNumbers":
        """Return the numbers of the latest record alone."""
        return KnownNumbers(
            {name: one for name, one in self.dated.items() if one.time == self.latest}, self.latest
        )

    def since(self, time: int | None) -> "KnownNumbers":
        """Return the numbers measured at a time, ns, or later; all for None."""
        kept = {name: one for name, one in self.dated.items() if time is None or one.time >= time}
        return KnownNumbers(kept, self.latest)

    def followed_by(self, numbers: Mapping[str, Measured], time: int) -> "KnownNumbers":
        """Return the numbers after a further record.

        A stop is dropped once the stem has surely gone beyond it. The farthest position stays until
        a record shows a stop, or a position at least as far.
        """
        dated = dict(self.dated)
        fresh = dict(numbers)
        for end, stop, side in _ENDS:
            if end not in fresh or stop in fresh:
                continue
            now, met, farthest = fresh[end], dated.get(stop), dated.get(end)
            if met and side * (now.value - met.value) > now.half_width + met.half_width:
                del dated[stop]
            if farthest and not side * (now.value - farthest.value) >= 0:
                del fresh[end]
        dated |= {n: DatedNumber(time, one.value, one.half_width) for n, one in fresh.items()}
        return KnownNumbers(dated, time)

    def common_factor(
        self, baseline: Baseline | None, limits: ValveLimits | None = None
    ) -> Measured | None:
        """Return the common factor of change of spring and friction (`common_factor`)."""
        if baseline is None:
            return None
        return common_factor(valve_changes(self.numbers, baseline.numbers), limits or ValveLimits())

    def with_record(self, numbers: Mapping[str, Measured], time: int) -> "KnownNumbers":
        """Return the numbers after inserting a record that may be older than others."""
        known = KnownNumbers({n: one for n, one in self.dated.items() if one.time < time})
        known = known.followed_by(numbers, time)
        for later in sorted({one.time for one in self.dated.values() if one.time > time}):
            known = known.followed_by(
                {n: one.number for n, one in self.dated.items() if one.time == later}, later
            )
        return known

    def findings(
        self, baseline: Baseline | None, valve: Valve, limits: ValveLimits | None = None
    ) -> tuple[Finding, ...]:
        """Return the changes since a baseline (`diagnose_numbers`).

        A finding that rests on a number of an earlier record states its date.
        """
        if baseline is None or not baseline.numbers:
            return ()
        found = diagnose_numbers(self.numbers, baseline, valve, limits)
        return tuple(map(self._with_date, found))

    def _with_date(self, finding: Finding) -> Finding:
        times = {self.dated[name].time for name in finding.numbers if name in self.dated}
        if not times - {self.latest}:
            return finding
        dated = said(Code.MEASURED_EARLIER, of=finding.statement, time=min(times))
        return replace(finding, statement=dated)
