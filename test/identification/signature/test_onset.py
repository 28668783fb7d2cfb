# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The onset of motions that are known in closed form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from valve_friction_ros.identification.signature.strokes import fit_onset

TIME = np.arange(2000) * 1e-3
REST = 5e-3


def motion(onset, lag, speed, jump=0.0, growth=0.0):
    """Position of a stem without inertia under a force that grows from the onset on."""
    since = np.maximum(TIME - onset, 0.0)
    fade = 1 - np.exp(-since / lag)
    steady = since - lag * fade
    return (
        REST
        + speed * (steady + growth * (since**2 / 2 - lag * steady))
        + np.sign(speed) * jump * lag * fade
    )


@settings(max_examples=20)
@given(
    onset=st.floats(0.7, 1.2),
    lag=st.floats(0.02, 0.4),
    speed=st.floats(1e-4, 1e-2),
    way=st.sampled_from([1.0, -1.0]),
    growth=st.floats(-0.2, 0.2),
)
def test_growing_force(onset, lag, speed, way, growth):
    found = fit_onset(TIME, motion(onset, lag, way * speed, growth=growth), onset + 0.05, growth)
    assert found.time == pytest.approx(onset, abs=1e-4)
    assert found.level == pytest.approx(REST, abs=1e-3 * speed)
    assert found.jump_speed == 0.0


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("lag", [0.1, 0.34])
def test_slip_jump(way, lag):
    found = fit_onset(TIME, motion(0.9, lag, way * 1.2e-3, jump=4e-3), 0.8)
    assert found.time == pytest.approx(0.9, abs=1e-5)
    assert found.level == pytest.approx(REST, abs=1e-9)
    assert found.jump_speed == pytest.approx(4e-3, rel=1e-4)


def test_noise_moves_the_onset_by_less_than_a_threshold_would():
    """A threshold of four deviations would be passed 0.2 s late."""
    noise = 28.6e-6 * np.random.default_rng(0).standard_normal((10, TIME.size))
    errors = [fit_onset(TIME, motion(0.9, 0.22, 1.2e-3) + one, 1.0).time - 0.9 for one in noise]
    assert np.sqrt(np.mean(np.square(errors))) < 0.02


def test_too_few_samples():
    with pytest.raises(ValueError, match="7 samples are too few for an onset, at least 8"):
        fit_onset(TIME[:7], TIME[:7], 0.0)
