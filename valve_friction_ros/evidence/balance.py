"""Many moves combined: the weighted regression of their force balances."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, special

from valve_friction_ros.evidence.moves import Moves

__all__ = ["BLOCK", "FEWEST_BLOCKS", "FEWEST_MOVES", "Balance", "Series", "balance_of", "series_of"]

BLOCK = 600.0
"""Least time, s, of moves whose errors are taken as correlated."""

_BLOCK_MOVES = 4
"""And least number of such moves in each direction."""

_MOST_BLOCKS = 60
FEWEST_BLOCKS = 4
"""Blocks below which nothing is estimated: their scatter gives the interval."""

FEWEST_MOVES = 12
"""Moves in each direction below which nothing is estimated."""

_EPOCH = 3600.0
"""Time, s, over which the preload stays the same: temperature and sensors drift over longer."""

_MOST_EPOCHS = 60
"""Their number is bounded: months of a quiet valve cost no more than hours of a busy one."""

_SPEED, _ALONG, _DRIFT = 1.0, 0.5, 0.2
"""Standard deviations of what friction may change by with the speed, at the mean speed, and along
the travel; and of the preload from hour to hour; as shares of the sliding friction."""

_FASTEST = 3.0
"""Speed of a move, over the mean, beyond which its friction is taken to change no further."""

_HUBER = 2.0
_ROUNDS = 4
_QUIETEST = 1e-3
"""Least scatter of a move, as a share of the friction."""

_SYSTEMATIC = 0.02
"""Standard deviation, as a share of the friction, of what no scatter shows: presliding, sampling,
and the travel in motions that are too short to be a move. Chosen: a packing that bends by 25 µm
before it slides changes the mean friction of 0.5 mm by some 4 %."""

_BENT = 0.005
"""The same of a friction that follows speed and place by another law than a line: what it adds to
the spring constant, over the scatter of the places."""

SPRING, SPEED, ALONG, STATIC, PRELOAD = range(5)
"""Places of the unknowns. Deviations of the preload follow, one an epoch; friction is the last."""

SLIDING = -1


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


def blocks_of(moves: Moves) -> NDArray[np.intp]:
    """Return the block of each move: ten minutes at least, and some moves in each direction."""
    if not len(moves):
        return np.array([], dtype=np.intp)
    span = max(BLOCK, float(moves.time[-1] - moves.time[0]) / _MOST_BLOCKS)
    block, begin, up, down = 0, float(moves.time[0]), 0, 0
    found = []
    for time, way in zip(moves.time.tolist(), moves.direction.tolist(), strict=True):
        if time - begin >= span and min(up, down) >= _BLOCK_MOVES:
            block, begin, up, down = block + 1, time, 0, 0
        found.append(block)
        up, down = up + (way > 0), down + (way < 0)
    blocks = np.array(found, dtype=np.intp)
    if block and (min(up, down) < _BLOCK_MOVES or time - begin < 0.5 * span):
        blocks[blocks == block] = block - 1
    return blocks


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
    blocks = blocks_of(moves)
    count = int(blocks[-1]) + 1 if len(moves) else 0
    ways = [int(np.sum(moves.direction == way)) for way in (-1, 1)]
    if min(ways) < FEWEST_MOVES or count < FEWEST_BLOCKS:
        return None
    scale, place, speed = _scales(moves)
    one = np.zeros(len(moves), dtype=np.intp)
    design = _with_onsets(_design(moves, one, speed, place), moves, blocks, place)
    precision = _priors(design.rows.shape[1], scale, speed, moves, travel)
    precision[SLIDING] = 0.0
    shift = 0.0
    if spring_constant is not None:
        shift, precision[SPRING] = spring_constant, _KNOWN
    target = design.force - shift * design.rows[:, SPRING]
    values, weight = _robust(design, target, precision, scale)
    scatter, lag = _covariance(design, target, weight, count, precision)
    values[SPRING] += shift
    systematic = np.outer(timing * lag, timing * lag).astype(np.float64)
    for friction in (SLIDING, STATIC):
        systematic[friction, friction] += (_SYSTEMATIC * values[friction]) ** 2
    if spring_constant is None:
        spread = math.sqrt(float(np.average((moves.place - place) ** 2, weights=moves.distance)))
        systematic[SPRING, SPRING] += (_BENT * scale / max(spread, 1e-12)) ** 2
    quantile = float(special.stdtrit(max(count - 2, 2), 0.975))
    onsets = int(np.isfinite(moves.onset_force).sum())
    return Balance(values, scatter, systematic, quantile, speed, place, onsets, timing, lag)


def series_of(moves: Moves, travel: float) -> Series | None:
    """Return the friction block by block; None where there are fewer than two.

    Spring, speed and place have one coefficient each, found within the blocks, so neither a new
    range of set points nor other speeds look like another friction.
    """
    blocks = blocks_of(moves)
    count = int(blocks[-1]) + 1 if len(moves) else 0
    if count < 2:
        return None
    scale, place, speed = _scales(moves)
    design = _design(moves, blocks, speed, place)
    precision = _priors(design.rows.shape[1], scale, speed, moves, travel)
    precision[-count:] = (1e-3 / scale) ** 2
    values, weight = _robust(design, design.force, precision, scale)
    normal = (design.rows * weight[:, None]).T @ design.rows + np.diag(precision)
    covariance = _solution(normal, np.eye(values.size))[-count:, -count:]
    first = np.flatnonzero(np.diff(blocks, prepend=-1))
    last = np.append(first[1:], len(moves)) - 1
    return Series(moves.time[first], moves.time[last], values[-count:], covariance, first)


_KNOWN = 1e30


class _Design(NamedTuple):
    """Regressors, forces, weights (mean 1), rates of the forces, and blocks of some rows."""

    rows: NDArray[np.float64]
    force: NDArray[np.float64]
    weight: NDArray[np.float64]
    rate: NDArray[np.float64]
    blocks: NDArray[np.intp]


def _scales(moves: Moves) -> tuple[float, float, float]:
    """Return a rough friction (N), the mean place (m) and the mean speed (m/s)."""
    place, speed = (
        float(np.average(one, weights=moves.distance)) for one in (moves.place, moves.speed)
    )
    rows = np.column_stack((moves.direction, moves.place - place, np.ones(len(moves))))
    root = np.sqrt(moves.distance)
    found = linalg.lstsq(rows * root[:, None], moves.force * root)[0]
    least = 1e-9 * (1.0 + float(np.max(np.abs(moves.force))))
    return max(abs(float(found[0])), least), place, speed


def _design(moves: Moves, frictions: NDArray[np.intp], speed: float, place: float) -> _Design:
    """Return the rows of moves, with one friction for each number in `frictions`."""
    passed = moves.time - moves.time[0]
    epoch = max(_EPOCH, float(passed[-1]) / (_MOST_EPOCHS - 1))
    epochs = (passed / epoch).astype(np.intp)
    kinds, epochs = np.unique(epochs, return_inverse=True)
    several = kinds.size if kinds.size > 1 else 0
    way, away = moves.direction, moves.place - place
    every = np.arange(len(moves))
    groups = int(frictions.max()) + 1
    rows = np.zeros((len(moves), PRELOAD + 1 + several + groups))
    rows[:, SPRING], rows[:, PRELOAD] = away, 1.0
    rows[:, SPEED] = way * (np.minimum(moves.speed, _FASTEST * speed) - speed)
    rows[:, ALONG] = way * away
    if several:
        rows[every, PRELOAD + 1 + epochs] = 1.0
    rows[every, PRELOAD + 1 + several + frictions] = way
    weight = moves.distance / float(np.mean(moves.distance))
    return _Design(rows, moves.force, weight, moves.force_rate, frictions)


def _with_onsets(design: _Design, moves: Moves, blocks: NDArray[np.intp], place: float) -> _Design:
    """Add a row for each breakaway, and put all rows into their blocks."""
    begun = np.isfinite(moves.onset_force)
    way, away = moves.direction[begun], moves.onset_position[begun] - place
    rows = design.rows[begun]
    rows[:, [SLIDING, SPEED]] = 0.0
    rows[:, STATIC], rows[:, SPRING], rows[:, ALONG] = way, away, way * away
    return _Design(
        np.vstack((design.rows, rows)),
        np.concatenate((design.force, moves.onset_force[begun])),
        np.concatenate((design.weight, np.full(way.size, _ONSET))),
        np.concatenate((design.rate, moves.onset_rate[begun])),
        np.concatenate((blocks, blocks[begun])),
    )


_ONSET = 0.25
"""Weight of a breakaway. It alone decides the static friction; of the rest it knows less than a
move."""


def _priors(
    size: int, scale: float, speed: float, moves: Moves, travel: float
) -> NDArray[np.float64]:
    """Return the precision of each prior, all about zero."""
    precision = np.full(size, (1.0 / (_DRIFT * scale)) ** 2)
    precision[[SPRING, PRELOAD]] = 0.0
    precision[STATIC] = (1e-3 / scale) ** 2
    precision[SPEED] = (speed / (_SPEED * scale)) ** 2
    length = travel if math.isfinite(travel) else max(float(np.ptp(moves.place)), 1e-9)
    precision[ALONG] = (length / (_ALONG * scale)) ** 2
    return precision


def _robust(
    design: _Design, target: NDArray[np.float64], precision: NDArray[np.float64], scale: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the values by Huber's weights, and the weights of the rows, 1/N²."""
    deviation = scale
    factor: NDArray[np.float64] = np.ones(target.size, dtype=np.float64)
    values: NDArray[np.float64] = np.zeros(design.rows.shape[1], dtype=np.float64)
    for _ in range(_ROUNDS):
        weight = design.weight * factor / deviation**2
        normal = (design.rows * weight[:, None]).T @ design.rows + np.diag(precision)
        values = _solution(normal, design.rows.T @ (weight * target))
        left = np.abs(target - design.rows @ values) * np.sqrt(design.weight)
        deviation = max(1.4826 * float(np.median(left)), _QUIETEST * scale)
        factor = np.minimum(1.0, _HUBER * deviation / np.maximum(left, 1e-300))
    return values, design.weight * factor / deviation**2


def _solution(normal: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve with unknowns of one size; one that nothing determines stays zero."""
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    scaled = normal / np.outer(size, size) + 1e-12 * np.eye(size.size)
    found: NDArray[np.float64] = linalg.solve(scaled, (right.T / size).T, assume_a="pos")
    solution: NDArray[np.float64] = (found.T / size).T
    return solution


def _covariance(
    design: _Design,
    target: NDArray[np.float64],
    weight: NDArray[np.float64],
    count: int,
    precision: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the covariance by scatter and priors, and the change of the values by 1 s of lag."""
    rows, size = design.rows, design.rows.shape[1]
    weighted = rows * weight[:, None]
    normals, rights = np.zeros((count, size, size)), np.zeros((count, size))
    for one in range(count):
        inside = design.blocks == one
        normals[one] = weighted[inside].T @ rows[inside]
        rights[one] = weighted[inside].T @ target[inside]
    normal, right = normals.sum(axis=0) + np.diag(precision), rights.sum(axis=0)
    without = np.array([_solution(normal - normals[i], right - rights[i]) for i in range(count)])
    spread = without - without.mean(axis=0)
    inverse = _solution(normal, np.eye(size))
    by_blocks = (count - 1) / count * spread.T @ spread + inverse @ np.diag(precision) @ inverse
    # The larger of both, one by one: the scatter of few blocks may be small by chance.
    larger = np.diag(inverse) / np.maximum(np.diag(by_blocks), 1e-300)
    grown = np.sqrt(np.maximum(larger, 1.0))
    return by_blocks * np.outer(grown, grown), _solution(normal, weighted.T @ design.rate)
