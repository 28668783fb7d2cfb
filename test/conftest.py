# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Shared by all tests: the bench valves and their simulated records."""

import contextlib
import os
import signal
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

# As in commands and nodes: with threads, small matrices take twice the processor time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
from hypothesis import settings
from local_server import database, postgres  # noqa: F401 - fixtures
from processes import MARK, orphans
from records import sine_record

from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    KarnoppParameters,
    Recording,
    Valve,
    converter_response,
    simulate,
)

SAMPLE_PERIOD = 1e-3

# A shell that runs the tests in the background has Ctrl-C ignored, by all that they start too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

os.environ[MARK] = str(os.getpid())

# The same examples in every run, and no deadline: the first call of a kernel compiles it.
settings.register_profile("project", deadline=None, derandomize=True)
settings.load_profile("project")


def pytest_configure(config):
    """Compile the kernels once, before processes that test side by side begin.

    Of kernels that two processes compile at once, each keeps its own, which may differ from the
    cached one in the last digit.
    """
    if getattr(config.option, "numprocesses", None) and not hasattr(config, "workerinput"):
        words = "from valve_friction_ros.identification.methods import compile_methods as c; c()"
        subprocess.run([sys.executable, "-c", words], check=True, cwd=config.rootpath)


def pytest_collection_modifyitems(items):
    """Let each test over the middleware run three times before it counts as failed.

    Fast DDS 2.14.5 at times locks itself up when participants come and go (its issue 6502), and
    loses an answer that comes before discovery has ended (rmw_fastrtps issue 842). The summary
    names each test that ran again.
    """
    for item in items:
        if "ros_environment" in item.fixturenames:
            item.add_marker(pytest.mark.flaky(reruns=2))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Start the nodes that the tests of a module share anew for a test that runs a second time.

    Those of its first run may be locked up, and do not end well then.
    """
    shared = item._fixtureinfo.name2fixturedefs.get("shared")
    if shared and getattr(item, "execution_count", 1) > 1:
        with contextlib.suppress(AssertionError):
            shared[-1].finish(item._request)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item):
    """End the nodes that a test over the middleware has left running: they would slow the next."""
    yield
    if "ros_environment" in item.fixturenames:
        for orphan in orphans():
            with contextlib.suppress(ProcessLookupError):
                os.kill(orphan, signal.SIGKILL)


class Bench(NamedTuple):
    """A valve with the true parameters of its packing."""

    valve: Valve
    parameters: KarnoppParameters


@pytest.fixture(scope="session", autouse=True)
def ros_home(tmp_path_factory):
    """Nodes that keep files where nobody told them keep them here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("VALVE_FRICTION_HISTORY_URL", raising=False)
        patch.setenv("ROS_HOME", str(tmp_path_factory.mktemp("ros_home")))
        yield


@pytest.fixture(scope="session")
def benches():
    """The simulated valves that every check uses, by name."""
    return {
        "low": Bench(BENCH_VALVE, LOW_FRICTION),
        "high": Bench(BENCH_VALVE, HIGH_FRICTION),
        "graphite": Bench(GRAPHITE_VALVE, GRAPHITE_PACKING),
    }


@pytest.fixture(scope="session")
def bench_trajectory(benches):
    """Function of valve name, excitation and duration (s): pressure and trajectory at 1 kHz."""

    @cache
    def run(name, excitation, duration):
        time = np.arange(round(duration / SAMPLE_PERIOD) + 1) * SAMPLE_PERIOD
        pressure = converter_response(excitation.sample(time), SAMPLE_PERIOD)
        return pressure, simulate(*benches[name], pressure, SAMPLE_PERIOD)

    return run


@pytest.fixture(scope="session")
def bench_record(bench_trajectory):
    """Function of valve name, excitation, duration (s) and noise: the recording of a bench run."""

    @cache
    def record(name, excitation, duration, noise=None):
        pressure, trajectory = bench_trajectory(name, excitation, duration)
        recording = Recording(SAMPLE_PERIOD, pressure, trajectory.position)
        return noise.applied_to(recording) if noise else recording

    return record


@pytest.fixture(scope="session")
def bench_yaml():
    """The valve file that the package brings."""
    return Path(__file__).resolve().parents[1] / "config" / "valve_bench.yaml"


@pytest.fixture(scope="session")
def loose_record():
    """The bench valve with its packing lightly tightened."""
    return sine_record(LOW_FRICTION)
