# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Hosts as network namespaces of this machine, each on a cable of its own to one bridge."""

import contextlib
import os
import shutil
import signal
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from benchmark.harness.processes import Process, module

_BRIDGE = "vfbridge"
_NETWORK = "10.77.0"
OUTSIDE = f"{_NETWORK}.254"
"""Address at which the hosts reach this machine, and its database."""
_IP = shutil.which("ip") or "/sbin/ip"
_OWN_SHARED_MEMORY = 'mount -t tmpfs tmpfs /dev/shm; exec "$@"'
"""Processes of two hosts would otherwise meet in the shared memory of the machine."""


def _ip(*words: str) -> str:
    done = subprocess.run([_IP, *words], check=True, capture_output=True, text=True)
    return done.stdout


class Traffic(NamedTuple):
    """What has gone over the cable of a host: bytes and packets, sent and received by the host."""

    sent: int
    received: int
    packets_sent: int
    packets_received: int

    def since(self, earlier: "Traffic") -> "Traffic":
        """Return what has gone since then."""
        return Traffic(*(now - then for now, then in zip(self, earlier, strict=True)))


class Host:
    """A network namespace with a cable to the bridge; hosts are numbered from 0."""

    def __init__(self, number: int) -> None:
        self.name = f"vfhost{number}"
        self.address = f"{_NETWORK}.{number + 1}"
        self._cable = f"vfcable{number}"

    def make(self) -> None:
        """Make the namespace and its cable."""
        inside = ("-n", self.name)
        _ip("netns", "add", self.name)
        _ip("link", "add", self._cable, "type", "veth", "peer", "name", "eth0", "netns", self.name)
        _ip("link", "set", self._cable, "master", _BRIDGE, "up")
        _ip(*inside, "link", "set", "lo", "up")
        _ip(*inside, "address", "add", f"{self.address}/24", "dev", "eth0")
        _ip(*inside, "link", "set", "eth0", "up")
        _ip(*inside, "route", "add", "default", "dev", "eth0")

    def remove(self) -> None:
        """End what runs there, and remove the namespace with its cable."""
        with contextlib.suppress(subprocess.CalledProcessError):
            self.kill()
            _ip("netns", "delete", self.name)

    def start(self, command: Sequence[str]) -> Process:
        """Run a program on the host."""
        shell = ["sh", "-c", _OWN_SHARED_MEMORY, "sh", *command]
        return Process([_IP, "netns", "exec", self.name, *shell])

    def start_module(self, name: str, *arguments: str) -> Process:
        """Run a module of Python on the host."""
        return self.start(module(name, *arguments))

    def kill(self) -> None:
        """End all processes of the host at once, as the loss of its power does."""
        for process in _ip("netns", "pids", self.name).split():
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(process), signal.SIGKILL)

    def plug(self, is_in: bool) -> None:
        """Put the plug of the cable into the bridge, or pull it."""
        _ip("link", "set", self._cable, "up" if is_in else "down")

    def traffic(self) -> Traffic:
        """Return what has gone over the cable."""
        counters = Path(f"/sys/class/net/{self._cable}/statistics")
        # This end of the cable receives what the host sends.
        names = ("rx_bytes", "tx_bytes", "rx_packets", "tx_packets")
        return Traffic(*(int((counters / name).read_text()) for name in names))


@contextlib.contextmanager
def network(count: int) -> Iterator[list[Host]]:
    """Provide hosts that see nothing but each other and `OUTSIDE`; needs root."""
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
