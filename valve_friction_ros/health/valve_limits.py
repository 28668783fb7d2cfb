# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""How far the numbers of a valve may move away from those of its baseline."""

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class ValveLimits:
    """Bounds of the change of a valve, beside those of its friction (`FrictionLimits`).

    A bound counts as passed only when the whole interval of the change lies beyond it.

    Attributes
    ----------
    spring_change, spring_failure : float
        Change of the spring constant, as a share, that is worth a look, and that is a failure.
    preload_change : float
        Shift of the balance, as a share of the spring's force over the travel.
    slip_change : float
        Growth of the slip jump (F_s − F_c)/k, as a share of the travel.
    viscous_factor : float
        Factor, up or down, of the viscous friction.
    asymmetry_change : float
        Change of the share by which viscous friction is larger upward.
    stop_change : float
        Shift of a travel stop, as a share of the travel.
    noise_factor : float
        Factor, upward, of the noise of a sensor.
    lag_change : float
        Change of the lag of the stem behind the pressure, s.

    Raises
    ------
    ValueError
        If a limit is not above zero, a factor is not above 1, or the spring's two are out of order.

    Notes
    -----
    No standard gives such bounds; the defaults are chosen. Springs keep their constant within some
    percent for decades, so 15 % is a fault of spring or scale, and 30 % is one spring of three.
    3 % of the balance is above the drift of industrial sensors and below the usual margin of a
    bench set. A slip jump of 1 % more of the travel is as large as the steps that a loop commonly
    makes. A stop that has moved by 2 % no longer shuts, or opens, as it did. Viscous friction
    trades with the lag and changes with the temperature, so only a factor of 2 counts.
    """

    spring_change: float = 0.15
    spring_failure: float = 0.30
    preload_change: float = 0.03
    slip_change: float = 0.01
    viscous_factor: float = 2.0
    asymmetry_change: float = 0.2
    stop_change: float = 0.02
    noise_factor: float = 2.0
    lag_change: float = 0.02

    def __post_init__(self) -> None:
        """Refuse impossible limits."""
        for name in (one.name for one in fields(self)):
            least = 1.0 if name.endswith("factor") else 0.0
            if not (value := getattr(self, name)) > least:
                raise ValueError(f"{name} must be above {least:g}, got {value:g}")
        if not self.spring_change < self.spring_failure < 1:
            raise ValueError(
                "limits must obey spring_change < spring_failure < 1, got spring_change "
                f"{self.spring_change:g}, spring_failure {self.spring_failure:g}"
            )
