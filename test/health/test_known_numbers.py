# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What was found on a valve stays until it is measured anew."""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest

from valve_friction_ros.health import (
    Baseline,
    Diagnosis,
    FrictionLimits,
    FrictionMonitor,
    KnownNumbers,
    Level,
    Measured,
    MonitorSettings,
    StatusSignal,
)
from valve_friction_ros.model import Valve
from valve_friction_ros.wording import quoted

DAY = 86_400_000_000_000
TRAVEL = 0.03
VALVE = Valve(diaphragm_area=0.04, pressure_reference=1e5, travel=TRAVEL)
WHOLE = {
    "spring_constant": Measured(2e5, 1e3),
    "lower_stop": Measured(0.0, 1e-5),
    "lowest_position": Measured(0.0, 1e-5),
    "highest_position": Measured(0.025, 1e-5),
}
WITHIN = {"lowest_position": Measured(0.01, 1e-5), "highest_position": Measured(0.02, 1e-5)}
LOST = {**WHOLE, "lower_stop": Measured(2e-3, 1e-5), "lowest_position": Measured(2e-3, 1e-5)}
WEAK = {**WHOLE, "spring_constant": Measured(1.2e5, 1e3)}
HEALTHY = Baseline(150.0, numbers=WHOLE)


def after(*records):
    """What is known after records, one a day."""
    known = KnownNumbers()
    for day, numbers in enumerate(records):
        known = known.followed_by(numbers, day * DAY)
    return known


@pytest.mark.parametrize(
    ("changed", "level", "words"),
    [(LOST, Level.WARN, "travel is lost"), (WEAK, Level.ERROR, "the spring constant has changed")],
)
def test_a_weaker_record_leaves_the_finding_and_its_date(changed, level, words):
    (at_first,) = after(WHOLE, changed).findings(HEALTHY, VALVE)
    assert (at_first.level, "measured" in at_first.message) == (level, False)
    (later,) = after(WHOLE, changed, WITHIN, {}).findings(HEALTHY, VALVE)
    assert (later.level, later.status_signal) == (level, at_first.status_signal)
    assert words in later.message
    assert later.message.endswith("(measured 1970-01-02 00:00 UTC; no record since shows it)")


@pytest.mark.parametrize("changed", [LOST, WEAK])
def test_a_new_measurement_ends_it(changed):
    assert after(changed, WITHIN, WHOLE).findings(HEALTHY, VALVE) == ()


def test_a_stem_that_goes_beyond_the_stop_ends_it():
    known = after(LOST, {"lowest_position": Measured(0.0, 1e-5)})
    assert "lower_stop" not in known.dated
    assert known.findings(HEALTHY, VALVE) == ()


def test_a_record_that_is_older_than_others_replaces_none_of_theirs():
    known = after(WHOLE, LOST).with_record(WEAK, 0)
    assert known.dated == after(WEAK, LOST).dated
    assert known.latest == DAY


def test_what_was_measured_since_a_time():
    known = after(WHOLE, WITHIN)
    assert known.since(None) == known
    assert known.since(DAY).dated.keys() == set()
    assert known.since(0).dated == known.dated


def test_the_reach_is_that_of_the_farthest_record_until_a_stop_is_met():
    known = after(WHOLE, WITHIN)
    assert known.numbers["highest_position"] == WHOLE["highest_position"]
    assert known.of_latest == {}
    assert known.followed_by(LOST, 9 * DAY).numbers == LOST


class TestMonitor:
    @pytest.fixture
    def monitor(self, monkeypatch, unknown):
        """A monitor of a valve that has lost travel, and then shows nothing of it."""
        monitor = FrictionMonitor(MonitorSettings(VALVE))
        monitor.baseline = HEALTHY
        monkeypatch.setattr(
            "valve_friction_ros.health.friction_monitor.valve_numbers",
            lambda found: found.numbers,
        )
        for time, numbers in ((0, LOST), (DAY, WITHIN)):
            friction = {"coulomb_friction": unknown()}
            unclear = Diagnosis(Level.OK, StatusSignal.GOOD, quoted(""), None)
            found = SimpleNamespace(
                numbers=numbers,
                parameters=friction,
                sliding_speed=math.nan,
                diagnosis=unclear,
                baseline=HEALTHY,
                limits=FrictionLimits(),
            )
            monitor.accept(found, time)
        return monitor

    def test_the_finding_stays(self, monitor):
        (finding,) = monitor.findings
        assert "travel is lost" in finding.message
        assert monitor.changes["lower_stop"].value == pytest.approx(2e-3)

    def test_another_baseline_drops_it(self, monitor):
        monitor.baseline = HEALTHY
        assert monitor.findings == ()

    def test_another_valve_drops_it(self, monitor):
        settings = monitor.settings
        monitor.change_settings(replace(settings, window=20.0))
        assert monitor.findings
        monitor.change_settings(replace(settings, valve=replace(VALVE, travel=0.04)))
        assert monitor.findings == ()
