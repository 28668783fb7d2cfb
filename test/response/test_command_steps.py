"""Steps of a command: jumps between holds, not ramps, not noise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from valve_friction_ros.response.command_steps import CommandHolds
from valve_friction_ros.streams import Samples

SECOND = 1_000_000_000


def changes(times, values, blocks=1):
    holds = CommandHolds(1.0)
    found = []
    for at, each in zip(
        np.array_split(np.asarray(times), blocks), np.array_split(values, blocks), strict=True
    ):
        found += holds.take(Samples(np.round(at * 1e9).astype(np.int64), each))
    return found + holds.advance(10_000 * SECOND)


@given(
    st.lists(
        st.tuples(st.floats(1.0, 100.0), st.sampled_from([-0.1, -0.02, 0.003, 0.05])),
        min_size=1,
        max_size=8,
    )
)
def test_a_command_that_is_published_when_it_changes(moves):
    times = np.cumsum([seconds for seconds, _ in moves])
    levels = 0.5 + np.cumsum([0.0, *(change for _, change in moves)])
    found = changes(np.array([0.0, *times]), levels)
    assert [one.is_step for one in found] == [True] * len(moves)
    assert [one.stamp for one in found] == [round(time * 1e9) for time in times]
    np.testing.assert_allclose([one.after for one in found], levels[1:])
    np.testing.assert_allclose([one.before for one in found], levels[:-1])
    np.testing.assert_allclose([one.held for one in found], [seconds for seconds, _ in moves])


@pytest.mark.parametrize("blocks", [1, 7, 400])
@pytest.mark.parametrize("noise", [0.0, 5e-4])
def test_a_sampled_command_with_noise(blocks, noise):
    times = np.arange(4000) / 100
    values = np.where(times < 20, 0.4, 0.45)
    values = values + noise * np.random.default_rng(1).standard_normal(times.size)
    (found,) = (one for one in changes(times, values, blocks) if one.held >= 5.0)
    assert found.is_step
    assert found.stamp == 20 * SECOND
    assert found.held == pytest.approx(20.0, abs=0.32)  # until the noise is known
    assert found.after - found.before == pytest.approx(0.05, abs=3 * noise + 1e-12)


@pytest.mark.parametrize("rate", [0.001, 0.01])
def test_a_ramp_is_no_step(rate):
    times = np.arange(6000) / 100
    found = changes(times, 0.3 + rate * np.maximum(times - 5, 0))
    assert found
    assert not any(one.is_step and one.held >= 1.0 for one in found[1:])
    assert not found[0].is_step


def test_a_jump_in_three_samples_is_one_step():
    times = np.arange(2000) / 50
    values = np.interp(times, [10.0, 10.06], [0.2, 0.3])
    (found,) = changes(times, values)
    assert found.after == pytest.approx(0.3)
