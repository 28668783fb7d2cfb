# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""How far the numbers of a valve have moved away from those of its baseline."""

import math
from collections.abc import Mapping

from valve_friction_ros.health.measured import Measured

RATIOS = (
    "spring_constant",
    "coulomb_friction",
    "static_friction",
    "viscous_friction",
    "drive_noise",
    "stem_noise",
)
"""Numbers of which the ratio is compared: they are above zero."""

DIFFERENCES = {
    "spring_preload": "N",
    "slip_force": "N",
    "viscous_asymmetry": "1",
    "lower_stop": "m",
    "upper_stop": "m",
    "lag": "s",
}
"""Numbers of which the difference is compared, with their units."""


def _ratio(now: Measured, healthy: Measured) -> Measured | None:
    """Return a number over that of the baseline.

    The half widths of two independent measurements are shares that add in squares, and the interval
    is symmetric in the logarithm. Where the interval of a number reaches zero, that of the ratio
    has all quotients of the two intervals.
    """
    if not (now.value > 0 and healthy.value > 0):
        return None
    ratio, spread = now.value / healthy.value, math.hypot(now.share, healthy.share)
    if max(now.share, healthy.share) >= 1.0:
        least, healthy_least = (max(one.value - one.half_width, 0.0) for one in (now, healthy))
        low = least / (healthy.value + healthy.half_width)
        most = now.value + now.half_width
        return Measured.between(ratio, low, most / healthy_least if healthy_least else math.inf)
    return Measured.between(ratio, ratio * math.exp(-spread), ratio * math.exp(spread))


def difference(now: Measured, healthy: Measured) -> Measured:
    """Return a number less that of the baseline; independent half widths add in squares."""
    value, width = now.value - healthy.value, math.hypot(now.half_width, healthy.half_width)
    return Measured(value, width)


def valve_changes(
    now: Mapping[str, Measured], healthy: Mapping[str, Measured]
) -> dict[str, Measured]:
    """Return the change of each number that both have, by name: `RATIOS` and `DIFFERENCES`."""
    both = now.keys() & healthy.keys()
    changes = {name: _ratio(now[name], healthy[name]) for name in RATIOS if name in both}
    found = {name: change for name, change in changes.items() if change is not None}
    return found | {
        name: difference(now[name], healthy[name]) for name in DIFFERENCES if name in both
    }
