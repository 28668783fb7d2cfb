# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""`stem_command` over DDS: moves in service, their figures, limits and blame."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from live_nodes import NAMESPACE, PROJECT, SECOND, START, STREAM, time_of, values_of
from rclpy.duration import Duration
from records import quick_record
from sensor_msgs.msg import JointState

from valve_friction_ros.history import HistoryFile, read_answers

NODE = f"{NAMESPACE}/identifier"
OK, WARN = b"\x00", b"\x01"
TRAVEL = 0.028575
RATE = 20
LEVELS = (0.5, 0.55, 0.5, 0.6, 0.503, 0.563, 0.453)
HOLD = 15.0


def commander(live):
    publisher = live.client.node.create_publisher(JointState, f"{NAMESPACE}/stem_command", STREAM)
    live.client.wait_until(publisher.get_subscription_count, "a subscription to the command")

    def send(scale):
        for place, level in enumerate(LEVELS):
            message = JointState(name=["stem"], position=[scale * level])
            message.header.stamp = time_of(START + round(place * HOLD * SECOND))
            publisher.publish(message)
        assert publisher.wait_for_all_acked(Duration(seconds=40))

    return send


def answer(dead_time, lag):
    """Stamps, pressure and position of a stem that follows its pressure, behind the command."""
    times = np.arange(0, HOLD * len(LEVELS), 1 / RATE)
    share = np.full(times.size, LEVELS[0])
    for place in range(1, len(LEVELS)):
        since = times - place * HOLD - dead_time
        begun = since >= 0
        start = share[np.flatnonzero(begun)[0] - 1] if begun.any() else 0.0
        share[begun] = LEVELS[place] + (start - LEVELS[place]) * np.exp(-since[begun] / lag)
    stamps = START + np.round(times * SECOND).astype(np.int64)
    noise = np.random.default_rng(3).standard_normal(times.size)
    return stamps, 8e4 + 1.3e5 * share + 20 * noise, TRAVEL * (share + 1e-5 * noise[::-1])


@pytest.mark.parametrize(("unit", "scale"), [("m", TRAVEL), ("'%'", 100.0)])
def test_moves_in_service(live, unit, scale):
    live.start_identifier({"command_unit": unit, "window": 3600.0})
    client = live.client
    assert "moves" not in client.status_values()
    commander(live)(scale)
    stamps, pressure, position = answer(1.0, 0.5)
    client.send((stamps, pressure), (stamps, position))
    status = client.next_status(lambda one: values_of(one).get("moves") == "6", "six moves")
    values = values_of(status)
    assert status.level == OK
    assert values["moves ignored"] == "0"
    assert float(values["dead_time [s]"]) == pytest.approx(1.0, abs=0.1)
    assert float(values["T63 [s]"]) == pytest.approx(1.5, abs=0.1)
    assert float(values["T86 [s]"]) == pytest.approx(2.0, abs=0.1)
    assert abs(float(values["steady_error [%]"])) < 0.1
    assert float(values["command deviation 95th percentile [%]"]) < 12.0
    assert values["dead_time cause"] == "unknown"  # three slow moves are too few
    assert client.set_together(NODE, {"dead_time_limit": 0.8}).successful
    status = client.next_status(lambda one: one.level == WARN, "a late stem")
    assert values_of(status)["NE 107"] == "M"
    assert "after its command (median of 6 moves, limit 0.8 s)" in status.message
    assert "the pressure itself responds late: check the positioner" in status.message


def test_the_figures_outlive_a_kill(live, tmp_path):
    """They are kept, shown by a node that hears no command yet, in its page and by a command."""
    slow = {"window": 3600.0, "dead_time_limit": 0.8}
    node, client = live.start_identifier(slow), live.client
    commander(live)(TRAVEL)
    stamps, pressure, position = answer(1.0, 0.5)
    client.send((stamps, pressure), (stamps, position))

    def is_late(status):  # after the last of its moves
        return status.level == WARN and values_of(status)["moves"] == "6"

    before = values_of(client.next_status(is_late, "a late stem"))
    file = HistoryFile(tmp_path / "valve_friction_ros" / "history.sqlite")
    client.wait_until(lambda: len(read_answers(file, NODE)) == 6, "the moves in the history")
    live.kill(node)

    live.start_identifier({**slow, "method": "bench"})
    status = client.next_status(lambda one: "moves" in values_of(one), "the moves of before")
    after = values_of(status)
    assert status.level == WARN
    assert "after its command (median of 6 moves, limit 0.8 s)" in status.message
    same = ("moves", "moves until [time]", "dead_time [s]", "T63 high [s]", "dead_time cause")
    assert [after[key] for key in same] == [before[key] for key in same]
    assert after["moves until [time]"] == "2023-11-14T22:14:50Z"
    client.identified(quick_record())
    page = Path(client.trigger("report").message).read_text(encoding="utf-8")
    assert "Answer to the command" in page
    assert "latest 6 steps of stem_command, from 2023-11-14 22:13 to 2023-11-14 22:14" in page
    shown = subprocess.run(
        [sys.executable, "-m", "valve_friction_ros", "history", str(file.path)],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert "stem_command: 6 steps, 0 ignored; medians: dead time 1" in shown.stdout, shown.stderr
    assert client.trigger("reset_usage").success
    client.status_values(lambda one: values_of(one)["moves"] == "0", "a new packing")
    assert client.next_status().level == OK
    assert read_answers(file, NODE) == ()


def test_without_a_command_nothing_is_said(live):
    live.start_identifier({"dead_time_limit": 0.1, "window": 3600.0})
    stamps, pressure, position = answer(0.5, 0.5)
    live.client.send((stamps, pressure), (stamps, position))
    live.client.wait_for_buffered(2 * stamps.size)
    status = live.client.next_status()
    shown = [
        key for key in values_of(status) if not key.startswith(("evidence ", "baseline_lacks "))
    ]
    assert not [key for key in shown if "command" in key or "moves" in key]
    assert "command" not in status.message


def test_commands_that_are_none_do_no_harm(live):
    live.start_identifier({"window": 3600.0})
    publisher = live.client.node.create_publisher(JointState, f"{NAMESPACE}/stem_command", STREAM)
    live.client.wait_until(publisher.get_subscription_count, "a subscription to the command")
    stamps, pressure, position = answer(0.5, 0.5)
    for command in ([], [math.nan], [1e300]):
        publisher.publish(JointState(position=command))
    live.client.send((stamps, pressure), (stamps, position))
    live.client.wait_for_buffered(2 * stamps.size)
    status = live.client.next_status()
    assert status.level == OK, status.message
    assert "moves" not in values_of(status)
    assert "1e+300 m is no place" in values_of(status)["stem_command problem"]
