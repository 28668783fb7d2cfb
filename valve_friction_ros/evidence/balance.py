"""Moves combined: one estimate of friction and spring, with its covariance."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.evidence.blocks import blocks_of
from valve_friction_ros.evidence.design import (
    SLIDING,
    SPRING,
    STATIC,
    Design,
    design_of,
    priors,
    robust,
    scales_of,
    solution,
    with_onsets,
)
from valve_friction_ros.evidence.moves import Moves
from valve_friction_ros.identification.trust.student import student_quantile

__all__ = ["FEWEST_BLOCKS", "FEWEST_MOVES", "MOST_BLOCKS", "Balance", "balance_of"]

MOST_BLOCKS = 60
"""Blocks of an estimate at most: the intervals of more are no narrower."""

FEWEST_BLOCKS = 4
"""Blocks below which nothing is estimated: their scatter gives the interval."""

FEWEST_MOVES = 12
"""Moves in each direction below which nothing is estimated."""

_SYSTEMATIC = 0.02
"""Standard deviation, as a share of the friction, of what no scatter shows: presliding, sampling,
and the travel in motions that are too short to be a move. Chosen: a packing that bends by 25 µm
before it slides changes the mean friction of 0.5 mm by some 4 %."""

_BENT = 0.005
"""The same of a friction that follows speed and place by another law than a line: what it adds to
the spring constant, over the scatter of the places."""


@dataclass(frozen=True, eq=False)
class Balance:
    """Estimate of the unknowns, with its covariance.

    Attributes
    ----------
    values : ndarray of float, shape (p,)
        Spring constant (N/m), change of friction with speed (N·s/m) and along the travel (N/m),
        static friction (N), preload (N) at `place`, its deviations by epoch, and last the sliding
        friction (N).
    scatter : ndarray of float, shape (p, p)
        Covariance by the scatter of blocks, and by the priors.
    systematic : ndarray of float, shape (p, p)
        Covariance by the lag of the signals, and by what no scatter shows.
    quantile : float
        Half width of a 95 % interval over the standard error, of what scatters.
    speed : float
        Speed that the sliding friction belongs to, ∫|v|·|dx| / ∫|dx| of all moves, m/s.
    place : float
        Mean position of the moves, m.
    onsets : int
        Moves that began at a rest.
    timing : float
        Standard deviation of the lag between the signals, s.
    lag : ndarray of float, shape (p,)
        Change of the values by a lag of 1 s.
    """

    values: NDArray[np.float64]
    scatter: NDArray[np.float64]
    systematic: NDArray[np.float64]
    quantile: float
    speed: float
    place: float
    onsets: int
    timing: float
    lag: NDArray[np.float64]

    def number(self, slope: NDArray[np.float64]) -> tuple[float, float]:
        """Return standard error and half width of a number, by its derivatives to the values."""
        random, fixed = (
            math.sqrt(max(float(slope @ one @ slope), 0.0))
            for one in (self.scatter, self.systematic)
        )
        return math.hypot(random, fixed), math.hypot(self.quantile * random, _TWO * fixed)


_TWO = 2.0


def balance_of(
    moves: Moves, timing: float, travel: float, spring_constant: float | None = None
) -> Balance | None:
    """Combine moves.

    Parameters
    ----------
    moves : Moves
        The moves, oldest first.
    timing : float
        Standard deviation of the lag between the signals, s.
    travel : float
        Travel of the stem, m.
    spring_constant : float, optional
        Known value, N/m.

    Returns
    -------
    Balance or None
        None where there are too few moves.

    Notes
    -----
    Weights are the distances: the sliding friction is the mean over the distance. Outliers have
    Huber's weights. The unknowns but friction, spring and first preload have priors, in the
    covariance too. The scatter is that of leaving out one block of time after the other
    (jackknife), which holds for errors that are correlated within a block. A lag of the signals
    is not estimated, since a friction that changes with speed looks like one: its uncertainty is
    carried into all numbers.
    """
    blocks = blocks_of(moves, MOST_BLOCKS)
    count = int(blocks[-1]) + 1 if len(moves) else 0
    ways = [int(np.sum(moves.direction == way)) for way in (-1, 1)]
    if min(ways) < FEWEST_MOVES or count < FEWEST_BLOCKS:
        return None
    scales = scales_of(moves)
    scale, place, speed = scales
    design = design_of(moves, np.zeros(len(moves), dtype=np.intp), scales)
    precision = priors(design, scales, moves, travel)
    precision[SLIDING] = 0.0
    design = with_onsets(design, moves, place)
    shift = 0.0
    if spring_constant is not None:
        shift, precision[SPRING] = spring_constant, _KNOWN
    target = design.force - shift * design.dense[:, SPRING]
    values, weight = robust(design, target, precision, scale)
    blocks = np.concatenate((blocks, blocks[np.isfinite(moves.onset_force)]))
    scatter, lag = _covariance(design, target, weight, blocks, precision)
    values[SPRING] += shift
    systematic = np.outer(timing * lag, timing * lag).astype(np.float64)
    for friction in (SLIDING, STATIC):
        systematic[friction, friction] += (_SYSTEMATIC * values[friction]) ** 2
    if spring_constant is None:
        spread = math.sqrt(float(np.average((moves.place - place) ** 2, weights=moves.distance)))
        systematic[SPRING, SPRING] += (_BENT * scale / max(spread, 1e-12)) ** 2
    quantile = student_quantile(0.975, max(count - 2, 2))
    onsets = int(np.isfinite(moves.onset_force).sum())
    return Balance(values, scatter, systematic, quantile, speed, place, onsets, timing, lag)


_KNOWN = 1e30


def _covariance(
    design: Design,
    target: NDArray[np.float64],
    weight: NDArray[np.float64],
    blocks: NDArray[np.intp],
    precision: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the covariance by scatter and priors, and the change of the values by 1 s of lag."""
    order = np.argsort(blocks, kind="stable")
    rows, weight = design.rows()[order], weight[order]
    weighted = rows * weight[:, None]
    parts = np.split(np.arange(order.size), np.flatnonzero(np.diff(blocks[order])) + 1)
    normals = np.array([weighted[part].T @ rows[part] for part in parts])
    rights = np.array([target[order[part]] @ weighted[part] for part in parts])
    normal, right = normals.sum(axis=0) + np.diag(precision), rights.sum(axis=0)
    without = solution(normal - normals, right - rights)
    count = len(parts)
    spread = without - without.mean(axis=0)
    inverse = solution(normal, np.eye(design.size))
    by_blocks = (count - 1) / count * spread.T @ spread + inverse @ np.diag(precision) @ inverse
    # The larger of both, one by one: the scatter of few blocks may be small by chance.
    larger = np.diag(inverse) / np.maximum(np.diag(by_blocks), 1e-300)
    grown = np.sqrt(np.maximum(larger, 1.0))
    return by_blocks * np.outer(grown, grown), solution(normal, design.rate[order] @ weighted)
