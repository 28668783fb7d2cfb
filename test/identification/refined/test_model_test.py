"""Noise told from misfit, on residuals that are made of both."""

import math

import numpy as np
import pytest

from valve_friction_ros.identification.refined.model_test import misfit_of
from valve_friction_ros.identification.refined.output_error import OutputError
from valve_friction_ros.identification.refined.refinement import Refinement
from valve_friction_ros.identification.trust.estimating_equation import EstimatingEquation
from valve_friction_ros.identification.trust.misfit import Misfit
from valve_friction_ros.model import Valve
from valve_friction_ros.signals.conditioned_record import ConditionedRecord

SIZE = 4000
PLACE = 2 * np.pi * np.arange(SIZE) / SIZE
STEM = 5e-3 * np.sin(PLACE)  # moves by 10 mm, 5/√2 mm about its mean
NO_EQUATION = EstimatingEquation.of_least_squares(np.empty((SIZE, 0)), np.empty(SIZE))


def wave(cycles, rms):
    """Waves of different numbers of cycles are orthogonal."""
    return rms * math.sqrt(2) * np.sin(cycles * PLACE)


def refinement(misfit=0.0, noise=0.0, moved=0.0):
    """Residuals of a systematic part, the stem's noise and the noise of either half."""
    shared = wave(7, misfit) + wave(11, noise)
    halves = shared + wave(13, moved), shared - wave(13, moved)
    record = ConditionedRecord(1e-3, STEM, (STEM, STEM), STEM, noise, 1, 1)
    problem = OutputError(record, Valve(1.0))
    return Refinement(problem, {}, (), NO_EQUATION, STEM + shared, halves)


def test_the_three_parts_are_told_apart():
    found = misfit_of(refinement(misfit=30e-6, noise=20e-6, moved=10e-6))
    # mean(r₁·r₂) = misfit² + noise² − moved², the last by construction instead of by chance
    assert found.systematic == pytest.approx(math.sqrt(30**2 - 10**2) * 1e-6, rel=1e-9)
    assert found.rms == pytest.approx(math.hypot(30e-6, 20e-6), rel=1e-9)
    assert found.fit == pytest.approx(1 - math.hypot(30e-6, 20e-6) / (5e-3 / math.sqrt(2)))
    # all that moved, a fifth of the noise, and 2e-4 of 10 mm
    assert found.tolerated == pytest.approx(10e-6 + 4e-6 + 2e-6, rel=1e-5)
    assert not found.describes


def test_noise_alone_is_no_misfit():
    found = misfit_of(refinement(noise=60e-6))
    assert found.systematic == pytest.approx(0.0, abs=1e-12)
    assert found.describes
    assert found.rms == pytest.approx(60e-6, rel=1e-9)


@pytest.mark.parametrize(("share", "describes"), [(0.99, True), (1.01, False)])
def test_describes_up_to_what_is_tolerated(share, describes):
    tolerated = 0.2 * 20e-6 + 2e-4 * 10e-3
    found = misfit_of(refinement(misfit=share * tolerated, noise=20e-6))
    assert found.describes is describes


def test_excess_is_what_chance_does_not_expect():
    assert Misfit(1.0, 0.0, 5e-6, 4e-6).excess == pytest.approx(4e-6, rel=1e-12)  # 3, 4, 5
    assert Misfit(1.0, 0.0, 2e-6, 4e-6).excess == 0.0
