# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The simulated benches of the reproduction, read from their configuration files."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from valve_friction_ros.model import KarnoppParameters, SensorNoise, SquareWave, Valve
from valve_friction_ros.model.checks import require_finite, require_positive
from valve_friction_ros.records.valve_file import read_yaml

BENCH_NAMES = ("low", "high", "graphite")
"""The benches of ``config/bench_<name>.yaml``: the paper's two packings, and graphite."""

_PARAMETERS = tuple(field.name for field in fields(KarnoppParameters))


@dataclass(frozen=True)
class Bench:
    """A simulated valve with converter and sensors, in SI units.

    `truth` holds the parameters that the identification should find. The noise-free pressure acts
    on the stem. `converter_lag` is the time constant of the V/P converter, and `assumed_mass` the
    nominal mass of the moving parts.
    """

    name: str
    valve: Valve
    truth: KarnoppParameters
    square: SquareWave
    converter_lag: float
    sample_period: float
    noise: SensorNoise
    assumed_mass: float

    @property
    def position_bias(self) -> float:
        """The true x̄ of (10), m."""
        return self.truth.spring_preload / self.truth.spring_constant

    def with_noise(self, noise: SensorNoise) -> "Bench":
        """Return the same bench with other noise."""
        return replace(self, noise=noise)


def read_bench(folder: Path, name: str) -> Bench:
    """Read a bench from ``bench_<name>.yaml``, the parameter file of its three nodes.

    Raises ValueError with the file and the cause in one line.
    """
    path = folder / f"bench_{name}.yaml"
    content = read_yaml(path)
    try:
        source, simulator, identifier = (
            _Section(content, node) for node in ("pressure_source", "simulator", "identifier")
        )
        return Bench(
            name=name,
            valve=Valve(
                diaphragm_area=simulator["diaphragm_area"],
                pressure_reference=simulator["pressure_reference"],
                travel=simulator["travel"],
                pressure_minimum=identifier["pressure_minimum"],
                pressure_maximum=identifier["pressure_maximum"],
            ),
            truth=KarnoppParameters(
                **{key: simulator[key] for key in _PARAMETERS if key in simulator}
            ),
            square=SquareWave(source["low"], source["high"], source["period"]),
            converter_lag=source["converter_lag"],
            sample_period=1 / require_positive("sample_rate", source["sample_rate"]),
            noise=SensorNoise(simulator["position_noise"], source["pressure_noise"]),
            assumed_mass=identifier["assumed_mass"],
        )
    except (ValueError, TypeError) as error:
        raise ValueError(f"{path}: {error}") from None


class _Section:
    """The numbers of one node in a parameter file."""

    def __init__(self, content: Any, node: str) -> None:
        inner = content
        for key in ("/**", node, "ros__parameters"):
            inner = inner.get(key) if isinstance(inner, Mapping) else None
        if not isinstance(inner, Mapping):
            raise ValueError(f"the file has no parameters of {node}: add them")
        self._node, self._values = node, inner

    def __contains__(self, name: str) -> bool:
        return name in self._values

    def __getitem__(self, name: str) -> float:
        if name not in self._values:
            raise ValueError(f"{self._node} has no {name}: add it")
        return require_finite(f"{self._node}.{name}", self._values[name])
