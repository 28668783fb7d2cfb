# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The nodes that are churned: their names, arguments and services."""

from collections.abc import Sequence
from pathlib import Path

from benchmark.harness.processes import node, parameters

RATE = 250
"""Samples a second of each signal, Hz: visitors that listen cost more than the nodes."""

BENCH = Path(__file__).resolve().parents[2] / "config" / "bench_low.yaml"
_VALVE = "/fv_101"
AUDITED = f"{_VALVE}/identifier"
"""The identifier whose buffer nobody clears, so that each of its samples can be asked for."""

_OTHERS = ("/fv_201", "/fv_202")
IDENTIFIERS = (AUDITED, *(f"{valve}/identifier" for valve in _OTHERS))
NODES = (*IDENTIFIERS, f"{_VALVE}/simulator", f"{_VALVE}/pressure_source")

STREAMS = (f"{_VALVE}/actuator_pressure", f"{_VALVE}/stem_state")

SERVICES = {"identify": 6, "set_baseline": 6, "clear": 5, "save": 2, "report": 1}
"""Services of an identifier, and how often each is called beside the others."""


def nodes(
    folder: Path, valve: str = _VALVE, others: Sequence[str] = _OTHERS
) -> dict[str, list[str]]:
    """Return the commands of the nodes of a plant that writes into a folder.

    The valve streams as its bench does; the others, in one process, hear the same streams.
    """
    files = parameters(
        history_file=folder / "history.sqlite",
        save_folder=folder / "saved",
        report_folder=folder / "reports",
    )
    bench = ["--params-file", str(BENCH)]
    place = ["-r", f"__ns:={valve}", *bench]
    heard = [
        word
        for other in others
        for stream in ("actuator_pressure", "stem_state")
        for word in ("-r", f"{other}/{stream}:={valve}/{stream}")
    ]
    many = [*heard, *bench, *parameters(valves=f"[{','.join(others)}]")]
    return {
        "identifier": node("identifier", *place, *files),
        "identifiers": node("identifiers", *many, *files),
        "simulator": node("simulator", *place, *parameters(position_noise=5e-6)),
        "pressure_source": node("pressure_source", *place, *parameters(sample_rate=float(RATE))),
    }


def process_of(service: str) -> str:
    """Return the process of `nodes` that answers a service."""
    valve, name, _ = service.strip("/").split("/")
    return "identifiers" if f"/{valve}" in _OTHERS else name
