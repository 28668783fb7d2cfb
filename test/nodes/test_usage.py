# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The usage of a valve over DDS: counted, shown, kept through a kill, limited and reset."""

from datetime import date

import numpy as np
import pytest
from live_nodes import NAMESPACE, SECOND, START, values_of

from valve_friction_ros.history import HistoryFile, read_usage
from valve_friction_ros.model import BENCH_VALVE
from valve_friction_ros.streams import DAY

NODE = f"{NAMESPACE}/identifier"
OK, WARN = b"\x00", b"\x01"
TRAVEL = BENCH_VALVE.travel
PERIOD = 10 * SECOND
DISTANCE = "travelled_distance [m]"


def strokes(count, samples=64):
    """Full strokes, a stroke in `samples` samples, and the stem ends where it began."""
    one = np.linspace(0.0, TRAVEL, samples, endpoint=False)
    return np.concatenate([one if n % 2 == 0 else TRAVEL - one for n in range(count)])


def send(client, position, start=START):
    client.send(position=(start + PERIOD * np.arange(position.size), position))
    return start + PERIOD * position.size


def shown(client, key, value):
    """Wait until a value of the diagnostics is there; the values."""
    return client.status_values(
        lambda status: values_of(status).get(key) == value, f"{key} = {value}"
    )


def test_usage_is_shown_kept_and_goes_on(live, history):
    node = live.start_identifier()
    client = live.client
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
    live.kill(node)
    assert read_usage(history, NODE) == kept

    live.start_identifier()  # the same stamps once more are as good as new ones
    values = shown(client, "reversals", "19")
    assert float(values[DISTANCE]) == pytest.approx(kept.total.distance)
    send(client, strokes(16))
    values = shown(client, "reversals", "34")
    assert float(values[DISTANCE]) == pytest.approx(kept.total.distance + far, rel=1e-6)


def test_a_renewed_packing_counts_anew(live, history):
    live.start_identifier()
    client = live.client
    after = send(client, strokes(8))
    shown(client, "reversals", "7")
    answer = client.trigger("reset_usage")
    assert answer.success
    assert "the one before, of unknown age: 0.228" in answer.message
    assert "7 reversals" in answer.message
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


def test_limits_of_a_packing(live):
    """Two days of strokes; the limit is expected within a month, and then it is reached."""
    node = live.start_identifier({"reversal_limit": 400.0})
    client = live.client
    samples = 2 * DAY // PERIOD + 256
    many = np.tile(strokes(2, samples=512), -(-samples // 1024))[:samples]
    send(client, many)
    status = client.next_status(lambda one: "packing life" in one.message, "a warning")
    assert status.level == WARN
    values = values_of(status)
    assert values["NE 107"] == "M"
    pace = float(values["reversals pace [1/day]"])
    assert pace == pytest.approx(DAY / (512 * PERIOD), rel=0.05)
    assert values["reversal_limit_expected [date]"] in status.message
    assert "renew the packing, then call ~/reset_usage" in status.message
    assert client.set_together(NODE, {"reversal_limit": 20.0}).successful
    status = client.next_status(lambda one: "reached" in one.message, "a limit that is reached")
    assert status.level == WARN
    assert client.set_together(NODE, {"reversal_limit": 0.0, "travel_limit": 1e6}).successful
    status = client.next_status(lambda one: "packing life" not in one.message, "no warning")
    assert status.level == OK
    assert node.is_running()


def test_a_warning_of_a_packing_outlives_a_rest_and_a_restart(live, history):
    """While the valve rests the expected date recedes; only a renewed packing ends the warning."""
    node = live.start_identifier({"reversal_limit": 500.0})
    client = live.client
    samples = 2 * DAY // PERIOD + 256
    after = send(client, np.tile(strokes(2, samples=512), -(-samples // 1024))[:samples])
    status = client.next_status(lambda one: "packing life" in one.message, "a warning")
    assert status.level == WARN
    rest = after + 600 * SECOND * np.arange(1, 1500)
    client.send(position=(rest, np.zeros(rest.size)))
    client.wait_until(
        lambda: read_usage(history, NODE).total.time_watched > 9 * DAY, "the rest in the history"
    )
    live.kill(node)

    live.start_identifier({"reversal_limit": 500.0})
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
    assert values["usage"] == "not counted, as the travel is not finite: set travel"
    assert DISTANCE not in values


def test_earlier_runs_that_cannot_be_read_at_first(live, tmp_path):
    """The totals are those of this run and say so, until the file can be read."""
    blocked = tmp_path / "blocked"
    blocked.touch()
    history = HistoryFile(blocked / "history.sqlite")
    live.start_identifier({"history_file": history.path})
    client = live.client
    after = send(client, strokes(8))
    values = shown(client, "reversals", "7")
    assert values["usage"] == "of this run only, as the history cannot be read"
    blocked.unlink()
    after = send(client, strokes(8), after)
    after = send(client, strokes(8), after)
    client.next_status(lambda one: "usage" not in values_of(one), "all of the usage")
    send(client, strokes(8), after)
    client.wait_until(
        lambda: history.path.exists() and read_usage(history, NODE).total.reversals == 31,
        "all rows",
    )
