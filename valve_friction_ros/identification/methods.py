# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The methods of identification by name; all have the same arguments and return type."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Protocol

import numpy as np

from valve_friction_ros.identification.engine.coordinates import Profile
from valve_friction_ros.identification.engine.method import identify_bench, identify_plant
from valve_friction_ros.identification.published import identify as published
from valve_friction_ros.identification.result import Result
from valve_friction_ros.identification.settings import (
    DEFAULT_METHOD,
    IdentificationSettings,
    current_name,
)
from valve_friction_ros.identification.signature import force_balance as signature
from valve_friction_ros.model.checks import A_VALVE, require_type
from valve_friction_ros.model.excitations import BENCH_VALVE, LOW_FRICTION, SineWave
from valve_friction_ros.model.recording import Recording
from valve_friction_ros.model.simulation import compile_kernels, simulate
from valve_friction_ros.model.valve import Valve


class Method(Protocol):
    """A method of identification: from a record to parameters with verdicts."""

    def __call__(
        self, recording: Recording, valve: Valve, settings: IdentificationSettings | None = None
    ) -> Result:
        """Identify a record; raise RefusalError if it does not determine the friction."""


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        Profile.PLANT.value: identify_plant,
        Profile.BENCH.value: identify_bench,
        published.METHOD: published.identify_published,
        signature.METHOD: signature.identify_signature,
    }
)
"""``plant``: with the imperfections of a plant in the fit; ``bench``: the Karnopp model alone;
``published``: the paper's model 1; ``signature``: its model 2."""


def method_named(name: str) -> Method:
    """Return the method of this name; names of earlier versions are understood.

    Raises ValueError with the names, if no method has this one.
    """
    current = current_name(name)
    if current not in METHODS:
        raise ValueError(f"there is no method {name!r}: choose from {', '.join(METHODS)}")
    return METHODS[current]


def identify(
    recording: Recording,
    valve: Valve,
    settings: IdentificationSettings | str | None = None,
    method: str = DEFAULT_METHOD,
) -> Result:
    """Identify the friction of a valve from a recording.

    Parameters
    ----------
    recording : Recording
        Pressure and stem position, several strokes in both directions.
    valve : Valve
        Geometry.
    settings : IdentificationSettings or str, optional
        Prior knowledge and the settings of the sweep; or the name of the method, if there is
        nothing to set.
    method : str
        ``plant``, with the imperfections of a plant in the fit; ``bench``, with the Karnopp model
        alone; ``published``, the paper's model 1; or ``signature``, the paper's model 2, from a
        slow triangular wave.

    Returns
    -------
    Result
        Parameters with intervals and verdicts.

    Raises
    ------
    RefusalError
        If the record does not determine the friction; the message names cause and remedy.
    ValueError
        If no method has this name, or two are named.
    TypeError
        If an argument has another type, such as a frame in place of a recording.

    Examples
    --------
    >>> import numpy as np
    >>> import valve_friction_ros as vf
    >>> valve = vf.Valve(diaphragm_area=0.0445, travel=28.575e-3)
    >>> packing = vf.KarnoppParameters(1.6, 4865.0, 150.0, 150.0, 2.05e5)
    >>> time = np.arange(4000) / 100
    >>> pressure = 6.5e4 + 5e4 * np.sin(2 * np.pi * time / 10)
    >>> stem = vf.simulate(valve, packing, pressure, sample_period=0.01)
    >>> result = vf.identify(vf.Recording(0.01, pressure, stem.position), valve)
    >>> friction = result.parameters["coulomb_friction"]
    >>> low, high = friction.interval
    >>> low < 150.0 < high
    True
    """
    require_type("recording", recording, "what vf.read_recording returns", Recording)
    require_type("valve", valve, A_VALVE, Valve)
    if isinstance(settings, str):
        if method not in (DEFAULT_METHOD, settings):
            raise ValueError(f"settings names the method {settings!r}, and method {method!r}")
        return method_named(settings)(recording, valve)
    if settings is not None:
        require_type("settings", settings, "vf.IdentificationSettings(...)", IdentificationSettings)
    return method_named(method)(recording, valve, settings)


def compile_methods() -> None:
    """Compile all kernels, or load their compiled forms, by identifying six simulated seconds.

    Takes a second, and up to a minute the first time on a machine.
    """
    compile_kernels()
    period, count = 0.01, 600
    pressure = SineWave(period=3.0).sample(period * np.arange(count))
    position = simulate(BENCH_VALVE, LOW_FRICTION, pressure, period).position
    random = np.random.default_rng(0)
    noisy = position + 1e-6 * random.standard_normal(count)
    identify(Recording(period, pressure + 5.0 * random.standard_normal(count), noisy), BENCH_VALVE)
