"""Limits of the verdicts of all methods."""

from valve_friction_ros.identification.settings import IdentificationSettings

__all__ = ["FALL_SPEED", "FEWEST_STROKES", "NO_SLIP", "finest_half_share", "too_few_strokes"]

FALL_SPEED = 6.5e-3
"""Speed, m/s, up to which friction may fall: twice the v_s = 3.26 mm/s published for graphite.

At 2·v_s the fall is complete but for e⁻⁴ = 2 %. A slower record does not separate F_c from the
friction at low speed. An absolute size from one packing, applied to every valve."""

FEWEST_STROKES = 3
"""Strokes below which every verdict is at most weak: two strokes give a scatter with one degree of
freedom, whose interval is 12.7 standard errors."""

_FINEST = 5e-4
_FINEST_SPRING = 2e-4
"""Least half width of an interval, as a share of the value, however quiet the record is.

Chosen for the errors of smoothing and sampling, which no scatter shows; they change a spring
constant less. The shares are absolute: they do not follow the sampling of the record."""

NO_SLIP = "no slip jump in the record: F_s cannot be separated from F_c"
"""Reason of a static friction that is not identifiable."""


def too_few_strokes(strokes: int) -> str:
    """Return the reason that a record has too few strokes, or an empty string."""
    if strokes >= FEWEST_STROKES:
        return ""
    return f"only {strokes} strokes: record at least {FEWEST_STROKES}, up and down"


def finest_half_share(name: str, settings: IdentificationSettings) -> float:
    """Least half width of the interval of a parameter, as a share of its value."""
    by_spring = name == "spring_preload" and settings.position_bias is not None
    return _FINEST_SPRING if name == "spring_constant" or by_spring else _FINEST
