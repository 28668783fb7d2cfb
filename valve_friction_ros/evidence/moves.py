"""Moves of the stem: what each says about friction, in a few numbers."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.model.checks import require_finite, require_non_negative, require_positive

__all__ = ["Move", "Moves"]


@dataclass(frozen=True)
class Move:
    """One motion of the stem in one direction, from rest to rest.

    The stem has no kinetic energy at either end, so the work balance holds whatever inertia and
    stick-slip did between them:

        ∫ S_a·(P − P_ref) dx = k·(x₂² − x₁²)/2 + F_0·(x₂ − x₁) + F·|x₂ − x₁| .

    Divided by x₂ − x₁ it is one linear equation: ``force`` = k·x̄ + F_0 ± F, with the mean
    position x̄ of the two ends.

    Attributes
    ----------
    begin, end : int
        When it began and ended, ns since 1970 (UTC).
    start, stop : float
        Position of the stem before and after it, m.
    force : float
        Mean force of the actuator over the distance, N.
    force_rate : float
        Mean rate of that force over the distance, N/s: what a lag of one second would add.
    speed : float
        Mean speed over the distance, ∫|v|·|dx| / ∫|dx|, m/s.
    onset_force, onset_position, onset_rate : float
        Force (N), position (m) and rate of the force (N/s) when the stem broke away from a rest;
        nan where there was no rest before.

    Raises
    ------
    ValueError
        If a number is impossible.
    """

    begin: int
    end: int
    start: float
    stop: float
    force: float
    force_rate: float
    speed: float
    onset_force: float = math.nan
    onset_position: float = math.nan
    onset_rate: float = math.nan

    def __post_init__(self) -> None:
        """Refuse what is no move."""
        if not self.begin < self.end:
            raise ValueError(f"a move must end after its begin, got {self.begin} to {self.end} ns")
        for name in ("start", "stop", "force", "force_rate"):
            require_finite(name, getattr(self, name))
        require_positive("distance", self.distance)
        require_non_negative("speed", self.speed)

    @property
    def distance(self) -> float:
        """Distance between its ends, m."""
        return abs(self.stop - self.start)

    @property
    def direction(self) -> int:
        """+1 up, −1 down."""
        return 1 if self.stop > self.start else -1


@dataclass(frozen=True, eq=False)
class Moves:
    """Columns of several moves, shape (n,) each; see `Move`.

    Attributes
    ----------
    time : ndarray of float
        Seconds since the first one began, at the end of each.
    """

    time: NDArray[np.float64]
    place: NDArray[np.float64]
    distance: NDArray[np.float64]
    direction: NDArray[np.float64]
    force: NDArray[np.float64]
    force_rate: NDArray[np.float64]
    speed: NDArray[np.float64]
    onset_force: NDArray[np.float64]
    onset_position: NDArray[np.float64]
    onset_rate: NDArray[np.float64]

    @classmethod
    def of(cls, moves: Sequence[Move]) -> "Moves":
        """Return the columns of moves, oldest first."""
        origin = moves[0].begin if moves else 0
        rows = np.array(
            [
                (
                    (one.end - origin) / 1e9,
                    0.5 * (one.start + one.stop),
                    one.distance,
                    one.direction,
                    one.force,
                    one.force_rate,
                    one.speed,
                    one.onset_force,
                    one.onset_position,
                    one.onset_rate,
                )
                for one in moves
            ],
            dtype=np.float64,
        ).reshape(-1, len(fields(cls)))
        return cls(*rows.T)

    def __len__(self) -> int:
        """Count the moves."""
        return self.time.size

    def __getitem__(self, chosen: slice | NDArray[np.bool_] | NDArray[np.intp]) -> "Moves":
        """Return some of them."""
        return Moves(*(getattr(self, field.name)[chosen] for field in fields(self)))
