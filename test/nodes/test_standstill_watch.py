# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A stem that stands still while its pressure changes, in the node and without a command."""

import numpy as np
from bags import START
from diagnostic_msgs.msg import DiagnosticStatus
from live_nodes import values_of
from records import quick_record

OK, ERROR = DiagnosticStatus.OK, DiagnosticStatus.ERROR

SECOND = 10**9


def still(place, pressures, begin):
    """Stamps, pressures and positions: one of each in a second."""
    stamps = START + begin * SECOND + SECOND * np.arange(len(pressures), dtype=np.int64)
    return (stamps, np.array(pressures, dtype=float)), (stamps, np.full(len(pressures), place))


def test_a_seized_stem_is_an_alarm_until_it_moves(live):
    record = quick_record()
    live.start_identifier({"window": 3600.0})
    client = live.client
    client.identified(record)
    assert client.trigger("set_baseline").success
    assert client.next_status().level == OK
    middle = 0.5 * float(record.position.min() + record.position.max())
    resting, supply = float(np.median(record.pressure)), float(record.pressure.max())
    client.send(*still(middle, [*40 * [resting], *40 * [supply]], 60))
    status = client.next_status(lambda one: one.level == ERROR, "a seized stem")
    assert status.message.startswith(f"the stem has stood still at {1e3 * middle:.1f} mm since ")
    values = values_of(status)
    assert values["NE 107"] == "F"
    assert values["standstill since [time]"].startswith("2023-11-14T22:14")
    assert float(values["standstill static_friction at least [N]"]) > 2 * float(
        values["coulomb_friction [N]"]
    )
    client.send(*still(1.2 * middle, 30 * [supply], 140))
    status = client.next_status(lambda one: one.level == OK, "a stem that moves again")
    assert "stood still" not in status.message
