"""Figures of moves against those of plants with a known transfer function, by scipy alone."""

import numpy as np
import pytest
import scipy
from valve_streams import TRAVEL, feed, held

from valve_friction_ros.response import ResponseMonitor

DEAD_TIME, STEP, BEGIN, END = 0.4, 0.1, 20.0, 70.0
PLANTS = {
    "first order": ([1.0], [0.8, 1.0]),
    "critically damped": ([1.0], [0.25, 1.0, 1.0]),
    "overshooting": ([1.0], [1.0, 0.8, 1.0]),
    "gain below one": ([0.9], [0.5, 1.0]),
}


def unit_step(plant, times):
    """The answer of a transfer function to a unit step at 0, exact at each time."""
    return scipy.signal.step(scipy.signal.TransferFunction(*plant), T=times)[1]


def expected(plant):
    """Times to 63.2 % and 86.5 % of the whole change, and the overshoot, on a fine grid."""
    times = np.arange(0.0, 60.0, 1e-3)
    share = unit_step(plant, times) / (plant[0][-1] / plant[1][-1])
    t63, t86 = (times[np.argmax(share >= 1 - np.exp(-n))] for n in (1, 2))
    return DEAD_TIME + t63, DEAD_TIME + t86, max(share.max() - 1.0, 0.0)


@pytest.mark.parametrize(("rate", "way"), [(20.0, 1.0), (100.0, -1.0)])
@pytest.mark.parametrize("name", PLANTS)
def test_figures_of_a_known_plant(name, way, rate):
    plant, rng = PLANTS[name], np.random.default_rng(8)
    fine = np.arange(0.0, END, 1e-3)
    answer = np.concatenate([np.zeros(round((BEGIN + DEAD_TIME) / 1e-3)), unit_step(plant, fine)])
    times = np.arange(0.0, END, 1 / rate)
    stem = 0.5 + way * STEP * answer[np.round(times / 1e-3).astype(int)]
    monitor = ResponseMonitor(TRAVEL)
    feed(
        monitor,
        held([(BEGIN, 0.5), (END - BEGIN, 0.5 + way * STEP)]),
        (times, stem + 1e-5 * rng.standard_normal(times.size)),
        (times, 8e4 + 1.3e5 * stem + 20.0 * rng.standard_normal(times.size)),
    )
    (move,) = monitor.summary.moves
    t63, t86, overshoot = expected(plant)
    sample = 1 / rate
    assert move.t63 == pytest.approx(t63, abs=sample)
    assert move.t86 == pytest.approx(t86, abs=sample)
    assert move.overshoot == pytest.approx(overshoot, abs=3e-3)
    first = fine[np.argmax(np.abs(STEP * unit_step(plant, fine)) >= 1e-3)]
    assert DEAD_TIME <= move.dead_time <= DEAD_TIME + first + sample
    assert move.steady_error == pytest.approx(way * STEP * (1 - plant[0][-1]), abs=1e-3)
