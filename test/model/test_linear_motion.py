# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The closed form of the sliding motion against matrix exponential and power series.

With the time as unit, h depends on two numbers: c = damping·t and s = stiffness·t².
"""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm, expm_cond

from valve_friction_ros.model import HIGH_FRICTION
from valve_friction_ros.model.linear_motion import (
    Motion,
    first_turn,
    impulse_response,
    motion_after,
    self_convolution,
)

EPS = np.finfo(float).eps


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


def test_first_turn_closed_forms():
    # Undamped, h = sin(ωt)/ω: a·cos + (j/ω)·sin is first zero at ωt = π/4 for j = −a·ω,
    # at 3π/4 for j = +a·ω, at π/2 for j = 0.
    assert first_turn(3.0, -6.0, 0.0, 4.0) == pytest.approx(math.pi / 8, rel=8 * EPS, abs=0)
    assert first_turn(3.0, 6.0, 0.0, 4.0) == pytest.approx(3 * math.pi / 8, rel=8 * EPS, abs=0)
    assert first_turn(3.0, 0.0, 0.0, 4.0) == pytest.approx(math.pi / 4, rel=8 * EPS, abs=0)
    # Free mass: a + j·t.
    assert first_turn(3.0, -6.0, 0.0, 0.0) == 0.5
    assert first_turn(3.0, 6.0, 0.0, 0.0) == math.inf
    # No spring: a·e^−ct + j·(1 − e^−ct)/c with a = 1, j = −1, c = 1 is zero at ln 2.
    assert first_turn(1.0, -1.0, 1.0, 0.0) == pytest.approx(math.log(2), rel=8 * EPS, abs=0)
    # Critical, c = 2, ω₀ = 1: a·(1 − t) + j·t.
    assert first_turn(1.0, -2.0, 2.0, 1.0) == pytest.approx(1 / 3, rel=8 * EPS, abs=0)
    assert first_turn(1.0, 2.0, 2.0, 1.0) == math.inf


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
