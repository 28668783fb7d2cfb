# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Limits of the verdicts of all methods."""

FALL_SPEED = 6.5e-3
"""Speed, m/s, up to which friction may fall: twice the v_s = 3.26 mm/s published for graphite.

At 2·v_s the fall is complete but for e⁻⁴ = 2 %. A slower record does not separate F_c from the
friction at low speed. An absolute size from one packing, applied to every valve."""

NO_SLIP = "no slip jump in the record: F_s cannot be separated from F_c"
"""Reason of a static friction that is not identifiable."""
