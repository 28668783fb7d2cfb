# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Topics of a status, which anybody may publish, are subscribed to both or not at all."""

import numpy as np
import pytest

from valve_friction_ros.dashboard.live_state import Sources
from valve_friction_ros.nodes.dashboard import node
from valve_friction_ros.nodes.dashboard.node import WatchedSignals


class Node:
    """Counts its subscriptions."""

    def __init__(self):
        self.open = []


class Subscription:
    """Refuses what rclpy refuses."""

    def __init__(self, node, _kind, topic, _quality, **_):
        if " " in topic:
            raise ValueError("Invalid topic name: has a space:\n  a second line")
        self._node, self._topic = node, topic
        node.open.append(topic)

    def end(self):
        self._node.open.remove(self._topic)

    def take(self):
        return []


@pytest.fixture(autouse=True)
def subscriptions(monkeypatch):
    monkeypatch.setattr(node, "PolledSubscription", Subscription)


@pytest.mark.parametrize("topics", [("no topic", "/stem"), ("/pressure", "no topic")])
def test_a_name_that_is_none_is_told_and_leaves_nothing_open(topics):
    node, heard = Node(), {"/v/identifier": Sources(*topics, "stem")}
    signals = WatchedSignals(heard.__getitem__)
    strip = signals.watch("/v/identifier")
    for _ in range(3):
        signals.step(node)
    assert node.open == []
    assert strip.note() == "'no topic' cannot be subscribed to: Invalid topic name: has a space:"
    heard["/v/identifier"] = Sources("/pressure", "/stem", "stem")
    signals.step(node)
    assert node.open == ["/pressure", "/stem"]
    assert strip.trouble == ""
    strip.add(0, np.array([1]), np.array([1.0]))
    signals.unwatch("/v/identifier")
    signals.step(node)
    assert node.open == []
