"""One identified state of the packing, as the topics of the identifier tell it."""

from collections.abc import Mapping
from typing import NamedTuple

from rich.table import Table

from valve_friction_ros.commands.demo.bench_client import BenchClient, BenchError
from valve_friction_ros.figures import Case
from valve_friction_ros.identification import (
    UNITS,
    Drawing,
    Parameter,
    Verdict,
    parameter_cells,
    parameter_mapping,
    sweep_panels,
)
from valve_friction_ros.model import KarnoppParameters

__all__ = ["TOLERANCES", "Outcome", "identified", "table_of"]

TOLERANCES = {
    "mass": 0.10,
    "viscous_friction": 0.02,
    "coulomb_friction": 0.01,
    "static_friction": 0.1,
    "spring_constant": 0.002,
    "spring_preload": 0.002,
}
"""Relative errors that a published estimate may have, by parameter, with the noise of the demo.

The mass is given, 1.6 kg for both packings. A published F_s is read from single samples.
"""
_INTERVALS = 3.0
"""Half widths of its interval by which an identified value may be off."""
_ANSWER_TIMEOUT = 120.0
_NEWEST = 2.0
"""Age, s, up to which a diagnosed estimate is the one just asked for."""


class Outcome(NamedTuple):
    """One identified state of the packing."""

    label: str
    truth: KarnoppParameters
    published: Mapping[str, float]
    refined: Mapping[str, Parameter]
    case: Case

    def errors(self) -> dict[str, float]:
        """Relative errors of the published estimate."""
        return {name: self.published[name] / getattr(self.truth, name) - 1 for name in TOLERANCES}

    def missed(self) -> list[str]:
        """Parameters whose published error exceeds the tolerance, or whose interval is untrue."""
        outside = {
            name for name, error in self.errors().items() if not abs(error) <= TOLERANCES[name]
        }
        untrue = {
            name
            for name, one in self.refined.items()
            if one.verdict is Verdict.IDENTIFIED
            and abs(one.value - getattr(self.truth, name)) > _INTERVALS * one.half_width
        }
        return [name for name in TOLERANCES if name in outside | untrue]


def identified(client: BenchClient, label: str, truth: KarnoppParameters) -> Outcome:
    """Identify the record on the running node and read the result from its topics."""
    recording = client.recording()
    client.trigger("identify")
    client.wait(
        lambda: float(client.diagnostic_values.get("estimate_age [s]", "inf")) < _NEWEST,
        _ANSWER_TIMEOUT,
        "diagnostic of the estimate",
    )
    values = client.diagnostic_values
    if "threshold [m/s]" not in values:
        raise BenchError(f"no published estimate: {values['warnings']}")
    sweep = client.sweep_columns()
    published = {name: float(values[f"{name} published [{UNITS[name]}]"]) for name in TOLERANCES}
    refined = {name: _refined(name, values) for name in TOLERANCES}
    panels = sweep_panels(
        sweep["threshold"],
        sweep["coulomb_friction"],
        sweep["sigma"],
        float(values["threshold [m/s]"]),
        refined["coulomb_friction"],
    )
    return Outcome(label, truth, published, refined, Case(label, recording, Drawing(panels)))


def _refined(name: str, values: Mapping[str, str]) -> Parameter:
    """Read a parameter with its verdict from a diagnostic."""
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
    """Put true, published and refined values side by side; what is off is red."""
    table = Table(title=outcome.label, title_justify="left", box=None, header_style="bold")
    table.add_column("parameter", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for heading in ("true", "published", "error", "refined", "± 95 %"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    for name, error in outcome.errors().items():
        _, value, width, unit, verdict, _ = parameter_cells(
            name, parameter_mapping(outcome.refined[name])
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
