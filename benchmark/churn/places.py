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
from typing import NamedTuple

__all__ = [
    "AUDITED",
    "IDENTIFIERS",
    "NODES",
    "RATE",
    "SERVICES",
    "STREAMS",
    "Node",
    "nodes",
    "parameter_words",
    "process_of",
]

RATE = 250
"""Samples a second of each signal, Hz: visitors that listen cost more than the nodes."""

_BENCH = Path(__file__).resolve().parents[2] / "config" / "bench_low.yaml"
_VALVE = "/fv_101"
AUDITED = f"{_VALVE}/identifier"
"""The identifier whose buffer nobody clears, so that each of its samples can be asked for."""

_OTHERS = ("/fv_201", "/fv_202")
IDENTIFIERS = (AUDITED, *(f"{valve}/identifier" for valve in _OTHERS))
NODES = (*IDENTIFIERS, f"{_VALVE}/simulator", f"{_VALVE}/pressure_source")

STREAMS = (f"{_VALVE}/actuator_pressure", f"{_VALVE}/stem_state")

SERVICES = {"identify": 6, "set_baseline": 6, "clear": 5, "save": 2, "report": 1}
"""Services of an identifier, and how often each is called beside the others."""


class Node(NamedTuple):
    """A process to start: an executable of the package and its ROS arguments."""

    executable: str
    arguments: Sequence[str]


def parameter_words(**values: object) -> list[str]:
    """Return the arguments that set parameters of a node."""
    return [word for name, value in values.items() for word in ("-p", f"{name}:={value}")]


def nodes(folder: Path, valve: str = _VALVE, others: Sequence[str] = _OTHERS) -> dict[str, Node]:
    """Return the processes of a plant that writes into a folder.

    The valve streams as its bench does; the others, in one process, hear the same streams.
    """
    files = parameter_words(
        history_file=folder / "history.sqlite",
        save_folder=folder / "saved",
        report_folder=folder / "reports",
    )
    place = ["-r", f"__ns:={valve}", "--params-file", str(_BENCH)]
    streams = (f"{valve}/actuator_pressure", f"{valve}/stem_state")
    heard = [
        word
        for other in others
        for stream in streams
        for word in ("-r", f"{other}/{stream.rpartition('/')[2]}:={stream}")
    ]
    found = {
        "identifier": [*place, *files],
        "identifiers": [
            *heard,
            "--params-file",
            str(_BENCH),
            *parameter_words(valves=f"[{','.join(others)}]"),
            *files,
        ],
        "simulator": [*place, *parameter_words(position_noise=5e-6)],
        "pressure_source": [
            *place,
            *parameter_words(sample_rate=float(RATE)),
        ],
    }
    return {name: Node(name, arguments) for name, arguments in found.items()}


def process_of(service: str) -> str:
    """Return the process of `nodes` that answers a service."""
    valve, node, _ = service.strip("/").split("/")
    return "identifiers" if f"/{valve}" in _OTHERS else node
