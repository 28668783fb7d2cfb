"""Whether the stamps of a move can be believed, before it joins those that are kept."""

from valve_friction_ros.evidence.moves import Move

__all__ = ["stamp_problem"]

_DAY = 86_400_000_000_000
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
    if now > _CLOCK_IS_SET and move.end > max(now, last or 0) + _DAY:
        return "more than a day ahead of the clock, and of those that are kept"
    return ""
