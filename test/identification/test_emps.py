# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A real machine: the electro-mechanical positioning system, a published benchmark."""

from pathlib import Path

import numpy as np
import pytest

from valve_friction_ros.identification import IdentificationSettings, published_estimate
from valve_friction_ros.model import Drive, Recording, Valve

RECORD = (
    Path(__file__).resolve().parents[3] / "shared" / "data" / "emps" / "emps_identification.csv"
)

# Published IDIM-LS values.
PUBLISHED = {
    "mass": 95.1089,
    "viscous_friction": 203.5034,
    "coulomb_friction": 20.3935,
    "spring_preload": -3.1648,
}


@pytest.fixture(scope="module")
def estimate():
    if not RECORD.is_file():
        pytest.skip("the benchmark record is not the project's to distribute; it is not here")
    time, force, position = np.loadtxt(RECORD, delimiter=",", skiprows=1, unpack=True)
    period = float(np.median(np.diff(time)))
    assert period == pytest.approx(1e-3, rel=1e-9)
    record = Recording(period, force, position, driven_by=Drive.FORCE)
    return published_estimate(
        record, Valve(), IdentificationSettings(fixed={"spring_constant": 0.0})
    )


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_value(estimate, name):
    assert getattr(estimate, name) == pytest.approx(PUBLISHED[name], rel=0.05)


def test_the_rest_of_the_estimate(estimate):
    assert estimate.spring_constant == 0.0
    assert estimate.fixed == ("spring_constant",)
    assert estimate.r_squared > 0.99
    assert estimate.samples > 20_000
