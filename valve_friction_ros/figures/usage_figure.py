"""The figure of a valve's usage: where the stem was, and how far it travelled each day."""

import numpy as np
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure

from valve_friction_ros.figures.page import dress
from valve_friction_ros.streams import DAY
from valve_friction_ros.usage import BINS, ValveUsage

__all__ = ["usage_figure"]

_DAYS = 31
"""Last days that are drawn."""
_FEWEST_DAYS = 7
"""Days on the axis; around a single one matplotlib would show hours."""
_COLOUR = "#0072B2"


def usage_figure(usage: ValveUsage, is_narrow: bool = False) -> Figure:
    """Draw the time at each 5 % of the travel, and the distance of each of the last 31 days.

    Both are those of the packing in use; on a narrow page one is below the other. Raises
    ValueError if the valve was not watched.
    """
    used = usage.since_renewal
    if not used.time_watched:
        raise ValueError("the valve was not watched: there is nothing to draw")
    figure = Figure(figsize=(3.7, 4.8) if is_narrow else (7.1, 2.6), layout="constrained")
    places, days = figure.subplots(2, 1) if is_narrow else figure.subplots(1, 2)
    width = 100 / BINS
    shares = 100 * np.array(used.histogram) / used.time_watched
    places.bar(width * np.arange(BINS), shares, width, align="edge", color=_COLOUR)
    places.set_xlim(0, 100)
    places.set_xlabel("stem position [% of the travel]")
    places.set_ylabel("time [%]")
    last = [one for one in usage.days if one.renewal == usage.renewal][-_DAYS:]
    dates = np.array([np.datetime64(int(one.day * DAY), "ns") for one in last], "datetime64[D]")
    days.bar(dates, [one.usage.distance for one in last], color=_COLOUR)
    first = min(dates[0], dates[-1] - (_FEWEST_DAYS - 1))
    half = np.timedelta64(12, "h")
    days.set_xlim(first - half, dates[-1] + half)
    locator = AutoDateLocator(minticks=2, maxticks=5)  # type: ignore[no-untyped-call]
    days.xaxis.set_major_locator(locator)
    days.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]
    days.set_xlabel("day [UTC]")
    days.set_ylabel("travelled distance [m]")
    dress((places, days))
    return figure
