# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The paper's bench valve with the three packings that every check uses.

Sources: section 4 and Table 1 ("model 1") for the valve and its Teflon packing, lightly and
strongly tightened; the bias of 1.13 mm follows (16). The graphite set shows a slip jump.
"""

from valve_friction_ros.model.karnopp_parameters import KarnoppParameters
from valve_friction_ros.model.valve import Valve

PRESSURE_RANGE = (41740.0, 206840.0)
"""Input range of the bench, Pa: 0 % and 100 % of the paper's excitations."""

BENCH_VALVE = Valve(
    diaphragm_area=0.0445,
    pressure_reference=PRESSURE_RANGE[0],
    travel=0.028575,
    pressure_minimum=0.0,
    pressure_maximum=250000.0,
)
"""Fisher ET globe valve; force counts from the bottom of the pressure range."""

_POSITION_BIAS = 1.13e-3
"""x̄, m: the mean of (16)."""

_SPRING_CONSTANT = 2.05e5
"""k of Table 1, model 1, N/m."""

LOW_FRICTION = KarnoppParameters(
    mass=1.542,
    viscous_friction=4865.0,
    coulomb_friction=152.7,
    static_friction=152.7,
    spring_constant=_SPRING_CONSTANT,
    spring_preload=_SPRING_CONSTANT * _POSITION_BIAS,
)
"""Packing lightly tightened: Table 1, model 1."""

HIGH_FRICTION = KarnoppParameters(
    mass=1.75,
    viscous_friction=4.48e4,
    coulomb_friction=606.0,
    static_friction=606.0,
    spring_constant=_SPRING_CONSTANT,
    spring_preload=_SPRING_CONSTANT * _POSITION_BIAS,
)
"""Packing strongly tightened: Table 1, model 1."""

GRAPHITE_VALVE = Valve(
    diaphragm_area=BENCH_VALVE.diaphragm_area,
    pressure_reference=0.0,
    travel=BENCH_VALVE.travel,
    pressure_minimum=BENCH_VALVE.pressure_minimum,
    pressure_maximum=BENCH_VALVE.pressure_maximum,
)
"""The same body with a gauge pressure sensor, for the graphite packing."""

GRAPHITE_PACKING = KarnoppParameters(
    mass=1.6,
    viscous_friction=7.05e4,
    coulomb_friction=665.4,
    static_friction=942.4,
    spring_constant=2.069e5,
    spring_preload=2571.0,
)
"""Graphite packing: static above Coulomb friction, so the stem jumps as it breaks away."""
