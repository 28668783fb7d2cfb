"""The panel of a valve's usage: the distance of each day, and renewals of the packing."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from valve_friction_ros.streams import DAY
from valve_friction_ros.usage import UsedDay, ValveUsage

__all__ = ["draw_usage", "used_days"]

_COLOUR = "#56B4E9"
_RENEWED = "#009E73"


def used_days(usage: ValveUsage, span: tuple[int, int]) -> tuple[UsedDay, ...]:
    """Return the days that lie within a time, ns, at least in part."""
    begin, end = span
    return tuple(one for one in usage.days if one.day * DAY < end and (one.day + 1) * DAY > begin)


def draw_usage(axes: Axes, usage: ValveUsage, span: tuple[int, int]) -> None:
    """Draw the travelled distance of each day of a time axis of this span, ns, and the renewals."""
    days = used_days(usage, span)
    numbers = sorted({one.day for one in days})
    sums = [sum(one.usage.distance for one in days if one.day == day) for day in numbers]
    width = np.timedelta64(DAY, "ns")
    axes.bar(
        _dates([DAY * day for day in numbers]),
        sums,
        width,
        align="edge",
        color=_COLOUR,
        label="travel of a day",
    )
    for renewal in sorted({one.renewal for one in days if span[0] <= one.renewal <= span[1]}):
        begin = _dates([renewal])[0]
        axes.axvline(begin, color=_RENEWED, ls="-.", lw=1.5, label="packing renewed")
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("travel [m/day]")
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)


def _dates(times: Sequence[int]) -> NDArray[np.datetime64]:
    return np.asarray(times, dtype=np.int64).astype("datetime64[ns]")
