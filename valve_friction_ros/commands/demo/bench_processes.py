"""The nodes of a bench as processes of their own."""

import contextlib
import os
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from valve_friction_ros.commands.demo.bench_client import BenchError

__all__ = ["NodeProcess", "free_domain", "quick_discovery", "running_nodes"]

_STOP_TIMEOUT = 5.0
_DOMAINS = 100
"""Domains 1 to 100: a larger number may collide with ports that the system gives away."""
_PROFILE = Path(__file__).with_name("fast_discovery.xml")


class NodeProcess(NamedTuple):
    """One node to run: its executable and its parameters."""

    executable: str
    parameters: Mapping[str, object]


def quick_discovery() -> dict[str, str]:
    """Return the environment in which processes of this machine find each other quickly.

    Nothing leaves the machine. What the user has set already stays.
    """
    wanted = {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "FASTRTPS_DEFAULT_PROFILES_FILE": str(_PROFILE),
    }
    return {name: value for name, value in wanted.items() if name not in os.environ}


@contextlib.contextmanager
def free_domain() -> Iterator[int]:
    """Provide a ROS domain that the user has not set and no other demo of this machine uses.

    A domain of a running bench would show its topics here, under the same names. An abstract
    socket of the domain's number is held as long as the domain is in use.
    """
    set_already = os.environ.get("ROS_DOMAIN_ID", "0")
    first = os.getpid() % _DOMAINS
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as claim:
        for step in range(_DOMAINS):
            number = 1 + (first + step) % _DOMAINS
            if str(number) != set_already and _is_bound(claim, number):
                yield number
                return
    raise BenchError("no ROS domain is free: end another demo")


def _is_bound(claim: socket.socket, number: int) -> bool:
    try:
        claim.bind(f"\0valve_friction_ros/domain/{number}")
    except OSError:  # in use
        return False
    return True


def _command(node: NodeProcess, namespace: str) -> list[str]:
    command = [sys.executable, "-m", f"valve_friction_ros.nodes.{node.executable}"]
    command += ["--ros-args", "--log-level", "warn", "-r", f"__ns:=/{namespace}"]
    for name, value in node.parameters.items():
        command += ["-p", f"{name}:={value}"]
    return command


def _wait_or_kill(process: subprocess.Popen[bytes]) -> None:
    try:
        process.wait(_STOP_TIMEOUT)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _stop(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        if process.poll() is None:
            process.terminate()
    for process in processes:
        _wait_or_kill(process)


@contextlib.contextmanager
def running_nodes(
    nodes: Sequence[NodeProcess], namespace: str
) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Run `nodes` in `namespace` as long as the context lasts; then stop them."""
    processes: list[subprocess.Popen[bytes]] = []
    try:
        # A session of their own keeps the terminal's Ctrl-C from them: they are stopped here.
        processes += [
            subprocess.Popen(_command(node, namespace), start_new_session=True) for node in nodes
        ]
        yield processes
    finally:
        _stop(processes)
