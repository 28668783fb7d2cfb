"""The evidence of the moves in service: gathered, kept in the history, shown, and judged."""

import math
import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone

from rclpy.node import Node

from valve_friction_ros.evidence import MOST_MOVES, Evidence, Move, MoveStream, evidence_of
from valve_friction_ros.health import (
    Baseline,
    Diagnosis,
    Finding,
    FrictionMonitor,
    Level,
    baseline_by_evidence,
    diagnosis_by_evidence,
)
from valve_friction_ros.history import HistoryFile, KeptValve, keep_moves
from valve_friction_ros.model.valve import Valve
from valve_friction_ros.nodes.identifier.history_writer import HistoryWriter
from valve_friction_ros.nodes.identifier.parameters import HISTORY_DAYS
from valve_friction_ros.streams import Arrivals

__all__ = ["EvidenceWatch"]

_COMBINE_EVERY = 300_000_000_000
"""Nanoseconds of stamps from one combination to the next: thousands of moves take 0.1 s."""

_WRITE_EVERY = 5.0
"""Time between two writings, s. A killed node loses so much, and a move that has not ended."""

_SHOWN = ("sliding_friction", "static_friction", "spring_constant", "spring_preload")


def _date(stamp: int) -> str:
    return f"{datetime.fromtimestamp(stamp / 1e9, timezone.utc):%Y-%m-%dT%H:%M:%SZ}"


def _number(value: float) -> str:
    return f"{value:.9g}"


@dataclass(eq=False)
class _Batch:
    """Moves to be written in the writer's thread, and whether they are."""

    valve: KeptValve
    built: Valve
    moves: tuple[Move, ...]
    days: float
    is_written: bool = False

    def __call__(self, file: HistoryFile) -> None:
        keep_moves(file, self.valve, self.built, self.moves, self.days)
        self.is_written = True


class EvidenceWatch:
    """Gathers the moves of the valve, and compares their friction with the baseline; a `Watch`."""

    def __init__(self, node: Node, monitor: FrictionMonitor, history: HistoryWriter) -> None:
        self._node, self._monitor, self._history = node, monitor, history
        self._built = monitor.settings.valve
        self._stream = MoveStream(self._built)
        self._ledger: deque[Move] = deque(history.moves()[-MOST_MOVES:], maxlen=MOST_MOVES)
        self._unwritten: deque[Move] = deque(maxlen=MOST_MOVES)
        self._batch: _Batch | None = None
        self._written_at = time.monotonic()
        self._combine()

    @property
    def evidence(self) -> Evidence:
        """What the moves say together, as of the latest combination."""
        return self._evidence

    @property
    def source(self) -> str:
        """What the evidence is of, in words."""
        return f"by {self._evidence.moves} moves in service since {_date(self._evidence.since)}"

    def as_baseline(self) -> Baseline:
        """Return the sliding friction of the moves as baseline; raises RefusalError."""
        self._combine()
        return baseline_by_evidence(self._evidence)

    def follow_parameters(self) -> None:
        """Use the valve and the settings in force; other forces need other moves."""
        if self._monitor.settings.valve != self._built:
            self.close()
            self._built = self._monitor.settings.valve
            self._stream = MoveStream(self._built)
            self._ledger.clear()
        self._combine()

    def forget_samples(self) -> None:
        """Drop the move under way; the moves that have ended stay."""
        self._stream.forget()

    def take(self, arrivals: Arrivals) -> None:
        """Take samples; combine the moves now and then."""
        moves = self._stream.take(arrivals)
        if not moves:
            return
        while self._ledger and self._ledger[-1].end > moves[0].begin:  # the clock was set back
            self._ledger.pop()
        self._ledger.extend(moves)
        self._unwritten.extend(moves)
        if abs(moves[-1].end - self._combined) >= _COMBINE_EVERY:
            self._combine()

    def findings(self) -> Sequence[Finding]:
        """Return that friction has grown or collapsed, if so."""
        diagnosis = self._diagnosis()
        if diagnosis is None or diagnosis.level < Level.WARN:
            return ()
        return (Finding(diagnosis.level, diagnosis.status_signal, diagnosis.message),)

    def values(self) -> Mapping[str, str]:
        """Return what the moves say, with intervals, or why they do not."""
        self._history.settle()
        if time.monotonic() - self._written_at >= _WRITE_EVERY:
            self._keep()
        found = self._evidence
        values = {"evidence moves": str(found.moves)}
        if found.moves:
            values["evidence since [time]"] = _date(found.since)
            values["evidence until [time]"] = _date(found.until)
        if not found.is_known:
            values["evidence reason"] = found.parameters["sliding_friction"].reason
        else:
            values |= self._numbers()
        if (change := found.change) is not None:
            values["evidence change_ratio"] = _number(change.ratio)
            values["evidence change_ratio low"] = _number(change.low)
            values["evidence change_ratio high"] = _number(change.high)
            values["evidence change earliest [time]"] = _date(change.earliest)
            values["evidence change latest [time]"] = _date(change.latest)
        diagnosis = self._diagnosis()
        if diagnosis is not None and (ratio := diagnosis.ratio) is not None:
            values["evidence friction_ratio"] = _number(ratio.value)
            values["evidence friction_ratio low"] = _number(ratio.low)
            values["evidence friction_ratio high"] = _number(ratio.high)
            values["evidence friction_ratio of"] = ratio.what
        return values

    def close(self) -> None:
        """Write what is not written yet; the writer's thread finishes it."""
        if self._unwritten:
            self._write()

    def _numbers(self) -> dict[str, str]:
        values = {}
        for name in _SHOWN:
            one = self._evidence.parameters[name]
            values[f"evidence {name} [{one.unit}]"] = _number(one.value)
            values[f"evidence {name} half width [{one.unit}]"] = _number(one.half_width)
            values[f"evidence {name} verdict"] = one.verdict.value
            if one.reason:
                values[f"evidence {name} reason"] = one.reason
        values["evidence sliding_speed [m/s]"] = _number(self._evidence.sliding_speed)
        band = self._evidence.parameters["dead_band"]
        travel = self._monitor.settings.valve.travel
        scale, unit = (100 / travel, "%") if math.isfinite(travel) else (1e3, "mm")
        values[f"evidence dead_band [{unit}]"] = _number(scale * band.value)
        values[f"evidence dead_band half width [{unit}]"] = _number(scale * band.half_width)
        if band.reason:
            values["evidence dead_band reason"] = band.reason
        return values

    def _diagnosis(self) -> Diagnosis | None:
        settings = self._monitor.settings
        return diagnosis_by_evidence(
            self._evidence, settings.valve, self._monitor.baseline, settings.limits
        )

    def _combine(self) -> None:
        settings = self._monitor.settings
        ledger = tuple(self._ledger)
        self._evidence = evidence_of(ledger, settings.valve, settings.identification)
        self._combined = ledger[-1].end if ledger else 0

    def _keep(self) -> None:
        """Have the writer's thread write the new moves, once those before are written."""
        self._written_at = time.monotonic()
        if self._batch is not None and not self._batch.is_written:
            self._history.keep_soon(self._batch)
        elif self._unwritten:
            self._write()

    def _write(self) -> None:
        days = self._node.get_parameter(HISTORY_DAYS.name).value
        self._batch = _Batch(self._history.valve, self._built, tuple(self._unwritten), days)
        self._unwritten.clear()
        self._history.keep_soon(self._batch)
