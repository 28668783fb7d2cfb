"""Student's t: the quantile of an interval, without scipy.

scipy.special would do, but takes 55 MB and a second of processor time in a program that needs
nothing else of it, such as the dashboard.
"""

import math
from functools import cache

__all__ = ["student_quantile"]

_STEPS = 60


@cache
def student_quantile(probability: float, freedom: int) -> float:
    """Return the t that Student's distribution stays below with a probability.

    Parameters
    ----------
    probability : float
        Above 0.5 and below 1.
    freedom : int
        Degrees of freedom, 1 at least.

    Notes
    -----
    P(|T| < t) is a finite sum of powers of cos θ with tan θ = t/√freedom (Abramowitz and Stegun,
    26.7.3 and 26.7.4); θ is found by halving.
    """
    low, high = 0.0, math.pi / 2
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        if _within(middle, freedom) < 2 * probability - 1:
            low = middle
        else:
            high = middle
    return math.sqrt(freedom) * math.tan(0.5 * (low + high))


def _within(angle: float, freedom: int) -> float:
    """Return P(|T| < t) for tan(angle) = t/√freedom."""
    sine, square = math.sin(angle), math.cos(angle) ** 2
    is_odd = freedom % 2
    term = math.cos(angle) if is_odd else 1.0
    total = 0.0
    for step in range(freedom // 2):
        total += term
        power = 2 * step + (2 if is_odd else 1)
        term *= square * power / (power + 1)
    return 2 / math.pi * (angle + sine * total) if is_odd else sine * total
