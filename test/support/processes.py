# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Processes of tests: run to their end, found by their environment, waited for."""

import contextlib
import os
import subprocess
import sys
import time
from pathlib import Path

MARK = "VALVE_FRICTION_TESTS"
"""Environment variable of all that a test starts: the process that runs the test."""


PATIENCE = 120.0
"""Time for one thing to happen on a slow and loaded machine, s."""


def wait_until(condition, told=lambda: "", patience=PATIENCE, turn=0.01):
    """Look until `condition()` is true, and return it; fail with what is `told` at the end."""
    deadline = time.monotonic() + patience
    while not (met := condition()):
        assert time.monotonic() < deadline, f"not within {patience:g} s: {told()}"
        time.sleep(turn)
    return met


def ran(*arguments, program=("-m", "valve_friction_ros"), **options):
    """Run Python on a program, by default the command, to its end: code, stdout and stderr."""
    words = [sys.executable, *map(str, (*program, *arguments))]
    usual = {"capture_output": True, "text": True, "timeout": 300}
    done = subprocess.run(words, check=False, **(usual | options))
    return done.returncode, done.stdout, done.stderr


def printed(*program, **options):
    """What Python prints of a program, which must end well."""
    code, out, error = ran(program=program, **options)
    assert code == 0, error
    return out


def processes_with(words):
    """Return the processes whose environment contains `words`, by number, with their parents."""
    found = {}
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if words.encode() in (place / "environ").read_bytes():
                state = (place / "stat").read_text().rpartition(")")[2].split()
                found[int(place.name)] = int(state[1])
    return found


def orphans():
    """Return the nodes and commands started by tests of this process whose parents have ended."""
    mine = processes_with(f"{MARK}={os.getpid()}\0")
    return [
        number
        for number, parent in mine.items()
        if parent not in mine and parent != os.getpid() and _is_of_the_project(number)
    ]


def _is_of_the_project(number):
    try:
        return b"valve_friction_ros" in Path(f"/proc/{number}/cmdline").read_bytes()
    except OSError:
        return False
