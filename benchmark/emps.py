# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A real machine: EMPS, an electro-mechanical axis with published parameters."""

from pathlib import Path

import numpy as np

from benchmark.harness.rows import Bound
from valve_friction_ros.identification import IdentificationSettings, Verdict, identify
from valve_friction_ros.model import Drive, Recording, Valve

RECORD = (
    Path(__file__).resolve().parents[2] / "shared" / "data" / "emps" / "emps_identification.csv"
)

PUBLISHED = {
    "mass": 95.1089,
    "viscous_friction": 203.5034,
    "coulomb_friction": 20.3935,
    "spring_preload": -3.1648,
}
"""IDIM-LS values of the data set's authors."""


def emps_bounds() -> list[Bound] | None:
    """Identify EMPS with default settings and no spring; None where the record is absent."""
    if not RECORD.is_file():
        return None
    time, force, position = np.loadtxt(RECORD, delimiter=",", skiprows=1, unpack=True)
    record = Recording(float(np.median(np.diff(time))), force, position, driven_by=Drive.FORCE)
    settings = IdentificationSettings(fixed={"spring_constant": 0.0})
    result = identify(record, Valve(), settings)
    bounds = []
    for name, published in PUBLISHED.items():
        one = result.parameters[name]
        error = one.value / published - 1
        inside = abs(one.value - published) <= one.half_width
        shown = one.verdict is not Verdict.NOT_IDENTIFIABLE
        what = f"EMPS: {name} within 2 % of {published:g}, or inside its interval"
        reached = f"{one.value:.4g} ± {one.half_width:.2g}, {error:+.1%}, {one.verdict.value}"
        bounds.append(Bound(what, reached, shown and (abs(error) <= 0.02 or inside)))
    return bounds
