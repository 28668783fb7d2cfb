# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The valve, its friction model and its simulation; no ROS."""

from typing import TYPE_CHECKING

from valve_friction_ros.on_demand import names_on_demand

if TYPE_CHECKING:
    from valve_friction_ros.model.drive import DEFAULT_LAG as DEFAULT_LAG, Drive as Drive
    from valve_friction_ros.model.excitations import (
        BENCH_VALVE as BENCH_VALVE,
        GRAPHITE_PACKING as GRAPHITE_PACKING,
        GRAPHITE_VALVE as GRAPHITE_VALVE,
        HIGH_FRICTION as HIGH_FRICTION,
        LOW_FRICTION as LOW_FRICTION,
        PRESSURE_RANGE as PRESSURE_RANGE,
        Excitation as Excitation,
        IsaSteps as IsaSteps,
        SampledPressure as SampledPressure,
        SineWave as SineWave,
        SquareWave as SquareWave,
        TriangleWave as TriangleWave,
    )
    from valve_friction_ros.model.recording import (
        Recording as Recording,
        SensorNoise as SensorNoise,
        converter_response as converter_response,
    )
    from valve_friction_ros.model.simulation import (
        StemState as StemState,
        Trajectory as Trajectory,
        advance as advance,
        balanced_state as balanced_state,
        compile_kernels as compile_kernels,
        simulate as simulate,
    )
    from valve_friction_ros.model.valve import (
        KarnoppParameters as KarnoppParameters,
        Valve as Valve,
    )
else:
    __getattr__ = names_on_demand(__name__)
