# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The node that plays a stroke test, as a process."""

import pytest
from live_nodes import LATCHED, NAMESPACE, SECOND, START, STREAM
from sensor_msgs.msg import FluidPressure
from std_msgs.msg import String

HOME = 1e5
ROWS = ((0.0, HOME), (0.5, HOME), (2.5, 1.4e5), (600.0, 1.4e5))
NODE = f"{NAMESPACE}/stroke_player"


@pytest.fixture
def player(live, tmp_path):
    """A player; `signals` keeps its signals coming, at the position `live.position`."""
    file = tmp_path / "test.csv"
    file.write_text("time_s,pressure_pa\n" + "".join(f"{t},{p}\n" for t, p in ROWS))
    live.set_points = live.client.listen(FluidPressure, f"{NAMESPACE}/pressure_set_point", STREAM)
    live.states = live.client.listen(String, f"{NODE}/state", LATCHED)
    parameters = {"file": str(file), "file_minimum": 0.9e5, "file_maximum": 1.5e5, "silence": 5.0,
                  "position_minimum": 0.002, "position_maximum": 0.02}  # fmt: skip
    live.player = live.start("stroke_player", parameters)
    live.position, live.sent = 0.01, 0
    live.client.connect()
    return live


def signals(live):
    """Send a sample of each signal."""
    live.sent += 1
    live.client.send_pressure(START + live.sent * SECOND // 100, 1.1e5)
    live.client.send_stem(START + live.sent * SECOND // 100, live.position)


def wait(live, condition, what):
    """Wait while the signals come."""

    def met():
        signals(live)
        return condition()

    live.client.wait_until(met, what)


def last(live):
    return live.set_points[-1].fluid_pressure if live.set_points else None


def test_it_plays_when_asked_and_goes_back_by_limit_and_by_its_end(player):
    live = player
    assert not live.client.trigger("start", NODE).success  # no signal has come
    wait(live, lambda: live.sent > 50, "signals")
    assert last(live) is None  # and nothing begins by itself
    answer = live.client.trigger("start", NODE)
    assert answer.success, answer.message
    wait(live, lambda: last(live) == 1.4e5, "the highest set point")
    values = [one.fluid_pressure for one in live.set_points]
    assert values[0] == HOME
    assert values == sorted(values)
    live.position = 0.0201
    wait(live, lambda: last(live) == HOME, "the way back")
    wait(live, lambda: "beyond its limit of 0.02 m" in live.states[-1].data, "the state")
    live.position = 0.01
    wait(live, lambda: live.sent % 50 == 0, "good signals")
    assert live.client.trigger("start", NODE).success
    wait(live, lambda: last(live) > 1.2e5, "set points")
    live.player.interrupt()
    live.player.require_good_end()
    live.client.drain()
    assert last(live) == HOME
