"""Blocks of time whose moves have correlated errors."""

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.evidence.moves import Moves

__all__ = ["BLOCK", "blocks_of"]

BLOCK = 600.0
"""Least time, s, of moves whose errors are taken as correlated."""

_MOVES = 4
"""And least number of such moves in each direction."""


def blocks_of(moves: Moves, most: int | None = None) -> NDArray[np.intp]:
    """Return the block of each move: ten minutes at least, and some moves in each direction.

    Parameters
    ----------
    moves : Moves
        The moves, oldest first.
    most : int, optional
        Number of blocks that is hardly passed: beyond it they are longer.
    """
    if not len(moves):
        return np.array([], dtype=np.intp)
    span = BLOCK
    if most is not None:
        span = max(span, float(moves.time[-1] - moves.time[0]) / most)
    block, begin, up, down = 0, float(moves.time[0]), 0, 0
    found = []
    for time, way in zip(moves.time.tolist(), moves.direction.tolist(), strict=True):
        if time - begin >= span and min(up, down) >= _MOVES:
            block, begin, up, down = block + 1, time, 0, 0
        found.append(block)
        up, down = up + (way > 0), down + (way < 0)
    blocks = np.array(found, dtype=np.intp)
    if block and (min(up, down) < _MOVES or time - begin < 0.5 * span):
        blocks[blocks == block] = block - 1
    return blocks
