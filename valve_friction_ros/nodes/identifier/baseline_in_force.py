# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The baseline in force, set by the parameter, the services or the history."""

import contextlib
import math
from collections.abc import Callable, Iterable

from rclpy.node import Node
from rclpy.parameter import Parameter

from valve_friction_ros.health.baseline import Baseline, BaselineLack, BaselineRefusalError, Lack
from valve_friction_ros.health.by_evidence import lack_of_moves
from valve_friction_ros.health.diagnosis import Diagnosis
from valve_friction_ros.health.friction_monitor import FrictionMonitor
from valve_friction_ros.health.levels import Finding, Level
from valve_friction_ros.history import KeptBaseline
from valve_friction_ros.history.status_values import number_text
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.nodes.identifier.evidence_watch import EvidenceWatch
from valve_friction_ros.nodes.identifier.history_writer import HistoryWriter
from valve_friction_ros.streams import utc_minute

_RESTORE = "restore_baseline"
_PARAMETER = "baseline_coulomb_friction"


def baseline_from(value: float | None) -> Baseline | None:
    """Build the baseline from its parameter; raises ValueError for an impossible value."""
    return None if value is None or math.isnan(value) else Baseline(value)


def _value(baseline: Baseline | None) -> float | None:
    return None if baseline is None else baseline.coulomb_friction


def _described_with_date(kept: KeptBaseline) -> str:
    return f"baseline {kept.baseline}, set {utc_minute(kept.time)}"


class BaselineInForce:
    """Puts a baseline in force from the parameter, the services or the history.

    The parameter shows F_c of the baseline in force, or nan if it has only sliding friction. If the
    parameter is changed, its value is an exact F_c without sliding friction; nan removes the
    baseline. `level` returns the level of all findings on the valve.
    """

    def __init__(
        self,
        node: Node,
        monitor: FrictionMonitor,
        history: HistoryWriter,
        evidence: EvidenceWatch,
        level: Callable[[], Level],
    ) -> None:
        self._node, self._monitor, self._history = node, monitor, history
        self._evidence, self._level = evidence, level

    def _given(self) -> Baseline | None:
        return baseline_from(self._node.get_parameter(_PARAMETER).value)

    def begin(self) -> None:
        """Take the baseline from the parameter, else from the history, and log its source."""
        kept = self._history.baseline
        self._monitor.baseline = self._given()
        given, log = self._monitor.baseline, self._node.get_logger()
        if given is not None:
            source = f"from the parameter {_PARAMETER}"
            if kept is not None:
                source += f"; the baseline in the history is not used: {_described_with_date(kept)}"
            log.info(f"baseline {given}, {source}")
        elif kept is not None:
            self._put_in_force(kept.baseline)
            log.info(f"{_described_with_date(kept)}, from the history {self._history.path}")

    async def set(self) -> str:
        """Set and store the newest reliable friction as the baseline; return old and new baseline.

        It is the friction of the latest result, or the sliding friction of the moves in service.
        The moves are used if those since the result suffice for a baseline, if there is no result,
        if the latest identification was refused, or if the result cannot be a baseline. Raises
        RefusalError in an alarm, or if neither can be a baseline.
        """
        baseline, by_evidence = await self._newest()
        self._require_no_alarm()
        since = self._evidence.evidence.since if by_evidence else None
        seen = self._monitor.seen_until
        source = self._evidence.source
        if seen is not None:
            identified = f"the identification of {utc_minute(seen)}"
            source = f"{source}, newer than {identified}" if by_evidence else f"by {identified}"
        return await self._change(
            self._history.kept_now(baseline, self._level(), since), f" ({source})"
        )

    async def _newest(self) -> tuple[Baseline, bool]:
        """Return the new baseline, and whether it is from the moves in service."""
        seen, is_refused = self._monitor.seen_until, self._monitor.refusal is not None
        if is_refused or (seen is not None and await self._evidence.outdates(seen)):
            with contextlib.suppress(RefusalError):
                return await self._evidence.as_baseline(), True
        try:
            return self._monitor.result_as_baseline(), False
        except RefusalError as refusal:
            try:
                return await self._evidence.as_baseline(), True
            except RefusalError as of_moves:
                raise RefusalError(f"{refusal}; {of_moves}") from None

    async def restore(self) -> str:
        """Restore and store the baseline that the last ``~/set_baseline`` has replaced.

        Raises RefusalError in an alarm, or if there is nothing to undo.
        """
        last = self._history.baseline
        if last is None or last.by == _RESTORE:
            raise RefusalError(
                "there is no ~/set_baseline to undo: call ~/set_baseline to set a baseline"
            )
        if last.baseline != self._monitor.baseline:
            raise RefusalError(
                f"the baseline of the last ~/set_baseline ({last.baseline}) is no longer in "
                f"force: set {_PARAMETER}, or call ~/set_baseline"
            )
        self._require_no_alarm()
        return await self._change(self._history.replaced_now(last, _RESTORE, self._level()))

    def values(self) -> dict[str, str]:
        """Return whether `set` could now set a baseline, and if not, what is lacking.

        After a refused identification the previous result may still serve.
        """
        lacks = self._monitor.baseline_lacks()
        if lacks and (of_moves := lack_of_moves(self._evidence.evidence)) is not None:
            lacks = (*lacks, of_moves)
        else:
            lacks = ()
        if self._forbidding() is not None:
            lacks = (*lacks, BaselineLack("valve", Lack.HEALTH))
        values = {"baseline_possible": str(not lacks).lower()}
        for one in lacks:
            values[f"baseline_lacks {one.of}"] = one.lack.name
            if one.lack is Lack.PRECISION:
                values[f"baseline_lacks {one.of} share [%]"] = number_text(100 * one.share)
                values[f"baseline_lacks {one.of} largest [%]"] = number_text(100 * one.largest)
        return values

    def _forbidding(self) -> Diagnosis | Finding | None:
        """Return the alarm that forbids a new baseline, or None."""
        found: list[Diagnosis | Finding] = [
            self._monitor.diagnosis(),
            *self._monitor.findings,
            *self._evidence.findings(),
        ]
        worst = max(found, key=lambda one: one.level)
        allowed = self._node.get_parameter("baseline_in_alarm").value
        return worst if worst.level >= Level.WARN and not allowed else None

    def _require_no_alarm(self) -> None:
        worst = self._forbidding()
        if worst is not None:
            raise BaselineRefusalError(
                f"the valve is in {worst.level.name}, which a new baseline could hide "
                f"({worst.message}): repair it and identify again; if the valve is healthy, set "
                "baseline_in_alarm to true and call again",
                BaselineLack("valve", Lack.HEALTH),
            )

    async def _change(self, kept: KeptBaseline, source: str = "") -> str:
        self._put_in_force(kept.in_force)
        await self._history.keep_baseline(kept)
        answer = (
            f"baseline: {kept.in_force or 'none'}; previous: {kept.replaced or 'none'}"
            f"{self._history.reservation}{source}"
        )
        if kept.in_force is not None and (remark := kept.in_force.remark):
            answer = f"{answer}; {remark}"
        self._node.get_logger().info(answer)
        return answer

    def _put_in_force(self, baseline: Baseline | None) -> None:
        value = _value(baseline)
        shown = math.nan if value is None else value
        self._node.set_parameters([Parameter(_PARAMETER, value=shown)])
        self._monitor.baseline = baseline  # after the node has processed the parameter

    def follow_parameter(self, changes: Iterable[Parameter]) -> None:
        """Follow a change of the parameter, unless its value is already in force."""
        if _PARAMETER not in {one.name for one in changes}:
            return
        given = self._given()
        if given is None or _value(given) != _value(self._monitor.baseline):
            self._monitor.baseline = given
