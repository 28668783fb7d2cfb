"""Sliding friction of one block of moves after the other."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.evidence.blocks import blocks_of
from valve_friction_ros.evidence.design import design_of, priors, robust, scales_of
from valve_friction_ros.evidence.moves import Moves

__all__ = ["Series", "series_of"]


@dataclass(frozen=True, eq=False)
class Series:
    """Sliding friction of one block after the other, at one speed and one place.

    Attributes
    ----------
    begin, end : ndarray of float, shape (b,)
        Times of the first and the last move of each block, as in `Moves`, s.
    friction : ndarray of float, shape (b,)
        Sliding friction, N.
    covariance : ndarray of float, shape (b, b)
        By the scatter of moves, and by what speed and place leave open.
    first : ndarray of int, shape (b,)
        First move of each block.
    """

    begin: NDArray[np.float64]
    end: NDArray[np.float64]
    friction: NDArray[np.float64]
    covariance: NDArray[np.float64]
    first: NDArray[np.intp]


def series_of(moves: Moves, travel: float) -> Series | None:
    """Return the friction block by block; None where there are fewer than two.

    Spring, speed and place have one coefficient each, found within the blocks, so neither a new
    range of set points nor other speeds look like another friction.
    """
    blocks = blocks_of(moves)
    count = int(blocks[-1]) + 1 if len(moves) else 0
    if count < 2:
        return None
    scales = scales_of(moves)
    design = design_of(moves, blocks, scales)
    precision = priors(design, scales, moves, travel)
    values, weight = robust(design, design.force, precision, scales.friction)
    covariance = design.normal(weight, precision).friction_covariance()
    first = np.flatnonzero(np.diff(blocks, prepend=-1))
    last = np.append(first[1:], len(moves)) - 1
    return Series(moves.time[first], moves.time[last], values[-count:], covariance, first)
