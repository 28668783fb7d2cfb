"""The nodes of a bench as processes of their own."""

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

__all__ = ["NodeProcess", "quick_discovery", "running_nodes"]

_STOP_TIMEOUT = 5.0
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
