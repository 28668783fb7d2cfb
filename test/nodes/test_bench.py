# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""A bench over topics: the simulated valve, the source of its pressure, and stroke tests played."""

import json
import math

import numpy as np
import pytest
from live_nodes import LATCHED, NAMESPACE, SECOND, START, STREAM, stamp_of
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import String

from valve_friction_ros.commands.plan_test import player, write_test
from valve_friction_ros.identification import IdentificationSettings
from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    IsaSteps,
    SineWave,
    SquareWave,
    converter_response,
    simulate,
)
from valve_friction_ros.planning import Conditions, Limits, known_friction, plan_test

NODE = f"{NAMESPACE}/simulator"
PERIOD = 0.01
PRESSURE = SineWave(period=10.0).sample(np.arange(1000) * PERIOD)
STAMPS = START + 10_000_000 * np.arange(1000, dtype=np.int64)
KARNOPP = ("mass", "viscous_friction", "coulomb_friction", "static_friction", "spring_constant")
EXACT = {"rtol": 0, "atol": 1e-12}  # m; pressure in and position out are doubles


def wait_for_stem(client):
    topic = f"{NAMESPACE}/stem_state"
    client.wait_until(lambda: client.node.count_publishers(topic), "the stem")


@pytest.fixture(scope="module")
def running(shared):
    process = shared.start("simulator")
    states = shared.client.listen(JointState, f"{NAMESPACE}/stem_state", STREAM)
    shared.client.connect_pressure()
    wait_for_stem(shared.client)
    return shared.client, states, process, [START]


@pytest.fixture
def stem(running):
    """Publish pressures to a stem that starts at rest, with low friction."""
    client, states, _, begin = running
    values = {name: getattr(LOW_FRICTION, name) for name in KARNOPP}
    assert client.set_together(NODE, {"travel": BENCH_VALVE.travel, **values}).successful
    begin[0] -= 1000 * SECOND  # back in time: the stem starts anew
    return Stem(client, states, begin[0])


class Stem:
    def __init__(self, client, states, start):
        self.client = client
        self.states = states
        self.start = start
        self.states.clear()

    def respond(self, pressure, first=0):
        """Publish samples, the first of them number `first`; return positions and velocities."""
        stamps = self.start + 10_000_000 * np.arange(first, first + len(pressure), dtype=np.int64)
        self.states.clear()
        self.client.send(pressure=(stamps, pressure))
        self.client.wait_until(lambda: len(self.states) >= len(pressure), "the stem's states")
        assert [stamp_of(state.header.stamp) for state in self.states] == stamps.tolist()
        assert all(list(state.name) == ["stem"] for state in self.states)
        return (
            np.array([state.position[0] for state in self.states]),
            np.array([state.velocity[0] for state in self.states]),
        )


def test_stem_follows_the_model_at_the_stamps_of_the_pressure(stem):
    position, velocity = stem.respond(PRESSURE)
    expected = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE, PERIOD)
    assert np.ptp(position) > 0.01
    np.testing.assert_allclose(position, expected.position, **EXACT)
    np.testing.assert_allclose(velocity, expected.velocity, rtol=0, atol=1e-9)


def test_friction_changes_while_it_runs(stem):
    before, _ = stem.respond(PRESSURE[:400])
    tightened = {name: getattr(HIGH_FRICTION, name) for name in KARNOPP}
    result = stem.client.set_together(NODE, tightened)
    assert result.successful, result.reason
    after, _ = stem.respond(PRESSURE[400:], first=400)

    start = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE[:400], PERIOD)
    end = simulate(BENCH_VALVE, HIGH_FRICTION, PRESSURE[399:], PERIOD, start.end)
    np.testing.assert_allclose(before, start.position, **EXACT)
    np.testing.assert_allclose(after, end.position[1:], **EXACT)
    unchanged = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE, PERIOD).position[400:]
    assert np.abs(after - unchanged).max() > 1e-3


def test_coulomb_above_static_friction_is_refused(stem):
    (result,) = stem.client.set_parameters(NODE, {"coulomb_friction": 606.0})
    assert not result.successful
    assert "static_friction (152.7) must not be below coulomb_friction (606)" in result.reason
    result = stem.client.set_together(NODE, {"coulomb_friction": 606.0, "static_friction": 605.0})
    assert not result.successful
    assert stem.client.parameters(NODE, "coulomb_friction", "static_friction") == [152.7, 152.7]
    position, _ = stem.respond(PRESSURE[:300])
    expected = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE[:300], PERIOD)
    np.testing.assert_allclose(position, expected.position, **EXACT)


def test_stamps_that_go_back_start_the_stem_anew(stem, running):
    _, _, process, _ = running
    stem.respond(PRESSURE[:500])
    warnings = process.errors.count("went backwards")
    position, _ = stem.respond(PRESSURE[300:400])
    expected = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE[300:400], PERIOD)
    np.testing.assert_allclose(position, expected.position, **EXACT)

    def warned():  # once in five seconds, however often they go back
        stem.respond(PRESSURE[300:400])
        return process.errors.count("went backwards") > warnings

    stem.client.wait_until(warned, "a warning")
    assert process.errors.count("went backwards") == warnings + 1


def test_bad_pressures_are_passed_over(stem):
    stem.respond(PRESSURE[:100])
    for bad in (math.nan, math.inf, -math.inf, 1e308, -1e306, 1e12):
        stem.client.send_pressure(stem.start + SECOND, bad)
    stem.client.send_pressure(stem.start + 99 * 10_000_000, 2e5)  # repeats a stamp
    position, _ = stem.respond(PRESSURE[100:200], first=100)
    expected = simulate(BENCH_VALVE, LOW_FRICTION, PRESSURE[:200], PERIOD)
    np.testing.assert_allclose(position, expected.position[100:], **EXACT)


def test_travel_made_shorter_than_the_stem_is_out(stem):
    position, _ = stem.respond(PRESSURE[:500])
    assert position[-1] > 0.01
    (result,) = stem.client.set_parameters(NODE, {"travel": 0.005})
    assert result.successful, result.reason
    position, _ = stem.respond(PRESSURE[500:], first=500)
    assert np.all((position[1:] >= 0) & (position[1:] <= 0.005))


def test_slip_jump_valve_with_noise_by_seed(live):
    values = {
        **{name: getattr(GRAPHITE_PACKING, name) for name in (*KARNOPP, "spring_preload")},
        "pressure_reference": 0.0,
        "position_noise": 1e-5,
        "noise_seed": 7,
        "joint": "plug",
    }
    live.start("simulator", values)
    states = live.client.listen(JointState, f"{NAMESPACE}/stem_state", STREAM)
    live.client.connect_pressure()
    wait_for_stem(live.client)
    live.client.send(pressure=(STAMPS, PRESSURE))
    live.client.wait_until(lambda: len(states) >= 1000, "the stem's states")
    expected = simulate(GRAPHITE_VALVE, GRAPHITE_PACKING, PRESSURE, PERIOD).position
    noise = 1e-5 * np.random.default_rng(7).standard_normal(1000)
    position = np.array([state.position[0] for state in states])
    np.testing.assert_allclose(position, expected + noise, **EXACT)
    assert list(states[0].name) == ["plug"]


RATE = 200.0
SPEED = 10.0
LAG = 0.3
WAVE = SquareWave(low=6e4, high=1.5e5, period=2.0)
PARAMETERS = {
    "low": 6e4,
    "high": 1.5e5,
    "period": 2.0,
    "sample_rate": RATE,
    "speed": SPEED,
    "converter_lag": LAG,
}
ONE_PERIOD = round(WAVE.period * RATE)


def heard(live, parameters, count):
    """Start a source; return stamps and pressures of `count` samples in a row."""
    messages = live.client.listen(FluidPressure, f"{NAMESPACE}/actuator_pressure", STREAM)
    live.start("pressure_source", parameters)
    live.client.wait_until(lambda: len(messages) >= count, f"{count} samples")
    stamps = np.array([stamp_of(message.header.stamp) for message in messages[:count]])
    return stamps, np.array([message.fluid_pressure for message in messages[:count]])


def require_part(heard_part, signal):
    """Require that what was heard is a part of `signal`, from where the listener joined."""
    windows = np.lib.stride_tricks.sliding_window_view(signal, heard_part.size)
    first = int(np.argmin(np.abs(windows - heard_part).max(axis=1)))
    np.testing.assert_allclose(heard_part, windows[first], rtol=1e-12)
    assert np.ptp(heard_part) > 1e3


def published(excitation, lag=LAG, seconds=200.0):
    time = np.arange(round(seconds * RATE)) / RATE
    return converter_response(excitation.sample(time), 1 / RATE, lag)


def test_a_square_wave_behind_the_converter_with_noise_told_by_its_seed(live):
    """Without a lost sample."""
    deviation = 100.0
    noisy = {**PARAMETERS, "pressure_noise": deviation, "noise_seed": 5}
    stamps, pressure = heard(live, noisy, 2 * ONE_PERIOD)
    np.testing.assert_array_equal(np.diff(stamps), round(SECOND / RATE))
    clean = published(WAVE)
    require_part(pressure, clean + deviation * np.random.default_rng(5).standard_normal(clean.size))


def test_a_rate_that_nanoseconds_do_not_divide(live):
    rate = 1e3 / 3
    stamps, _ = heard(live, {**PARAMETERS, "sample_rate": rate, "speed": 100.0}, 100)
    since_first = stamps - stamps[0]
    exact = np.arange(100) * SECOND / rate
    assert np.abs(since_first - exact).max() <= 1.0  # each of the two ends is rounded


def test_signals_that_are_no_wave(live, tmp_path):
    """A file, whose rows are joined by lines; and steps, of which none falls on a sample."""
    file = tmp_path / "steps.csv"
    file.write_text("time_s,note,pressure_pa\n10,a,60000\n11,b,80000\n11.5,c,70000\n20,d,90000\n")
    exact = {**PARAMETERS, "converter_lag": 0.0, "speed": 1.0}
    _, pressure = heard(live, {**exact, "excitation": "file", "file": str(file)}, 300)
    time = np.arange(4000) / RATE
    require_part(pressure, np.interp(time, [0, 1, 1.5, 10], [6e4, 8e4, 7e4, 9e4]))
    live.kill(live.nodes[-1])
    hold = 0.0513  # s
    _, pressure = heard(live, {**exact, "excitation": "isa_steps", "period": hold}, 200)
    steps = IsaSteps(centre=1.05e5, span=9e4, hold=hold)
    require_part(pressure, published(steps, lag=0.0, seconds=10.0))
    assert np.unique(pressure).size > 5


def test_jitter_is_of_the_time_alone_and_bounded(live):
    """Stamps leave the grid by up to the jitter either way; the pressures are as before."""
    jitter = 1e-3
    stamps, pressure = heard(live, {**PARAMETERS, "time_jitter": jitter}, 2 * ONE_PERIOD)
    require_part(pressure, published(WAVE))
    off = (stamps - stamps[0]) / SECOND - np.arange(stamps.size) / RATE
    off -= (off.max() + off.min()) / 2
    assert np.abs(off).max() <= 1.001 * jitter
    assert off.std() == pytest.approx(jitter / np.sqrt(3), rel=0.1)
    assert np.all(np.diff(stamps) > 0)


HOME = 1e5
ROWS = ((0.0, HOME), (0.2, HOME), (1.2, 1.4e5), (600.0, 1.4e5))
PLAYER = f"{NAMESPACE}/stroke_player"


@pytest.fixture
def stroke_player(live, tmp_path):
    """A player; `send_signals` keeps its send_signals coming, at the position `live.position`."""
    file = tmp_path / "test.csv"
    file.write_text("time_s,pressure_pa\n" + "".join(f"{t},{p}\n" for t, p in ROWS))
    live.set_points = live.client.listen(FluidPressure, f"{NAMESPACE}/pressure_set_point", STREAM)
    live.states = live.client.listen(String, f"{PLAYER}/state", LATCHED)
    parameters = {"file": str(file), "file_minimum": 0.9e5, "file_maximum": 1.5e5, "silence": 5.0,
                  "position_minimum": 0.002, "position_maximum": 0.02}  # fmt: skip
    live.player = live.start("stroke_player", parameters)
    live.position, live.sent = 0.01, 0
    live.client.connect()
    return live


def send_signals(live):
    """Send a sample of each signal."""
    live.sent += 1
    live.client.send_pressure(START + live.sent * SECOND // 100, 1.1e5)
    live.client.send_stem(START + live.sent * SECOND // 100, live.position)


def wait(live, condition, what):
    """Wait while the send_signals come."""

    def met():
        send_signals(live)
        return condition()

    live.client.wait_until(met, what)


def last(live):
    return live.set_points[-1].fluid_pressure if live.set_points else None


def test_it_plays_when_asked_and_goes_back_by_limit_and_by_its_end(stroke_player):
    live = stroke_player
    assert not live.client.trigger("start", PLAYER).success  # no signal has come
    wait(live, lambda: live.sent > 50, "send_signals")
    assert last(live) is None  # and nothing begins by itself
    live.client.success("start", PLAYER)
    wait(live, lambda: last(live) == 1.4e5, "the highest set point")
    values = [one.fluid_pressure for one in live.set_points]
    assert values[0] == HOME
    assert values == sorted(values)
    live.position = 0.0201
    wait(live, lambda: last(live) == HOME, "the way back")
    wait(live, lambda: "beyond its limit of 0.02 m" in live.states[-1].data, "the state")
    live.position = 0.01
    wait(live, lambda: live.sent % 50 == 0, "good send_signals")
    assert live.client.trigger("start", PLAYER).success
    wait(live, lambda: last(live) > 1.2e5, "set points")
    live.player.interrupt()
    live.player.require_good_end()
    live.client.drain()
    assert last(live) == HOME


TEST_RATE, TEST_SPEED = 50.0, 4.0
NAMES = ("coulomb_friction", "sliding_friction")


@pytest.fixture(scope="module")
def plan():
    """Planned for a friction that is two thirds of the true one."""
    true = HIGH_FRICTION
    frictions = known_friction(
        true.coulomb_friction / 1.5,
        (true.spring_constant, true.spring_preload),
        true.mass,
        viscous_friction=true.viscous_friction / 1.5,
        factor=1.5,
    )
    settings = IdentificationSettings(assumed_mass=1.6)
    return plan_test(BENCH_VALVE, frictions, Limits(duration=30.0), Conditions(TEST_RATE), settings)


@pytest.mark.slow
def test_what_is_reported_is_what_was_promised(live, plan, tmp_path):
    file = tmp_path / "stroke_test.csv"
    write_test(file, plan)
    names = ("diaphragm_area", "pressure_reference", "travel")
    valve = {name: getattr(BENCH_VALVE, name) for name in names}
    true = {name: getattr(HIGH_FRICTION, name) for name in (*KARNOPP, "spring_preload")}
    live.start("simulator", {**valve, **true, "position_noise": 10e-6})
    live.start_identifier({**valve, "window": 40.0, "assumed_mass": 1.6})
    wait_for_stem(live.client)
    heard = live.client.listen(JointState, f"{NAMESPACE}/stem_state", STREAM)
    played = {"sample_rate": TEST_RATE, "speed": TEST_SPEED, "pressure_noise": 100.0}
    live.start("pressure_source", player(plan, file) | played)

    def has_ended():
        stamps = [stamp_of(message.header.stamp) for message in heard[:1] + heard[-1:]]
        return stamps and stamps[1] - stamps[0] >= (plan.test.duration - 1.0) * SECOND

    live.client.wait_until(has_ended, "the end of the test")
    positions = [message.position[0] / BENCH_VALVE.travel for message in heard]
    assert 0.19 < min(positions) < 0.45
    assert 0.55 < max(positions) < 0.81
    live.client.success("identify")
    promised = plan.forecasts[-1]
    assert promised.parameters.coulomb_friction == pytest.approx(606.0)
    values, widths = live.client.friction(*NAMES), live.client.half_widths(*NAMES)
    assert abs(values["coulomb_friction"] - 606.0) <= widths["coulomb_friction"]
    for name in NAMES:
        assert 0.4 < widths[name] / promised.half_widths[name] < 2.5, json.dumps(widths)
