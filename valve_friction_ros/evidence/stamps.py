"""Whether the stamps of a move can be believed, before it joins those that are kept."""

from valve_friction_ros.evidence.moves import Move
from valve_friction_ros.streams import DAY

__all__ = ["lies_behind_those_ahead", "stamp_problem"]

_MINUTE = 60_000_000_000
_DELAY = 10 * _MINUTE
"""Longest delay, ns, of a move whose stamps agree with the node's clock."""

_CLOCK_IS_SET = 10**18
"""Time, ns, of 2001-09-09: a clock that reads less is not set, or is that of a simulation."""


def stamp_problem(move: Move, last: int | None, now: int) -> str:
    """Return why a move cannot join the kept ones; empty if it can.

    Parameters
    ----------
    move : Move
        A new move.
    last : int or None
        End of the newest kept move, ns since 1970 (UTC); None without any.
    now : int
        The node's clock, ns since 1970 (UTC).
    """
    if last is not None and move.begin < last:
        return "before those that are kept"
    if now > _CLOCK_IS_SET and move.end > max(now, last or 0) + DAY:
        return "more than a day ahead of the clock, and of those that are kept"
    return ""


def lies_behind_those_ahead(move: Move, last: int, now: int) -> bool:
    """Return whether a move agrees with the clock, and the newest kept one lies ahead of both.

    Several such moves tell that the clock was ahead before. One tells little: a machine that has
    just started may not have set its clock yet.

    Parameters
    ----------
    move : Move
        A new move.
    last : int
        End of the newest kept move, ns since 1970 (UTC).
    now : int
        The node's clock, ns since 1970 (UTC).
    """
    agrees = now - _DELAY <= move.end <= now + _MINUTE
    return now > _CLOCK_IS_SET and agrees and last > max(now + _MINUTE, move.begin)
