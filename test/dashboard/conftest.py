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
