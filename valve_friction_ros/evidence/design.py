"""Force balances of moves as linear equations, and their robust solution."""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from valve_friction_ros.evidence.moves import Moves

__all__ = [
    "ALONG",
    "PRELOAD",
    "SLIDING",
    "SPEED",
    "SPRING",
    "STATIC",
    "Design",
    "Normal",
    "Scales",
    "design_of",
    "priors",
    "robust",
    "scales_of",
    "solution",
    "with_onsets",
]

SPRING, SPEED, ALONG, STATIC, PRELOAD = range(5)
"""Places of the unknowns. Deviations of the preload follow, one an epoch; frictions are last."""

SLIDING = -1

_EPOCH = 3600.0
"""Time, s, over which the preload stays the same: temperature and sensors drift over longer."""

_MOST_EPOCHS = 60
"""Their number is bounded: months of a quiet valve cost no more than hours of a busy one."""

_SPEED, _ALONG, _DRIFT = 1.0, 0.5, 0.2
"""Standard deviations of what friction may change by with the speed, at the mean speed, and along
the travel; and of the preload from hour to hour; as shares of the sliding friction."""

_FASTEST = 3.0
"""Speed of a move, over the mean, beyond which its friction is taken to change no further."""

_ONSET = 0.25
"""Weight of a breakaway. It alone decides the static friction; of the rest it knows less than a
move."""

_HUBER = 2.0
_ROUNDS = 4
_QUIETEST = 1e-3
"""Least scatter of a move, as a share of the friction."""


class Scales(NamedTuple):
    """A rough friction (N), the mean place (m) and the mean speed (m/s) of moves."""

    friction: float
    place: float
    speed: float


@dataclass(frozen=True, eq=False)
class Design:
    """Rows of linear equations of force.

    The unknowns are the spring constant (N/m), the change of friction with speed (N·s/m) and along
    the travel (N/m), the static friction (N), the preload (N) at the mean place, its deviations by
    epoch, and last one sliding friction (N) or several.

    Attributes
    ----------
    dense : ndarray of float, shape (n, 5)
        Regressors of the unknowns up to `PRELOAD`.
    epoch, group : ndarray of int, shape (n,)
        Deviation of the preload, and sliding friction, of each row.
    way : ndarray of float, shape (n,)
        Regressor of the sliding friction: ±1, or 0 for a breakaway.
    force, weight, rate : ndarray of float, shape (n,)
        Force, N; weight, mean 1; and rate of the force, N/s.
    epochs, groups : int
        Number of deviations, 0 where the preload has none, and of sliding frictions.
    """

    dense: NDArray[np.float64]
    epoch: NDArray[np.intp]
    group: NDArray[np.intp]
    way: NDArray[np.float64]
    force: NDArray[np.float64]
    weight: NDArray[np.float64]
    rate: NDArray[np.float64]
    epochs: int
    groups: int

    @property
    def shared(self) -> int:
        """Number of the unknowns but the sliding frictions."""
        return PRELOAD + 1 + self.epochs

    @property
    def size(self) -> int:
        """Number of the unknowns."""
        return self.shared + self.groups

    def rows(self) -> NDArray[np.float64]:
        """Return all regressors, shape (n, p)."""
        every = np.arange(self.force.size)
        rows = np.zeros((every.size, self.size))
        rows[:, : PRELOAD + 1] = self.dense
        if self.epochs:
            rows[every, PRELOAD + 1 + self.epoch] = 1.0
        rows[every, self.shared + self.group] = self.way
        return rows

    def normal(self, weight: NDArray[np.float64], precision: NDArray[np.float64]) -> "Normal":
        """Return the normal equations of weighted rows, and of priors about zero."""
        dense, first, shared = self.dense * weight[:, None], PRELOAD + 1, self.shared
        both, mixed = np.diag(precision[:shared]), np.zeros((shared, self.groups))
        both[:first, :first] += dense.T @ self.dense
        mixed[:first] = _sums((dense * self.way[:, None]).T, self.group, self.groups)
        if self.epochs:
            both[:first, first:] = _sums(dense.T, self.epoch, self.epochs)
            both[first:, :first] = both[:first, first:].T
            places = np.arange(first, shared)
            both[places, places] += np.bincount(self.epoch, weight, self.epochs)
            cells, count = self.epoch * self.groups + self.group, self.epochs * self.groups
            mixed[first:] = np.bincount(cells, weight * self.way, count).reshape(self.epochs, -1)
        friction = precision[shared:] + np.bincount(self.group, weight * self.way**2, self.groups)
        return Normal(both, mixed, friction)

    def right(self, weighted: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the right side of the normal equations of weighted targets, shape (p,)."""
        epochs = np.bincount(self.epoch, weighted, self.epochs)[: self.epochs]
        frictions = np.bincount(self.group, weighted * self.way, self.groups)
        return np.concatenate((self.dense.T @ weighted, epochs, frictions))

    def forces(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the force of each row, N."""
        forces = self.dense @ values[: PRELOAD + 1] + self.way * values[self.shared + self.group]
        if self.epochs:
            forces += values[PRELOAD + 1 + self.epoch]
        return np.asarray(forces, dtype=np.float64)


def _sums(rows: NDArray[np.float64], places: NDArray[np.intp], count: int) -> NDArray[np.float64]:
    return np.array([np.bincount(places, row, count) for row in rows])


class Normal(NamedTuple):
    """Normal equations of s shared unknowns and g sliding frictions.

    Hundreds of frictions cost little: none meets another one, so they are eliminated first.

    Attributes
    ----------
    shared, mixed, friction : ndarray of float, shapes (s, s), (s, g), (g,)
        Their parts; that of the frictions is diagonal.
    """

    shared: NDArray[np.float64]
    mixed: NDArray[np.float64]
    friction: NDArray[np.float64]

    def solved(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the unknowns, shape (p,)."""
        size = self.shared.shape[0]
        ratio = self.mixed / self.friction
        left = self.shared - ratio @ self.mixed.T
        shared = solution(left, right[:size] - ratio @ right[size:])
        return np.concatenate((shared, right[size:] / self.friction - ratio.T @ shared))

    def friction_covariance(self) -> NDArray[np.float64]:
        """Return the block of the inverse that belongs to the frictions, shape (g, g)."""
        ratio = self.mixed / self.friction
        left = self.shared - ratio @ self.mixed.T
        return np.diag(1.0 / self.friction) + ratio.T @ solution(left, ratio)


def scales_of(moves: Moves) -> Scales:
    """Return the scales of moves."""
    place, speed = (
        float(np.average(one, weights=moves.distance)) for one in (moves.place, moves.speed)
    )
    rows = np.column_stack((moves.direction, moves.place - place, np.ones(len(moves))))
    root = np.sqrt(moves.distance)
    found = scipy.linalg.lstsq(rows * root[:, None], moves.force * root)[0]
    least = 1e-9 * (1.0 + float(np.max(np.abs(moves.force))))
    return Scales(max(abs(float(found[0])), least), place, speed)


def design_of(moves: Moves, frictions: NDArray[np.intp], scales: Scales) -> Design:
    """Return the rows of moves, with one friction for each number in `frictions`."""
    passed = moves.time - moves.time[0]
    epoch = max(_EPOCH, float(passed[-1]) / (_MOST_EPOCHS - 1))
    kinds, epochs = np.unique((passed / epoch).astype(np.intp), return_inverse=True)
    way, away = moves.direction, moves.place - scales.place
    dense = np.zeros((len(moves), PRELOAD + 1))
    dense[:, SPRING], dense[:, PRELOAD] = away, 1.0
    speed = scales.speed
    dense[:, SPEED] = way * (np.minimum(moves.speed, _FASTEST * speed) - speed)
    dense[:, ALONG] = way * away
    return Design(
        dense,
        epochs.astype(np.intp),
        frictions,
        way,
        moves.force,
        moves.distance / float(np.mean(moves.distance)),
        moves.force_rate,
        kinds.size if kinds.size > 1 else 0,
        int(frictions.max()) + 1,
    )


def with_onsets(design: Design, moves: Moves, place: float) -> Design:
    """Add a row for each breakaway, in their order."""
    begun = np.isfinite(moves.onset_force)
    way, away = moves.direction[begun], moves.onset_position[begun] - place
    dense = design.dense[begun]
    dense[:, SPEED] = 0.0
    dense[:, STATIC], dense[:, SPRING], dense[:, ALONG] = way, away, way * away
    return replace(
        design,
        dense=np.vstack((design.dense, dense)),
        epoch=np.concatenate((design.epoch, design.epoch[begun])),
        group=np.concatenate((design.group, design.group[begun])),
        way=np.concatenate((design.way, np.zeros(way.size))),
        force=np.concatenate((design.force, moves.onset_force[begun])),
        weight=np.concatenate((design.weight, np.full(way.size, _ONSET))),
        rate=np.concatenate((design.rate, moves.onset_rate[begun])),
    )


def priors(design: Design, scales: Scales, moves: Moves, travel: float) -> NDArray[np.float64]:
    """Return the precision of the prior of each unknown, all about zero."""
    friction, _, speed = scales
    precision = np.full(design.size, (1.0 / (_DRIFT * friction)) ** 2)
    precision[[SPRING, PRELOAD]] = 0.0
    precision[STATIC] = (1e-3 / friction) ** 2
    precision[SPEED] = (speed / (_SPEED * friction)) ** 2
    length = travel if math.isfinite(travel) else max(float(np.ptp(moves.place)), 1e-9)
    precision[ALONG] = (length / (_ALONG * friction)) ** 2
    precision[design.shared :] = (1e-3 / friction) ** 2
    return precision


def robust(
    design: Design, target: NDArray[np.float64], precision: NDArray[np.float64], friction: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the unknowns by Huber's weights, and the weights of the rows, 1/N²."""
    deviation = friction
    factor: NDArray[np.float64] = np.ones(target.size, dtype=np.float64)
    values: NDArray[np.float64] = np.zeros(design.size, dtype=np.float64)
    for _ in range(_ROUNDS):
        weight = design.weight * factor / deviation**2
        values = design.normal(weight, precision).solved(design.right(weight * target))
        left = np.abs(target - design.forces(values)) * np.sqrt(design.weight)
        deviation = max(1.4826 * float(np.median(left)), _QUIETEST * friction)
        factor = np.minimum(1.0, _HUBER * deviation / np.maximum(left, 1e-300))
    return values, design.weight * factor / deviation**2


def solution(normal: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve with unknowns of one size; one that nothing determines stays zero.

    Several systems are solved at once where both have another axis before.
    """
    size = np.sqrt(np.maximum(np.diagonal(normal, axis1=-2, axis2=-1), 1e-300))
    scaled = normal / (size[..., :, None] * size[..., None, :]) + 1e-12 * np.eye(size.shape[-1])
    columns = right if right.ndim == normal.ndim else right[..., None]
    found = np.linalg.solve(scaled, columns / size[..., None]) / size[..., None]
    return np.asarray(found.reshape(right.shape), dtype=np.float64)
