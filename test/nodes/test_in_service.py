# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A valve in service over DDS: its usage, moves and answers to commands, counted and kept."""

from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from histories import VALVE
from live_nodes import NAMESPACE, NODE, OK, PROJECT, SECOND, START, STREAM, WARN, time_of, values_of
from processes import ran
from rclpy.duration import Duration
from records import quick_record
from sensor_msgs.msg import JointState
from service import VALVE as BUILT
from service import signals

from valve_friction_ros.history import HistoryFile, read_answers, read_moves, read_usage
from valve_friction_ros.model import BENCH_VALVE, LOW_FRICTION
from valve_friction_ros.streams import DAY

TRAVEL = BENCH_VALVE.travel
PERIOD = 10 * SECOND
DISTANCE = "travelled_distance [m]"


def strokes(count, samples=64):
    """Full strokes, a stroke in `samples` samples, and the stem ends where it began."""
    one = np.linspace(0.0, TRAVEL, samples, endpoint=False)
    return np.concatenate([one if n % 2 == 0 else TRAVEL - one for n in range(count)])


def send(client, position, start=START, period=PERIOD):
    client.send(position=(start + period * np.arange(position.size), position))
    return start + period * position.size


def shown(client, key, value):
    """Wait until a value of the diagnostics is there; the values."""
    return client.status_values(
        lambda status: values_of(status).get(key) == value, f"{key} = {value}"
    )


@pytest.mark.slow
def test_usage_is_shown_kept_and_goes_on(live, history):
    client = live.client_of_identifier()
    after = send(client, strokes(16))  # 1024 samples: four blocks
    values = shown(client, "reversals", "15")
    far = 15 * TRAVEL + TRAVEL * 63 / 64
    assert float(values[DISTANCE]) == pytest.approx(far, rel=1e-6)
    assert float(values["strokes"]) == pytest.approx(far / TRAVEL, rel=1e-6)
    assert float(values["time_watched [s]"]) == 10230
    histogram = [float(one) for one in values["travel_histogram [s]"].split(",")]
    assert sum(histogram) == 10230
    assert float(values["time_near_seat [s]"]) == histogram[0] > 0
    assert float(values["counting_dead_band [mm]"]) >= 0.28
    assert values["packing_renewed [date]"] == "not known"
    assert client.set_together(NODE, {"air_to": "close"}).successful
    assert client.status_values()["time_near_seat [s]"] == f"{histogram[-1]:g}"
    client.wait_until(
        lambda: history.path.exists() and read_usage(history, NODE).days, "rows of the usage"
    )
    send(client, strokes(4), after)
    shown(client, "reversals", "19")
    client.wait_until(lambda: read_usage(history, NODE).total.reversals == 19, "the last rows")
    kept = read_usage(history, NODE)
    live.kill(live.nodes[-1])
    assert read_usage(history, NODE) == kept

    live.start_identifier()  # the same stamps once more are as good as new ones
    values = shown(client, "reversals", "19")
    assert float(values[DISTANCE]) == pytest.approx(kept.total.distance)
    send(client, strokes(16))
    values = shown(client, "reversals", "34")
    assert float(values[DISTANCE]) == pytest.approx(kept.total.distance + far, rel=1e-6)


def test_a_renewed_packing_counts_anew(live, history):
    client = live.client_of_identifier()
    after = send(client, strokes(8))
    shown(client, "reversals", "7")
    answer = client.success("reset_usage")
    assert "the previous packing, of unknown age: 0.228" in answer
    assert "7 reversals" in answer
    values = client.last_values()
    assert (values["reversals"], values["reversals in all"]) == ("0", "7")
    assert values["packing_renewed [date]"] != "not known"
    assert read_usage(history, NODE).renewal > 0
    assert read_usage(history, NODE).total.reversals == 7
    assert read_usage(history, NODE).since_renewal.reversals == 0
    send(client, strokes(8), after)
    values = shown(client, "reversals in all", "15")
    assert values["reversals"] == "8"


def test_a_node_that_is_stopped_keeps_all(live, history):
    node = live.start_identifier()
    client = live.client
    send(client, strokes(4, samples=16), START)  # less than a block
    client.wait_for_buffered(7)  # of 64 samples the last window
    live.client.watched.clear()
    node.stop()
    assert read_usage(history, NODE).total.reversals == 3


def test_a_warning_of_a_packing_outlives_a_rest_and_a_restart(live, history):
    """While the valve rests the expected date recedes; only a renewed packing ends the warning."""
    client = live.client_of_identifier({"reversal_limit": 500.0})
    samples = DAY // (2 * PERIOD) + 64  # two days
    position = np.tile(strokes(2, samples=128), -(-samples // 256))[:samples]
    after = send(client, position, period=4 * PERIOD)
    status = client.next_status(lambda one: "packing life" in one.message, "a warning")
    assert status.level == WARN
    rest = after + 600 * SECOND * np.arange(1, 1500)
    client.send(position=(rest, np.zeros(rest.size)))
    client.wait_until(
        lambda: read_usage(history, NODE).total.time_watched > 9 * DAY, "the rest in the history"
    )
    live.restart({"reversal_limit": 500.0})
    status = client.next_status(lambda one: "packing life" in one.message, "the same warning")
    assert (status.level, values_of(status)["NE 107"]) == (WARN, "M")
    expected = values_of(status)["reversal_limit_expected [date]"]
    assert (date.fromisoformat(expected) - date.today()).days > 31
    assert client.trigger("reset_usage").success
    status = client.next_status(lambda one: "packing life" not in one.message, "a new packing")
    assert status.level == OK


def test_a_machine_without_stops(live):
    live.start_identifier({"travel": ".inf"})
    values = live.client.status_values()
    assert values["usage"] == "not counted, because the travel is not finite: set travel"
    assert DISTANCE not in values


def test_earlier_runs_that_cannot_be_read_at_first(live, tmp_path):
    """The totals are those of this run and say so, until the file can be read."""
    blocked = tmp_path / "blocked"
    blocked.touch()
    history = HistoryFile(blocked / "history.sqlite")
    client = live.client_of_identifier({"history_file": history.path})
    after = send(client, strokes(8))
    values = shown(client, "reversals", "7")
    assert values["usage"] == "for this run only, because the history cannot be read"
    blocked.unlink()
    after = send(client, strokes(8), after)
    after = send(client, strokes(8), after)
    client.next_status(lambda one: "usage" not in values_of(one), "all of the usage")
    send(client, strokes(8), after)
    client.wait_until(
        lambda: history.path.exists() and read_usage(history, NODE).total.reversals == 31,
        "all rows",
    )


MINUTE = 60.0
SECURE = {"timing_uncertainty": 0.01}
CYCLE = np.array([0.42, 0.45, 0.48, 0.51, 0.48, 0.45]) * BUILT.travel
MOVES = 48


def serve(client, first, friction):
    """Publish the samples around some moves, one a minute, from move number `first` on."""
    places = np.resize(CYCLE, MOVES + 1)
    stamps, pressure, position = signals(
        places, friction, period=MINUTE, rate=10.0, whole=False, start=first * MINUTE
    )
    client.send((stamps, pressure), (stamps, position))


def number(values, key):
    return float(values.get(f"evidence {key}", "nan"))


@pytest.mark.slow
def test_it_adds_up_and_survives_a_kill(live, history):
    client = live.client_of_identifier(SECURE)

    def in_file():
        return read_moves(history, VALVE.name, BUILT)

    refused = client.refusal("set_baseline")
    assert refused.startswith("the valve has no result")
    assert "moves in service cannot be the baseline yet: 0 moves up and 0 down" in refused
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
    assert "moves in service since 2023-11-14" in client.success("set_baseline")
    live.kill(live.nodes[-1])

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
    assert "the valve is in WARN" in client.refusal("set_baseline")


def test_the_newer_of_identification_and_moves_leads_and_is_the_baseline(live, history):
    """A record of 300 N at 22:13 is followed by moves of 300 N, and then by moves of 450 N."""
    packing = replace(
        LOW_FRICTION, coulomb_friction=300.0, static_friction=300.0, viscous_friction=500.0
    )
    client = live.client_of_identifier(SECURE)
    client.identified(quick_record(packing))
    answer = client.success("set_baseline")
    assert answer.endswith("(by the identification of 2023-11-14 22:13 UTC)")
    assert client.trigger("reset_usage").success  # the strokes of the record are no evidence
    serve(client, 1, 300.0)
    client.status_values(
        lambda status: number(values_of(status), "reference [N]") > 0, "a reference"
    )
    serve(client, 1 + MOVES, 450.0)
    status = client.next_status(lambda status: "has grown" in status.message, "the growth")
    assert status.message.startswith("friction has grown: sliding friction")
    dated = " (identified earlier, 2023-11-14 22:13 UTC)"
    _, _, before = status.message.partition("; friction normal: Coulomb friction is 1.00")
    assert dated in before
    assert client.set_together(NODE, {"baseline_in_alarm": True}).successful
    answer = client.success("set_baseline")
    assert "newer than the identification of 2023-11-14 22:13 UTC)" in answer
    kept = history.baseline(VALVE.name).baseline
    assert kept.sliding.value == pytest.approx(450.0, rel=0.05)
    assert kept.coulomb_friction is None
    assert kept.numbers["spring_constant"].value == pytest.approx(2.05e5, rel=0.01)


@pytest.mark.slow
def test_a_renewed_packing_a_wrong_stamp_and_another_actuator(live):
    client = live.client_of_identifier(SECURE)
    serve(client, 0, 300.0)
    before = client.status_values(
        lambda status: number(values_of(status), "reference [N]") > 0, "a reference"
    )
    assert number(before, "reference [N]") == pytest.approx(300.0, rel=0.03)
    changed = client.set_together(NODE, {"travel": 0.03})
    assert changed.successful, changed.reason
    serve(client, -100_000, 300.0)
    left = client.status_values(
        lambda status: "evidence left_out" in values_of(status), "moves left out"
    )
    assert number(left, "moves") >= number(before, "moves")
    assert "its moves are no longer used as evidence" in client.success("reset_usage")
    renewed = client.status_values(lambda status: number(values_of(status), "moves") == 0, "none")
    assert "evidence reference [N]" not in renewed
    serve(client, MOVES, 450.0)
    after = client.status_values(
        lambda status: number(values_of(status), "reference [N]") > 0, "another reference"
    )
    assert number(after, "reference [N]") == pytest.approx(450.0, rel=0.03)
    assert "evidence change_ratio" not in after
    assert client.set_together(NODE, {"diaphragm_area": 0.05}).successful  # makes other forces
    client.next_status(lambda status: number(values_of(status), "moves") == 0, "no moves")


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
    client = live.client_of_identifier({"command_unit": unit, "window": 3600.0})
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
    assert "the actuator pressure itself responds late: check the positioner" in status.message


@pytest.mark.slow
def test_the_figures_outlive_a_kill(live, history):
    """They are kept, shown by a node that hears no command yet, in its page and by a command."""
    slow = {"window": 3600.0, "dead_time_limit": 0.8}
    client = live.client_of_identifier(slow)
    commander(live)(TRAVEL)
    stamps, pressure, position = answer(1.0, 0.5)
    client.send((stamps, pressure), (stamps, position))

    def is_late(status):  # after the last of its moves
        return status.level == WARN and values_of(status)["moves"] == "6"

    before = values_of(client.next_status(is_late, "a late stem"))
    client.wait_until(lambda: len(read_answers(history, NODE)) == 6, "the moves in the history")
    live.restart({**slow, "method": "bench"})
    status = client.next_status(lambda one: "moves" in values_of(one), "the moves of before")
    after = values_of(status)
    assert status.level == WARN
    assert "after its command (median of 6 moves, limit 0.8 s)" in status.message
    same = ("moves", "moves until [time]", "dead_time [s]", "T63 high [s]", "dead_time cause")
    assert [after[key] for key in same] == [before[key] for key in same]
    assert after["moves until [time]"] == "2023-11-14T22:14:50Z"
    client.identified(quick_record())
    page = Path(client.trigger("report").message).read_text(encoding="utf-8")
    assert "Response to the command" in page
    assert "latest 6 steps of stem_command, from 2023-11-14 22:13 to 2023-11-14 22:14" in page
    _, shown, error = ran("history", history.path, cwd=PROJECT)
    assert "stem_command: 6 steps, 0 ignored; medians: dead time 1" in shown, error
    assert client.trigger("reset_usage").success
    client.status_values(lambda one: values_of(one)["moves"] == "0", "a new packing")
    assert client.next_status().level == OK
    assert read_answers(history, NODE) == ()
