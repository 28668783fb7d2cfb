# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Three simulated valves on the dashboard: one healthy, one tightening, one leaking."""

import contextlib
import importlib.util
import socket
import subprocess
import time
import webbrowser
from pathlib import Path
from typing import NamedTuple

from rich.console import Console

from valve_friction_ros.commands.demo.bench import ANSWER_TIMEOUT, NodeProcess, running_nodes
from valve_friction_ros.commands.process import ExitCode
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.model.excitations import BENCH_VALVE, SquareWave
from valve_friction_ros.nodes.service_call import Caller, caller

_PORT = 8080
_RATE = 200.0
_RECORD = 2 * SquareWave().period
_REST = _RECORD
"""Time between a change of the packings and the identification, s: the record is new by then."""
_FRICTION = 300.0
_START_TIMEOUT = 90.0


class PlantValve(NamedTuple):
    """A valve in the namespace `name`, and the change of its packing, its `fate` in a word.

    `growth` is the factor of friction from one identification to the next, `end` that after all.
    """

    name: str
    fate: str
    growth: float
    end: float

    def friction(self, step: int) -> float:
        """Return the Coulomb friction at an identification, N."""
        bound = max if self.growth < 1 else min
        return _FRICTION * bound(self.growth**step, self.end)


VALVES = (
    PlantValve("fv_101", "healthy", 1.0, 1.0),
    PlantValve("fv_102", "tightening", 1.15, 3.0),
    PlantValve("fv_103", "leaking", 0.85, 0.3),
)


def require_dashboard() -> None:
    """Raise RefusalError if NiceGUI is not installed."""
    if importlib.util.find_spec("nicegui") is None:
        from valve_friction_ros.dashboard.context import INSTALL  # noqa: PLC0415 - rarely needed

        raise RefusalError(
            f"the dashboard needs NiceGUI: run `{INSTALL}`, or `make demo DEMO_ARGS=--dashboard`"
        )


def plant_nodes(valve: PlantValve, number: int, history: Path) -> list[NodeProcess]:
    """Return the nodes of a valve: slow sine, noise of 10 µm and 20 Pa, jitter of 1 ms."""
    return [
        NodeProcess(
            "identifier",
            {
                **vars(BENCH_VALVE),
                "valve_tag": valve.name.upper().replace("_", "-"),
                "history_file": history,
                "window": _RECORD,
            },
        ),
        NodeProcess(
            "simulator",
            {
                **_packing(valve.friction(0)),
                "viscous_friction": 1.0e4,
                "mass": 1.6,
                "position_noise": 1e-5,
                "noise_seed": 2 * number + 1,
            },
        ),
        NodeProcess(
            "pressure_source",
            {
                "excitation": "sine",
                "sample_rate": _RATE,
                "pressure_noise": 20.0,
                "time_jitter": 1e-3,
                "noise_seed": 2 * number + 2,
            },
        ),
    ]


def _packing(friction: float) -> dict[str, float]:
    return {"coulomb_friction": friction, "static_friction": friction}


def _tell(client: Caller, console: Console) -> None:
    """Identify all valves repeatedly, each time with the packing of the next step."""
    step = 0
    while True:
        for valve in VALVES:
            packing = _packing(valve.friction(step))
            client.set_parameters(f"/{valve.name}/simulator", packing, ANSWER_TIMEOUT)
            _call(client, valve, "clear")
        time.sleep(_REST)
        for valve in VALVES:
            answer = _call(client, valve, "identify")
            if step == 0:
                answer = _call(client, valve, "set_baseline")
            says = f"{valve.name} ({valve.fate}, F_c {valve.friction(step):.0f} N): {answer}"
            console.print(says, highlight=False, markup=False)
        step += 1


def _call(client: Caller, valve: PlantValve, service: str) -> str:
    """Call a service of an identifier; return its answer, even if it reports a failure."""
    answer = client.call(f"/{valve.name}/identifier", service, ANSWER_TIMEOUT)
    if answer is None:  # only if it is no longer wanted
        raise KeyboardInterrupt
    level = "" if answer.level is None else f"{answer.level.name}: "
    return f"{level}{answer.message}"


def _free_port() -> int:
    """Return the usual port, or another free port."""
    with socket.socket() as tried:
        for port in (_PORT, 0):
            with contextlib.suppress(OSError):
                tried.bind(("127.0.0.1", port))
                break
        found: int = tried.getsockname()[1]
        return found


def _wait_for_page(process: subprocess.Popen[bytes], port: int) -> None:
    deadline = time.monotonic() + _START_TIMEOUT
    while time.monotonic() < deadline:
        if process.poll() is not None:
            break
        with socket.socket() as tried:
            if tried.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    raise RefusalError(f"the dashboard did not open port {port} within {_START_TIMEOUT:g} s")


def show_plant(console: Console, home: Path) -> int:
    """Run three valves and the dashboard until Ctrl-C or SIGTERM; `home` holds their history."""
    port = _free_port()
    history = home / "history.sqlite"
    with contextlib.ExitStack() as running, contextlib.suppress(KeyboardInterrupt):
        shown = NodeProcess("dashboard", {"port": port, "history_file": history})
        (dashboard,) = running.enter_context(running_nodes([shown], ""))
        for number, valve in enumerate(VALVES):
            nodes = plant_nodes(valve, number, history)
            running.enter_context(running_nodes(nodes, valve.name))
        _wait_for_page(dashboard, port)
        address = f"http://127.0.0.1:{port}/"
        console.print(f"the dashboard is at {address} until Ctrl-C", highlight=False)
        webbrowser.open(address)
        client = running.enter_context(caller(lambda: True))
        for valve in VALVES:
            client.find(valve.name, _START_TIMEOUT)
        _tell(client, console)
    return ExitCode.DONE
