"""The diagnosis by moves in service, and the baseline that they can be."""

import pytest
from service import VALVE, made_moves

from valve_friction_ros.evidence import evidence_of
from valve_friction_ros.health import (
    Baseline,
    FrictionLimits,
    Level,
    SlidingFriction,
    StatusSignal,
    baseline_by_evidence,
    diagnosis_by_evidence,
)
from valve_friction_ros.identification import IdentificationSettings, RefusalError

LIMITS = FrictionLimits()
EXACT = IdentificationSettings(timing_uncertainty=0.005)


def evidence(friction, hours=2.0, settings=EXACT):
    return evidence_of(made_moves(hours, friction), VALVE, settings)


def baseline(value=300.0):
    return Baseline(sliding=SlidingFriction(value, 10.0, 1.25e-3))


@pytest.mark.parametrize(
    ("now", "level", "signal", "words"),
    [
        (300.0, Level.OK, StatusSignal.GOOD, "friction normal"),
        (450.0, Level.WARN, StatusSignal.MAINTENANCE_REQUIRED, "friction has grown"),
        (750.0, Level.ERROR, StatusSignal.FAILURE, "excess friction"),
        (90.0, Level.ERROR, StatusSignal.OUT_OF_SPECIFICATION, "friction collapsed"),
    ],
)
def test_limits_are_those_of_an_identification(now, level, signal, words):
    found = diagnosis_by_evidence(evidence(lambda _: now), VALVE, baseline(), LIMITS)
    assert (found.level, found.status_signal) == (level, signal)
    assert found.message.startswith(words)
    assert "moves in service since 2023-11-14" in found.message
    assert found.ratio.value == pytest.approx(now / 300.0, rel=0.05)


def test_a_change_warns_where_there_is_no_baseline():
    grown = evidence(lambda hour: 450.0 if hour > 2 else 300.0, hours=3.0)
    found = diagnosis_by_evidence(grown, VALVE, None, LIMITS)
    assert found.level is Level.WARN
    assert "times what it was before 2023-11-1" in found.message
    assert diagnosis_by_evidence(evidence(lambda _: 300.0), VALVE, None, LIMITS) is None


def test_a_baseline_of_another_friction_is_not_compared():
    found = diagnosis_by_evidence(evidence(lambda _: 450.0), VALVE, Baseline(100.0), LIMITS)
    assert found is None


def test_a_negative_friction_points_to_the_signals():
    found = diagnosis_by_evidence(evidence(lambda _: -300.0), VALVE, baseline(), LIMITS)
    assert found.level is Level.WARN
    assert "check the direction of both signals" in found.message


class TestBaseline:
    def test_of_moves(self):
        one = baseline_by_evidence(evidence(lambda _: 300.0))
        assert one.coulomb_friction is None
        assert one.sliding.value == pytest.approx(300.0, rel=0.02)

    def test_too_few(self):
        with pytest.raises(RefusalError, match=r"no baseline yet: .* moves up and"):
            baseline_by_evidence(evidence(lambda _: 300.0, hours=0.2))

    def test_too_wide(self):
        wide = evidence(lambda _: 50.0, settings=IdentificationSettings(timing_uncertainty=0.1))
        with pytest.raises(RefusalError, match=r"known to .* a baseline needs"):
            baseline_by_evidence(wide)
