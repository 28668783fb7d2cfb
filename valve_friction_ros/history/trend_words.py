"""The trend in words, and what a picture of it shows."""

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.history.trend import Trend
from valve_friction_ros.identification import SLIDING, two_digits
from valve_friction_ros.streams import utc

__all__ = ["LIMIT_NAMES", "drift_text", "end_of_trend", "friction_of"]

LIMIT_NAMES = {"warn_ratio": "worth maintenance", "error_ratio": "excess", "low_ratio": "may leak"}
"""What the limits of the friction mean."""


def drift_text(trend: Trend) -> str:
    """Return the drift with its interval, and when a limit is expected to be crossed."""
    text = f"{trend.drift:+.3g} ± {two_digits(trend.half_width)} N a month".replace("-", "−")
    if trend.crossing is None:
        return text
    when = utc(trend.crossing.time)
    return f"{text}; {LIMIT_NAMES[trend.crossing.limit.value]} expected {when:%Y-%m-%d}"


def end_of_trend(trend: Trend) -> int:
    """Return the time up to which a trend is drawn, ns."""
    if trend.crossing is None:
        return trend.end
    return min(trend.crossing.latest, trend.end + 2 * (trend.end - trend.begin))


def friction_of(baseline: Baseline | None, of: str) -> float | None:
    """Return the friction of a baseline by its name, N; None where it has none."""
    if baseline is None:
        return None
    if of == SLIDING:
        return None if baseline.sliding is None else baseline.sliding.value
    return baseline.coulomb_friction
