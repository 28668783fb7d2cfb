# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""The plant of the soak: its processes, what is sent to them, its disk and its database."""

import contextlib
import math
import signal
import sqlite3
import subprocess
import time
import uuid
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from numpy.typing import NDArray
from rclpy.task import Future
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout
from std_srvs.srv import Trigger

from benchmark.harness import processes
from benchmark.harness.postgres import PostgresServer
from benchmark.harness.run import Ledger, Participant
from valve_friction_ros.history import copied
from valve_friction_ros.history.outbox import count_unsent
from valve_friction_ros.history.place import HistoryServer
from valve_friction_ros.model import (
    BENCH_VALVE,
    LOW_FRICTION,
    Recording,
    SensorNoise,
    SineWave,
    simulate,
)
from valve_friction_ros.nodes.plumbing.messages import time_message
from valve_friction_ros.nodes.plumbing.qos import blocks, stream

PIECE = 50
"""Rows per piece, sent at once."""

_ROWS, _RATE = 500, 100.0
"""Rows per record, and rows per second of the valve's time."""
_STEPS = 20
"""Number of steps in which friction grows over the month."""

PERIOD = 0.05
"""Sample period of nonsense, s."""
TOLD_WITHIN = 5.0
"""Time limit, s, for a node to report nonsense."""

_BAR, _MM = 1e5, 1e-3
_SECOND = 10**9
_FAR = 3 * 10**8 * _SECOND


class Piece(NamedTuple):
    """Rows sent at once: stamps, ns, and measured values, Pa and m."""

    stamps: NDArray[np.int64]
    pressure: NDArray[np.float64]
    position: NDArray[np.float64]


@lru_cache
def _record(growth: float) -> Recording:
    """Return five seconds of a valve with friction grown by a factor."""
    time = np.arange(_ROWS) / _RATE
    friction = replace(
        LOW_FRICTION,
        coulomb_friction=growth * LOW_FRICTION.coulomb_friction,
        static_friction=growth * LOW_FRICTION.static_friction,
    )
    pressure = SineWave(period=5.0).sample(time)
    position = simulate(BENCH_VALVE, friction, pressure, 1 / _RATE).position
    return SensorNoise(5e-6, 50.0, seed=1).applied_to(Recording(1 / _RATE, pressure, position))


class Feed:
    """Records of one valve with friction that grows over the month by a factor."""

    def __init__(self, growth: float) -> None:
        self._growth = growth
        self.clock_error = 0
        """Time by which the sensors' clock is ahead, ns."""
        self.bad_rows = 0
        """Number of rows in the next record with a pressure of nan."""

    def record(self, share: float, now: int) -> Iterator[Piece]:
        """Yield a record for a share of the month, starting at a time, ns."""
        step = round(share * _STEPS) / _STEPS
        record = _record(1.0 + (self._growth - 1.0) * step)
        period = round(1e9 / _RATE)
        stamps = now + self.clock_error + period * np.arange(_ROWS, dtype=np.int64)
        pressure = record.pressure.copy()
        pressure[: self.bad_rows] = math.nan
        self.bad_rows = 0
        for begin in range(0, _ROWS, PIECE):
            piece = slice(begin, begin + PIECE)
            yield Piece(stamps[piece], pressure[piece], record.position[piece])


def stamped(stamp: int, pressure: float, position: float) -> tuple[FluidPressure, JointState]:
    """Return the messages of both sensors at a time, ns."""
    drive = FluidPressure(fluid_pressure=pressure)
    stem = JointState(name=["stem"], position=[position])
    drive.header.stamp = stem.header.stamp = time_message(stamp)
    return drive, stem


class Nonsense(Enum):
    """Kinds of nonsense, with the words expected from the node."""

    WRONG_JOINT = "no position for the joint 'stem'"
    PRESSURE_NAN = "actuator_pressure: 100 % of its samples are rejected"
    POSITION_NAN = "stem_state: 100 % of its samples are rejected"
    PRESSURE_ABOVE = "900000 Pa is outside the sensor's range"
    PRESSURE_BELOW = "-10000 Pa is outside the sensor's range"
    STEM_IN_MM = "stem_state: 100 % of its samples lie outside the travel"
    STEM_ENDLESS = "1e+308 m is outside the range of any valve"
    STEM_LATE = "later than actuator_pressure"
    CLOCK_AHEAD = "3472 days ahead of the clock"
    CLOCK_BEHIND = "3472 days behind the clock"
    NO_STAMPS = "time stamps are repeated"


def said(kind: Nonsense | None, now: int) -> tuple[FluidPressure, JointState]:
    """Return the messages of both sensors at a time, ns; None for the truth."""
    phase = 2 * math.pi * (now / _SECOND % 8.0) / 8.0
    pressure = {
        Nonsense.PRESSURE_NAN: math.nan,
        Nonsense.PRESSURE_ABOVE: 9 * _BAR,
        Nonsense.PRESSURE_BELOW: -0.1 * _BAR,
    }.get(kind, (1.2 + 0.3 * math.sin(phase)) * _BAR)
    truth = (6.0 + 2.0 * math.sin(phase)) * _MM
    position = {
        Nonsense.POSITION_NAN: math.nan,
        Nonsense.STEM_IN_MM: truth / _MM,
        Nonsense.STEM_ENDLESS: 1e308,
    }.get(kind, truth)
    off = {Nonsense.CLOCK_AHEAD: _FAR, Nonsense.CLOCK_BEHIND: -_FAR, Nonsense.NO_STAMPS: -now}
    stamp = now + off.get(kind, 0)
    drive, stem = stamped(stamp, pressure, position)
    if kind is Nonsense.STEM_LATE:
        stem.header.stamp = time_message(stamp + 5 * _SECOND)
    if kind is Nonsense.WRONG_JOINT:
        stem.name = ["arm"]
    return drive, stem


_COUNT = "SELECT count(*) FROM identification"
_SIZE = "64m"
_CHUNK = 2**16


class Kept(NamedTuple):
    """Contents of a history file and a server at the end."""

    # identifications, counted by the clients of the database engines
    in_file: int
    on_server: int
    # rows in the file that wait for the server, by the file's own count; rows that a process writes
    # as it ends are sent at its next start
    waiting: int
    lacking: int  # rows of all tables that were missing or different on the server


class Database:
    """A database on a server that may be killed and suspended."""

    def __init__(self, server: PostgresServer) -> None:
        self.server = server
        self._name = server.database()
        self.url = server.url(self._name)
        self.is_away = False
        """Whether a fault affects it now."""

    def compared_with(self, file: Path) -> Kept:
        """Compare a file with the server; afterwards the server has everything."""
        ((on_server,),) = self.server.do(self._name, _COUNT)
        with contextlib.closing(sqlite3.connect(file)) as connection:
            (in_file,) = connection.execute(_COUNT).fetchone()
        waiting = count_unsent(file).waiting
        parts = copied(file, HistoryServer(self.url))
        lacking = sum(one.written + (not one.is_same) for one in parts)
        return Kept(in_file, on_server, waiting, lacking)


@contextlib.contextmanager
def small_disk(folder: Path) -> Iterator[bool]:
    """Mount a 64 MB file system in memory on a folder; provide whether that was allowed."""
    folder.mkdir(parents=True, exist_ok=True)
    command = ["mount", "-t", "tmpfs", "-o", f"size={_SIZE}", "tmpfs", str(folder)]
    is_mounted = False
    with contextlib.suppress(FileNotFoundError):
        is_mounted = subprocess.run(command, capture_output=True, check=False).returncode == 0
    try:
        yield is_mounted
    finally:
        if is_mounted:
            subprocess.run(["umount", "-l", str(folder)], check=False)


@contextlib.contextmanager
def filled(folder: Path) -> Iterator[None]:
    """Fill the disk of a folder."""
    filler = folder / f"filler_{uuid.uuid4().hex}"  # two faults may fill it at once
    with contextlib.suppress(OSError), filler.open("wb", buffering=0) as stream:
        while True:
            stream.write(bytes(_CHUNK))
    try:
        yield
    finally:
        filler.unlink()


_CALL_LIMIT = 120.0
"""Time, s, after which a call is considered unanswered."""
SERVICES = ("identify", "set_baseline", "save", "report")


@dataclass
class Life:
    """A process from start to end."""

    process: processes.Process
    begin: float  # start time, s since 1970
    # samples sent to each of its valves, including bad samples
    sent: Counter[str] = field(default_factory=Counter)
    # values and message of the latest diagnostic of each valve
    told: dict[str, Mapping[str, str]] = field(default_factory=dict)
    messages: dict[str, str] = field(default_factory=dict)
    # calls under way: valve, service and start time by future
    calls: dict[Future, tuple[str, str, float]] = field(default_factory=dict)
    # identifications answered since a valve last reported that its history is written
    unsaved: int = 0

    def told_samples(self, valve: str, which: str) -> int:
        """Return the number of samples of a valve ``taken``, or ``rejected`` with a cause."""
        return int(self.told.get(valve, {}).get(f"samples_{which}", "0"))

    @property
    def is_settled(self) -> bool:
        """Whether every sent sample is accounted for."""
        return all(
            self.told_samples(valve, "taken") + self.told_samples(valve, "rejected") == count
            for valve, count in self.sent.items()
        )


class Process:
    """One process of the plant with the namespaces of its valves, over all restarts."""

    def __init__(
        self, name: str, folder: Path, valves: Sequence[str], command: Sequence[str]
    ) -> None:
        self.name, self.valves = name, valves
        self._command, self._log = command, folder / f"{name}.log"
        self.is_held = False
        """Whether to hold back samples and calls for now."""
        self.begin()

    def begin(self) -> None:
        """Start or restart the process."""
        self.life = Life(processes.Process(self._command, self._log), time.time())


class Plant(Participant):
    """All processes, and a node that feeds, calls and hears them."""

    def __init__(self, ledger: Ledger, plant: Sequence[Process]) -> None:
        self.ledger, self.processes = ledger, plant
        super().__init__("soak")
        self._by_valve = {valve: one for one in plant for valve in one.valves}
        self.valves = tuple(self._by_valve)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._hear, 1000)

        def publishers(kind: type, name: str, qos: object) -> dict[str, object]:
            create = self.node.create_publisher
            return {valve: create(kind, f"{valve}/{name}", qos) for valve in self.valves}

        self._pressures = publishers(FluidPressure, "actuator_pressure", stream())
        self._stems = publishers(JointState, "stem_state", stream())
        self._blocks = publishers(Float64MultiArray, "identifier/samples", blocks())
        self._clients = {
            (valve, service): self.node.create_client(Trigger, f"{valve}/identifier/{service}")
            for valve in self.valves
            for service in SERVICES
        }

    def process_of(self, valve: str) -> Process:
        """Return the process that monitors a valve."""
        return self._by_valve[valve]

    def spin(self, seconds: float) -> None:
        """Listen for some time, and note finished calls."""
        super().spin(seconds)
        for process in self.processes:
            for call in list(process.life.calls):
                begin = process.life.calls[call][-1]
                if call.done() or time.monotonic() - begin > _CALL_LIMIT:
                    self._note(process.life, call)

    def _note(self, life: Life, call: Future) -> None:
        valve, service, begin = life.calls.pop(call)
        answer = call.result() if call.done() else None
        if service == "identify" and answer is not None:
            life.unsaved += 1
        self.ledger.add(
            "call",
            valve=valve,
            service=service,
            seconds=None if answer is None else time.monotonic() - begin,
            success=None if answer is None else answer.success,
            message="" if answer is None else answer.message,
        )

    def _hear(self, message: DiagnosticArray) -> None:
        stamp = message.header.stamp
        for status in message.status:
            valve = status.name.rpartition("/identifier")[0]
            process = self._by_valve.get(valve)
            if process is None or stamp.sec + stamp.nanosec / 1e9 < process.life.begin:
                continue
            life = process.life
            life.told[valve] = {one.key: one.value for one in status.values}
            life.messages[valve] = status.message
            if "the history is not written" not in status.message:
                life.unsaved = 0

    def is_ready(self, valve: str) -> bool:
        """Whether a valve publishes and has subscribed."""
        process = self._by_valve[valve]
        if process.is_held or valve not in process.life.told:
            return False
        if len(process.valves) > 1:
            return bool(self._blocks[valve].get_subscription_count())
        publishers = self._pressures[valve], self._stems[valve]
        return all(one.get_subscription_count() for one in publishers)

    def send(self, valve: str, piece: Piece) -> None:
        """Send rows as single samples or, to a process of many valves, as a block."""
        process = self._by_valve[valve]
        rows = len(piece.stamps)
        if len(process.valves) == 1:
            for row in zip(*(part.tolist() for part in piece), strict=True):
                self._publish(valve, stamped(*row))
            return
        columns = (piece.stamps / 1e9, piece.pressure, piece.position)
        data = [float(number) for row in zip(*columns, strict=True) for number in row]
        layout = MultiArrayLayout(
            dim=[
                MultiArrayDimension(label="sample", size=rows, stride=3 * rows),
                MultiArrayDimension(label="time,pressure,position", size=3, stride=3),
            ]
        )
        self._blocks[valve].publish(Float64MultiArray(layout=layout, data=data))
        process.life.sent[valve] += 2 * rows

    def say(self, valve: str, kind: Nonsense | None) -> None:
        """Send the present samples of both sensors of a valve: nonsense, or the truth."""
        self._publish(valve, said(kind, time.time_ns()))

    def _publish(self, valve: str, messages: tuple[FluidPressure, JointState]) -> None:
        for publishers, message in zip((self._pressures, self._stems), messages, strict=True):
            publishers[valve].publish(message)
        self._by_valve[valve].life.sent[valve] += len(messages)

    def ask(self, valve: str, service: str) -> None:
        """Call a service of a valve, if available."""
        client, process = self._clients[valve, service], self._by_valve[valve]
        if client.service_is_ready() and not process.is_held:
            call = client.call_async(Trigger.Request())
            process.life.calls[call] = valve, service, time.monotonic()

    def end_life(self, process: Process, how: signal.Signals) -> None:
        """End a process, and note its sample counts."""
        life = process.life
        if how is signal.SIGKILL:
            life.process.kill()
        else:
            took = life.process.end(how)
            code = life.process.exit_code()
            self.ledger.add("ending", name=process.name, seconds=took, code=code)
        self.note_end(process, how.name)

    def note_end(self, process: Process, how: str) -> None:
        """Log the samples sent to an ended process, and its own counts of them.

        Calls under way will not be answered.
        """
        life = process.life
        for valve, service, _ in life.calls.values():
            self.ledger.add("call", valve=valve, service=service, seconds=None, ended=how)
        life.calls.clear()
        for valve in process.valves:
            self.ledger.add(
                "life",
                valve=valve,
                end=how,
                sent=life.sent[valve],
                taken=life.told_samples(valve, "taken"),
                rejected=life.told_samples(valve, "rejected"),
                causes=life.told.get(valve, {}).get("samples_rejected causes", ""),
                unsaved=life.unsaved,
            )
