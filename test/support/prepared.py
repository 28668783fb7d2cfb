# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Nodes, and their processes that identify, as forks of a process that has loaded all they need.

A node that starts by itself spends a second of processor time on imports and compiled code, and as
much again in the process that identifies for it. Nothing here has threads or a middleware yet when
it forks. Its diagnostics come four times a second, so that a test waits less for the next.
"""

import contextlib
import functools
import json
import os
import runpy
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import traceback
from importlib import import_module
from pathlib import Path

NODES = ("identifier", "identifiers", "simulator", "pressure_source", "stroke_player")
_LOADED = (
    "lifecycle_msgs.srv",
    "rclpy.lifecycle",
    "sensor_msgs.msg",
    "std_srvs.srv",
    *(
        f"valve_friction_ros.{name}"
        for name in (
            "alerts",
            "health",
            "history.alarm_rows",
            "history.history",
            "history.service_rows",
            "history.status_values",
            "nodes.plumbing.polled_subscription",
            "nodes.plumbing.processes",
            "nodes.plumbing.running",
            "records.bags",
            "response",
            "streams.data_quality",
        )
    ),
)
"""What nodes import, but for the settings, whose defaults are those of a node's environment."""
_PLACE = "VALVE_FRICTION_PREPARED"
"""Environment variable of the address at which a node asks for its identifying process."""


def forked(words, files, folder, environment):
    """Fork a node of these words; `files` are those of stdout and stderr."""
    return Forked(_preparation()[0], words, files, folder, environment)


def command(*arguments, **environment):
    """Start the command of the package in the folder of the project; `ended` tells its end."""
    files = [tempfile.TemporaryFile("w+") for _ in range(2)]  # noqa: SIM115 - closed at its end
    words = ["valve_friction", *map(str, arguments)]
    numbers = [one.fileno() for one in files]
    process = forked(words, numbers, Path(__file__).parents[2], os.environ | environment)
    process.files = files
    return process


@functools.cache
def _preparation():
    """Address and process of what forks, which ends with this process of tests."""
    address = f"valve_friction_ros/prepared/{os.getpid()}"
    folder = Path(__file__).parent
    path = os.pathsep.join(filter(None, [str(folder.parents[1]), os.environ.get("PYTHONPATH")]))
    process = subprocess.Popen(
        [sys.executable, __file__, address],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": path},
        cwd="/",
    )
    assert process.stdout.readline() == b"ready\n"
    return address, process


class Forked:
    """A fork that runs `words`, with what of `subprocess.Popen` nodes and tests use."""

    def __init__(self, address, words, files, folder=".", environment=os.environ):
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.connect(f"\0{address}")
        told = json.dumps([words, str(folder), dict(environment | {_PLACE: address})])
        socket.send_fds(self._socket, [told.encode()], files)
        self.pid = int(self._socket.recv(64))
        self._code, self._lock = None, threading.Lock()

    @property
    def returncode(self):
        return self.poll()

    def poll(self):
        """Its exit code, or None while it runs."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            return self.wait(0)

    def wait(self, timeout=None):
        """Wait for its end; its exit code."""
        with self._lock:
            if self._code is None:
                if not select.select([self._socket], [], [], timeout)[0]:
                    raise subprocess.TimeoutExpired(str(self.pid), timeout)
                self._code = int(self._socket.recv(64))
                self._socket.close()
            return self._code

    def ended(self):
        """Wait for the end of a command: exit code, stdout and stderr."""
        told = [self.wait(300)]
        for one in self.files:
            one.seek(0)
            told.append(one.read())
            one.close()
        return tuple(told)

    def send_signal(self, number):
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self):
        self.send_signal(signal.SIGKILL)


class _Identifying(Forked):
    """A process that identifies, as `plumbing.processes` starts it."""

    def __init__(self):
        asked, self.stdin = os.pipe()
        self.stdout, answered = os.pipe()
        super().__init__(os.environ[_PLACE], ["serve"], [asked, answered, 2])
        for one in (asked, answered):
            os.close(one)
        self.stdin, self.stdout = os.fdopen(self.stdin, "wb"), os.fdopen(self.stdout, "rb")

    def communicate(self):
        for one in (self.stdin, self.stdout):
            one.close()
        self.wait()


def _run(words):
    """What a fork does: a node by its name, a script, the command, or the work of a node."""
    from valve_friction_ros.commands.start import main
    from valve_friction_ros.nodes import start
    from valve_friction_ros.nodes.plumbing import processes

    sys.argv = words
    if words == ["serve"]:
        os.setsid()
        processes.serve()
    if words[0] == "valve_friction":
        return main()
    processes._started = _Identifying
    import_module("valve_friction_ros.nodes.identifier.node")._DIAGNOSTIC_PERIOD = 0.25
    if words[0] in NODES:
        return getattr(start, words[0])()
    sys.path.insert(0, str(Path(words[0]).parent))
    runpy.run_path(words[0], run_name="__main__")
    return 0


def _fork(connection):
    """Fork the one that is asked for, and tell its number and later its exit code."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    told, files, _, _ = socket.recv_fds(connection, 1 << 20, 3)
    child = os.fork()
    if child:
        for one in files:
            os.close(one)
        connection.send(str(child).encode())
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        with contextlib.suppress(OSError):
            connection.send(str(code).encode())
        os._exit(0)
    connection.close()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for place, one in enumerate(files, 3 - len(files)):
        os.dup2(one, place)
        os.close(one)
    words, folder, environment = json.loads(told)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    code = 1
    try:
        code = _run(words)
    except SystemExit as end:
        code = end.code
    except Exception:  # noqa: BLE001 - told as Python tells it
        traceback.print_exc()
    # As nodes end: what is torn down after that belongs to the process that has forked.
    for one in (sys.stdout, sys.stderr):
        one.flush()
    os._exit(code)


def _serve(address):
    """Fork what is asked for until the tests end."""
    for name in _LOADED:
        import_module(name)
    assert "valve_friction_ros.settings" not in sys.modules, "its defaults are of an environment"
    import_module("valve_friction_ros.identification.methods").compile_methods()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C in the terminal is for the tests
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    listener.bind(f"\0{address}")
    listener.listen()
    os.write(1, b"ready\n")
    while sys.stdin not in (ready := select.select([sys.stdin, listener], [], [])[0]):
        assert ready
        connection, _ = listener.accept()
        if not os.fork():
            listener.close()
            _fork(connection)
        connection.close()


if __name__ == "__main__":
    _serve(sys.argv[1])
