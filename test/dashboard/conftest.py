# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Made-up valves of a plant."""

import pytest
from simulated_plant import hear, values_of_valve

from valve_friction_ros.dashboard import Plant, Status


@pytest.fixture
def plant():
    """Nine made-up valves, of each kind one, heard at time 100 s; silent after 5 s."""
    made = Plant(silence=5.0)
    for index in range(9):
        hear(made, Status(*values_of_valve(index)), 100.0)
    return made
