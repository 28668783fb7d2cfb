# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Force balances of moves as linear equations, their robust solution and its covariance.

Moves in one block of time have correlated errors, so the scatter of blocks gives the interval.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.evidence.moves import Moves
from valve_friction_ros.identification.trust.uncertainty import MEDIAN_MAGNITUDE, student_quantile

BLOCK = 600.0
"""Least duration, s, of a block of moves, whose errors are taken as correlated."""

_LEAST_MOVES = 4
"""Least number of moves in a block in each direction."""


def blocks_of(moves: Moves, most: int | None = None) -> NDArray[np.intp]:
    """Return the block of each move; a block has at least ten minutes and moves both ways.

    Blocks get longer where there would be more than about `most` of them.
    """
    if not len(moves):
        return np.array([], dtype=np.intp)
    span = BLOCK
    if most is not None:
        span = max(span, float(moves.time[-1] - moves.time[0]) / most)
    block, begin, up, down = 0, float(moves.time[0]), 0, 0
    found = []
    for time, way in zip(moves.time.tolist(), moves.direction.tolist(), strict=True):
        if time - begin >= span and min(up, down) >= _LEAST_MOVES:
            block, begin, up, down = block + 1, time, 0, 0
        found.append(block)
        up, down = up + (way > 0), down + (way < 0)
    blocks = np.array(found, dtype=np.intp)
    if block and (min(up, down) < _LEAST_MOVES or time - begin < 0.5 * span):
        blocks[blocks == block] = block - 1
    return blocks


SPRING, SPEED, ALONG, STATIC, PRELOAD = range(5)
"""Indices of the unknowns. Deviations of the preload follow, one per epoch; frictions are last."""

SLIDING = -1

_EPOCH = 3600.0
"""Time, s, over which the preload is constant: temperature and sensors drift more slowly."""

_MOST_EPOCHS = 60
"""Largest number of epochs: months of a quiet valve cost no more than hours of a busy valve."""

_SPEED, _ALONG, _DRIFT = 1.0, 0.5, 0.2
"""Standard deviations, as shares of the sliding friction: of its change with speed, at the mean
speed; of its change along the travel; and of the preload from hour to hour."""

_SIDE, _LEAST_OF_A_SIDE, _SEARCHED = 6, 3, 6
"""Moves of each direction compared on either side of a step of the preload; their least number; and
moves to either side within which the step is then located."""

_STEP_ERRORS, _STEP_SHARE, _MOST_STEPS = 6.0, 0.25, 120
"""Standard errors, and share of the friction, from which the preload has stepped; and most steps
that are followed. Smaller steps are drift or outliers."""

_FASTEST = 3.0
"""Speed of a move, over the mean, beyond which friction is assumed to change no further."""

_ONSET = 0.25
"""Weight of a breakaway. Breakaways alone determine the static friction, but they determine the
other unknowns less well than moves."""

_HUBER = 2.0
_ROUNDS = 4
_QUIETEST = 1e-3
"""Least scatter of a move, as a share of the friction."""


class Scales(NamedTuple):
    """Scales of moves: rough friction (N), mean position (m) and mean speed (m/s)."""

    friction: float
    place: float
    speed: float


@dataclass(frozen=True, eq=False)
class Design:
    """Linear equations of force, in rows.

    The unknowns are the spring constant (N/m), the change of friction with speed (N·s/m) and along
    the travel (N/m), the static friction (N), the preload (N) at the mean position, its deviations
    by epoch, and last one or several sliding frictions (N).
    """

    dense: NDArray[np.float64]
    """Regressors of the unknowns up to `PRELOAD`, shape (n, 5); n is the number of rows."""
    epoch: NDArray[np.intp]
    group: NDArray[np.intp]
    """Index of the preload deviation and of the sliding friction in each row."""
    way: NDArray[np.float64]
    """Regressor of the sliding friction: ±1, or 0 for a breakaway."""
    force: NDArray[np.float64]
    weight: NDArray[np.float64]
    rate: NDArray[np.float64]
    """Force, N; weight, mean 1; and rate of the force, N/s."""
    epochs: int
    groups: int
    """Number of preload deviations, 0 without any, and of sliding frictions."""
    step: float = 0.0
    """Largest step of the preload, N; 0 without any."""

    @property
    def shared(self) -> int:
        """Number of unknowns without the sliding frictions."""
        return PRELOAD + 1 + self.epochs

    @property
    def size(self) -> int:
        """Number of unknowns."""
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
        """Return the normal equations of weighted rows and of priors about zero."""
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
        """Return the right-hand side of the normal equations for weighted targets, shape (p,)."""
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

    No row contains two frictions. They are eliminated first, so hundreds of frictions cost little.
    """

    shared: NDArray[np.float64]
    mixed: NDArray[np.float64]
    friction: NDArray[np.float64]
    """Blocks of the matrix, shapes (s, s), (s, g) and (g,): the block of the frictions is
    diagonal."""

    def solved(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the unknowns, shape (p,)."""
        size = self.shared.shape[0]
        ratio = self.mixed / self.friction
        left = self.shared - ratio @ self.mixed.T
        shared = solution(left, right[:size] - ratio @ right[size:])
        return np.concatenate((shared, right[size:] / self.friction - ratio.T @ shared))

    def friction_covariance(self) -> NDArray[np.float64]:
        """Return the block of the inverse for the frictions, shape (g, g)."""
        ratio = self.mixed / self.friction
        left = self.shared - ratio @ self.mixed.T
        return np.diag(1.0 / self.friction) + ratio.T @ solution(left, ratio)


def scales_of(moves: Moves, levels: NDArray[np.intp]) -> Scales:
    """Return the scales of moves, given their levels of the preload (`levels_of`)."""
    moves = moves[_is_steady(levels)]
    place, speed = (
        float(np.average(one, weights=moves.distance)) for one in (moves.place, moves.speed)
    )
    rows = np.column_stack((moves.direction, moves.place - place, np.ones(len(moves))))
    root = np.sqrt(moves.distance)
    found = np.linalg.lstsq(rows * root[:, None], moves.force * root, rcond=None)[0]
    least = 1e-9 * (1.0 + float(np.max(np.abs(moves.force))))
    return Scales(max(abs(float(found[0])), least), place, speed)


def _is_steady(levels: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return whether the process force clearly did not step during a move."""
    steps = np.diff(levels) != 0
    return np.asarray(~(np.append(False, steps) | np.append(steps, False)), dtype=np.bool_)


def levels_of(moves: Moves) -> tuple[NDArray[np.intp], float]:
    """Find the steps of the process force: the level of each move, from 0, and the largest step, N.

    A pressure on the plug shifts the forces of upward and downward moves alike; friction shifts
    them apart. The mean of the medians of both directions therefore steps with the process force
    and not with friction. Medians ignore the move during which the process force steps.
    """
    count, way = len(moves), moves.direction
    number = np.zeros(count, dtype=np.intp)
    if count < 4 * _LEAST_OF_A_SIDE:
        return number, 0.0
    left, friction = _without_spring(moves)
    error = float(np.median(np.abs(np.diff(left)))) / (MEDIAN_MAGNITUDE * math.sqrt(2.0))
    free = np.ones(count, dtype=np.bool_)
    largest = 0.0
    for _ in range(_MOST_STEPS):
        median, known = _beside(left, way)
        steps = 0.5 * (median[:, 1] - median[:, 0]).sum(axis=0)
        with np.errstate(divide="ignore"):
            errors = error * np.sqrt(0.25 * 0.5 * math.pi * (1.0 / known).sum(axis=(0, 1)))
        enough = free & (known.min(axis=(0, 1)) >= _LEAST_OF_A_SIDE)
        over = np.abs(steps) / np.maximum(_STEP_ERRORS * errors, _STEP_SHARE * friction)
        place = int(np.argmax(np.where(enough, over, 0.0)))
        if not (enough[place] and over[place] > 1.0):
            break
        near = slice(max(place - _SEARCHED, 0), place + _SEARCHED)
        before, after = (np.where(way[near] > 0, *median[:, side, place]) for side in (0, 1))
        gain = np.abs(left[near] - before) - np.abs(left[near] - after)
        begin = near.start + int(np.argmin(np.concatenate(([0.0], np.cumsum(gain)))))
        number[begin:] += 1
        left[begin:] -= steps[place]
        largest = max(largest, abs(float(steps[place])))
        free[near] = False
    return number, largest


def _beside(
    values: NDArray[np.float64], way: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the medians of the moves in each direction before and from each place on.

    Also returns the numbers of these moves, at most `_SIDE`. Shapes are (2, 2, n): direction, side,
    place. After a step of the process force, a loop brings the stem back by moves in one direction;
    the last moves in the other direction are farther away.
    """
    found = []
    for sign in (1.0, -1.0):
        of_way = way == sign
        passed = np.cumsum(of_way) - of_way
        found.append(_medians(np.append(values[of_way], np.nan))[:, :, passed])
    both = np.array(found)
    return both[:, 0], both[:, 1]


def _without_spring(moves: Moves) -> tuple[NDArray[np.float64], float]:
    """Return the forces of moves without spring and friction, N, and the friction.

    The fit uses differences of successive moves, where each step of the preload is one outlier.
    """
    way = moves.direction
    rows = np.column_stack((way, moves.place, way * moves.speed))
    changes, target = np.diff(rows, axis=0), np.diff(moves.force)
    least = _QUIETEST * float(np.median(np.abs(target)))
    weight: NDArray[np.float64] = np.ones(target.size)
    values: NDArray[np.float64] = np.zeros(rows.shape[1])
    for _ in range(2 * _ROUNDS):
        normal = (changes * weight[:, None]).T @ changes
        values = solution(normal, changes.T @ (weight * target))
        off = np.abs(target - changes @ values)
        limit = _HUBER * max(float(np.median(off)) / MEDIAN_MAGNITUDE, least)
        weight = np.minimum(1.0, limit / np.maximum(off, 1e-300))
    friction = values[0] + values[2] * float(np.mean(moves.speed))
    return moves.force - rows @ values, abs(float(friction))


def _medians(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the medians before and after each place, and the numbers of values; shape (2, 2, n).

    The value at the place belongs to the second side. Values of nan are ignored.
    """
    padded = np.concatenate((np.full(_SIDE, np.nan), values, np.full(_SIDE, np.nan)))
    windows = np.sort(np.lib.stride_tricks.sliding_window_view(padded, _SIDE), axis=1)
    counts = np.isfinite(windows).sum(axis=1)
    every = np.arange(counts.size)
    high, low = np.minimum(counts // 2, _SIDE - 1), np.maximum(counts - 1, 0) // 2
    found = np.array([0.5 * (windows[every, low] + windows[every, high]), counts])
    return np.stack((found[:, : values.size], found[:, _SIDE : _SIDE + values.size]), axis=1)


def _epochs_of(time: NDArray[np.float64], levels: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return a number for each move, alike for moves with the same preload.

    Epochs begin anew at each step of the preload, and the rest of the last one belongs to the epoch
    before it. After a step, no earlier epoch tells the preload, and the first moves may all have
    one direction, which does not tell preload and friction apart.
    """
    epoch = max(_EPOCH, float(time[-1] - time[0]) / (_MOST_EPOCHS - 1))
    begin, end = (np.searchsorted(levels, levels, side) for side in ("left", "right"))
    number = ((time - time[begin]) / epoch).astype(np.intp)
    if levels[-1]:
        last = ((time[end - 1] - time[begin]) / epoch).astype(np.intp) - 1
        number = np.minimum(number, np.maximum(last, 0))
    return np.asarray(number + (_MOST_EPOCHS + 1) * levels, dtype=np.intp)


def design_of(moves: Moves, frictions: NDArray[np.intp]) -> tuple[Design, Scales]:
    """Return the rows of moves, with one friction per number in `frictions`, and their scales."""
    levels, largest_step = levels_of(moves)
    scales = scales_of(moves, levels)
    kinds, epochs = np.unique(_epochs_of(moves.time, levels), return_inverse=True)
    way, away = moves.direction, moves.place - scales.place
    dense = np.zeros((len(moves), PRELOAD + 1))
    dense[:, SPRING], dense[:, PRELOAD] = away, 1.0
    speed = scales.speed
    dense[:, SPEED] = way * (np.minimum(moves.speed, _FASTEST * speed) - speed)
    dense[:, ALONG] = way * away
    weight = moves.distance / float(np.mean(moves.distance)) * _is_steady(levels)
    design = Design(
        dense,
        epochs.astype(np.intp),
        frictions,
        way,
        moves.force,
        weight,
        moves.force_rate,
        kinds.size if kinds.size > 1 else 0,
        int(frictions.max()) + 1,
        largest_step,
    )
    return design, scales


def with_onsets(design: Design, moves: Moves, place: float) -> Design:
    """Append one row per breakaway, in the order of the moves."""
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
        weight=np.concatenate((design.weight, _ONSET * (design.weight[begun] > 0))),
        rate=np.concatenate((design.rate, moves.onset_rate[begun])),
    )


def priors(design: Design, scales: Scales, moves: Moves, travel: float) -> NDArray[np.float64]:
    """Return the precision of the prior of each unknown; all priors are about zero."""
    friction, _, speed = scales
    precision = np.full(design.size, 1.0 / math.hypot(_DRIFT * friction, design.step) ** 2)
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
    """Return the unknowns found with Huber's weights, and the weights of the rows, 1/N²."""
    deviation = friction
    factor: NDArray[np.float64] = np.ones(target.size, dtype=np.float64)
    values: NDArray[np.float64] = np.zeros(design.size, dtype=np.float64)
    for _ in range(_ROUNDS):
        weight = design.weight * factor / deviation**2
        values = design.normal(weight, precision).solved(design.right(weight * target))
        left = np.abs(target - design.forces(values)) * np.sqrt(design.weight)
        deviation = max(float(np.median(left)) / MEDIAN_MAGNITUDE, _QUIETEST * friction)
        factor = np.minimum(1.0, _HUBER * deviation / np.maximum(left, 1e-300))
    return values, design.weight * factor / deviation**2


def solution(normal: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve with the unknowns scaled to one size; an undetermined unknown stays zero.

    A leading axis in both arguments solves several systems at once.
    """
    size = np.sqrt(np.maximum(np.diagonal(normal, axis1=-2, axis2=-1), 1e-300))
    scaled = normal / (size[..., :, None] * size[..., None, :]) + 1e-12 * np.eye(size.shape[-1])
    columns = right if right.ndim == normal.ndim else right[..., None]
    found = np.linalg.solve(scaled, columns / size[..., None]) / size[..., None]
    return np.asarray(found.reshape(right.shape), dtype=np.float64)


MOST_BLOCKS = 60
"""Most blocks of an estimate: more would not narrow its intervals."""

FEWEST_BLOCKS = 4
"""Fewest blocks of an estimate: their scatter gives the interval."""

FEWEST_MOVES = 12
"""Fewest moves of an estimate in each direction."""

_SYSTEMATIC = 0.02
"""Standard deviation, as a share of the friction, of errors that no scatter shows: presliding,
sampling, and travel in motions too short to be a move. Chosen: a packing that bends by 25 µm before
it slides changes the mean friction of 0.5 mm by some 4 %."""

_BENT = 0.005
"""The same for a friction that is not linear in speed and position. Divided by the scatter of the
positions, it is an error of the spring constant."""


@dataclass(frozen=True, eq=False)
class Balance:
    """Estimate of the unknowns, with its covariance."""

    values: NDArray[np.float64]
    """Spring constant (N/m), change of friction with speed (N·s/m) and along the travel (N/m),
    static friction (N), preload (N) at `place`, its deviations by epoch, and last the sliding
    friction (N): shape (p,)."""
    scatter: NDArray[np.float64]
    """Covariance from the scatter of blocks and from the priors, shape (p, p)."""
    systematic: NDArray[np.float64]
    """Covariance from the lag of the signals and from errors that no scatter shows, shape (p,
    p)."""
    quantile: float
    """Half width of a 95 % interval over the standard error, for the scatter."""
    speed: float
    """Speed to which the sliding friction applies, ∫|v|·|dx| / ∫|dx| of all moves, m/s."""
    place: float
    """Mean position of the moves, m."""
    onsets: int
    """Number of moves that began at rest."""
    timing: float
    """Standard deviation of the lag between the signals, s."""
    lag: NDArray[np.float64]
    """Change of the values for a lag of 1 s, shape (p,)."""

    def number(self, slope: NDArray[np.float64]) -> tuple[float, float]:
        """Return standard error and half width of a number from its derivatives by the values."""
        random, fixed = (
            math.sqrt(max(float(slope @ one @ slope), 0.0))
            for one in (self.scatter, self.systematic)
        )
        return math.hypot(random, fixed), math.hypot(self.quantile * random, 2.0 * fixed)


def balance_of(
    moves: Moves, timing: float, travel: float, spring_constant: float | None = None
) -> Balance | None:
    """Estimate the unknowns from moves, oldest first; None with too few.

    `timing` is the standard deviation of the lag between the signals, s, and `spring_constant` a
    known value, N/m.

    Moves are weighted by distance, so the sliding friction is the mean over the distance. Outliers
    have Huber's weights. All unknowns except friction, spring and first preload have priors, which
    enter the covariance too. The scatter comes from leaving out one block of time after another
    (jackknife), which is valid for errors correlated within a block. The lag of the signals is not
    estimated, since a friction that changes with speed looks like a lag. Its uncertainty enters all
    numbers.
    """
    blocks = blocks_of(moves, MOST_BLOCKS)
    count = int(blocks[-1]) + 1 if len(moves) else 0
    ways = [int(np.sum(moves.direction == way)) for way in (-1, 1)]
    if min(ways) < FEWEST_MOVES or count < FEWEST_BLOCKS:
        return None
    design, scales = design_of(moves, np.zeros(len(moves), dtype=np.intp))
    scale, place, speed = scales
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
    """Return the covariance from scatter and priors, and the change of the values per 1 s lag."""
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
    # The larger variance of each unknown: the scatter of few blocks may be small by chance.
    larger = np.diag(inverse) / np.maximum(np.diag(by_blocks), 1e-300)
    grown = np.sqrt(np.maximum(larger, 1.0))
    return by_blocks * np.outer(grown, grown), solution(normal, design.rate[order] @ weighted)
