# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Student's t: the quantile of an interval, without scipy.

scipy.special would do, but takes 55 MB and a fifth of a second of processor time in a program that
needs nothing else of it.
"""

import math
from functools import cache

_MANY = 1e8
"""Degrees of freedom from which the quantile is that of the normal distribution to 10⁻⁸."""

_TINY = 1e-300
_ROUNDING = 1e-15
_MOST_TERMS = 10_000
_MOST_STEPS = 200
"""A fraction of n degrees of freedom takes some √n terms; each step towards a quantile far out in
the tail of few degrees of freedom doubles it at least."""


@cache
def student_quantile(probability: float, freedom: float) -> float:
    """Return the t that Student's distribution stays below with a probability.

    Parameters
    ----------
    probability : float
        Above 0.5 and below 1.
    freedom : float
        Degrees of freedom, above zero; infinitely many make it the normal distribution.

    Notes
    -----
    Above zero the distribution function is concave, so Newton's method from zero rises towards the
    quantile without passing it.
    """
    freedom = min(freedom, _MANY)
    half = 0.5 * freedom
    scale = math.exp(math.lgamma(half + 0.5) - math.lgamma(half)) / math.sqrt(math.pi * freedom)
    t = 0.0
    for _ in range(_MOST_STEPS):
        density = scale * (1 + t * t / freedom) ** -(half + 0.5)
        step = (1 - probability - _above(t, freedom)) / -density
        t += step
        if not step > _ROUNDING * t:
            break
    return t


def _above(t: float, freedom: float) -> float:
    """Return P(T > t) for t ≥ 0: half the incomplete beta function I_x(n/2, 1/2), x = n/(n + t²).

    By its continued fraction (Abramowitz and Stegun 26.5.8, evaluated as Lentz does), or by that
    of 1 − I where it converges faster.
    """
    share = freedom / (freedom + t * t)
    half = 0.5 * freedom
    if share < (half + 1) / (half + 2.5):
        return 0.5 * _beta(half, 0.5, share, t * t / (freedom + t * t))
    return 0.5 - 0.5 * _beta(0.5, half, t * t / (freedom + t * t), share)


def _beta(a: float, b: float, x: float, rest: float) -> float:
    """Return the regularised incomplete beta function I_x(a, b); `rest` is 1 − x."""
    if x <= 0.0:
        return 0.0
    logarithm = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
    front = math.exp(logarithm + a * math.log(x) + b * math.log(rest)) / a
    numerator, denominator = 1.0, 1.0 / _not_zero(1 - (a + b) * x / (a + 1))
    value = denominator
    for order in range(1, _MOST_TERMS):
        even = order * (b - order) * x / ((a + 2 * order - 1) * (a + 2 * order))
        odd = -(a + order) * (a + b + order) * x / ((a + 2 * order) * (a + 2 * order + 1))
        for term in (even, odd):
            denominator = 1.0 / _not_zero(1 + term * denominator)
            numerator = _not_zero(1 + term / numerator)
            value *= numerator * denominator
        if abs(numerator * denominator - 1) < _ROUNDING:
            break
    return front * value


def _not_zero(value: float) -> float:
    return value if abs(value) > _TINY else _TINY
