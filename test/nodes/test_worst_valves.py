# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The small dashboard in `examples/`, beside a live node."""

from live_nodes import PROJECT
from records import quick_record

from valve_friction_ros.model import HIGH_FRICTION

SCRIPT = PROJECT / "examples" / "worst_valves.py"


def test_it_shows_a_valve_and_what_becomes_of_it(live):
    live.start_identifier({"valve_tag": "FV-101"})
    shown = live.start("worst_valves", script=SCRIPT, namespace=None)
    client = live.client
    client.wait_until(lambda: "OK    FV-101" in shown.output, "the valve")
    client.identified(quick_record())
    assert client.trigger("set_baseline").success
    client.identified(quick_record(HIGH_FRICTION))
    client.wait_until(lambda: "ERROR FV-101" in shown.output, "the alarm")
    assert shown.output.splitlines()[-1].split()[2:5] == ["NE", "107", "F"]
