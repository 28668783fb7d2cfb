"""The joint of a message that is the stem."""

from collections.abc import Sequence

__all__ = ["DEFAULT_JOINT", "joint_index", "joint_position", "only_joint"]

DEFAULT_JOINT = "stem"
"""Default name of the stem's joint."""


def joint_index(names: Sequence[str], positions: int, joint: str) -> int | None:
    """Index of `joint` among `positions` positions; None if it is missing.

    An empty name means the first joint; so does every name where the joints have no names.
    """
    index = 0
    if joint and names:
        if joint not in names:
            return None
        index = names.index(joint)
    return index if index < positions else None


def joint_position(names: Sequence[str], positions: Sequence[float], joint: str) -> float | None:
    """Position (m) of `joint`, of the first joint for an empty name; None if it is missing.

    A message may leave out the names of its joints.
    """
    index = joint_index(names, len(positions), joint)
    return None if index is None else positions[index]


def only_joint(names: Sequence[str]) -> str:
    """Choose the stem's joint among `names`: the only joint, or the joint of the default name.

    Raises ValueError if there are several joints without the default name.
    """
    if len(names) <= 1:
        return "".join(names)
    if DEFAULT_JOINT in names:
        return DEFAULT_JOINT
    raise ValueError(f"several joints ({', '.join(names)}): name the joint that is the stem")
