# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Identification every so many seconds, by the node's clock."""

import math

from builtin_interfaces.msg import Time
from histories import as_kept
from live_nodes import NAMESPACE, SECOND, START, stamp_of, values_of
from records import quick_record
from rosgraph_msgs.msg import Clock

from valve_friction_ros.identification import identify
from valve_friction_ros.model import BENCH_VALVE, Recording

NODE = f"{NAMESPACE}/identifier"
RECORD = quick_record()
EXPECTED = as_kept(identify(RECORD, BENCH_VALVE).parameters["coulomb_friction"])


def skipped(words):
    return lambda status: words in values_of(status).get("scheduled_skip", "")


def test_it_identifies_without_being_asked(live, history):
    node = live.start_identifier({"period": 0.2})
    client = live.client
    status = client.next_status(skipped("no samples of actuator_pressure"), "a skip")
    assert status.message == "no estimate: nothing has been identified yet"
    values = values_of(status)
    assert values["reason"] == ""
    assert 0 <= float(values["scheduled_skip_age [s]"]) < 30
    client.send_record(RECORD, START)

    def is_whole():
        entries = history.entries()
        return entries and entries[-1].friction == EXPECTED

    client.wait_until(is_whole, "an identification of the whole record")
    assert client.friction("coulomb_friction") == {"coulomb_friction": EXPECTED.value}
    status = client.next_status(skipped("no new samples since the last identification"), "a skip")
    assert values_of(status)["estimate_valid"] == "true"
    assert not any(entry.refusal for entry in history.entries())
    count = len(history.entries())

    # A record that tells nothing leaves verdict and history as they are, and the log too.
    assert client.trigger("clear").success
    still = Recording(0.01, RECORD.pressure, 0 * RECORD.position)
    client.send_record(still, START + 60 * SECOND)
    client.wait_for_buffered(2 * len(still))
    status = client.next_status(skipped("the stem"), "a skip")
    assert "refused" not in status.message
    assert values_of(status)["estimate_valid"] == "true"
    assert values_of(status)["reason"] == ""
    assert len(history.entries()) == count
    assert "refused" not in node.errors

    # Asked for, the same is a refusal.
    assert not client.trigger("identify").success
    assert "the latest identification was refused" in client.next_status().message
    assert history.entries()[-1].refusal


def test_the_period_is_changed_while_it_runs(live):
    live.start_identifier()
    client = live.client
    assert "scheduled_skip" not in client.status_values()
    assert client.set_together(NODE, {"period": 0.1}).successful
    client.next_status(skipped("no samples"), "a skip")
    assert client.set_together(NODE, {"period": 0.0}).successful
    client.next_status(lambda status: "scheduled_skip" not in values_of(status), "the end of it")
    assert not client.set_together(NODE, {"period": -1.0}).successful


def test_by_simulated_time(live):
    """The clock of a simulation or of a bag, not the wall's."""
    live.start_identifier({"period": 100.0, "use_sim_time": True})
    client = live.client
    clock = client.node.create_publisher(Clock, "/clock", 10)
    now = 1_000

    def tick_until(condition, step):
        nonlocal now
        before = len(client.statuses)

        def met():
            nonlocal now
            now += step
            clock.publish(Clock(clock=Time(sec=now)))
            return any(condition(*one) for one in client.statuses[before:])

        client.wait_until(met, "a status")

    def skipped_at(stamp, status):
        age = float(values_of(status).get("scheduled_skip_age [s]", "nan"))
        return stamp_of(stamp) / SECOND - age if skipped("no samples")(status) else math.nan

    tick_until(lambda _, status: "/clock" not in status.message, 0)
    reached = now
    # The first clock comes long after zero, so the schedule is due at once, and 100 s later.
    tick_until(lambda *one: skipped_at(*one) >= reached, 1)
    tick_until(lambda *one: skipped_at(*one) >= reached + 100, 1)
    times = {round(skipped_at(*one)) for one in client.statuses if skipped_at(*one) > 0}
    first, second = sorted(times)[0], sorted(times)[-1]
    assert reached <= first < reached + 100 <= second < reached + 300
    assert sum(time < reached + 100 for time in times) == 1
