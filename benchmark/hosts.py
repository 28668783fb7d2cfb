# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.


"""A plant of many hosts on one machine, some of which die or are cut off: `make hosts`."""

import argparse
import contextlib
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from benchmark.harness.postgres import PostgresServer, running_server
from benchmark.harness.processes import Process, module, processor_seconds, resident_megabytes
from benchmark.harness.rows import Row, judged, logged, opened_console, rows_table, some, write_json

_BRIDGE = "vfbridge"
_NETWORK = "10.77.0"
OUTSIDE = f"{_NETWORK}.254"
"""Address of this machine and its database, as seen from the hosts."""
_IP = shutil.which("ip") or "/sbin/ip"
_OWN_SHARED_MEMORY = 'mount -t tmpfs tmpfs /dev/shm; exec "$@"'
"""Gives each host its own shared memory; otherwise processes of two hosts would meet there."""


def _ip(*words: str) -> str:
    done = subprocess.run([_IP, *words], check=True, capture_output=True, text=True)
    return done.stdout


class Host:
    """A network namespace with a cable to the bridge; hosts are numbered from 0."""

    def __init__(self, number: int) -> None:
        self.name = f"vfhost{number}"
        self.address = f"{_NETWORK}.{number + 1}"
        self._cable = f"vfcable{number}"

    def make(self) -> None:
        """Create the namespace and its cable."""
        inside = ("-n", self.name)
        _ip("netns", "add", self.name)
        _ip("link", "add", self._cable, "type", "veth", "peer", "name", "eth0", "netns", self.name)
        _ip("link", "set", self._cable, "master", _BRIDGE, "up")
        _ip(*inside, "link", "set", "lo", "up")
        _ip(*inside, "address", "add", f"{self.address}/24", "dev", "eth0")
        _ip(*inside, "link", "set", "eth0", "up")
        _ip(*inside, "route", "add", "default", "dev", "eth0")

    def remove(self) -> None:
        """End all processes, and remove the namespace with its cable."""
        with contextlib.suppress(subprocess.CalledProcessError):
            self.kill()
            _ip("netns", "delete", self.name)

    def start(self, command: Sequence[str]) -> Process:
        """Run a program on the host."""
        shell = ["sh", "-c", _OWN_SHARED_MEMORY, "sh", *command]
        return Process([_IP, "netns", "exec", self.name, *shell])

    def start_module(self, name: str, *arguments: str) -> Process:
        """Run a Python module on the host."""
        return self.start(module(name, *arguments))

    def kill(self) -> None:
        """Kill all processes of the host at once, like a power failure."""
        for process in _ip("netns", "pids", self.name).split():
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(process), signal.SIGKILL)

    def plug(self, is_in: bool) -> None:
        """Plug the cable into the bridge, or unplug it."""
        _ip("link", "set", self._cable, "up" if is_in else "down")

    def traffic(self) -> Counter[str]:
        """Return the bytes sent and received by the host so far, and the packets sent."""
        counters = Path(f"/sys/class/net/{self._cable}/statistics")
        # This end of the cable receives what the host sends.
        names = {"sent": "rx_bytes", "received": "tx_bytes", "packets": "rx_packets"}
        return Counter({key: int((counters / name).read_text()) for key, name in names.items()})


@contextlib.contextmanager
def network(count: int) -> Iterator[list[Host]]:
    """Provide hosts that see only each other and `OUTSIDE`; needs root."""
    hosts = [Host(number) for number in range(count)]
    _ip("link", "add", _BRIDGE, "type", "bridge", "mcast_snooping", "0")
    try:
        _ip("address", "add", f"{OUTSIDE}/24", "dev", _BRIDGE)
        _ip("link", "set", _BRIDGE, "up")
        for host in hosts:
            host.make()
        yield hosts
    finally:
        for host in hosts:
            host.remove()
        _ip("link", "delete", _BRIDGE)


_SERVER_PORT = 11811
_START = 600.0
_PATIENCE = 120.0
"""Longest times, s, to the first complete picture and to a later complete picture."""
_TRUTH = 6.0
"""Time limit, s, for the dashboard to show an event: its silence of 5 s, and the second between two
messages of a valve."""
_ASKED = 5
"""Valves per host to identify while the host is cut off, and before it dies."""
_LOOK, _LOOK_AT_DATABASE = 0.1, 0.2
_COUNT = """
SELECT count(*) FROM identification JOIN valve ON valve.id = valve_id WHERE valve.name LIKE %s
"""


class Group(NamedTuple):
    """The valves of one host: numbers shown as heard and as silent, and fewest samples held."""

    heard: int = 0
    silent: int = 0
    fewest: int = 0


class Database:
    """A server outside the hosts, to which all send the history from their own files."""

    def __init__(self, server: PostgresServer, folder: Path) -> None:
        self._server, self._folder = server, folder
        self._name = server.database()

    def arguments(self, host: str) -> list[str]:
        """Return the arguments of a host's processes."""
        file, url = self._folder / f"{host}.sqlite", self._server.url(self._name)
        return ["--history", str(file), "--history-url", url]

    def count(self, host: str) -> int:
        """Return the number of identifications on the server for the valves of a host."""
        if not self._server.do(self._name, "SELECT to_regclass('identification')")[0][0]:
            return 0  # no host has sent anything
        ((count,),) = self._server.do(self._name, _COUNT, (f"/{host}\\_%",))
        return int(count)

    def rows(
        self, host: str, words: str, answered: int, patience: float, begin: float
    ) -> Iterator[Row]:
        """Wait until the server has all identifications that a host has answered."""
        while self.count(host) < answered and time.monotonic() < begin + patience:
            time.sleep(_LOOK_AT_DATABASE)
        kept = self.count(host)
        took = time.monotonic() - begin if kept >= answered else math.inf
        yield some(f"host {words}: identifications answered", answered)
        yield Row("of them on the server", kept, goal="all", met=kept == answered)
        yield Row("after", took, "s")


class _Running:
    """The processes on one host with valves."""

    def __init__(
        self, host: Host, name: str, options: argparse.Namespace, kept: Sequence[str]
    ) -> None:
        self.host, self.name, self.valves = host, name, options.valves
        valves = [f"{name}_{number}" for number in range(options.valves)]
        seconds = round(options.seconds + options.cut + 60.0)
        stream = ["--rate", str(options.rate), "--seconds", str(seconds)]
        self.process = host.start_module("benchmark.hosts_node", "serve", *valves, *stream, *kept)
        self.identifiers = int(self.process.output.readline())

    def samples_sent(self) -> int:
        """Wait until the source has sent everything; return the samples of both signals."""
        return 2 * int(self.process.output.readline())

    def ask(self) -> int:
        """Identify some of its valves by a client on the host; return the number of answers."""
        valves = [f"{self.name}_{number}" for number in range(_ASKED)]
        with self.host.start_module("benchmark.hosts_node", "ask", *valves) as asker:
            return int(asker.output.read() or 0)


class _Plant:
    """The dashboard and the hosts, and the picture on the dashboard: its latest printed line."""

    def __init__(
        self, hosts: Sequence[Host], options: argparse.Namespace, database: Database | None
    ) -> None:
        office, *others = hosts
        self.office, self.database, self._options = office, database, options
        self.has_server: bool = options.server
        self.begin = time.monotonic()
        words = ("--ros-args", "-p", "history_file:=''")
        self.dashboard = office.start_module("benchmark.hosts_node", "dashboard", *words)
        self._groups: dict[str, Group] = {}
        threading.Thread(target=self._read, daemon=True).start()
        self.hosts = [self.run(host, f"h{number}") for number, host in enumerate(others)]
        self.valves = options.valves * len(others)

    def run(self, host: Host, name: str) -> _Running:
        kept = self.database.arguments(name) if self.database else []
        return _Running(host, name, self._options, kept)

    def _read(self) -> None:
        for line in self.dashboard.output:
            found = json.loads(line)["groups"]
            self._groups = {name: Group(**group) for name, group in found.items()}

    def group(self, one: _Running) -> Group:
        """Return the shown state of the valves of a host."""
        return self._groups.get(one.name, Group())

    def time_until(
        self, is_met: Callable[[], bool], patience: float, begin: float | None = None
    ) -> float:
        """Wait for a condition; return the time since `begin` or now, s, or inf on timeout."""
        begin = time.monotonic() if begin is None else begin
        while not is_met():
            if time.monotonic() - begin > patience:
                return math.inf
            self.dashboard.require_running()
            time.sleep(_LOOK)
        return time.monotonic() - begin

    def is_shown(self, one: _Running) -> bool:
        """Whether all valves of a host are shown, none of them silent."""
        return self.group(one)[:2] == (one.valves, 0)

    def is_silent(self, one: _Running) -> bool:
        """Whether all valves of a host are shown as silent."""
        return self.group(one).silent == one.valves

    def is_complete(self) -> bool:
        return all(map(self.is_shown, self.hosts))

    def truth(self, item: str, is_met: Callable[[], bool]) -> Row:
        """Wait for a condition of the picture, with the goal `_TRUTH`."""
        took = self.time_until(is_met, _PATIENCE)
        return Row(item, took, "s", goal=f"within {_TRUTH:g} s", met=took <= _TRUTH)


@contextlib.contextmanager
def _started(options: argparse.Namespace) -> Iterator[_Plant]:
    """Provide the running plant."""
    with network(options.hosts + 1) as hosts, contextlib.ExitStack() as stack:
        os.environ |= {"ROS_DOMAIN_ID": "0", "RCUTILS_COLORIZED_OUTPUT": "0"}
        for name in ("ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_DISCOVERY_SERVER"):
            os.environ.pop(name, None)
        if options.server:
            executable = str(Path(sys.executable).with_name("fast-discovery-server"))
            where = ("-l", hosts[0].address, "-p", str(_SERVER_PORT))
            stack.callback(hosts[0].start([executable, "-i", "0", *where]).kill)
            os.environ["ROS_DISCOVERY_SERVER"] = f"{hosts[0].address}:{_SERVER_PORT}"
        server = stack.enter_context(running_server(OUTSIDE))
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        yield _Plant(hosts, options, None if server is None else Database(server, folder))


def _used(plant: _Plant) -> Counter[str]:
    """Return the total use so far: time and processor times, s, and traffic."""
    used: Counter[str] = sum((one.host.traffic() for one in plant.hosts), Counter())
    used["time"] = time.monotonic()
    used["identifiers"] = sum(processor_seconds(one.identifiers) for one in plant.hosts)
    used["dashboard"] = plant.dashboard.usage().processor
    used["office"] = plant.office.traffic()["received"]
    return used


def _at_start(plant: _Plant) -> Iterator[Row]:
    took = plant.time_until(plant.is_complete, _START, plant.begin)
    yield Row("start to the complete picture", took, "s", goal="shown", met=math.isfinite(took))
    used, count = _used(plant), plant.valves
    yield Row("traffic until then, a valve", used["sent"] / count / 1e3, "kB")
    spent = 1e3 * used["identifiers"] / count
    yield Row("processor time of the identifiers until then, a valve", spent, "ms")
    yield Row("processor time of the dashboard until then", used["dashboard"], "s")


def _in_service(plant: _Plant, seconds: float) -> Iterator[Row]:
    """Measure the cost of the plant while nothing happens."""
    time.sleep(min(15.0, seconds / 2))  # the discovery ends
    before = _used(plant)
    time.sleep(seconds / 2)
    used, count = _used(plant) - before, plant.valves
    span = used["time"]
    memory = sum(resident_megabytes(one.identifiers) for one in plant.hosts)
    yield Row("a valve", 1e3 * used["identifiers"] / span / count, "mcores")
    yield Row("a valve", memory / count, "MB")
    yield Row("a valve", used["sent"] / span / count / 1e3, "kB/s")
    yield Row("a valve", used["packets"] / span / count, "packets/s")
    yield Row("dashboard", used["dashboard"] / span, "cores")
    yield Row("dashboard", plant.dashboard.usage().memory, "MB")
    yield Row("received by the dashboard's host", used["office"] / span / 1e6, "MB/s")


def _death(plant: _Plant) -> Iterator[Row]:
    """Kill a host, and restart it."""
    dead, others, database = plant.hosts[0], plant.hosts[1:], plant.database
    answered = dead.ask() if database else 0
    dead.host.kill()  # its stored rows may still wait for the server
    dead.process.kill()
    silent = plant.truth("a host dies: its valves are silent", lambda: plant.is_silent(dead))
    rest = all(map(plant.is_shown, others))
    yield silent
    yield Row("hosts that are still shown then", float(rest * len(others)), goal="all", met=rest)
    plant.hosts[0] = plant.run(dead.host, dead.name)
    if database:
        words = "that died, and is back"
        yield from database.rows(dead.name, words, answered, _START, time.monotonic())
    took, item = plant.time_until(plant.is_complete, _START), "it returns: start to the"
    yield Row(f"{item} complete picture", took, "s", goal="shown", met=took < _START)


def _partition(plant: _Plant, seconds: float) -> Iterator[Row]:
    """Unplug a host for a while."""
    # A client that starts on the host while it is cut off from a discovery server finds nothing.
    cut, database = plant.hosts[-1], None if plant.has_server else plant.database
    begin = time.monotonic()
    cut.host.plug(False)
    yield plant.truth("a host is cut off: its valves are silent", lambda: plant.is_silent(cut))
    answered = 0
    if database:
        answered = cut.ask()
        yield Row("of its identifications meanwhile, answered there", answered)
        kept = database.count(cut.name)
        item = "of them on the server while it is cut off"
        yield Row(item, kept, goal="0", met=not kept)
    time.sleep(max(0.0, begin + seconds - time.monotonic()))
    cut.host.plug(True)
    plugged = time.monotonic()
    yield plant.truth("plugged in again: its valves are heard", lambda: plant.is_shown(cut))
    if database:
        yield from database.rows(cut.name, "that was cut off", answered, _PATIENCE, plugged)
    yield plant.truth("and the complete picture", plant.is_complete)


def _at_end(plant: _Plant) -> Iterator[Row]:
    """Count the samples in the identifiers after the sources have sent everything."""
    for one in plant.hosts[1:]:
        sent = one.samples_sent()

        def held(one: _Running = one) -> int:
            return plant.group(one).fewest

        plant.time_until(lambda held=held, sent=sent: held() >= sent, 10.0)
        item, share = f"samples held of those sent on {one.name}", 100 * held() / sent
        yield Row(item, share, "%", goal="all", met=held() == sent)


def _rows(plant: _Plant, options: argparse.Namespace) -> Iterator[Row]:
    yield from _at_start(plant)
    yield from _in_service(plant, options.seconds)
    yield from _death(plant)
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
        print("hosts: network namespaces need root: run `sudo make hosts`", file=sys.stderr)
        return 2
    console, found = opened_console(), []
    discovery = "discovery server" if options.server else "multicast"
    title = f"{options.hosts} hosts × {options.valves} valves, {discovery}"
    with _started(options) as plant:
        logged(_rows(plant, options), found, console)
    console.print(rows_table(title, found))
    write_json({title: found}, options.output)
    return judged(found, console)


if __name__ == "__main__":
    sys.exit(main())
