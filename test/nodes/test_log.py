# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a node logs: that it is ready, each identification, baseline and change of level, once."""

from live_nodes import NAMESPACE
from records import quick_record


def lines(process, words):
    return [line for line in process.errors.splitlines() if words in line]


def test_each_event_is_logged_once(live):
    process = live.start_identifier({"input_timeout": 1.0})
    client, node = live.client, f"{NAMESPACE}/identifier"
    client.wait_until(lambda: lines(process, "ready"), "the ready line")
    client.wait_until(lambda: lines(process, "level OK → WARN"), "a change of level")
    refusal = client.trigger("identify").message
    assert f"no data on {NAMESPACE}/actuator_pressure for" in refusal
    assert "its publisher is silent" in refusal
    assert "no samples of actuator_pressure" in refusal
    # A patient node is content with old samples, so that no slow machine adds changes of level.
    assert client.set_together(node, {"input_timeout": 600.0}).successful
    answer = client.identified(quick_record())
    client.wait_until(lambda: lines(process, "level WARN → OK"), "a content node")
    baseline = client.trigger("set_baseline").message
    assert client.set_together(node, {"input_timeout": 1.0}).successful
    client.wait_until(lambda: len(lines(process, "level OK → WARN")) == 2, "silence again")
    (ready,) = lines(process, "ready")
    assert f"{NAMESPACE}/actuator_pressure and {NAMESPACE}/stem_state" in ready
    identified = lines(process, "identified: ")
    assert answer.split("; ")[-1] in identified[-1]
    assert len(lines(process, baseline)) == 1
    assert len(lines(process, "level WARN → OK")) == 1
