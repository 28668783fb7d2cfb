# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Recorded files of the bench valve, and the description of that valve."""

import json
import os
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from kept_rows import run_here

from valve_friction_ros.model import Recording, SineWave, SquareWave, simulate

PROJECT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def square_record(bench_record):
    """Two periods of the paper's square wave at 1 kHz, low friction."""
    return bench_record("low", SquareWave(), 20.8)


@pytest.fixture(scope="session")
def quick_record(benches):
    """Ten seconds of a sine at 100 Hz, low friction: a small file."""
    pressure = SineWave(period=10.0).sample(np.arange(1000) / 100)
    return Recording(0.01, pressure, simulate(*benches["low"], pressure, 0.01).position)


@pytest.fixture
def command(capsys):
    """Function of a sub-command and its arguments: exit code, stdout and stderr."""

    def command(*arguments):
        try:
            code = run_here(arguments)
        except SystemExit as end:  # of the parser
            code = end.code
        return (code, *capsys.readouterr())

    return command


@pytest.fixture
def told(command):
    """Function of a sub-command and arguments, which must end well and without a word: stdout."""

    def told(*arguments):
        code, out, err = command(*arguments)
        assert (code, err) == (0, "")
        return out

    return told


@pytest.fixture
def call(command):
    """Function of arguments: exit code, stdout and stderr of `identify`."""
    return partial(command, "identify")


@pytest.fixture
def printed(call):
    """Function of arguments: the one JSON object that the command prints."""

    def printed(*arguments):
        code, out, err = call(*arguments, "--json")
        assert (code, err) == (0, "")
        assert out.count("\n") == 1
        return json.loads(out, parse_constant=pytest.fail)

    return printed


@pytest.fixture
def refused(command):
    """Function of a sub-command and arguments: its one line on stderr, with exit code 2."""

    def refused(name, *arguments):
        code, out, err = command(name, *arguments)
        assert (code, out) == (2, "")
        line, rest = err.split("\n", 1)
        assert rest == ""
        speaker, _, message = line.partition(": ")
        assert speaker == f"valve_friction {name}"
        return message

    return refused


@pytest.fixture
def refusal(refused):
    """Function of arguments: the one line with which `identify` refuses them."""
    return partial(refused, "identify")


@pytest.fixture
def listed(file, told):
    """Function of arguments of `history` on the file of the tests: what it prints."""
    return lambda *arguments, path=file: told("history", path, *arguments)


@pytest.fixture(scope="session")
def bench_options(bench_yaml):
    return ["--valve", str(bench_yaml)]


@pytest.fixture
def quick_csv(write_csv, columns_of, quick_record):
    return write_csv(columns_of(quick_record))


@pytest.fixture
def write_csv(tmp_path):
    """Function of columns by header: a CSV file with every number to the last digit."""

    def write(columns, name="record.csv"):
        path = tmp_path / name
        table = zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True)
        lines = [",".join(columns), *(",".join(map(repr, row)) for row in table)]
        path.write_text("\n".join(lines) + "\n")
        return path

    return write


@pytest.fixture
def columns_of():
    """Function of a recording: its columns by the headers that the command expects."""

    def columns(record):
        return {
            "time_s": np.round(record.time, 9),
            "position_m": record.position,
            "pressure_pa": record.pressure,
        }

    return columns


@pytest.fixture
def ros_environment(tmp_path):
    """Environment of a ROS domain that no other test uses, here or in another run."""
    from valve_friction_ros.commands.demo.bench import free_domain

    inherited = {
        name: value
        for name, value in os.environ.items()
        if name not in {"ROS_AUTOMATIC_DISCOVERY_RANGE", "FASTRTPS_DEFAULT_PROFILES_FILE"}
    }
    path = os.pathsep.join(filter(None, [str(PROJECT), os.environ.get("PYTHONPATH")]))
    with free_domain() as number:
        yield inherited | {
            "ROS_DOMAIN_ID": str(number),
            "ROS_LOG_DIR": str(tmp_path),
            "PYTHONPATH": path,
        }
