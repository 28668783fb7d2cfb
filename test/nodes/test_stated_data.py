# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is stated of a valve, and what is not, over real topics."""

from live_nodes import NAMESPACE
from records import quick_record

from valve_friction_ros.model import LOW_FRICTION

NODE = f"{NAMESPACE}/identifier"
UNSTATED = dict.fromkeys(
    ("diaphragm_area", "pressure_reference", "travel", "pressure_minimum", "pressure_maximum")
)


def test_what_nobody_has_stated_is_said_until_somebody_does(live):
    live.start_identifier(UNSTATED)
    client = live.client
    assert client.parameters(NODE, *UNSTATED) == [None] * len(UNSTATED)
    client.identified(quick_record())
    values = client.last_values()
    assert values["assumed"] == ", ".join(UNSTATED)
    assert "newtons are of an assumed area" in values["warnings"]
    assert values["coulomb_friction verdict"] == "weak"
    assert values["coulomb_friction reason"] == "of an assumed area"
    assert client.trigger("set_baseline").success

    stated = {"diaphragm_area": 0.0445, "pressure_reference": 41740.0, "travel": 0.028575}
    assert client.set_together(NODE, stated).successful
    client.identified(quick_record())
    values = client.last_values()
    assert values["assumed"] == "pressure_minimum, pressure_maximum"
    assert values["coulomb_friction verdict"] == "identified"
    assert float(values["friction_ratio"]) == 1.0


def test_stated_data_are_compared_with_the_record(live):
    """The file of a valve says it as the file of a command does."""
    spring = LOW_FRICTION.spring_constant
    live.start_identifier({"spring_constant": spring / 2, "mass": 1.542})
    client = live.client
    client.identified(quick_record())
    values = client.last_values()
    assert "N/m by the record and 102500 N/m as stated: check diaphragm_area" in values["warnings"]
    assert values["coulomb_friction verdict"] == "weak"
    assert client.set_together(NODE, {"spring_constant": spring}).successful
    client.identified(quick_record())
    values = client.last_values()
    assert "as stated" not in values["warnings"]
    assert values["coulomb_friction verdict"] == "identified"


def test_impossible_stated_data_are_rejected(live):
    live.start_identifier()
    for name, value in (("mass", -1.0), ("spring_constant", 2e5 * 1e6)):
        result = live.client.set_together(NODE, {name: value})
        assert not result.successful
        assert name in result.reason
