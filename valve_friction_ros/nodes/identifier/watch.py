# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What an identifier watches on its valve beside the identified friction."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from valve_friction_ros.health import Finding
from valve_friction_ros.streams import Arrivals


class Watch(Protocol):
    """Follows the samples of a valve, and adds to its diagnostics."""

    def take(self, arrivals: Arrivals) -> None:
        """Take samples, some 20 times a second, in the executor's thread; it must return soon."""

    def findings(self) -> Sequence[Finding]:
        """Return what is found on the valve now; each raises its level where it is more severe."""

    def values(self) -> Mapping[str, str]:
        """Return values of the diagnostics, the unit of a number in its key."""
