# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Limits that all methods share."""

import math

from valve_friction_ros.identification.trust.verdict import FALL_SPEED


def test_friction_may_fall_up_to_twice_the_stribeck_velocity_of_graphite():
    """v_s = 3.26 mm/s; exp(−(v/v_s)²) has fallen to e⁻⁴ at twice that."""
    assert math.isclose(FALL_SPEED, 2 * 3.26e-3, rel_tol=0.01)
