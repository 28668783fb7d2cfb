# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Identify the friction of control valves with the Karnopp model, with confidence intervals.

All of this works without ROS; all quantities are in SI units. The names below are loaded on first
use. ``doc/rooms.md`` shows the packages behind them, and which may import which.

Examples
--------
Simulate a valve, identify it, and compare it with its healthy state.

>>> import numpy as np
>>> import valve_friction_ros as vf
>>> valve = vf.Valve(diaphragm_area=0.0445, travel=28.575e-3)
>>> healthy = vf.KarnoppParameters(
...     mass=1.6, viscous_friction=4865.0, coulomb_friction=150.0, static_friction=150.0,
...     spring_constant=2.05e5,
... )
>>> time = np.arange(4000) / 100
>>> pressure = 6.5e4 + 5e4 * np.sin(2 * np.pi * time / 10)
>>> stem = vf.simulate(valve, healthy, pressure, sample_period=0.01)
>>> result = vf.identify(vf.Recording(0.01, pressure, stem.position), valve)
>>> friction = result.parameters["coulomb_friction"]
>>> friction.verdict.value, bool(abs(friction.value - 150) < 1)
('identified', True)
>>> vf.compare(result, vf.Baseline(75.0)).level.name
'WARN'
"""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.front_door import (
        compare as compare,
        read_recording as read_recording,
        simulate as simulate,
    )
    from valve_friction_ros.health.baseline import Baseline as Baseline
    from valve_friction_ros.identification.methods import identify as identify
    from valve_friction_ros.identification.refusal import RefusalError as RefusalError
    from valve_friction_ros.identification.result import Result as Result
    from valve_friction_ros.identification.settings import (
        IdentificationSettings as IdentificationSettings,
    )
    from valve_friction_ros.identification.steps.step_response import step_test as step_test
    from valve_friction_ros.identification.steps.validation import validate as validate
    from valve_friction_ros.model.recording import (
        Recording as Recording,
        SensorNoise as SensorNoise,
    )
    from valve_friction_ros.model.valve import (
        KarnoppParameters as KarnoppParameters,
        Valve as Valve,
    )
    from valve_friction_ros.records.valve_file import read_valve_file as read_valve_file
else:
    __getattr__ = names_on_demand(__name__)

__version__ = "0.1.0"


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted({*globals(), *names_on_demand(__name__)("__all__")})
