"""Refusal of a record that does not determine the friction."""

__all__ = ["LittleMotionError", "RefusalError"]


class RefusalError(Exception):
    """A record does not determine what was asked for; the message names cause and remedy.

    Examples
    --------
    >>> import valve_friction_ros as vf
    >>> valve = vf.Valve(diaphragm_area=0.0445)
    >>> try:
    ...     vf.identify(vf.Recording(0.01, [1e5] * 1000, [0.01] * 1000), valve)
    ... except vf.RefusalError as refusal:
    ...     print(str(refusal).split(":")[0])
    the stem did not move
    """


class LittleMotionError(RefusalError):
    """A record is too short, or its valve moves too little: no fault, as valves mostly rest."""
