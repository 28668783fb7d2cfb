"""Evidence that adds up: moves of a valve in service, and what they say together; no ROS."""

from valve_friction_ros.evidence.estimate import MOST_MOVES, Change, Evidence, evidence_of
from valve_friction_ros.evidence.moves import Move, Moves
from valve_friction_ros.evidence.stamps import lies_behind_those_ahead, stamp_problem
from valve_friction_ros.evidence.stream import MoveStream

__all__ = [
    "MOST_MOVES",
    "Change",
    "Evidence",
    "Move",
    "MoveStream",
    "Moves",
    "evidence_of",
    "lies_behind_those_ahead",
    "stamp_problem",
]
