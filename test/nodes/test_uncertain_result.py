# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""An uncertain result ends no alarm, over real topics; the low side has a warning."""

from dataclasses import replace

from live_nodes import NAMESPACE, values_of
from records import quick_record

from valve_friction_ros.model import HIGH_FRICTION, LOW_FRICTION, SensorNoise

NODE = f"{NAMESPACE}/identifier"
OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"
LIMITS = {"warn_ratio": 1.25, "error_ratio": 1.5, "low_ratio": 0.5}


def record_of(share):
    """A record of the bench valve whose friction is so many times the usual one."""
    names = ("coulomb_friction", "static_friction", "viscous_friction")
    friction = {name: share * getattr(LOW_FRICTION, name) for name in names}
    return quick_record(replace(LOW_FRICTION, **friction))


HEALTHY, TIGHT, LOOSE = quick_record(), quick_record(HIGH_FRICTION), record_of(0.6)
UNSURE = SensorNoise(15e-5, 300.0, seed=1).applied_to(record_of(1.42))


def test_an_alarm_ends_by_a_sure_result_only_also_over_a_restart(live):
    node = live.start_identifier(LIMITS)
    client = live.client

    def status_after(record):
        client.identified(record)
        return client.statuses[-1][1]

    status_after(HEALTHY)
    assert client.trigger("set_baseline").success
    assert status_after(TIGHT).level == ERROR

    unsure = status_after(UNSURE)
    values = values_of(unsure)
    low, high = (float(values[f"friction_ratio {end}"]) for end in ("low", "high"))
    assert low < LIMITS["warn_ratio"] < LIMITS["error_ratio"] < high
    assert (unsure.level, values["NE 107"]) == (ERROR, "F")
    assert unsure.message.startswith("excess friction: ")
    assert "the latest record does not clear it: friction has grown: " in unsure.message
    live.kill(node)

    live.start_identifier(LIMITS)
    assert client.next_status().level == ERROR
    status = status_after(HEALTHY)
    assert (status.level, values_of(status)["NE 107"]) == (OK, "")

    status = status_after(UNSURE)  # without an alarm before it: grown, not surely excessive
    assert (status.level, values_of(status)["NE 107"]) == (WARN, "M")
    assert status.message.startswith("friction has grown: ")

    status = status_after(LOOSE)
    assert (status.level, values_of(status)["NE 107"]) == (WARN, "M")
    assert status.message.startswith("friction has fallen: ")
