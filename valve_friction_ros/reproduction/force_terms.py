"""The contribution of each term to the force balance (4), for Fig. 5."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.reproduction.programme import BenchResult
from valve_friction_ros.signals import differentiate

__all__ = ["ForceTerms", "force_terms"]

_ORDER = 3
_WINDOW = 0.25
"""Order, and length in s, of the derivative windows. Chosen: short against the 35.5 s of the
sine."""

_REST = 0.05
"""Share of the top speed below which the stem counts as resting. Chosen: above its noise."""


class ForceTerms(NamedTuple):
    """Time since the first sample, s, and the terms of (4) by name, N, shape (n,) each.

    The terms are k·x, F_c·sgn ẋ, F_v·ẋ and m·ẍ, in this order; x counts from the bias of (10), and
    the sign of a resting stem is 0.
    """

    time: NDArray[np.float64]
    terms: dict[str, NDArray[np.float64]]


def force_terms(result: BenchResult) -> ForceTerms:
    """Evaluate the terms for the measured sine with model 1.

    The derivative windows are a quarter of a second long, so that the remaining noise is small.
    """
    recording, model = result.experiments.sine.measured, result.identified.published
    window = round(_WINDOW / recording.sample_period) | 1
    found = differentiate(recording.position, recording.sample_period, window, _ORDER)
    moving = np.abs(found.velocity) > _REST * np.max(np.abs(found.velocity))
    return ForceTerms(
        found.inner(recording.time),
        {
            "k·x": model.spring_constant * found.inner(recording.position) + model.spring_preload,
            "F_c·sgn ẋ": model.coulomb_friction * np.sign(found.velocity) * moving,
            "F_v·ẋ": model.viscous_friction * found.velocity,
            "m·ẍ": model.mass * found.acceleration,
        },
    )
