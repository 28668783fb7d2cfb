# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""How nodes start: what they load, what they refuse in one line, and what they say of a start."""

import json
import os
import signal
import socket
import subprocess
import sys
import time

import pytest
import yaml
from live_nodes import NAMESPACE, NODE, PROJECT, Domain, NodeProcess, values_of
from local_server import free_port
from processes import ran

from benchmark.harness.processes import parameters as as_arguments
from valve_friction_ros.records.files import data_folder

PLAYED = str(PROJECT / "test/nodes/played_pressure.csv")
OF_A_FILE = {"excitation": "file", "file": PLAYED}
REFUSED = {  # node, parameters, words of the only line
    "even window": ("identifier", {"derivative_window": 30}, "window must be odd"),
    "mm": ("identifier", {"travel": 28.6}, "mm read as m?"),
    "misspelled": (
        "identifier",
        {"diaphragm_aera": 0.1},
        "identifier has no parameter 'diaphragm_aera': did you mean 'diaphragm_area'?",
    ),
    "unknown": ("identifier", {"gain": 1.0}, "identifier has no parameter 'gain': known are "),
    "whole number": (
        "identifier",
        {"window": 60},
        "window: expected 'Type.DOUBLE' got 'Type.INTEGER': write 60.0",
    ),
    "all at once": (
        "identifier",
        {"windw": 3.0, "travel": 1, "diaphragm_area": 0.0},
        "identifier has no parameter 'windw': did you mean 'window'?; "
        "travel: expected 'Type.DOUBLE' got 'Type.INTEGER': write 1.0; "
        "diaphragm_area must be 1e-06 to 1000, got 0",
    ),
    "gauge": ("identifier", {"pressure_reference": 0}, "'Type.INTEGER': write 0.0"),
    "number as a tag": ("identifier", {"valve_tag": 101}, "put it in quotes, '101'"),
    "no home": (
        "identifier",
        {"history_file": "'~nobody-such/x'"},
        "history_file ~nobody-such/x: Could not determine home",
    ),
    "address": ("identifier", {"webhook_url": "http://example.com/s3cret"}, "to another machine"),
    "password": (
        "identifier",
        {"history_url": "postgresql://me:s3cret@host/db"},
        "history_url holds a password",
    ),
    "friction": ("simulator", {"coulomb_friction": 600.0}, "static_friction"),
    "quality": (
        "simulator",
        {f"qos_overrides.{NAMESPACE}/stem_state.publisher.reliability": "perhaps"},
        "reliability",
    ),
    "excitation": ("pressure_source", {"excitation": "noise"}, "'noise' is unknown"),
    "jitter": (
        "pressure_source",
        {"sample_rate": 200.0, "time_jitter": 0.0025},
        "time_jitter (0.0025 s) must be below half",
    ),
    "no file name": ("pressure_source", {"excitation": "file"}, "file"),
    "no file": ("pressure_source", {"excitation": "file", "file": "no.csv"}, "no.csv"),
    "file pressure": (
        "pressure_source",
        {**OF_A_FILE, "file_maximum": 1e5},
        "150000 Pa violates file_maximum (100000 Pa)",
    ),
    "file rate": (
        "pressure_source",
        {**OF_A_FILE, "file_rate": 2e4},
        "25000 Pa/s violates file_rate (20000 Pa/s)",
    ),
    "no valves": ("identifiers", {}, "no valve is named"),
    "valve twice": ("identifiers", {"valves": "[fv_1, fv_1]"}, "valve /fv_1 is named twice"),
    "one namespace": ("identifiers", {"valves": "[fv_1, fv_2]"}, "/fv_1 is remapped to /fv_101"),
    "no namespace": ("identifiers", {"valves": "[fv-1]"}, "fv-1"),
    "open host": ("dashboard", {"host": "'0.0.0.0'"}, "cannot start: host '0.0.0.0'"),
    "prot": ("dashboard", {"prot": 8093}, "has no parameter 'prot'"),
}


@pytest.fixture
def ended(tmp_path):
    """Function of a node, parameters and arguments: exit code and errors of its process."""
    domain = Domain()

    def ended(name, parameters=None, arguments=(), script=None, namespace=NAMESPACE):
        process = NodeProcess(name, domain, tmp_path, parameters, arguments, script, namespace)
        try:
            code = process.exit_code()
            assert process.output == ""
            return code, process.errors
        finally:
            process.kill()

    yield ended
    domain.release()


def only_line(ended):
    """The one line by which a node refuses to start."""
    code, errors = ended
    assert code == 2, errors
    (line,) = errors.splitlines()
    assert line.startswith("cannot start: ")
    return line


STARTS = """
import json, os, sys
from valve_friction_ros.nodes import start
codes, ends = [], []
os._exit = ends.append
for place, (node, words) in enumerate(json.loads(sys.argv[1])):
    os.dup2(os.open(f"{place}.err", os.O_WRONLY | os.O_CREAT), 2)
    sys.argv[1:] = words
    getattr(start, node)()
    codes.append(ends[-1])
print(json.dumps(codes))
"""


@pytest.fixture(scope="module")
def wrong_starts(tmp_path_factory):
    """Exit code and errors of each wrong start, one after the other in one process."""
    folder, place = tmp_path_factory.mktemp("starts"), ["--ros-args", "-r", f"__ns:={NAMESPACE}"]
    starts = [(node, place + as_arguments(**given)) for node, given, _ in REFUSED.values()]
    code, out, error = ran(json.dumps(starts), program=("-c", STARTS), cwd=folder)
    assert code == 0, error
    errors = [(folder / f"{number}.err").read_text() for number in range(len(starts))]
    return dict(zip(REFUSED, zip(json.loads(out), errors, strict=True), strict=True))


@pytest.mark.parametrize("name", REFUSED)
def test_a_wrong_start_is_refused_in_one_line(wrong_starts, name):
    if REFUSED[name][0] == "dashboard":
        pytest.importorskip("nicegui", reason="NiceGUI is not installed")
    line = only_line(wrong_starts[name])
    assert REFUSED[name][2] in line
    assert "s3cret" not in line


def test_a_file_of_parameters_is_checked_too(ended, tmp_path):
    path = tmp_path / "valves.yaml"
    path.write_text("/**:\n  ros__parameters:\n    pressure_referense: 0.0\n")
    line = only_line(ended("identifier", arguments=["--params-file", str(path)]))
    assert "parameter 'pressure_referense': did you mean 'pressure_reference'?" in line
    path.write_text(
        "/**:\n  ros__parameters:\n    travel: -1.0\n"
        "/identifiers:\n  ros__parameters:\n    valves: [fv_101, fv_102]\n"
    )
    code, errors = ended("identifiers", arguments=["--params-file", str(path)], namespace=None)
    assert code == 2
    told = "identifier: travel must be above zero, got -1"
    assert errors == f"cannot start: /fv_101/{told}; /fv_102/{told}\n"


@pytest.mark.parametrize("arguments", [["-p", "window"], ["--params-file", "missing.yaml"]])
def test_malformed_arguments_end_the_start_without_a_traceback(ended, arguments):
    code, errors = ended("simulator", arguments=arguments)
    assert code == 2
    assert "Traceback" not in errors
    assert arguments[-1] in errors


def test_no_place_for_the_log(ended, monkeypatch):
    monkeypatch.setenv("ROS_LOG_DIR", "/proc/nowhere")
    code, errors = ended("simulator")
    assert code == 2
    assert errors.splitlines()[-1].endswith(": set ROS_LOG_DIR to a writable folder")


def test_without_a_home_the_folder_says_so(monkeypatch):
    monkeypatch.delenv("ROS_HOME", raising=False)
    monkeypatch.delenv("HOME", raising=False)
    monkeypatch.setattr("os.getuid", lambda: 4_242_424)  # in no list of users
    assert str(data_folder()) == "~/.ros/valve_friction_ros"


def test_a_dashboard_whose_port_is_in_use(ended):
    pytest.importorskip("nicegui", reason="NiceGUI is not installed")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        code, errors = ended("dashboard", {"port": other.getsockname()[1]})
    assert code == 2
    assert "use another port" in errors


def test_a_dashboard_without_nicegui_says_what_to_install(ended, tmp_path):
    script = tmp_path / "dashboard.py"
    script.write_text(
        "import sys\nsys.modules['nicegui'] = None\n"
        "from valve_friction_ros.nodes.start import dashboard\nsys.exit(dashboard())\n"
    )
    code, errors = ended("dashboard", script=script)
    assert code == 2
    assert errors.splitlines() == [
        "cannot start: the dashboard needs NiceGUI, which is not installed: "
        "run `pip install 'nicegui>=3.18,<4'`"
    ]


@pytest.mark.parametrize("requests", [[signal.SIGTERM], [signal.SIGINT, signal.SIGINT]])
def test_requests_to_stop_end_a_dashboard_cleanly(live, requests):
    """The second one, such as that of `ros2 launch` without a terminal, ends it at once."""
    pytest.importorskip("nicegui", reason="NiceGUI is not installed")
    process = live.start("dashboard", {"port": free_port()}, namespace=None)
    live.client.wait_until(lambda: "ready: open" in process.errors + process.output, "the server")
    live.client.watched.clear()
    live.nodes.remove(process)
    for number in requests:
        process._process.send_signal(number)
        time.sleep(0.02)  # until the signal is handled, a second one is the same
    process.require_good_end()


SHARED = """/**:
  ros__parameters:
    use_sim_time: false
    robot_description: of a node of another package
    mass: 1.6
    columns: {time_column: Zeit, inverted_position: true, opposing_pressure_column: p2}
    qos_overrides./actuator_pressure.subscription.depth: 10
/fv_101/identifier:
  ros__parameters:
    fixed.mass: 1.7
    fixed: {spring_constant: 0.0, viscous_friction: null}
    baseline_coulomb_friction: null
"""


def test_a_file_that_nodes_of_several_packages_and_recordings_share(live, tmp_path):
    """With unset numbers as ``ros2 param dump`` writes them."""
    path = tmp_path / "shared.yaml"
    path.write_text(SHARED)
    process = live.start("identifier", arguments=["--params-file", str(path)])
    names = ("fixed.mass", "fixed.spring_constant", "fixed.viscous_friction", "use_sim_time")
    assert live.client.parameters(NODE, *names) == [1.7, 0.0, None, False]
    assert live.client.parameters(NODE, "baseline_coulomb_friction") == [None]
    told = sorted(line for line in process.errors.splitlines() if "WARN" in line)
    assert len(told) == 2
    assert any("has the parameter 'robot_description': it is ignored" in one for one in told)
    (columns,) = (one for one in told if "applies to tables, not to topics" in one)
    assert "columns.inverted_position and columns.opposing_pressure_column: " in columns


def test_compiled_code_without_a_place_is_said(live, tmp_path):
    script = tmp_path / "simulator_without_cache.py"
    script.write_text(
        "import sys, time\n"
        "from valve_friction_ros.model import compiled\n"
        "from valve_friction_ros.nodes import simulator\n"
        "from valve_friction_ros.nodes.plumbing import worker\n"
        "compiled._without_cache.add('one')\n"
        "worker._QUICK = 0.0\n"
        "simulator.compile_kernels = lambda: time.sleep(1.0)\n"
        "sys.exit(simulator.main())\n"
    )
    process = live.start("simulator", script=script)
    live.client.wait_until(lambda: "ready: " in process.errors, "the ready line")
    assert "at every start, because no cache folder is writable" in process.errors
    assert "set NUMBA_CACHE_DIR" in process.errors


def test_diagnostics_say_that_it_prepares(live, tmp_path):
    script = tmp_path / "slow_preparation.py"
    script.write_text(
        "import sys, time\n"
        "from pathlib import Path\n"
        "from valve_friction_ros.nodes.identifier import node, workers\n"
        "from valve_friction_ros.nodes.plumbing import worker\n"
        "worker._QUICK = 0.0\n"
        "def prepare():\n"
        "    while not Path('prepared').exists():\n"
        "        time.sleep(0.05)\n"
        "workers.compile_methods = prepare\n"
        "node._PROCESSES = 0\n"
        "sys.exit(node.main())\n"
    )
    process = live.start("identifier", {"input_timeout": 600.0}, script=script)
    status = live.client.next_status()
    assert values_of(status)["preparing"].startswith("preparing: compiling numeric code")
    assert status.message.endswith(values_of(status)["preparing"])
    assert "ready: " not in process.errors
    (tmp_path / "prepared").touch()
    status = live.client.next_status(lambda one: "preparing" not in values_of(one), "its end")
    assert "preparing" not in status.message
    live.client.wait_until(lambda: "ready: " in process.errors, "the ready line")


def python(code, *arguments, **environment):
    """What a Python of its own prints."""
    bare = {key: value for key, value in os.environ.items() if key != "OPENBLAS_NUM_THREADS"}
    done = ran(*arguments, program=("-c", code), cwd=PROJECT, env=bare | environment)
    assert done[::2] == (0, "")
    return done[1]


@pytest.mark.parametrize("given", ["-p", "fv_101", "--params-file"])
def test_arguments_that_ros_does_not_read_are_refused(given):
    """Without --ros-args a parameter was ignored, and the valve watched with its default."""
    code = (
        "import sys; from valve_friction_ros.nodes import start; sys.argv[1:] = sys.argv[-2:]; "
        "assert start.identifier() == 2"
    )
    told = f"cannot start: '{given}' is not a ROS argument: write --ros-args before "
    ended, _, error = ran(given, "travel:=0.03", program=("-c", code), cwd=PROJECT)
    assert ended == 0
    assert error.startswith(told)


HELP = """
import sys
import rclpy
def refuse(*_, **__):
    raise AssertionError("ROS was started")
rclpy.init = refuse
from valve_friction_ros.nodes import start
for node in sys.argv[2:]:
    sys.argv[1:] = sys.argv[1:2]
    assert getattr(start, node)() == 0
    print("---")
"""


@pytest.mark.parametrize("option", ["-h", "--help"])
def test_help_names_the_parameters_without_starting_ros(option):
    defaults = {
        "identifier": ("window", 60.0),
        "identifiers": ("valves", [""]),
        "simulator": ("joint", "stem"),
        "pressure_source": ("excitation", "square"),
        "stroke_player": ("silence", 1.0),
    }
    *pages, rest = python(HELP, option, *defaults).split("---\n")
    assert rest == ""
    for (node, (parameter, default)), page in zip(defaults.items(), pages, strict=True):
        first, *lines = page.splitlines()
        assert first.startswith(f"usage: {node} [--ros-args ")
        listed = yaml.safe_load("\n".join(line for line in lines if line.startswith("  ")))
        assert listed[parameter] == default


def test_help_that_nobody_reads_ends_in_silence():
    """As in `identifier --help | head -1`."""
    node = subprocess.Popen(
        [sys.executable, "-c", HELP, "--help", "simulator"],
        cwd=PROJECT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    node.stdout.close()
    assert node.stderr.read() == ""
    node.stderr.close()
    assert node.wait(60) == -signal.SIGPIPE


HEAVY = {
    "scipy.stats",
    "scipy.signal",
    "matplotlib",
    "pandas",
    "jinja2",
    "rich",
    "psycopg",  # until a history is on a server
    "sqlalchemy",  # until a history is opened
    "valve_friction_ros.reports",
}


@pytest.mark.parametrize("node", ["identifiers", "simulator"])
def test_a_node_loads_nothing_that_only_a_later_request_needs(node):
    code = (
        f"import sys, valve_friction_ros.nodes.{node}; "
        "from valve_friction_ros.model import compile_kernels; compile_kernels(); "
        "print(*sys.modules)"
    )
    loaded = set(python(code).split())
    assert f"valve_friction_ros.nodes.{node}" in loaded
    assert ("valve_friction_ros.nodes.identifier.node" in loaded) == (node == "identifiers")
    assert HEAVY.isdisjoint(loaded)


def test_moves_in_service_load_no_numeric_library_but_numpy():
    """26 MB of a node whose identifications have a process of their own."""
    code = """
import sys
import valve_friction_ros.nodes.identifier.node
from valve_friction_ros.evidence import evidence_of

sys.path.append("test/support")
from service import VALVE, made_moves

assert evidence_of(made_moves(1.0, lambda _: 300.0), VALVE, None).is_known
print(*sys.modules)
"""
    heavy = {"numba", "scipy.special", "scipy.linalg", "scipy.optimize", "scipy.signal"}
    assert heavy.isdisjoint(python(code).split())


def test_a_dashboard_loads_no_numeric_library_but_numpy():
    """A second of its start and 50 MB."""
    pytest.importorskip("nicegui", reason="NiceGUI is not installed")
    code = """
import sys
import numpy as np
from valve_friction_ros.history.trend import fit_line
import valve_friction_ros.dashboard.charts
import valve_friction_ros.nodes.dashboard

days = np.arange(9.0)
fit_line(days, 1.0 + 0.1 * days + 0.01 * np.cos(9 * days), np.full(9, 0.001)).half_width(3.0)
print(*sys.modules)
"""
    loaded = set(python(code).split())
    assert "valve_friction_ros.dashboard.history_cache" in loaded
    heavy = {"numba", "scipy.special", "scipy.linalg", "scipy.optimize", "scipy.signal",
             "matplotlib", "pandas", "tornado", "aiohttp"}  # fmt: skip
    assert heavy.isdisjoint(loaded)


@pytest.mark.parametrize(("given", "used"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3")])
def test_matrices_are_computed_in_one_thread(given, used):
    code = (
        "import os, sys, valve_friction_ros.nodes.start; "
        "print(os.environ['OPENBLAS_NUM_THREADS'], 'numpy' in sys.modules)"
    )
    assert python(code, **given).split() == [used, "False"]
