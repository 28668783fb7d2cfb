# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Sub-command `demo`: tighten the packing of a simulated valve, and watch the monitor detect it."""

import argparse
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from valve_friction_ros.commands.console import OutputConsole
from valve_friction_ros.commands.demo.bench import (
    ANSWER_TIMEOUT,
    BenchClient,
    NodeProcess,
    bench_client,
    free_domain,
    quick_discovery,
    running_nodes,
)
from valve_friction_ros.commands.demo.plant import require_dashboard, show_plant
from valve_friction_ros.commands.process import ExitCode, requests_raise
from valve_friction_ros.figures import Case, friction_figure, require_picture_file, save_picture
from valve_friction_ros.health.levels import Level
from valve_friction_ros.identification.methods import compile_methods, identify
from valve_friction_ros.identification.refusal import RefusalError
from valve_friction_ros.identification.rendering import parameter_cells, parameter_mapping
from valve_friction_ros.identification.settings import UNITS, IdentificationSettings
from valve_friction_ros.identification.trust.verdict import Parameter, Verdict
from valve_friction_ros.model.excitations import (
    BENCH_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    SquareWave,
)
from valve_friction_ros.model.valve import KarnoppParameters
from valve_friction_ros.streams import RecordBuffer

WEIGHED_MASS = 1.6
"""Mass given to the identification, kg: with a square wave noise hides it."""

TOLERANCES = {
    "mass": 0.10,
    "viscous_friction": 0.02,
    "coulomb_friction": 0.01,
    "static_friction": 0.1,
    "spring_constant": 0.002,
    "spring_preload": 0.002,
}
"""Tolerated relative errors of a published estimate with the noise of the demo, by parameter.

The mass is given. A published F_s is read from single samples.
"""
_INTERVALS = 3.0
"""Tolerated error of an identified value, in half widths of its interval."""


class Outcome(NamedTuple):
    """One identified state of the packing."""

    label: str
    truth: KarnoppParameters
    published: Mapping[str, float]
    found: Mapping[str, Parameter]
    case: Case

    def errors(self) -> dict[str, float]:
        """Return the relative errors of the published estimate."""
        return {name: self.published[name] / getattr(self.truth, name) - 1 for name in TOLERANCES}

    def missed(self) -> list[str]:
        """Return the parameters whose published error or interval is out of tolerance."""
        outside = {
            name for name, error in self.errors().items() if not abs(error) <= TOLERANCES[name]
        }
        untrue = {
            name
            for name, one in self.found.items()
            if one.verdict is Verdict.IDENTIFIED
            and abs(one.value - getattr(self.truth, name)) > _INTERVALS * one.half_width
        }
        return [name for name in TOLERANCES if name in outside | untrue]


def identified(client: BenchClient, label: str, truth: KarnoppParameters) -> Outcome:
    """Identify the record on the running node, and read the result from its topics.

    The picture shows the same record, identified in this process.
    """
    recording, former = client.recording(), client.diagnostic_values.get("estimate_time")
    client.trigger("identify")
    client.wait(
        lambda: client.diagnostic_values.get("estimate_time") not in (None, former),
        ANSWER_TIMEOUT,
        "diagnostic of the estimate",
    )
    values = client.diagnostic_values
    if "threshold [m/s]" not in values:
        raise RefusalError(f"no published estimate: {values['warnings']}")
    published = {name: float(values[f"{name} published [{UNITS[name]}]"]) for name in TOLERANCES}
    found = {name: _found(name, values) for name in TOLERANCES}
    settings = IdentificationSettings(fixed={"mass": WEIGHED_MASS})
    drawn = identify(recording, BENCH_VALVE, settings)
    return Outcome(label, truth, published, found, Case.of(label, drawn))


def _found(name: str, values: Mapping[str, str]) -> Parameter:
    half_width = float(values[f"{name} half width [{UNITS[name]}]"])
    return Parameter(
        name,
        float(values[f"{name} [{UNITS[name]}]"]),
        float("nan"),
        half_width,
        Verdict(values[f"{name} verdict"]),
        values.get(f"{name} reason", ""),
    )


def table_of(outcome: Outcome) -> Table:
    """Show true, published and identified values side by side; values out of tolerance are red."""
    table = Table(title=outcome.label, title_justify="left", box=None, header_style="bold")
    table.add_column("parameter", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for heading in ("true", "published", "error", "identified", "± 95 %"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    for name, error in outcome.errors().items():
        _, value, width, unit, verdict, _ = parameter_cells(
            name, parameter_mapping(outcome.found[name])
        )
        table.add_row(
            name,
            unit,
            f"{getattr(outcome.truth, name):.6g}",
            f"{outcome.published[name]:.6g}",
            f"{100 * error:+.3f} %",
            value,
            width,
            verdict,
            style="red" if name in outcome.missed() else None,
        )
    return table


_NAMESPACE = "fv_101"
_RECORD = 2 * SquareWave().period
_POSITION_BIAS = LOW_FRICTION.spring_preload / LOW_FRICTION.spring_constant
_PRINTED_WIDTH = 100
_START_TIMEOUT = 30.0
_UNDER_WAY = 2.0
"""Signal time skipped after a change, s: samples still in transit are from before the change."""
_FRICTION = ("mass", "viscous_friction", "coulomb_friction", "static_friction")


def _record(client: BenchClient, console: Console, label: str) -> None:
    """Wait, with progress shown, until two periods have been recorded."""
    client.trigger("clear")
    client.begin_record()
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:4.1f} of {task.total:.1f} s"),
        TimeRemainingColumn(),
        console=console,
    ) as progress:
        task = progress.add_task(label, total=_RECORD)

        def enough() -> bool:
            progress.update(task, completed=min(client.recorded, _RECORD))
            return client.recorded >= _RECORD

        client.wait(enough, 3 * _RECORD, f"record of {_RECORD:g} s")


def _nodes() -> list[NodeProcess]:
    monitored = {
        "method": "bench",
        **vars(BENCH_VALVE),
        "position_bias": _POSITION_BIAS,
        "fixed.mass": WEIGHED_MASS,
        "valve_tag": _NAMESPACE.upper().replace("_", "-"),
        "history_file": "''",  # empty: a demo must not enter the history of a plant
    }
    return [
        NodeProcess("identifier", monitored),
        NodeProcess("simulator", {"position_noise": 3e-6, "noise_seed": 1}),  # low friction
        NodeProcess(
            "pressure_source", {"pressure_noise": 20.0, "time_jitter": 5e-5, "noise_seed": 2}
        ),
    ]


def _is_heard(client: BenchClient) -> bool:
    """Return whether the latest diagnostic of the identifier shows samples of both signals."""
    shown = client.diagnostic_values
    names = ("buffered_pressures", "buffered_positions")
    return all(int(shown.get(name, "0")) > 0 for name in names)


def _run(client: BenchClient, console: Console) -> tuple[Outcome, Outcome]:
    """Identify both states of the packing."""
    with console.status("waiting for the nodes"):
        client.wait(lambda: client.recorded > 0, _START_TIMEOUT, "stem position")
        client.wait(lambda: _is_heard(client), _START_TIMEOUT, "samples in the identifier")
    _record(client, console, "packing loose")
    before = identified(client, "packing loose", LOW_FRICTION)
    console.print(f"identified; {client.trigger('set_baseline')}", highlight=False)
    tightened = {name: getattr(HIGH_FRICTION, name) for name in _FRICTION}
    client.set_parameters(f"/{_NAMESPACE}/simulator", tightened, _START_TIMEOUT)
    console.print("the packing is tightened while the valve runs", highlight=False)
    client.begin_record()
    client.wait(lambda: client.recorded >= _UNDER_WAY, _START_TIMEOUT, "stem position")
    _record(client, console, "packing tight")
    return before, identified(client, "packing tight", HIGH_FRICTION)


def _report(
    outcomes: Sequence[Outcome], level: int, message: str, output: Path, console: Console
) -> int:
    """Print and plot the results, compare them with the tolerances; return the exit code."""
    for outcome in outcomes:
        console.print(table_of(outcome))
    diagnosis = f"/diagnostics {Level(level).name}: {message}"
    console.print(diagnosis, style="bold", highlight=False, markup=False)
    missed = [f"{name} ({outcome.label})" for outcome in outcomes for name in outcome.missed()]
    if missed:
        console.print(f"outside tolerance: {', '.join(missed)}", style="bold red")
    if level != Level.ERROR:
        console.print("the excess friction was not diagnosed", style="bold red")
    save_picture(friction_figure([outcome.case for outcome in outcomes], diagnosis), output)
    console.print(f"picture: {output}", highlight=False, markup=False, soft_wrap=True)
    return ExitCode.PARTLY if missed or level != Level.ERROR else ExitCode.DONE


def run(options: argparse.Namespace) -> int:
    """Run the bench and report the results."""
    console = OutputConsole(width=None if sys.stdout.isatty() else _PRINTED_WIDTH)
    if options.dashboard:
        require_dashboard()
    else:
        require_picture_file(options.output)
    with console.status("preparing"):  # otherwise each node would compile the same code
        compile_methods()
    os.environ.update(quick_discovery())
    requests_raise()  # the nodes have their own sessions, and would survive
    with free_domain() as domain, TemporaryDirectory(prefix="valve_friction_demo") as home:
        os.environ |= {"ROS_DOMAIN_ID": str(domain), "ROS_HOME": home}  # not of a plant
        if options.dashboard:
            return show_plant(console, Path(home))
        return _demonstrated(options, console)


def _demonstrated(options: argparse.Namespace, console: Console) -> int:
    buffer = RecordBuffer(BENCH_VALVE, 2 * _RECORD)
    with running_nodes(_nodes(), _NAMESPACE), bench_client(_NAMESPACE, buffer) as client:
        outcomes = _run(client, console)
    status: Any = client.status  # an estimate was read from it
    return _report(outcomes, status.level[0], status.message, options.output, console)
