# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""A month of a plant in an hour with the usual faults, each sample accounted for: `make soak`."""

import argparse
import itertools
import math
import random
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from benchmark.harness.postgres import PostgresServer, running_server, why_no_server
from benchmark.harness.processes import CODES, node, parameters
from benchmark.harness.rows import Row, none, some
from benchmark.harness.run import BENCH, Events, Ledger, by_kind, endured, run_parser
from benchmark.soak_plant import (
    PERIOD,
    SERVICES,
    TOLD_WITHIN,
    Database,
    Feed,
    Kept,
    Life,
    Nonsense,
    Piece,
    Plant,
    Process,
    filled,
    small_disk,
)
from valve_friction_ros.history import HistoryFile

_PATIENCE = 60.0
"""Time limit, s, to account for sent samples."""
_HOUR = 3600 * 10**9


@dataclass
class Site:
    """The objects that faults act on."""

    plant: Plant
    feeds: Mapping[str, Feed]  # feeds of the valves that work through the month
    of_now: str  # valve whose sensors stamp with the present time
    disk: Path | None  # folder of the history, if its disk is small
    database: Database | None
    chance: random.Random
    kinds: Iterator[Nonsense] = field(default_factory=lambda: itertools.cycle(Nonsense))
    nonsense: Nonsense | None = None  # present nonsense from the sensors of `of_now`
    silent: set[str] = field(default_factory=set)  # valves with silent sensors

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


def _database_away(
    site: Site, broken: Callable[[PostgresServer], AbstractContextManager[None]]
) -> Iterator[None]:
    """Break the history server until a node reports it."""
    database = site.database
    if database is None or database.is_away:
        return
    database.is_away = True
    with broken(database.server):
        yield from _until_told(site, "database away", _tells_of_database, 20.0)
    yield from _until(database.server.launch)
    database.is_away = False


def database_killed(site: Site) -> Iterator[None]:
    """Kill the history server with all its processes, and restart it."""

    @contextmanager
    def killed(server: PostgresServer) -> Iterator[None]:
        server.kill()
        yield

    return _database_away(site, killed)


def database_silent(site: Site) -> Iterator[None]:
    """Let the history server accept packets without answering, like a cut network."""
    return _database_away(site, PostgresServer.paused)


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


_KILLED = "SIGKILL"
_BUSY = "already running"
"""Words of a refusal without a record, so that nothing is stored."""
_MIDDLE, _MOST = 0.5, 1.05
"""Middle of the month, and limit of the final over the middle memory, of the lasting process."""


def _samples(lives: Events) -> Iterator[Row]:
    sent, taken, rejected = (
        sum(one[name] for one in lives) for name in ("sent", "taken", "rejected")
    )
    yield some("samples sent", sent)
    yield Row("samples taken", taken)
    yield Row("samples rejected with a cause", rejected)
    open_ = [(one["end"], one["sent"] - one["taken"] - one["rejected"]) for one in lives]
    killed = sum(count for end, count in open_ if end == _KILLED)
    yield Row("sent in the last second before a kill, or never told", killed)
    yield none("samples unexplained", sum(abs(count) for end, count in open_ if end != _KILLED))


def _identifications(calls: Events, lives: Events, stored: Mapping[str, int]) -> Iterator[Row]:
    everything = [one for one in calls if one["service"] == "identify"]
    asked = [one for one in everything if _BUSY not in (one.get("message") or "")]
    answered = [one for one in asked if one["seconds"] is not None]
    cut = [one for one in asked if one.get("ended")]
    yield Row("identifications asked", len(everything), "", goal="some", met=bool(asked))
    yield Row("refused, as another one ran", len(everything) - len(asked))
    yield Row("answered with a result", sum(bool(one["success"]) for one in answered))
    yield Row("answered with a refusal", sum(not one["success"] for one in answered))
    yield Row("under way when the process ended", len(cut))
    yield none("never answered", len(asked) - len(answered) - len(cut))
    kept = sum(stored.values())
    yield Row("stored in the history", kept)
    ended = sum(one["unsaved"] for one in lives if one["end"] == _KILLED)
    yield Row("waiting for a full disk at a kill", ended)
    lost = extra = 0
    for valve, count in stored.items():
        waiting = sum(one["unsaved"] for one in lives if one["valve"] == valve)
        mine = sum(one["valve"] == valve for one in answered)
        unanswered = sum(one["valve"] == valve for one in asked) - mine
        lost += max(mine - waiting - count, 0)
        extra += max(count - mine - unanswered, 0)
    yield none("answered, and not in the history", lost)
    yield none("in the history, and never asked", extra)
    if answered:
        yield Row("longest answer", max(one["seconds"] for one in answered), "s")


def _memory(looks: Events) -> Iterator[Row]:
    """Compare the end with the middle, by which time every part of the package has been used."""
    by_share = {one["share"]: one["megabytes"] for one in looks}
    for share, size in by_share.items():
        item = f"memory after {100 * share:.0f} % of the month"
        if share == 1.0 and _MIDDLE in by_share:
            goal, middle = f"under {_MOST:g} times", by_share[_MIDDLE]
            yield Row(item, size, "MB", middle, "in the middle", goal, size < _MOST * middle)
        else:
            yield Row(item, size, "MB")


def _nonsense(begun: Events, ended: Events) -> Iterator[Row]:
    """Check that each kind of nonsense is reported, and cleared, within the time limit."""
    yield Row("kinds of nonsense that sensors said", len({one["name"] for one in begun}), "of 11")
    for item, events in (("told", begun), ("over", ended)):
        late = [one for one in events if not (one["told"] and one["seconds"] <= TOLD_WITHIN)]
        yield none(f"nonsense that was not {item} within {TOLD_WITHIN:g} s", len(late))
        if events:
            longest = max(one["seconds"] for one in events)
            yield Row(f"longest until nonsense was {item}", longest, "s")


def rows(events: Events, stored: Mapping[str, int]) -> Iterator[Row]:
    """Account for all events; `stored` is the number of identifications in the history by valve."""
    of = by_kind(events)
    faults = Counter(one["name"] for one in of["fault"])
    for name, count in sorted(faults.items()):
        yield Row(f"fault: {name}", count)
    lives = of["life"]
    yield from _samples(lives)
    yield from _identifications(of["call"], lives, stored)
    others = [one for one in of["call"] if one["service"] != "identify"]
    yield Row("other calls", len(others))
    never = sum(one["seconds"] is None and not one.get("ended") for one in others)
    yield none("other calls never answered", never)
    for kind, item in (
        ("silence", "silent sensors"),
        ("full disk", "full disks"),
        ("database away", "databases away"),
    ):
        yield none(f"{item} that nobody told", sum(not one["told"] for one in of[kind]))
    yield from _nonsense(of["nonsense"], of["nonsense over"])
    for end in of["ending"]:
        if end["code"] not in CODES:
            item, code = f"{end['name']} ended with code", end["code"] or -1
            yield Row(item, code, "", goal="that of its signal", met=False)
    yield none("processes that ended by themselves", len(of["died"]))
    yield from _memory(of["memory"])


def database_rows(kept: Kept) -> Iterator[Row]:
    """Yield the final contents of history file and server."""
    yield Row("identifications in the file", kept.in_file)
    is_same = kept.on_server == kept.in_file
    yield Row("identifications on the server", kept.on_server, "", goal="as many", met=is_same)
    yield Row("rows that wait for the next start", kept.waiting)
    # A sent row may still wait, until the node knows that it has arrived.
    lost = max(kept.lacking - kept.waiting, 0)
    yield none("rows that the server lacks and that do not wait", lost)


_MONTH = 30 * 86_400 * 10**9
_GROWTH = {"/fv_101": 1.0, "/fv_102": 1.6, "/fv_201": 1.0, "/fv_202": 2.5}
_OF_NOW = "/fv_301"
"""Valve whose sensors stamp with the present time; its sensors also send nonsense."""
_TURN = 0.02
_PAUSE = 3.0
"""Mean time between two records of a valve, s."""
_CALM = 6.0
"""Mean time between two faults, s."""
_ASKED, _OTHERS = 0.6, SERVICES[1:]
_OTHER = 0.03
_START_LIMIT = 120.0
_LOOKS = (0.1, 0.25, 0.5, 0.75)
"""Shares of the month at which memory is measured, besides the end."""


def _processes(folder: Path, disk: Path, url: str) -> list[Process]:
    """Start identifiers of one valve each, and a process of two that lasts the whole month."""
    common = [
        "--params-file",
        str(BENCH),
        *parameters(
            history_file=disk / "history.sqlite",
            save_folder=folder / "saved",
            report_folder=folder / "reports",
            window=10.0,
            input_timeout=8.0,
            alarm_recordings=3,
            clock_tolerance=0.0,
            **({"history_url": url} if url else {}),
        ),
    ]

    def single(valve: str, *more: str) -> Process:
        command = node("identifier", "-r", f"__ns:={valve}", *common, *more)
        return Process(valve.strip("/"), folder, (valve,), command)

    *singles, first, second = _GROWTH
    many = node("identifiers", *common, *parameters(valves=f"[{first},{second}]"))
    return [
        *map(single, singles),
        single(_OF_NOW, *parameters(clock_tolerance=60.0)),
        Process("identifiers", folder, (first, second), many),
    ]


class _Month:
    def __init__(self, site: Site, seconds: float) -> None:
        self._site, self._seconds = site, seconds
        self._begin, self._month_begin = time.monotonic(), time.time_ns() - _MONTH
        self._under_way: dict[str, Iterator[Piece]] = {}
        self._next = dict.fromkeys(site.plant.valves, 0.0)
        self._faults: list[Iterator[None]] = []
        self._next_fault = time.monotonic() + _CALM
        self._next_word = 0.0

    @property
    def share(self) -> float:
        return (time.monotonic() - self._begin) / self._seconds

    def turn(self) -> None:
        """Send a piece to each working valve, and advance the faults."""
        site = self._site
        for valve in site.feeds:
            self._feed(valve)
        self._go_on()
        if time.monotonic() > self._next_fault:
            self._next_fault = time.monotonic() + site.chance.expovariate(1 / _CALM)
            names, weights = list(FAULTS), [weight for _, weight in FAULTS.values()]
            (name,) = site.chance.choices(names, weights)
            site.plant.ledger.add("fault", name=name, share=self.share)
            self._faults.append(FAULTS[name][0](site))
        site.plant.spin(_TURN)
        self._look()

    def _go_on(self) -> None:
        """Send the due samples of the valve `_OF_NOW`, and advance each fault by a step."""
        plant = self._site.plant
        if time.monotonic() >= self._next_word and plant.is_ready(_OF_NOW):
            self._next_word = time.monotonic() + PERIOD
            plant.say(_OF_NOW, self._site.nonsense)
        self._faults = [one for one in self._faults if next(one, self) is None]

    def _feed(self, valve: str) -> None:
        site, plant = self._site, self._site.plant
        if not plant.is_ready(valve):
            self._under_way.pop(valve, None)
            return
        if valve not in self._under_way:
            if time.monotonic() < self._next[valve] or valve in site.silent:
                return
            self._next[valve] = time.monotonic() + site.chance.expovariate(1 / _PAUSE)
            now = self._month_begin + round(self.share * _MONTH / 1e6) * 10**6
            self._under_way[valve] = site.feeds[valve].record(self.share, now)
        piece = next(self._under_way[valve], None)
        if piece is not None:
            plant.send(valve, piece)
            return
        del self._under_way[valve]
        if site.chance.random() < _ASKED:
            plant.ask(valve, "identify")
        if site.chance.random() < _OTHER:
            plant.ask(valve, site.chance.choice(_OTHERS))

    def _look(self) -> None:
        plant = self._site.plant
        for process in plant.processes:
            code = process.life.process.exit_code()
            if code is not None and not process.is_held:
                plant.ledger.add("died", name=process.name, code=code)
                plant.note_end(process, "died")
                process.begin()

    def finish(self) -> None:
        """Let all faults end, and wait until all sent samples are accounted for."""
        plant = self._site.plant
        deadline = time.monotonic() + _START_LIMIT
        while self._faults and time.monotonic() < deadline:
            self._go_on()
            plant.spin(_TURN)
        for process in plant.processes:
            for _ in settled(process):
                plant.spin(_TURN)
        plant.wait(lambda: not any(map(_is_waiting, plant.processes)), _START_LIMIT)


def _is_waiting(process: Process) -> bool:
    """Return whether rows of a process wait for the server."""
    waiting = [one.get("history_server waiting", "0") for one in process.life.told.values()]
    return any(count != "0" for count in waiting)


def _stored(path: Path, valves: Sequence[str]) -> Mapping[str, int]:
    """Count the identifications in the history by valve."""
    file = HistoryFile(path)
    return {valve: len(file.entries([f"{valve}/identifier"], 0, 2**63 - 1)) for valve in valves}


def _live(options: argparse.Namespace, seconds: float, ledger: Ledger) -> Iterator[Row]:
    """Run the plant for some seconds, and account for all events."""
    disk = options.folder / "disk"
    history = disk / "history.sqlite"
    with small_disk(disk) as is_small, running_server() as server:
        database = None if server is None else Database(server)
        if not is_small:
            ledger.add("left out", what="full disk: no rights to mount one")
        if database is None:
            ledger.add("left out", what=f"database: {why_no_server()}")
        processes = _processes(options.folder, disk, database.url if database else "")
        with Plant(ledger, processes) as plant:
            try:
                feeds = {valve: Feed(growth) for valve, growth in _GROWTH.items()}
                chance = random.Random(options.seed)
                site = Site(plant, feeds, _OF_NOW, disk if is_small else None, database, chance)
                if not plant.wait(lambda: all(map(plant.is_ready, plant.valves)), _START_LIMIT):
                    raise RuntimeError(f"the plant is not ready: see the logs in {options.folder}")
                _pass(_Month(site, seconds), plant)
            finally:
                for process in processes:
                    process.life.process.kill()
        yield from rows(ledger.events(), _stored(history, plant.valves))
        if database is not None:
            yield from database_rows(database.compared_with(history))


def _pass(month: _Month, plant: Plant) -> None:
    """Let the month pass, then end all processes; note memory and sample counts."""
    lasting = plant.processes[-1]

    def note_memory(share: float) -> None:
        memory = lasting.life.process.usage().memory
        plant.ledger.add("memory", name=lasting.name, share=share, megabytes=memory)

    looks = iter(_LOOKS)
    look = next(looks)
    while month.share < 1.0:
        month.turn()
        if month.share > look:
            note_memory(look)
            look = next(looks, math.inf)
    month.finish()
    note_memory(1.0)
    for process in plant.processes:
        plant.end_life(process, signal.SIGINT)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the soak; return 1 if a goal is missed."""
    return endured("a month in {}", run_parser("soak", __doc__), arguments, _live)


if __name__ == "__main__":
    sys.exit(main())
