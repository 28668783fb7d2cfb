# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Faults of a plant, as generators that advance step by step."""

import itertools
import random
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from benchmark.soak.feed import Feed, Nonsense
from benchmark.soak.plant import Database, Life, Plant, Process, filled

_PATIENCE = 60.0
"""Time limit, s, to account for sent samples."""
_HOUR = 3600 * 10**9


@dataclass
class Site:
    """The objects that faults act on.

    Attributes
    ----------
    feeds : mapping of str to Feed
        Feeds of the valves that work through the month.
    of_now : str
        Valve whose sensors stamp with the present time.
    disk : Path or None
        Folder of the history, if its disk is small.
    nonsense : Nonsense or None
        Present nonsense from the sensors of `of_now`.
    silent : set of str
        Valves with silent sensors.
    """

    plant: Plant
    feeds: Mapping[str, Feed]
    of_now: str
    disk: Path | None
    database: Database | None
    chance: random.Random
    kinds: Iterator[Nonsense] = field(default_factory=lambda: itertools.cycle(Nonsense))
    nonsense: Nonsense | None = None
    silent: set[str] = field(default_factory=set)

    def mortal(self) -> Process:
        """Choose a process that may be ended; the last process lasts the whole month."""
        return self.chance.choice(self.plant.processes[:-1])


def _for(seconds: float) -> Iterator[None]:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        yield


def _until(met: Callable[[], bool], seconds: float = _PATIENCE) -> Iterator[None]:
    end = time.monotonic() + seconds
    while not met() and time.monotonic() < end:
        yield


def settled(process: Process) -> Iterator[None]:
    """Hold back samples until all are accounted for and all calls are answered."""
    process.is_held = True
    yield from _until(lambda: process.life.is_settled and not process.life.calls)


def restart(site: Site) -> Iterator[None]:
    """End a process as launch and systemd do, and restart it."""
    process = site.mortal()
    if process.is_held:
        return
    yield from settled(process)
    site.plant.end_life(process, site.chance.choice((signal.SIGINT, signal.SIGTERM)))
    process.begin()
    process.is_held = False


def kill(site: Site) -> Iterator[None]:
    """Kill a process at a random instant, with samples and calls under way."""
    yield from _for(site.chance.uniform(0.0, 2.0))
    process = site.mortal()
    if process.is_held:
        return
    site.plant.end_life(process, signal.SIGKILL)
    process.is_held = True
    yield from _for(site.chance.uniform(0.0, 5.0))
    process.begin()
    process.is_held = False


def clock_step(site: Site) -> Iterator[None]:
    """Set the clock of a valve's sensors wrong by up to two hours, and correct it later."""
    feed = site.feeds[site.chance.choice([*site.feeds])]
    feed.clock_error = round(site.chance.uniform(-2.0, 2.0) * _HOUR)
    yield from _for(site.chance.uniform(5.0, 20.0))
    feed.clock_error = 0


def silent_sensor(site: Site) -> Iterator[None]:
    """Silence the sensors of a valve until the node reports it."""
    valve = site.chance.choice([*site.feeds])
    process = site.plant.process_of(valve)
    if valve in site.silent or process.is_held:
        return
    site.silent.add(valve)
    life, begin = process.life, time.monotonic()
    yield from _until(lambda: "no data on" in life.messages.get(valve, ""))
    if process.life is life:
        told = "no data on" in life.messages.get(valve, "")
        site.plant.ledger.add("silence", seconds=time.monotonic() - begin, told=told)
    site.silent.discard(valve)


def bad_samples(site: Site) -> Iterator[None]:
    """Let a pressure sensor send nan."""
    site.feeds[site.chance.choice([*site.feeds])].bad_rows = site.chance.randint(1, 40)
    yield


def nonsense(site: Site) -> Iterator[None]:
    """Let the sensors of a valve send nonsense until the node reports it, then the truth again.

    The kinds take turns. A case in which the process ends is not counted.
    """
    valve, process = site.of_now, site.plant.process_of(site.of_now)
    if site.nonsense is not None or not site.plant.is_ready(valve):
        return
    kind, life = next(site.kinds), process.life
    for event, wanted in (("nonsense", True), ("nonsense over", False)):
        site.nonsense = kind if wanted else None

        def is_so(wanted: bool = wanted) -> bool:
            return (kind.value in life.messages.get(valve, "")) is wanted

        begin = time.monotonic()
        yield from _until(is_so)
        if process.life is life and not process.is_held:
            seconds, told = time.monotonic() - begin, is_so()
            site.plant.ledger.add(event, name=kind.name, seconds=seconds, told=told)


def frozen(site: Site) -> Iterator[None]:
    """Suspend a process for some seconds, like a machine that swaps."""
    process = site.plant.processes[-1]
    if process.is_held:
        return
    process.is_held = True
    process.life.process.send(signal.SIGSTOP)
    yield from _for(site.chance.uniform(1.0, 6.0))
    process.life.process.send(signal.SIGCONT)
    process.is_held = False


def _until_told(
    site: Site, event: str, tells: Callable[[Life], bool], longer: float
) -> Iterator[None]:
    """Wait until a process reports a fault, and up to `longer` s more; log the result."""
    told: set[str] = set()

    def is_told() -> bool:
        told.update(one.name for one in site.plant.processes if tells(one.life))
        return bool(told)

    begin = time.monotonic()
    yield from _until(is_told)
    yield from _for(site.chance.uniform(0.0, longer))
    site.plant.ledger.add(event, seconds=time.monotonic() - begin, told=bool(told))


def _tells_of_disk(life: Life) -> bool:
    return any("the history is not written" in one for one in life.messages.values())


def _tells_of_database(life: Life) -> bool:
    return any(values.get("history_server problem") for values in life.told.values())


def full_disk(site: Site) -> Iterator[None]:
    """Fill the disk of the history until a node reports it, then make room again."""
    if site.disk is None:
        return
    with filled(site.disk):
        yield from _until_told(site, "full disk", _tells_of_disk, 10.0)


def database_killed(site: Site) -> Iterator[None]:
    """Kill the history server with all its processes, and restart it."""
    database = site.database
    if database is None or database.is_away:
        return
    database.is_away = True
    database.server.kill()
    yield from _until_told(site, "database away", _tells_of_database, 20.0)
    yield from _until(database.server.launch)
    database.is_away = False


def database_silent(site: Site) -> Iterator[None]:
    """Let the history server accept packets without answering, like a cut network."""
    database = site.database
    if database is None or database.is_away:
        return
    database.is_away = True
    with database.server.paused():
        yield from _until_told(site, "database away", _tells_of_database, 20.0)
    database.is_away = False


FAULTS: Mapping[str, tuple[Callable[[Site], Iterator[None]], float]] = {
    "restart": (restart, 3.0),
    "kill": (kill, 3.0),
    "clock step": (clock_step, 2.0),
    "silent sensor": (silent_sensor, 2.0),
    "bad samples": (bad_samples, 3.0),
    "nonsense": (nonsense, 3.0),
    "frozen": (frozen, 1.0),
    "full disk": (full_disk, 1.0),
    "database killed": (database_killed, 1.0),
    "database silent": (database_silent, 1.0),
}
"""Faults by name, each with its weight in the draw."""
