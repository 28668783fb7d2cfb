"""Limits that the verdicts of all methods share."""

from valve_friction_ros.identification.settings import IdentificationSettings

__all__ = ["FALL_SPEED", "FEWEST_STROKES", "NO_SLIP", "finest_half_share", "too_few_strokes"]

FALL_SPEED = 6.5e-3
"""Speed, m/s, up to which the friction of a packing is known to fall: twice the v_s = 3.26 mm/s
that was published for graphite. Slower records cannot tell F_c from the friction at low speed."""

FEWEST_STROKES = 3
"""Strokes below which the scatter between them is not known, and nothing is more than weak."""

_FINEST = 5e-4
_FINEST_SPRING = 2e-4
"""No interval is narrower than this share of the value, however quiet the record is: smoothing
and sampling leave no more. A spring constant suffers less from them."""

NO_SLIP = "no slip jump seen: F_s cannot be told from F_c"
"""Reason of a static friction that is not identifiable."""


def too_few_strokes(strokes: int) -> str:
    """Say that there are too few strokes for intervals, or nothing."""
    if strokes >= FEWEST_STROKES:
        return ""
    return f"{strokes} strokes only: record at least {FEWEST_STROKES}, up and down"


def finest_half_share(name: str, settings: IdentificationSettings) -> float:
    """Least half width of the interval of a parameter, as a share of its value."""
    by_spring = name == "spring_preload" and settings.position_bias is not None
    return _FINEST_SPRING if name == "spring_constant" or by_spring else _FINEST
