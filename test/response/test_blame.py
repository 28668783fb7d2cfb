"""Who is to blame, against valves with pneumatic positioners of another physics."""

import numpy as np
import pytest
from valve_streams import TRAVEL, feed

from benchmark.positioner import case_of, simulated, steps
from valve_friction_ros.response import Cause, ResponseMonitor

POSITIONER = {Cause.LATE, Cause.SLOW, Cause.SETTING}
WRONG = {
    "healthy": {Cause.FRICTION},
    "sticky": POSITIONER,
    "late": {Cause.FRICTION},
    "slow": {Cause.FRICTION},
    "setting": {Cause.FRICTION},
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "which", "cause"),
    [
        ("healthy", "dead_time", None),
        ("sticky", "dead_time", None),
        ("late", "dead_time", Cause.LATE),
        ("slow", "t86", None),
        ("setting", "deviation", None),
    ],
)
def test_one_case_of_each_fault(fault, which, cause):
    """No side is blamed wrongly; one case guards the rule, shares need many drawn ones."""
    case = case_of(fault, 1000)
    record = simulated(case, 1000, steps(np.random.default_rng([1000, 3]), 30, 0.1))
    monitor = ResponseMonitor(TRAVEL)
    feed(
        monitor,
        (record.command_stamps, record.command),
        (record.stamps, record.position),
        (record.pressure_stamps, record.pressure),
    )
    assert len(monitor.summary.moves) >= 12
    told = {one: monitor.summary.cause(one) for one in ("dead_time", "t86", "deviation")}
    assert not set(told.values()) & WRONG[fault]
    assert cause is None or told[which] is cause
