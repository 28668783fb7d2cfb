# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

r"""Exact motion of the sliding stem between two events.

While the stem slides one way, (1) with the first line of (2) is linear,

.. math:: m \ddot{x} + F_v \dot{x} + k x = f_0 + f_1 t ,

with a force that is linear in time because the pressure is. The matrix exponential of such a
second-order system has a closed form: with the impulse response :math:`h` of
:math:`\ddot{h} + 2\beta\dot{h} + \omega_0^2 h = 0`, :math:`h(0)=0`, :math:`\dot{h}(0)=1`, its
first integral :math:`h_1` and second integral :math:`h_2`,

.. math::
    \dot{x}(t) &= v_0 + a_0 h(t) + j_0 h_1(t) \\
    x(t) &= x_0 + v_0 t + a_0 h_1(t) + j_0 h_2(t)

where :math:`a_0` is the acceleration at t = 0 and :math:`j_0 = (f_1 - k v_0)/m` the jerk that the
force and the spring would give without damping. No step size enters, so nothing can become
unstable, however stiff the friction.

The Laplace transform of h is 1/P, that of its derivative by :math:`\omega_0^2` is −1/P², and that
by :math:`2\beta` is −p/P². All derivatives of the motion by damping and stiffness therefore follow
from :math:`q = h * h`, the response convolved with itself, its slope and its integrals.
"""

import math
from typing import NamedTuple

from valve_friction_ros.model.compiled import compiled

_MOST_TERMS = 64
"""Terms of a power series: where one is used, its terms fall faster than 2⁻ⁿ/n!, and some twenty
matter."""


class Response(NamedTuple):
    """Impulse response at one time: its derivative, itself, its first and second integral."""

    slope: float
    value: float
    integral: float
    second_integral: float


class Motion(NamedTuple):
    """Position, velocity and acceleration of the stem."""

    position: float
    velocity: float
    acceleration: float


@compiled
def _series_response(damping: float, stiffness: float, time: float) -> Response:
    """Power series of the impulse response, for times short against both time constants."""
    term, previous = time, 0.0
    slope, value = 1.0, time
    integral, second_integral = term * time / 2, term * time * time / 6
    for order in range(2, _MOST_TERMS):
        if not (abs(term) > 1e-18 * time or abs(previous) > 1e-18 * time):
            break
        following = -(damping * time * (order - 1) * term + stiffness * time * time * previous) / (
            order * (order - 1)
        )
        previous, term = term, following
        value += term
        slope += order * term / time
        integral += term * time / (order + 1)
        second_integral += term * time * time / ((order + 1) * (order + 2))
    return Response(slope, value, integral, second_integral)


@compiled
def _decay_integrals(rate: float, time: float) -> tuple[float, float]:
    """First and second integral from 0 to `time` of exp(rate·t)."""
    exponent = rate * time
    if abs(exponent) < 0.5:
        term = 0.5
        total = term
        for order in range(3, _MOST_TERMS):
            if not abs(term) > 1e-18:
                break
            term *= exponent / order
            total += term
        second = total * time * time
        return time + rate * second, second
    first = math.expm1(exponent) / rate
    return first, (first - time) / rate


@compiled
def _overdamped_response(
    damping: float, discriminant: float, stiffness: float, time: float
) -> Response:
    """Impulse response as the divided difference of two decays with well separated rates."""
    fast = -(damping / 2 + math.sqrt(discriminant))
    slow = stiffness / fast
    fast_decay, slow_decay = math.exp(fast * time), math.exp(slow * time)
    fast_first, fast_second = _decay_integrals(fast, time)
    slow_first, slow_second = _decay_integrals(slow, time)
    spread = fast - slow
    return Response(
        (fast * fast_decay - slow * slow_decay) / spread,
        (fast_decay - slow_decay) / spread,
        (fast_first - slow_first) / spread,
        (fast_second - slow_second) / spread,
    )


@compiled
def _oscillating_response(
    damping: float, discriminant: float, stiffness: float, time: float
) -> Response:
    """Impulse response of a damped oscillation, or of two nearly equal decays."""
    root = math.sqrt(abs(discriminant))
    angle = root * time
    decay = math.exp(-damping / 2 * time)
    if angle < 1e-8:
        value, cosine = time * decay, decay
    elif discriminant < 0:
        value, cosine = decay * math.sin(angle) / root, decay * math.cos(angle)
    else:
        slower = math.exp((root - damping / 2) * time)
        value = slower * -math.expm1(-2 * angle) / (2 * root)
        cosine = slower * (1 + math.exp(-2 * angle)) / 2
    slope = cosine - damping / 2 * value
    integral = (1 - slope - damping * value) / stiffness
    return Response(slope, value, integral, (time - value - damping * integral) / stiffness)


@compiled
def impulse_response(damping: float, stiffness: float, time: float) -> Response:
    """Impulse response of ḧ + damping·ḣ + stiffness·h = 0, its slope and its two integrals.

    Parameters
    ----------
    damping : float
        F_v/m, 1/s, not negative.
    stiffness : float
        k/m, 1/s², not negative.
    time : float
        Time since the impulse, s, not negative.

    Returns
    -------
    Response
        ḣ (1), h (s), ∫h (s²), ∬h (s³) at `time`.

    Notes
    -----
    Each branch is used where its formula loses no digits: the power series for short times, a
    divided difference of two decays where their rates lie well apart (stiff friction, no spring),
    and otherwise the oscillation, whose integrals follow from the differential equation.
    """
    if damping * time < 0.5 and stiffness * time * time < 0.25:
        return _series_response(damping, stiffness, time)
    quarter = damping * damping / 4
    discriminant = quarter - stiffness
    if discriminant > 0.01 * quarter:
        return _overdamped_response(damping, discriminant, stiffness, time)
    return _oscillating_response(damping, discriminant, stiffness, time)


@compiled
def _series_convolution(damping: float, stiffness: float, time: float) -> Response:
    """Power series of h ∗ h, driven by that of h."""
    friction, spring = damping * time, stiffness * time * time
    response, response_before = time, 0.0
    term, previous = 0.0, 0.0
    slope = value = integral = second_integral = 0.0
    for order in range(2, _MOST_TERMS):
        products = order * (order - 1)
        following = time * time * response_before - friction * (order - 1) * term
        previous, term = term, (following - spring * previous) / products
        following = -(friction * (order - 1) * response + spring * response_before) / products
        response_before, response = response, following
        value += term
        slope += order * term / time
        integral += term * time / (order + 1)
        second_integral += term * time * time / ((order + 1) * (order + 2))
        if order > 3 and not (abs(term) > 1e-18 * value or abs(previous) > 1e-18 * value):
            break
    return Response(slope, value, integral, second_integral)


@compiled
def _third_decay_integral(rate: float, time: float, second: float) -> float:
    """Third integral from 0 to `time` of exp(rate·t), given the second."""
    exponent = rate * time
    if abs(exponent) >= 0.5:
        return (second - time * time / 2) / rate
    term = 1.0 / 6.0
    total = term
    for order in range(4, _MOST_TERMS):
        if not abs(term) > 1e-18:
            break
        term *= exponent / order
        total += term
    return total * time * time * time


@compiled
def _overdamped_convolution(
    damping: float, discriminant: float, stiffness: float, time: float, response: Response
) -> Response:
    """H ∗ h of two decays with well separated rates: (e₁ − e₂)² transformed, over their spread."""
    fast = -(damping / 2 + math.sqrt(discriminant))
    slow = stiffness / fast
    square = 4 * discriminant
    slope, value = -2 * response.slope, -2 * response.value
    integral, second_integral = -2 * response.integral, -2 * response.second_integral
    for rate in (fast, slow):
        decay = math.exp(rate * time)
        first, second = _decay_integrals(rate, time)
        third = _third_decay_integral(rate, time, second)
        slope += decay * (1 + rate * time)
        value += time * decay
        integral += time * first - second
        second_integral += time * second - 2 * third
    return Response(slope / square, value / square, integral / square, second_integral / square)


@compiled
def _oscillating_convolution(
    damping: float, discriminant: float, stiffness: float, time: float, response: Response
) -> Response:
    """H ∗ h of a damped oscillation, or of two nearly equal decays."""
    square = discriminant * time * time
    if abs(square) < 1.0:
        term, total = 1.0 / 6.0, 0.0
        for order in range(1, _MOST_TERMS):
            if not abs(order * term) > 1e-18:
                break
            total += order * term
            term *= square / ((2 * order + 2) * (2 * order + 3))
        value = math.exp(-damping / 2 * time) * time * time * time * total
    else:
        cosine = 2 * response.slope + damping * response.value
        value = (time * cosine - 2 * response.value) / (4 * discriminant)
    slope = (time * response.value - damping * value) / 2
    integral = (response.integral - slope - damping * value) / stiffness
    second_integral = (response.second_integral - value - damping * integral) / stiffness
    return Response(slope, value, integral, second_integral)


@compiled
def self_convolution(damping: float, stiffness: float, time: float, response: Response) -> Response:
    """Convolve the impulse response with itself: the slope, q = h ∗ h, and its two integrals.

    They are what an impulse response loses by a unit of damping and of stiffness:

        ∂h/∂damping = −q̇ and ∂h/∂stiffness = −q,

    and so on for the integrals; q̈ = h − damping·q̇ − stiffness·q.

    Parameters
    ----------
    damping, stiffness, time : float
        As for `impulse_response`.
    response : Response
        Its result.

    Returns
    -------
    Response
        q̇ (s²), q (s³), ∫q (s⁴), ∬q (s⁵) at `time`.
    """
    if damping * time < 0.5 and stiffness * time * time < 0.25:
        return _series_convolution(damping, stiffness, time)
    quarter = damping * damping / 4
    discriminant = quarter - stiffness
    if discriminant > 0.01 * quarter:
        return _overdamped_convolution(damping, discriminant, stiffness, time, response)
    return _oscillating_convolution(damping, discriminant, stiffness, time, response)


@compiled
def motion_after(start: Motion, jerk: float, response: Response, time: float) -> Motion:
    """Motion `time` seconds after `start`, given the impulse response at that time."""
    return Motion(
        start.position
        + start.velocity * time
        + start.acceleration * response.integral
        + jerk * response.second_integral,
        start.velocity + start.acceleration * response.value + jerk * response.integral,
        start.acceleration * response.slope + jerk * response.value,
    )


@compiled
def first_turn(acceleration: float, jerk: float, damping: float, stiffness: float) -> float:
    """Time of the first zero of a₀·ḣ(t) + j₀·h(t), the acceleration, after t = 0; inf if none.

    Between two such times the velocity is monotone. An oscillating stem turns again every
    π/√(ω₀² − β²) after the first; any other turns once at most.
    """
    discriminant = damping * damping / 4 - stiffness
    if discriminant >= 0:
        root = math.sqrt(discriminant)
        fast = -(damping / 2 + root)
        slow = stiffness / fast if fast != 0 else 0.0
        weight = acceleration * slow + jerk
        if weight == 0:
            return math.inf
        ratio = -acceleration / weight
        if ratio <= 0:
            return math.inf
        argument = 2 * root * ratio
        return math.log1p(argument) / (2 * root) if argument > 0 else ratio
    frequency = math.sqrt(-discriminant)
    angle = math.atan2(-acceleration * frequency, jerk - acceleration * damping / 2)
    if angle <= 0:
        angle += math.pi
    if angle == 0:
        angle = math.pi
    return angle / frequency


class Dynamics(NamedTuple):
    """Parameters of one direction of motion, as floats for compiled kernels (SI units)."""

    mass: float
    viscous_friction: float
    coulomb_friction: float
    static_friction: float
    spring_constant: float
    limit_velocity: float
    travel: float
    stribeck_velocity: float


@compiled
def sliding_friction(dynamics: Dynamics, speed: float) -> float:
    """Friction of the sliding stem, N."""
    ratio = speed / dynamics.stribeck_velocity
    fall = (dynamics.static_friction - dynamics.coulomb_friction) * math.exp(-ratio * ratio)
    return dynamics.coulomb_friction + fall + dynamics.viscous_friction * speed


class FrictionFall(NamedTuple):
    """Remainder at one speed of the slip force ΔF = F_s − F_c, which falls with the speed.

    Attributes
    ----------
    share : float
        The share that is left, exp(−(v/v_s)²); 0 without a fall.
    by_stribeck : float
        Derivative of ΔF times that share by v_s, N·s/m.
    """

    share: float
    by_stribeck: float


@compiled
def friction_fall(dynamics: Dynamics, speed: float) -> FrictionFall:
    """Return the remainder of the slip force at a speed, m/s."""
    if dynamics.stribeck_velocity == 0.0:
        return FrictionFall(0.0, 0.0)
    ratio = speed / dynamics.stribeck_velocity
    share = math.exp(-ratio * ratio)
    slip = dynamics.static_friction - dynamics.coulomb_friction
    return FrictionFall(share, 2.0 * slip * ratio * ratio * share / dynamics.stribeck_velocity)
