# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A valve in service that nobody strokes: its moves add up, and survive a kill."""

from dataclasses import replace

import numpy as np
import pytest
from histories import VALVE
from live_nodes import NAMESPACE, values_of
from records import quick_record
from service import VALVE as BUILT
from service import signals

from valve_friction_ros.history import HistoryFile, read_moves
from valve_friction_ros.model import LOW_FRICTION

NODE = f"{NAMESPACE}/identifier"
PERIOD = 60.0
SECURE = {"timing_uncertainty": 0.01}
CYCLE = np.array([0.42, 0.45, 0.48, 0.51, 0.48, 0.45]) * BUILT.travel
MOVES = 48
WARN = b"\x01"


def serve(client, first, friction):
    """Publish the samples around some moves, one a minute, from move number `first` on."""
    places = np.resize(CYCLE, MOVES + 1)
    stamps, pressure, position = signals(
        places, friction, period=PERIOD, rate=10.0, whole=False, start=first * PERIOD
    )
    client.send((stamps, pressure), (stamps, position))


def number(values, key):
    return float(values.get(f"evidence {key}", "nan"))


def test_it_adds_up_and_survives_a_kill(live, tmp_path):
    history = HistoryFile(tmp_path / "valve_friction_ros" / "history.sqlite")
    node, client = live.start_identifier(SECURE), live.client

    def in_file():
        return read_moves(history, VALVE.name, BUILT)

    refused = client.trigger("set_baseline")
    assert not refused.success
    assert "the moves in service are no baseline yet: 0 moves up and 0 down" in refused.message
    serve(client, 0, 300.0)
    values = client.status_values(
        lambda status: number(values_of(status), "sliding_friction [N]") > 0, "an estimate"
    )
    friction, width = (
        number(values, f"sliding_friction{what} [N]") for what in ("", " half width")
    )
    assert abs(friction - 300.0) < width < 30.0
    assert number(values, "dead_band [%]") == pytest.approx(600 / 2.05e5 / 0.028575 * 100, rel=0.1)
    client.wait_until(lambda: len(in_file()) >= MOVES - 3, "moves in the history")
    answer = client.trigger("set_baseline")
    assert answer.success, answer.message
    assert "moves in service since 2023-11-14" in answer.message
    node.kill()
    live.nodes.remove(node)
    client.watched.clear()

    kept = in_file()
    live.start_identifier(SECURE)
    values = client.status_values(
        lambda status: values_of(status).get("evidence moves") == str(len(kept)), "all moves"
    )
    assert number(values, "sliding_friction [N]") == pytest.approx(300.0, rel=0.02)
    assert number(values, "friction_ratio") == pytest.approx(1.0, rel=0.02)
    assert float(values["baseline_sliding_friction [N]"]) == pytest.approx(300.0, rel=0.02)

    serve(client, MOVES, 450.0)
    status = client.next_status(
        lambda status: "friction has grown: sliding friction" in status.message, "the growth"
    )
    values = values_of(status)
    assert status.level == WARN
    assert values["NE 107"] == "M"
    assert number(values, "change_ratio low") < 1.5 < number(values, "change_ratio high")
    assert number(values, "friction_ratio low") > 1.25
    refused = client.trigger("set_baseline")
    assert not refused.success
    assert "the valve is in WARN" in refused.message


def test_the_newer_of_identification_and_moves_leads_and_is_the_baseline(live, tmp_path):
    """A record of 300 N at 22:13 is followed by moves of 300 N, and then by moves of 450 N."""
    packing = replace(
        LOW_FRICTION, coulomb_friction=300.0, static_friction=300.0, viscous_friction=500.0
    )
    history = HistoryFile(tmp_path / "valve_friction_ros" / "history.sqlite")
    live.start_identifier(SECURE)
    client = live.client
    client.identified(quick_record(packing))
    answer = client.trigger("set_baseline")
    assert answer.message.endswith("(by the identification of 2023-11-14 22:13 UTC)")
    assert client.trigger("reset_usage").success  # the strokes of the record are no evidence
    serve(client, 1, 300.0)
    client.status_values(
        lambda status: number(values_of(status), "reference [N]") > 0, "a reference"
    )
    serve(client, 1 + MOVES, 450.0)
    status = client.next_status(lambda status: "has grown" in status.message, "the growth")
    assert status.message.startswith("friction has grown: sliding friction")
    dated = " (identified earlier, 2023-11-14 22:13 UTC)"
    _, _, before = status.message.partition("; friction normal: coulomb friction is 1.00")
    assert dated in before
    assert client.set_together(NODE, {"baseline_in_alarm": True}).successful
    answer = client.trigger("set_baseline")
    assert answer.success, answer.message
    assert "newer than the identification of 2023-11-14 22:13 UTC)" in answer.message
    kept = history.baseline(VALVE.name).baseline
    assert kept.sliding.value == pytest.approx(450.0, rel=0.05)
    assert kept.coulomb_friction is None
    assert kept.numbers["spring_constant"].value == pytest.approx(2.05e5, rel=0.01)


def test_another_actuator_makes_other_forces(shared):
    shared.start_identifier()
    client = shared.client
    serve(client, 0, 300.0)
    client.next_status(lambda status: number(values_of(status), "moves") > 40, "the moves")
    node = f"{NAMESPACE}/identifier"
    assert client.set_together(node, {"diaphragm_area": 0.05}).successful
    client.next_status(lambda status: number(values_of(status), "moves") == 0, "no moves")


def test_a_renewed_packing_and_a_wrong_stamp(live):
    live.start_identifier(SECURE)
    client = live.client
    serve(client, 0, 300.0)
    before = client.status_values(
        lambda status: number(values_of(status), "reference [N]") > 0, "a reference"
    )
    assert number(before, "reference [N]") == pytest.approx(300.0, rel=0.03)
    node = f"{NAMESPACE}/identifier"
    changed = client.set_together(node, {"travel": 0.03})
    assert changed.successful, changed.reason
    serve(client, -100_000, 300.0)
    left = client.status_values(
        lambda status: "evidence left_out" in values_of(status), "moves left out"
    )
    assert number(left, "moves") >= number(before, "moves")
    answer = client.trigger("reset_usage")
    assert "its moves count no more as evidence" in answer.message
    renewed = client.status_values(lambda status: number(values_of(status), "moves") == 0, "none")
    assert "evidence reference [N]" not in renewed
    serve(client, MOVES, 450.0)
    after = client.status_values(
        lambda status: number(values_of(status), "reference [N]") > 0, "another reference"
    )
    assert number(after, "reference [N]") == pytest.approx(450.0, rel=0.03)
    assert "evidence change_ratio" not in after
