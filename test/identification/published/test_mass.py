# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Whether a record determines the mass, and what is assumed where it does not."""

import numpy as np
import pytest

from valve_friction_ros.identification import IdentificationSettings
from valve_friction_ros.identification.published.identify import (
    _mass_by_shorter_window,
    _why_mass_is_unknown,
)
from valve_friction_ros.model import BENCH_VALVE, SensorNoise, SineWave
from valve_friction_ros.signals import differentiate, measured


@pytest.mark.parametrize(
    ("mass", "other", "reason"),
    [
        (2.0, 2.0, None),
        (2.0, 2.5, None),  # a quarter of 2 kg is half a kilogram
        (2.0, 1.5, None),
        (2.0, 2.51, "2 kg becomes 2.51 kg with half the derivative window"),
        (2.0, 1.49, "2 kg becomes 1.49 kg with half the derivative window"),
        (2.0, np.nan, "2 kg becomes nan kg with half the derivative window"),
        (1 / 3, 1.0, "0.3333 kg becomes 1 kg with half the derivative window"),
        (0.5, 0.7, "0.5 kg becomes 0.7 kg with half the derivative window"),
        (0.0, 0.0, "its estimate is 0 kg"),
        (-1 / 3, -1 / 3, "its estimate is -0.3333 kg"),
    ],
)
def test_a_mass_keeps_within_a_quarter(mass, other, reason):
    assert _why_mass_is_unknown(mass, other) == reason


@pytest.mark.parametrize(
    ("window", "order", "half"), [(31, 3, 15), (33, 3, 17), (5, 3, 5), (7, 4, 7), (11, 4, 7)]
)
def test_mass_with_half_the_window(bench_record, window, order, half):
    """By `lstsq` above the threshold: half the window, odd, order + 2 samples at least."""
    record = measured(bench_record("high", SineWave(), 20.0, SensorNoise(10e-6, 100.0, 0)))
    settings = IdentificationSettings(derivative_window=window, order=order)
    force = BENCH_VALVE.actuator_force(record.pressure)
    threshold = 2e-3
    found = _mass_by_shorter_window(record, force, settings, threshold)
    velocity, acceleration, margin = differentiate(record.position, 1e-3, half, order)
    moving = np.abs(velocity) > threshold
    columns = [acceleration, np.sign(velocity), velocity, record.position[margin:-margin]]
    table = np.column_stack([*columns, np.ones(velocity.size)])[moving]
    lengths = np.linalg.norm(table, axis=0)
    solved = np.linalg.lstsq(table / lengths, force[margin:-margin][moving], rcond=None)[0]
    assert found == pytest.approx(solved[0] / lengths[0], rel=1e-6)


def test_no_mass_where_nothing_is_faster(bench_record):
    record = measured(bench_record("high", SineWave(), 20.0))
    force = BENCH_VALVE.actuator_force(record.pressure)
    assert np.isnan(_mass_by_shorter_window(record, force, IdentificationSettings(), 1.0))
