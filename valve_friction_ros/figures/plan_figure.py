"""The figure of a stroke plan: the pressure to be played, and the stem that is expected."""

import numpy as np
from matplotlib.figure import Figure

from valve_friction_ros.figures.page import dress, titled_figure
from valve_friction_ros.figures.panels import COLOURS
from valve_friction_ros.planning import StrokePlan
from valve_friction_ros.planning.forecast import moved

__all__ = ["plan_figure"]


def plan_figure(plan: StrokePlan) -> Figure:
    """Draw the pressure before the converter, and the stem of each valve of the range.

    Parameters
    ----------
    plan : StrokePlan
        The plan.

    Returns
    -------
    Figure
        To be saved or shown; no global state of matplotlib is touched.
    """
    test, travel = plan.test, plan.valve.travel
    figure = titled_figure(f"planned stroke test: {test.duration:.3g} s, {test.cycles} cycles")
    pressure, stem = figure.subplots(2, sharex=True)
    pressure.plot(test.times, test.pressures / 1e3, color=COLOURS[0])
    pressure.set_ylabel("pressure before\nthe converter [kPa]")
    for name, draw, colour in zip(
        plan.frictions.names,
        plan.frictions.draws,
        np.resize(COLOURS, len(plan.frictions.draws)),
        strict=True,
    ):
        motion = moved(test.excitation, test.duration, plan.valve, draw, plan.conditions)
        time = np.arange(motion.pressure.size) * motion.sample_period
        stem.plot(time, 100 * motion.stem.position / travel, color=colour, label=f"friction {name}")
    for share, label in ((plan.limits.lowest, "part of the travel"), (plan.limits.highest, None)):
        stem.axhline(100 * share, color="0.5", lw=0.8, ls="--", label=label)
    stem.set_ylabel("expected stem [% of travel]")
    stem.set_xlabel("time [s]")
    stem.legend(frameon=False, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    dress((pressure, stem))
    return figure
