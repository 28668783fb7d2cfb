# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A plant of many hosts, one of which dies and one is cut off: `make hosts`, as root."""

import argparse
import contextlib
import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from rich.console import Console

from benchmark.hosts.database import Database, plant_database
from benchmark.hosts.network import Host, Traffic, network
from benchmark.hosts.picture import Picture
from benchmark.process_usage import processor_seconds, resident_megabytes
from benchmark.speed.rows import Row
from benchmark.speed.table import machine_shape, rows_table, write_json

__all__ = ["main"]

_SERVER_PORT = 11811
_START = 600.0
_PATIENCE = 120.0
"""Longest times, s, to the first complete picture and to a later one."""
_TRUTH = 6.0
"""Time, s, within which the dashboard shall show what has happened: its silence of 5 s, and the
second between two messages of a valve."""
_BLOCKS_A_SECOND = 10
_ASKED = 5
"""Valves of a host that are identified while it is cut off, and before it dies."""


class _Running:
    """What runs on one host with valves."""

    def __init__(
        self,
        host: Host,
        name: str,
        options: argparse.Namespace,
        seconds: float,
        database: Database | None,
    ) -> None:
        self.host, self.name, self.valves = host, name, options.valves
        valves = [f"{name}_{number}" for number in range(options.valves)]
        stream = ["--rate", str(options.rate), "--seconds", str(round(seconds))]
        kept = [] if database is None else database.arguments(name)
        self.process = host.start("benchmark.hosts.host", [*valves, *stream, *kept])
        self.pids: dict[str, int] = json.loads(self.line())

    def line(self) -> str:
        assert self.process.stdout is not None  # noqa: S101 - it was asked for
        return self.process.stdout.readline() or "{}"

    def is_shown(self, picture: Picture) -> bool:
        group = picture.group(self.name)
        return (group.heard, group.silent) == (self.valves, 0)

    def is_silent(self, picture: Picture) -> bool:
        return picture.group(self.name).silent == self.valves

    def ask(self) -> int:
        """Have some of its valves identified, by somebody on the host; return the answers."""
        asker = self.host.start(
            "benchmark.hosts.asker", [f"{self.name}_{number}" for number in range(_ASKED)]
        )
        told, _ = asker.communicate()
        return int(told or 0)

    def cpu(self) -> float:
        return processor_seconds(self.pids["identifiers"])

    def megabytes(self) -> float:
        return resident_megabytes(self.pids["identifiers"])


class _Plant(NamedTuple):
    """The dashboard and the hosts."""

    dashboard: "subprocess.Popen[str]"
    picture: Picture
    at: Host
    hosts: list[_Running]
    database: Database | None

    def is_complete(self, picture: Picture) -> bool:
        return all(one.is_shown(picture) for one in self.hosts)


def _seconds(options: argparse.Namespace) -> float:
    """Return for how long the sources stream."""
    return options.seconds + options.cut + 60.0


@contextlib.contextmanager
def _started(options: argparse.Namespace) -> Iterator[tuple[_Plant, float]]:
    """Provide the running plant, and when it was started."""
    with network(options.hosts + 1) as (office, *others), contextlib.ExitStack() as stack:
        os.environ |= {"ROS_DOMAIN_ID": "0", "RCUTILS_COLORIZED_OUTPUT": "0"}
        for name in ("ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_DISCOVERY_SERVER"):
            os.environ.pop(name, None)
        if options.server:
            executable = Path(sys.executable).with_name("fast-discovery-server")
            command = ["ip", "netns", "exec", office.name, str(executable), "-i", "0"]
            command += ["-l", office.address, "-p", str(_SERVER_PORT)]
            server = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            stack.callback(server.wait)
            stack.callback(server.kill)
            os.environ["ROS_DISCOVERY_SERVER"] = f"{office.address}:{_SERVER_PORT}"
        database = stack.enter_context(plant_database())
        begin = time.monotonic()
        dashboard = office.start(
            "benchmark.hosts.dashboard", ["--ros-args", "-p", "history_file:=''"]
        )
        hosts = [
            _Running(host, f"h{number}", options, _seconds(options), database)
            for number, host in enumerate(others)
        ]
        yield _Plant(dashboard, Picture(dashboard), office, hosts, database), begin


class _Use(NamedTuple):
    """What all has used until a time."""

    time: float
    identifiers: float
    dashboard: float
    traffic: Traffic
    office: Traffic


def _used(plant: _Plant) -> _Use:
    traffic = [one.host.traffic() for one in plant.hosts]
    return _Use(
        time.monotonic(),
        sum(one.cpu() for one in plant.hosts),
        processor_seconds(plant.dashboard.pid),
        Traffic(*map(sum, zip(*traffic, strict=True))),
        plant.at.traffic(),
    )


def _truth(item: str, seconds: float) -> Row:
    return Row(item, seconds, "s", goal=f"within {_TRUTH:g} s", met=seconds <= _TRUTH)


def _at_start(plant: _Plant, begin: float) -> Iterator[Row]:
    took = plant.picture.time_until(plant.is_complete, _START, begin)
    count = sum(one.valves for one in plant.hosts)
    yield Row("start to the complete picture", took, "s", goal="shown", met=math.isfinite(took))
    traffic = [one.host.traffic() for one in plant.hosts]
    sent = sum(one.sent for one in traffic)
    yield Row("traffic until then, a valve", sent / count / 1e3, "kB")
    spent = sum(one.cpu() for one in plant.hosts)
    yield Row("processor time of the identifiers until then, a valve", 1e3 * spent / count, "ms")
    busy = processor_seconds(plant.dashboard.pid)
    yield Row("processor time of the dashboard until then", busy, "s")


def _in_service(plant: _Plant, seconds: float) -> Iterator[Row]:
    """Measure what the plant costs while nothing happens."""
    time.sleep(min(15.0, seconds / 2))  # the discovery ends
    before = _used(plant)
    time.sleep(seconds / 2)
    after = _used(plant)
    count, span = sum(one.valves for one in plant.hosts), after.time - before.time
    sent = after.traffic.since(before.traffic)
    yield Row("a valve", 1e3 * (after.identifiers - before.identifiers) / span / count, "mcores")
    yield Row("a valve", sum(one.megabytes() for one in plant.hosts) / count, "MB")
    yield Row("a valve", sent.sent / span / count / 1e3, "kB/s")
    yield Row("a valve", sent.packets_sent / span / count, "packets/s")
    yield Row("dashboard", (after.dashboard - before.dashboard) / span, "cores")
    yield Row("dashboard", resident_megabytes(plant.dashboard.pid), "MB")
    heard = after.office.since(before.office).received
    yield Row("received by the dashboard's host", heard / span / 1e6, "MB/s")


def _death(plant: _Plant, options: argparse.Namespace) -> Iterator[Row]:
    """Kill a host, and start it again."""
    dead, others, database = plant.hosts[0], plant.hosts[1:], plant.database
    answered = dead.ask() if database else 0
    dead.host.kill()  # what it has kept may wait still
    dead.process.wait()
    yield _truth("a host dies: its valves are silent", _until(plant, dead.is_silent))
    rest = all(one.is_shown(plant.picture) for one in others)
    yield Row(
        "hosts that are still shown then", float(rest * len(others)), "", None, "", "all", rest
    )
    plant.hosts[0] = _Running(dead.host, dead.name, options, _seconds(options), database)
    if database:
        yield from database.rows(dead.name, "that died, and is back", answered, _START)
    took = plant.picture.time_until(plant.is_complete, _START)
    yield Row(
        "it returns: start to the complete picture", took, "s", None, "", "shown", took < _START
    )


def _partition(plant: _Plant, seconds: float) -> Iterator[Row]:
    """Pull the plug of a host for a while."""
    cut = plant.hosts[-1]
    begin = time.monotonic()
    cut.host.plug(False)
    yield _truth("a host is cut off: its valves are silent", _until(plant, cut.is_silent))
    answered = 0
    if plant.database:
        answered = cut.ask()
        yield Row("of its identifications meanwhile, answered there", answered, "")
        kept = plant.database.count(cut.name)
        yield Row("of them on the server while it is cut off", kept, "", None, "", "0", not kept)
    time.sleep(max(0.0, begin + seconds - time.monotonic()))
    cut.host.plug(True)
    plugged = time.monotonic()
    yield _truth("plugged in again: its valves are heard", _until(plant, cut.is_shown))
    if plant.database:
        words = "that was cut off"
        yield from plant.database.rows(cut.name, words, answered, _PATIENCE, plugged)
    yield _truth("and the complete picture", _until(plant, plant.is_complete))


def _until(plant: _Plant, condition: object) -> float:
    return plant.picture.time_until(condition, _PATIENCE)  # type: ignore[arg-type]


def _at_end(plant: _Plant) -> Iterator[Row]:
    """Count the samples that the identifiers hold, once the sources have sent all."""
    for one in plant.hosts[1:]:
        sent = 2 * int(one.line())
        plant.picture.time_until(lambda p, o=one, s=sent: p.group(o.name).fewest >= s, 10.0)
        held = plant.picture.group(one.name).fewest
        item = f"samples held of those sent on {one.name}"
        yield Row(item, 100 * held / sent, "%", None, "", "all", held == sent)


def _rows(plant: _Plant, begin: float, options: argparse.Namespace) -> Iterator[Row]:
    yield from _at_start(plant, begin)
    yield from _in_service(plant, options.seconds)
    yield from _death(plant, options)
    yield from _partition(plant, options.cut)
    yield from _at_end(plant)


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="hosts", description=__doc__)
    parser.add_argument("--hosts", type=int, default=5, help="with valves (%(default)s)")
    parser.add_argument("--valves", type=int, default=20, help="of each (%(default)s)")
    parser.add_argument("--rate", type=int, default=100, help="of each signal, Hz (%(default)s)")
    parser.add_argument("--seconds", type=float, default=60.0, help="in service (%(default)g)")
    parser.add_argument("--cut", type=float, default=60.0, help="s a host is cut off (%(default)g)")
    parser.add_argument(
        "--server", action="store_true", help="discovery server, with the dashboard"
    )
    parser.add_argument("--output", type=Path, default=Path("hosts.json"), help="where rows go")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the plant; return 1 if a goal is missed."""
    options = _options(arguments)
    if os.geteuid():
        print("hosts: network namespaces need root: run `sudo make hosts`", file=sys.stderr)  # noqa: T201
        return 2
    console, found = Console(width=None if sys.stdout.isatty() else 120), []
    console.print(", ".join(f"{name} {value}" for name, value in machine_shape().items()))
    discovery = "discovery server" if options.server else "multicast"
    title = f"{options.hosts} hosts × {options.valves} valves, {discovery}"
    with _started(options) as (plant, begin):
        for row in _rows(plant, begin, options):
            found.append(row)
            console.log(f"{row.item}: {row.ours:.3g} {row.unit}")
    console.print(rows_table(title, found))
    write_json({title: found}, options.output)
    return 1 if any(row.met is False for row in found) else 0


if __name__ == "__main__":
    sys.exit(main())
