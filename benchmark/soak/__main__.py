# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A month of a plant in an hour: python -m benchmark.soak, or `make soak`."""

import argparse
import math
import random
import signal
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from benchmark.churn.visitor import BENCH
from benchmark.harness.postgres import why_no_server
from benchmark.harness.processes import node, parameters
from benchmark.harness.rows import Row
from benchmark.harness.run import Ledger, endured, run_parser
from benchmark.soak.faults import FAULTS, Site, settled
from benchmark.soak.feed import PERIOD, Feed, Piece
from benchmark.soak.plant import SERVICES, Plant, Process, own_database, small_disk
from benchmark.soak.summary import database_rows, rows
from valve_friction_ros.history import HistoryFile

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
    with small_disk(disk) as is_small, own_database() as database:
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
