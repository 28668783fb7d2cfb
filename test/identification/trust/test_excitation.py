# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What a record must hold: each limit from both sides, and what a refusal says."""

import math

import numpy as np
import pytest

from valve_friction_ros.identification import RefusalError
from valve_friction_ros.identification.trust.excitation import (
    _distances,
    _followed,
    require_enough_samples,
    require_motion,
    require_related_signals,
    require_travel,
    require_two_directions,
    require_unbroken,
)
from valve_friction_ros.model import Recording, Valve
from valve_friction_ros.signals import measured, position_noise

VALVE = Valve(0.0445, travel=0.02)
OPEN_ENDED = Valve(0.0445)


def record(position, pressure=None, period=0.1):
    position = np.asarray(position, dtype=float)
    return Recording(period, np.zeros(position.size) if pressure is None else pressure, position)


def refusal(requirement, *arguments):
    with pytest.raises(RefusalError) as caught:
        requirement(*arguments)
    return str(caught.value)


def triangle(up, down, samples=1000):
    """A noiseless stem that moves `up`, then `down`, at one speed."""
    turn = round(samples * up / (up + down))
    return np.concatenate([np.linspace(0, up, turn), np.linspace(up, up - down, samples - turn)])


def test_ten_windows_are_enough():
    require_enough_samples(record(np.zeros(30)), 3)
    assert refusal(require_enough_samples, record(np.zeros(29)), 3) == (
        f"the record is too short: 29 samples ({record(np.zeros(29)).duration:.3g} s), "
        "at least 30 are needed; record longer or sample faster"
    )


def test_a_gap_is_refused_in_its_own_words():
    require_unbroken(record([0.0, 1e-3]))
    broken = Recording(0.1, [0.0, 0.0], [0.0, 1e-3], gap="gap of 2 s: use another record")
    assert refusal(require_unbroken, broken) == "gap of 2 s: use another record"
    assert refusal(require_unbroken, measured(broken)) == "gap of 2 s: use another record"


@pytest.mark.parametrize(("share", "moves"), [(1.01, True), (0.99, False)])
def test_motion_is_ten_times_the_noise(share, moves):
    """White noise on a ramp whose ends are told apart by 10 deviations, more or less."""
    noise = np.random.default_rng(0).uniform(-1e-5, 1e-5, 400)
    noise[[0, -1]] = 1e-5 * np.array([-1, 1])

    def ramp(rise):
        return noise + np.linspace(0, rise, 400)

    # The ramp does not touch the second differences, so the noise is the same for any of them.
    span = 10 * position_noise(noise) * share
    position = ramp(span - 2e-5)
    assert np.ptp(position) == pytest.approx(span, rel=1e-9)
    if moves:
        require_motion(record(position))
    else:
        assert refusal(require_motion, record(position)) == (
            f"the stem did not move: its position spans {span * 1e6:.3g} µm with "
            f"{position_noise(noise) * 1e6:.3g} µm of noise; "
            "excite the valve over several percent of its travel"
        )


def test_a_stem_at_rest_did_not_move():
    assert "did not move: its position spans 0 µm" in refusal(require_motion, record([0.01] * 9))
    require_motion(record(np.linspace(0.0, 1e-9, 50)))


@pytest.mark.parametrize(
    ("position", "deadband", "expected"),
    [
        ([0, 3, 1, 5], 0.5, (7, 2)),
        ([0, 3, 1, 5], 2.0, (5, 0)),  # a turn of the dead band itself is none
        ([0, 3, 1, 5], 1.9, (7, 2)),
        ([5, 2, 4, 0], 0.5, (2, 7)),
        ([5, 2, 4, 0], 2.0, (0, 5)),
        ([0, 1, 0, 1, 0], 0.5, (2, 2)),
        ([2, 3, 0, 0, 4, 4, 1], 1.0, (5, 6)),
        ([0, 3, 1, 5, 2, 6], 0.5, (11, 5)),
        ([0, 3, 2.8, 2.4, 5], 0.5, (5.6, 0.6)),  # a slow turn is one as well
        ([0, 0.3, 0.1], 0.5, (0.3, 0)),
        ([0, -0.3, -0.1], 0.5, (0, 0.3)),
        ([1, 1, 1], 0.0, (0, 0)),
    ],
)
def test_distances_leave_small_turns_out(position, deadband, expected):
    up, down = _distances(np.array(position, dtype=float), deadband)
    assert (up, down) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("window", [1, 10])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_fiftieth_of_the_way_goes_back(window, sign):
    """Averages over the window make each way a window's step shorter at most."""
    require_two_directions(record(sign * triangle(0.97, 0.03)), window)
    text = refusal(require_two_directions, record(sign * triangle(0.985, 0.015)), window)
    way = "up" if sign > 0 else "down"
    assert text.startswith(f"the stem moved {way} only (")
    assert text.endswith(
        " mm down): friction and spring cannot be separated; record at least one stroke each way"
    )


def test_a_way_back_that_may_be_elastic_is_none():
    """A fourteenth of the way goes back: 0.3 % of the travel of 1 m are 3 mm, of 10 m 30 mm."""
    there_and_back = record(triangle(0.28, 0.02))
    require_two_directions(there_and_back, 1, 1.0)
    assert "down)" in refusal(require_two_directions, there_and_back, 1, 10.0)
    require_two_directions(there_and_back, 1, math.inf)


@pytest.mark.parametrize(
    ("ends", "way"),
    [
        ((0, 0.9988), "up only (999 mm up, 0 mm down)"),
        ((1, 0.0012), "down only (0 mm up, 999 mm down)"),
    ],
)
def test_one_way_in_numbers(ends, way):
    assert refusal(require_two_directions, record(np.linspace(*ends, 100)), 1) == (
        f"the stem moved {way}: friction and spring cannot be separated; "
        "record at least one stroke each way"
    )


def test_turns_within_the_noise_are_none():
    """A rising stem with white noise: averages over 25 samples keep a fifth of it."""
    noise = 1e-3 * np.random.default_rng(1).standard_normal(5000)
    text = refusal(require_two_directions, record(noise + np.linspace(0, 0.05, 5000)), 25)
    assert "0 mm down" in text
    # Turns of 5 mm, far beyond 10 · 1 mm/√25, count however noisy the stem is.
    turns = np.repeat([0.0, 5e-3] * 20, 125) + np.linspace(0, 0.2, 5000)
    require_two_directions(record(noise + turns), 25)


@pytest.mark.parametrize(
    ("lowest", "highest", "passes"),
    [
        (-0.001, 0.021, True),
        (0.0, 0.0002, True),
        (-0.00101, 0.0105, False),
        (0.01, 0.02101, False),
        (0.01, 0.01021, True),
        (0.01, 0.01019, False),
    ],
)
def test_the_stem_stays_within_a_twentieth_and_moves_a_hundredth(lowest, highest, passes):
    stem = record([lowest, highest])
    require_travel(stem, OPEN_ENDED)
    if passes:
        require_travel(stem, VALVE)
    else:
        refusal(require_travel, stem, VALVE)


def test_what_is_said_of_the_travel():
    assert refusal(require_travel, record([0.001, 0.05]), VALVE) == (
        "the stem position runs from 0.001 to 0.05 m, the travel from 0 to 0.02 m: "
        "check that the signals are not swapped, and check unit (m), zero and travel"
    )
    assert refusal(require_travel, record([0.01, 0.0100999]), VALVE) == (
        "too little travel: the stem moved 0.0999 mm, 0.5 % of its travel; "
        "excite the valve over several percent of it"
    )
    assert "moved 0.19 mm, 0.95 % of" in refusal(require_travel, record([0, 1.9e-4]), VALVE)


def strokes(scatter=0.0, slope=2e6, friction=1e4):
    """Pressure = slope · position ± friction, sampled like its blocks; scatter on the pressure."""
    position = 0.01 + 0.005 * np.sin(np.linspace(0, 6 * np.pi, 301))
    middle = 0.5 * (position[1:] + position[:-1])
    pressure = slope * position + friction * np.sign(np.gradient(position))
    noise = np.random.default_rng(0).standard_normal(position.size)
    assert middle.size == 300
    return record(position, pressure + scatter * noise)


def test_pressure_follows_the_moving_stem():
    slope, share, _ = _followed(strokes(friction=0.0))
    assert (slope, share) == (pytest.approx(2e6, rel=1e-9), pytest.approx(1.0, abs=1e-12))
    # The way of the stem explains its friction; only the turns lie between both.
    slope, share, dissipates = _followed(strokes())
    assert dissipates
    assert slope == pytest.approx(2e6, rel=1e-3)
    assert share > 0.99


def test_rests_and_other_sample_periods_do_not_matter():
    """Ten samples in each block of 0.1 s, and a rest in which the pressure does anything."""
    clean = strokes(friction=0.0)
    fine = record(np.repeat(clean.position, 10), np.repeat(clean.pressure, 10), 0.01)
    assert _followed(fine)[:2] == pytest.approx(_followed(clean)[:2], rel=1e-9)
    rest = record(
        np.concatenate([clean.position, np.full(100, clean.position[-1])]),
        np.concatenate([clean.pressure, 1e5 * np.random.default_rng(1).random(100)]),
    )
    assert _followed(rest)[:2] == pytest.approx(_followed(clean)[:2], rel=1e-9)


@pytest.mark.parametrize(("share", "counts"), [(0.045, False), (0.055, True)])
def test_a_twentieth_of_the_top_speed_is_motion(share, counts):
    """A creep in which the pressure does anything."""
    clean = strokes(friction=0.0)
    creep = share * np.abs(np.diff(clean.position)).max() * np.arange(1, 101)
    found = _followed(
        record(
            np.concatenate([clean.position, clean.position[-1] + creep]),
            np.concatenate([clean.pressure, 1e5 * np.random.default_rng(1).random(100)]),
        )
    )
    assert (found[:2] != pytest.approx(_followed(clean)[:2], rel=1e-9)) is counts


def test_what_two_blocks_make_up_for_is_left_out():
    """A pressure that is high in one block and low in the next is the same on their average."""
    clean = strokes(friction=0.0)
    zigzag = clean.pressure + 1e4 * (-1.0) ** np.arange(301)
    found = _followed(record(clean.position, zigzag))
    assert found[:2] == (pytest.approx(2e6, rel=1e-9), pytest.approx(1.0, abs=1e-12))


def test_the_unit_of_the_pressure_does_not_matter():
    scattered = strokes(scatter=1e4)
    small = record(scattered.position, 1e-9 * scattered.pressure)
    slope, share, _ = _followed(scattered)
    assert _followed(small)[:2] == pytest.approx((1e-9 * slope, share), rel=1e-9)
    require_related_signals(small)


def test_pressure_that_does_not_change():
    position = strokes().position
    assert refusal(require_related_signals, record(position, np.full(301, 1e5))) == (
        "the pressure did not change: excite the valve, or check the pressure sensor"
    )
    assert _followed(record(position, np.full(301, 1e5)))[1] == 0.0


def test_unrelated_signals():
    assert refusal(require_related_signals, strokes(scatter=1e6)) == (
        "pressure and stem do not move together (position and direction of the moving stem explain "
        f"{100 * _followed(strokes(scatter=1e6))[1]:.0f} % of the pressure): check that both "
        "signals belong to this valve, are not swapped, come from working sensors, and share one "
        "clock"
    )


def strokes_explaining(share, slope=2e6):
    """Strokes with as much scatter as leaves this share of the pressure explained."""
    scatter = 1e4
    for _ in range(40):  # more scatter explains less
        found = _followed(strokes(scatter, slope))[1]
        scatter *= np.sqrt(found / share)
    assert found == pytest.approx(share, abs=0.005)
    return strokes(scatter, slope)


@pytest.mark.parametrize(("share", "passes"), [(0.12, True), (0.08, False)])
def test_a_tenth_of_the_pressure_must_be_explained(share, passes):
    if passes:
        require_related_signals(strokes_explaining(share))
    else:
        refusal(require_related_signals, strokes_explaining(share))


def test_the_share_is_told_in_whole_percent():
    unrelated = strokes_explaining(0.0945)
    assert 0.0942 < _followed(unrelated)[1] < 0.0949
    assert "explain 9 % of the pressure" in refusal(require_related_signals, unrelated)


def turned_over(upright):
    """The same with a position that grows the other way."""
    return record(0.02 - upright.position, upright.pressure)


def test_a_stem_against_the_pressure():
    assert refusal(require_related_signals, turned_over(strokes())) == (
        "the stem moves against the pressure: invert the position, so that it grows in the "
        "direction in which pressure pushes the stem"
    )


def test_no_position_is_inverted_whose_loop_dissipates():
    """Of a hunting loop with slip jumps the slope may have either sign."""
    require_related_signals(strokes(slope=-2e6))


@pytest.mark.parametrize(("share", "passes"), [(0.48, True), (0.52, False)])
def test_where_less_than_half_is_explained_the_sign_is_chance(share, passes):
    turned = turned_over(strokes_explaining(share))
    if passes:
        require_related_signals(turned)
    else:
        assert "moves against the pressure" in refusal(require_related_signals, turned)


def test_the_jumps_of_a_stem_that_sticks_are_no_slow_sampling():
    """A third of the range between two samples upward; the way down is slow."""
    position = np.concatenate([np.linspace(0, 0.01, 4), np.linspace(0.01, 0, 101)[1:]])
    position = np.concatenate([position, np.linspace(0, 0.004, 50)])
    require_related_signals(record(position, 1e6 * position + 1e4, period=2.0))


@pytest.mark.parametrize(("samples", "share"), [(11, None), (9, 11), (3, 33)])
def test_a_stroke_has_ten_samples(samples, share):
    stroke = np.linspace(0, 0.01, samples + 1)
    position = np.concatenate([*[stroke, stroke[::-1]] * 5, np.zeros(50)])
    stem = record(position, 1e6 * position + 1e4, period=2.0)
    if share is None:
        require_related_signals(stem)
    else:
        assert refusal(require_related_signals, stem) == (
            f"sampling is too slow for the motion: the stem moves {share} % of its range between "
            "two samples, 2 s apart; sample faster, or check the stem sensor for a glitch"
        )
