# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Simulation of the Karnopp model against closed forms, matrix exponential and power series."""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm, expm_cond

from valve_friction_ros.model import (
    BENCH_VALVE,
    GRAPHITE_PACKING,
    GRAPHITE_VALVE,
    HIGH_FRICTION,
    LOW_FRICTION,
    KarnoppParameters,
    StemState,
    TriangleWave,
    Valve,
    advance,
    balanced_state,
    simulate,
)
from valve_friction_ros.model.linear_motion import (
    Motion,
    first_turn,
    impulse_response,
    motion_after,
    self_convolution,
)

EPS = np.finfo(float).eps
SAMPLE_PERIOD = 1e-3
FREE = Valve(1.0)  # no stops; 1 Pa is 1 N


def packing(mass=1.0, viscous=0.0, coulomb=0.0, static=None, spring=0.0, limit=0.0):
    return KarnoppParameters(
        mass, viscous, coulomb, coulomb if static is None else static, spring, 0.0, limit
    )


def constant(force, samples):
    return np.full(samples, float(force))


class TestClosedForms:
    @pytest.mark.parametrize("angle", [0.01, 0.7, 2.0, 3.5, 25.0])
    def test_undamped_spring_swings_as_a_cosine(self, angle):
        """With `angle` radians a sample: many samples a swing, or many swings a sample."""
        frequency, force, start = 50.0, 30.0, 0.4
        parameters = packing(mass=2.0, spring=2.0 * frequency**2)
        samples = 2000
        found = simulate(
            FREE, parameters, constant(force, samples), angle / frequency, StemState(start)
        )
        balance = force / parameters.spring_constant
        phase = angle * np.arange(samples)
        expected = balance + (start - balance) * np.cos(phase)
        speed = -frequency * (start - balance) * np.sin(phase)
        # Each sample adds a few roundings of the position and of its own phase.
        tolerance = 8 * EPS * samples * (1 + angle) * start
        np.testing.assert_allclose(found.position, expected, rtol=0, atol=tolerance)
        np.testing.assert_allclose(found.velocity, speed, rtol=0, atol=tolerance * frequency)

    def test_coulomb_friction_takes_the_same_off_each_swing(self):
        """Each half swing is a cosine about ±F_c/k, so its end is 2·F_c/k nearer to zero."""
        mass, spring, coulomb, start = 2.0, 800.0, 10.0, 0.31
        parameters = packing(mass=mass, spring=spring, coulomb=coulomb)
        half_swing = math.pi / math.sqrt(spring / mass)
        each = 2 * coulomb / spring
        # At the turns: 0.31, −0.285, 0.26, … to 0.01 m, where the spring pulls less than F_c.
        samples = 20
        found = simulate(FREE, parameters, constant(0.0, samples), half_swing, StemState(start))
        turns = np.arange(samples)
        left = start - each * np.minimum(turns, 12)
        np.testing.assert_allclose(
            found.position, left * (-1.0) ** np.minimum(turns, 12), rtol=0, atol=1e-13
        )
        assert spring * abs(found.position[-1]) < coulomb < spring * (abs(left[11]))
        assert (found.velocity[13:] == 0).all()

    @pytest.mark.parametrize("limit", [0.0, 0.01, 0.2, 0.5])
    def test_block_on_a_table_stops_at_the_limit_velocity(self, limit):
        """From 1 m/s at −4 m/s²: it stops after (v − DV)/4 s, after (v² − DV²)/8 m."""
        parameters = packing(mass=0.5, coulomb=2.0, limit=limit)
        period = 1e-3
        found = simulate(FREE, parameters, constant(0.0, 400), period, StemState(0.0, 1.0))
        stop = (1.0 - limit) / 4.0
        time = period * np.arange(400)
        moving = time < stop
        np.testing.assert_array_equal(found.velocity[~moving], 0.0)
        np.testing.assert_allclose(found.velocity[moving], 1 - 4 * time[moving], atol=1e-13)
        assert (found.velocity[moving] > limit).all()
        np.testing.assert_allclose(found.position[~moving], (1 - limit**2) / 8, rtol=1e-13)

    def test_limit_velocity_holds_only_what_static_friction_can_hold(self):
        """Slowing towards a crawl below DV, the stem rests at DV if |pull| ≤ F_s, else it crawls.

        ẋ = crawl + (1 − crawl)·e^−100·t with crawl = (pull − F_c)/F_v.
        """
        parameters = packing(viscous=100.0, coulomb=5.0, static=8.0, limit=0.1)
        time = 1e-3 * np.arange(1000)
        for pull, rests in ((7.99, True), (8.01, False)):
            found = simulate(FREE, parameters, constant(pull, 1000), 1e-3, StemState(0.0, 1.0))
            crawl = (pull - 5.0) / 100.0
            speed = crawl + (1 - crawl) * np.exp(-100.0 * time)
            expected = np.where(speed > 0.1, speed, 0.0) if rests else speed
            np.testing.assert_allclose(found.velocity, expected, rtol=0, atol=1000 * EPS)


class TestSlipJump:
    def test_viscous_stem_jumps_onto_the_sliding_line(self):
        """Under a slow ramp the jump is (F_s − F_c)/k.

        Before the breakaway at F_s the stem rests at x₀. Long after, with the transient of
        F_v/k = 0.34 s gone, it slides at dF/dt/k with k·x = F − F_c − F_v·ẋ. The jump is what
        it has moved beyond the growth of the force since the breakaway over k.
        """
        p, rate = GRAPHITE_PACKING, 2000.0
        pressure = 8e4 + rate * SAMPLE_PERIOD * np.arange(30001)
        force = GRAPHITE_VALVE.actuator_force(pressure) - p.spring_preload
        found = simulate(GRAPHITE_VALVE, p, pressure, SAMPLE_PERIOD)
        start = force[0] / p.spring_constant
        np.testing.assert_allclose(found.position[0], start, rtol=1e-14)
        speed = 0.0445 * rate / p.spring_constant
        assert found.velocity[-1] == pytest.approx(speed, rel=1e-9)
        jump = (p.static_friction - p.coulomb_friction) / p.spring_constant
        lag = p.viscous_friction * speed / p.spring_constant
        growth = (force[-1] - p.spring_constant * start - p.static_friction) / p.spring_constant
        assert found.position[-1] - start == pytest.approx(jump + growth - lag, rel=1e-9)
        # It breaks away at F_s: 942.4 N at 89 N/s, within the sample before the first motion.
        first = int(np.flatnonzero(found.velocity)[0])
        due = p.static_friction / (0.0445 * rate) / SAMPLE_PERIOD
        assert first - 1 <= due < first

    def test_stick_slip_limit_cycle(self):
        """A slow ramp moves an undamped stem in equal jumps of 2·(F_s − F_c)/k.

        Each begins at F_s and, as the ramp hardly moves during a jump, ends at 2·F_c − F_s.
        """
        spring, coulomb, static, rate = 1e4, 20.0, 30.0, 0.5
        parameters = packing(spring=spring, coulomb=coulomb, static=static)
        time = 1e-2 * np.arange(20001)
        found = simulate(FREE, parameters, rate * time, 1e-2, StemState(0.0))
        resting = found.velocity == 0
        levels = np.unique(found.position[resting])
        assert levels.size == 1 + math.floor((100.0 - static) / (2 * (static - coulomb)) + 1)
        # The force grows by rate · π·√(m/k) = 0.016 N during the jump of 20 N, at most.
        share = rate * math.pi * math.sqrt(1.0 / spring) / (2 * (static - coulomb))
        jump = 2 * (static - coulomb) / spring
        np.testing.assert_allclose(np.diff(levels), jump, rtol=2 * share)


class TestTravelStops:
    def test_hit_and_left(self):
        """Full strokes: the stem is held at each stop until the spring can move it off.

        At the top it leaves when F − F_0 − k·travel = −F_s, at the bottom when F − F_0 = F_s.
        """
        p, travel = LOW_FRICTION, BENCH_VALVE.travel
        pressure = TriangleWave(period=20.0).sample(SAMPLE_PERIOD * np.arange(40001))
        position, velocity = simulate(BENCH_VALVE, p, pressure, SAMPLE_PERIOD)
        force = BENCH_VALVE.actuator_force(pressure) - p.spring_preload
        assert (position.min(), position.max()) == (0.0, travel)
        for stop, leaving in (
            (travel, p.spring_constant * travel - p.static_friction),
            (0.0, p.static_friction),
        ):
            held = position == stop
            np.testing.assert_array_equal(velocity[held], 0.0)
            edges = np.diff(held.astype(int))
            hits, departures = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
            assert hits.size == 2
            assert departures.size == 2
            assert (np.abs(velocity[hits]) > 1e-3).all()  # it arrives sliding
            for last in departures:
                # held at the last sample, beyond balance at the next one
                assert min(force[last : last + 2]) <= leaving <= max(force[last : last + 2])

    @pytest.mark.parametrize("speed", [0.1, 50.0])
    def test_no_rebound(self, speed):
        valve = Valve(1.0, travel=0.02)
        found = simulate(valve, packing(), constant(0.0, 1000), 1e-3, StemState(0.00955, speed))
        reached = math.ceil(0.01045 / speed / 1e-3)
        np.testing.assert_array_equal(found.position[reached:], 0.02)
        np.testing.assert_array_equal(found.velocity[reached:], 0.0)
        below = simulate(valve, packing(), constant(0.0, 1000), 1e-3, StemState(0.01045, -speed))
        np.testing.assert_array_equal(below.position[reached:], 0.0)


class TestStart:
    def test_balance_within_the_travel(self):
        p = LOW_FRICTION
        middle = balanced_state(BENCH_VALVE, p, 1e5)
        force = 0.0445 * (1e5 - 41740.0)
        assert middle.velocity == 0
        assert middle.position == pytest.approx((force - 231.65) / 2.05e5, rel=1e-14)
        assert balanced_state(BENCH_VALVE, p, 0.0) == StemState(0.0)
        assert balanced_state(BENCH_VALVE, p, 2.5e5) == StemState(BENCH_VALVE.travel)

    def test_balance_without_stops_or_spring(self):
        assert balanced_state(FREE, packing(spring=10.0), -5.0) == StemState(-0.5)
        assert balanced_state(FREE, packing(), 5.0) == StemState(0.0)

    def test_simulation_begins_there_by_default(self):
        pressure = np.linspace(1e5, 1.2e5, 50)
        found = simulate(BENCH_VALVE, LOW_FRICTION, pressure, SAMPLE_PERIOD)
        start = balanced_state(BENCH_VALVE, LOW_FRICTION, 1e5)
        assert StemState(found.position[0], found.velocity[0]) == start
        again = simulate(BENCH_VALVE, LOW_FRICTION, pressure, SAMPLE_PERIOD, start)
        np.testing.assert_array_equal(again.position, found.position)

    def test_single_sample(self):
        state = StemState(0.004, 0.01)
        found = simulate(BENCH_VALVE, LOW_FRICTION, np.array([1e5]), SAMPLE_PERIOD, state)
        assert found.end == state


class TestRefusals:
    @pytest.mark.parametrize("pressure", [[], [[1e5]], [1e5, math.nan], [math.inf, 1e5]])
    def test_pressure(self, pressure):
        rule = r"^pressure must be a non-empty row of finite samples"
        with pytest.raises(ValueError, match=rule):
            simulate(BENCH_VALVE, LOW_FRICTION, np.array(pressure), SAMPLE_PERIOD)

    @pytest.mark.parametrize("period", [0.0, -1e-3, math.nan, math.inf])
    def test_sample_period(self, period):
        with pytest.raises(ValueError, match=r"^sample_period must be"):
            simulate(BENCH_VALVE, LOW_FRICTION, np.array([1e5, 1e5]), period)

    @pytest.mark.parametrize("duration", [0.0, -1e-3, math.nan, math.inf])
    def test_duration(self, duration):
        with pytest.raises(ValueError, match=r"^duration must be"):
            advance(StemState(0.0), BENCH_VALVE, LOW_FRICTION, (1e5, 1e5), duration)

    @pytest.mark.parametrize("pressures", [(math.nan, 1e5), (1e5, math.inf)])
    def test_pressures_of_a_step(self, pressures):
        with pytest.raises(ValueError, match=r"^pressure must be finite"):
            advance(StemState(0.0), BENCH_VALVE, LOW_FRICTION, pressures, 1e-3)

    @pytest.mark.parametrize(
        ("start", "last", "what"),
        [(StemState(0.01), 0.0, "starts or stops"), (StemState(0.0, 0.015), 1e6, "reverses")],
    )
    def test_a_stem_that_swings_for_ever(self, start, last, what):
        """A massless stem on a stiff spring swings 10^10 times within the sample of 10 s."""
        swinging = packing(mass=1e-12, spring=1e7)
        with pytest.raises(ArithmeticError, match=f"{what} a million times within one sample"):
            advance(start, FREE, swinging, (0.0, last), 10.0)


def response(c, s, time):
    """Slope, value and the two integrals at `time`, each divided by its power of the time."""
    found = impulse_response(c / time, s / time**2, time)
    return np.array(
        [
            found.slope,
            found.value / time,
            found.integral / time**2,
            found.second_integral / time**3,
        ]
    )


def power_series(c, s):
    """The same by the Taylor series of h, with as many digits as its cancellation costs."""
    reach = c + math.sqrt(s)  # terms grow up to about exp(reach)
    with localcontext() as context:
        context.prec = int(40 + reach)
        damping, stiffness = Decimal(c), Decimal(s)
        term, previous, order = Decimal(1), Decimal(0), 1
        sums = [Decimal(0)] * 4
        while order < reach or max(abs(term), abs(previous)) > Decimal("1e-45"):
            sums[0] += order * term
            sums[1] += term
            sums[2] += term / (order + 1)
            sums[3] += term / ((order + 1) * (order + 2))
            following = -(damping * order * term + stiffness * previous) / (order * (order + 1))
            previous, term, order = term, following, order + 1
        return np.array([float(total) for total in sums])


def rounding_scales(c, s):
    """What one relative rounding of c, s or the time does to each of the four, about.

    With r² = |c²/4 − s|, h is the envelope, exp of the slower rate, times sin(r)/r or its like,
    so at most 1/max(1, r). A rounding of the rates, at most c + √s, moves it by so many eps, and
    one of s by s/max(1, r²) more, which is much near critical damping. The integrals settle at
    about 1/max(1, c, s).
    """
    root = math.sqrt(abs(c * c / 4 - s))
    envelope = math.exp(math.sqrt(max(c * c / 4 - s, 0.0)) - c / 2)
    value = envelope / max(1.0, root)
    settled = 1 / max(1.0, c, s)
    sensitivity = 1 + c + math.sqrt(s) + s / max(1.0, root * root)
    return sensitivity * np.array([envelope + c / 2 * value, value, settled, settled])


def roundings(c, s):
    """How many roundings each of the four takes.

    Near critical damping and below it the integrals come from the differential equation: a
    difference, rounded to about 2 eps, is divided by s once and twice, and s is 1/16 at the least
    there. All else rounds a dozen times.
    """
    return np.array([16, 16, 64, 512] if s > 0.98 * c * c / 4 else [16, 16, 16, 16])


nearness = st.one_of(st.just(0.0), st.floats(-16.0, -0.5).map(lambda power: 10**power))
signs = st.sampled_from([-1.0, 1.0])


@st.composite
def dimensionless(draw, largest=3.0):
    """c and s: independent of each other, without spring or damping, or nearly critical."""
    c = 10 ** draw(st.floats(-6.0, largest))
    kind = draw(st.sampled_from(["free", "no spring", "no damping", "critical"]))
    if kind == "no spring":
        return c, 0.0
    if kind == "critical":
        return c, c * c / 4 * (1 + draw(signs) * draw(nearness))
    s = 10 ** draw(st.floats(-8.0, 2 * largest))
    return (0.0, s) if kind == "no damping" else (c, s)


@given(dimensionless())
@example((25.6, 0.117))  # the bench valve with high friction: 39 µs, stepped by 1 ms
@example((0.5, 0.0625))  # critical damping where the branches meet
@example((0.499999999, 0.2499999))
@example((1.0, 0.25))
@example((0.0, 0.0))
def test_impulse_response_against_power_series(pair):
    c, s = pair
    error = np.abs(response(c, s, 1.0) - power_series(c, s))
    np.testing.assert_array_less(error, roundings(c, s) * EPS * rounding_scales(c, s) + 1e-39)


@pytest.mark.parametrize("time", [1e-6, 39e-6, 1e-3, 0.1])
def test_motion_of_the_stiff_valve(time):
    """Forced motion against the exponential of the system with force and slope as states."""
    p = HIGH_FRICTION
    position, velocity, force, slope = 0.012, 0.004, 3400.0, 5000.0
    acceleration = (force - p.spring_constant * position - p.viscous_friction * velocity) / p.mass
    jerk = slope / p.mass - p.spring_constant / p.mass * velocity
    damping, stiffness = p.viscous_friction / p.mass, p.spring_constant / p.mass
    response = impulse_response(damping, stiffness, time)
    found = motion_after(Motion(position, velocity, acceleration), jerk, response, time)
    system = np.zeros((4, 4))
    system[0, 1] = system[2, 3] = 1.0
    system[1, :3] = -stiffness, -damping, 1 / p.mass
    exponential, start = expm(system * time), [position, velocity, force, slope]
    expected = exponential @ start
    tolerance = 16 * EPS * expm_cond(system * time) * np.abs(exponential) @ start
    assert abs(found.position - expected[0]) <= tolerance[0]
    assert abs(found.velocity - expected[1]) <= tolerance[1]
    # (1) itself gives the acceleration; its terms are forces of up to 3 kN, over the mass.
    drive, spring = force + slope * time, p.spring_constant * found.position
    balance = (drive - spring - p.viscous_friction * found.velocity) / p.mass
    assert abs(found.acceleration - balance) <= 64 * EPS * force / p.mass


def acceleration(start, jerk, damping, stiffness, time):
    """Acceleration at `time`, and the part of it that rounding leaves open."""
    found = impulse_response(damping, stiffness, time)
    scales = rounding_scales(damping * time, stiffness * time**2)
    open_part = 32 * EPS * (abs(start) * scales[0] + abs(jerk) * time * scales[1])
    return start * found.slope + jerk * found.value, open_part


def timing_part(start, jerk, damping, stiffness):
    """Acceleration gained while a phase of the swing, known to about 2 eps·π, passes."""
    swing = stiffness - damping**2 / 4
    rate = abs(jerk) + abs(start) * (damping + math.sqrt(stiffness))
    return rate * 2 * EPS * math.pi / math.sqrt(swing) if swing > 0 else 0.0


@st.composite
def turns(draw):
    """Acceleration, jerk, damping and stiffness, the time in units of the faster one."""
    c, s = draw(dimensionless(largest=1.0))
    start = draw(signs) * 10 ** draw(st.floats(-4.0, 4.0))
    jerk = draw(st.one_of(st.just(0.0), st.floats(-4.0, 4.0).map(lambda power: 10**power)))
    return start, draw(signs) * jerk, c, s


@given(turns())
@example((1.0, -2.0, 2.0, 1.0))  # critical: (1 − 3·t)·e^−t
def test_first_turn(case):
    start, jerk, damping, stiffness = case
    turn = first_turn(start, jerk, damping, stiffness)
    if turn == math.inf:
        slow = stiffness / max(damping, 1e-300)
        times = np.geomspace(1e-3, 30 / min(slow, 1.0) if slow > 0 else 1e3, 60)
    else:
        assert turn > 0
        found, open_part = acceleration(start, jerk, damping, stiffness, turn)
        assert abs(found) <= open_part + timing_part(start, jerk, damping, stiffness)
        times = turn * np.linspace(0.0, 1.0, 60)[1:-1]
    for time in times:
        assume(damping * time < 600)
        found, open_part = acceleration(start, jerk, damping, stiffness, time)
        assert math.copysign(1.0, start) * found >= -open_part


def convolution_series(c, s):
    """h ∗ h at time 1 by its Taylor series, which that of h drives."""
    reach = c + math.sqrt(s)
    with localcontext() as context:
        context.prec = int(60 + reach)
        damping, stiffness = Decimal(c), Decimal(s)
        response, found = [Decimal(0), Decimal(1)], [Decimal(0), Decimal(0)]
        for order in range(2, int(60 + 4 * reach)):
            products = order * (order - 1)
            falls = (order - 1) * damping
            found.append((response[-2] - falls * found[-1] - stiffness * found[-2]) / products)
            response.append(-(falls * response[-1] + stiffness * response[-2]) / products)
        return np.array(
            [
                float(sum(order * term for order, term in enumerate(found))),
                float(sum(found)),
                float(sum(term / (order + 1) for order, term in enumerate(found))),
                float(sum(t / ((n + 1) * (n + 2)) for n, t in enumerate(found))),
            ]
        )


@settings(deadline=None)
@given(dimensionless(largest=2.0), st.floats(1e-3, 10.0))
@example((25.6, 0.117), 1.0)
@example((0.5, 0.0625), 1.0)
@example((0.499999999, 0.2499999), 1.0)
@example((40.0, 0.0), 1e-3)
def test_self_convolution_against_power_series(pair, time):
    c, s = pair
    damping, stiffness = c / time, s / time**2
    found = self_convolution(damping, stiffness, time, impulse_response(damping, stiffness, time))
    scaled = np.array(found) / time ** np.array([2, 3, 4, 5])
    expected = convolution_series(c, s)
    # An oscillation is small beside what it has come from; its integrals settle at 1/s and 1/s².
    settled = 1 / max(1.0, c, s) ** 2
    assert scaled == pytest.approx(expected, rel=1e-9, abs=1e-12 * settled)
