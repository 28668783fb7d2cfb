# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The parameter `method`: force balances of a valve signature, over topics."""

import numpy as np
import pytest
from live_nodes import NODE, values_of
from records import quick_record, simulated
from std_msgs.msg import Float64MultiArray

from valve_friction_ros.identification import (
    UNITS,
    IdentificationSettings,
    identify,
    identify_signature,
)
from valve_friction_ros.model import BENCH_VALVE, HIGH_FRICTION, TriangleWave


def signature_record():
    """Five strokes of a quick triangle at 100 Hz."""
    time = np.arange(5000) / 100
    return simulated(TriangleWave(period=20.0).sample(time), 0.01, HIGH_FRICTION)


@pytest.fixture(scope="module")
def client(shared):
    shared.start_identifier({"method": "signature"})
    return shared.client


def test_a_signature_is_identified(client):
    message = client.identified(signature_record())
    assert "the stem ignores reversals smaller than 21 % of its travel" in message
    expected = identify_signature(signature_record(), BENCH_VALVE, IdentificationSettings())
    told = client.friction(*UNITS, "fit", "rms", "dead_band", "threshold")
    for name in UNITS:
        assert told[name] == pytest.approx(expected.values[name], rel=1e-9, nan_ok=True)
    assert told["coulomb_friction"] == pytest.approx(606.0, rel=0.02)
    assert told["fit"] == pytest.approx(expected.fit, rel=1e-9)
    assert told["rms"] == pytest.approx(expected.rms, rel=1e-6)
    width = told["coulomb_friction"] + told["static_friction"]
    share = width / told["spring_constant"] / BENCH_VALVE.travel
    assert told["dead_band"] == pytest.approx(share, rel=1e-9)
    assert np.isnan(told["threshold"])
    assert np.isnan([*client.published(*UNITS).values()]).all()
    assert not client.latched(Float64MultiArray, f"{NODE}/sweep").data
    values = values_of(client.next_status())
    assert values["method"] == "signature"
    assert values["estimate_valid"] == "true"
    assert values["coulomb_friction verdict"] == "weak"
    assert float(values["fit [%]"]) == pytest.approx(100 * expected.fit, rel=1e-8)


def test_the_method_can_be_changed_while_the_node_runs(client):
    assert client.set_together(NODE, {"method": "bench"}).successful
    client.identified(quick_record())
    assert np.isfinite(client.friction("threshold")["threshold"])
    assert values_of(client.next_status())["method"] == "bench"


def test_former_names_are_understood(client):
    for former, used in (("robust", "plant"), ("refined", "bench"), ("best", "plant")):
        assert client.set_together(NODE, {"method": former}).successful
        client.identified(quick_record())
        assert values_of(client.next_status())["method"] == used
        expected = identify(quick_record(), BENCH_VALVE, method=used)
        told = client.friction("coulomb_friction", "threshold")
        assert told["coulomb_friction"] == expected.values["coulomb_friction"]
        assert told["threshold"] == expected.evidence["threshold"]


def test_the_timing_uncertainty_widens_the_intervals(client):
    """Each lag has a prior of that width; on a square wave the record tells little of the lags."""
    told = {}
    for uncertainty in (0.0, 0.2):
        assert client.set_together(NODE, {"timing_uncertainty": uncertainty}).successful
        client.identified(quick_record())
        told[uncertainty] = client.half_widths("viscous_friction")["viscous_friction"]
        expected = identify(
            quick_record(), BENCH_VALVE, IdentificationSettings(timing_uncertainty=uncertainty)
        )
        assert told[uncertainty] == expected.parameters["viscous_friction"].half_width
    assert told[0.0] < told[0.2]
    assert client.set_together(NODE, {"timing_uncertainty": np.nan}).successful
