"""Test whether the identified model describes the valve."""

import numpy as np

from valve_friction_ros.identification.refined.refinement import Refinement
from valve_friction_ros.identification.trust.misfit import Misfit

__all__ = ["misfit_of"]

_NOISE_SHARE = 0.2
_MOVED_SHARE = 1.0
_LEAST = 2e-4
"""Shares of the stem's noise, of the effect of the pressure's noise, and of the stem's movement in
the tolerated misfit.

Chosen: 70 of 71 simulated noisy records of Karnopp valves stay within it; valves with LuGre
friction (20 µm of presliding) exceed it up to 10 µm of noise (`benchmark/cases.py`)."""


def misfit_of(refinement: Refinement) -> Misfit:
    """Split the residual of a refinement into noise and misfit.

    The residuals under the two halves of the pressure share the misfit and the noise of the stem
    sensor, but not the noise of the pressure, so the mean of their product leaves

        systematic² = mean(r₁·r₂) − (noise of the stem)² .

    Half the distance between the two simulated stems is the effect of the pressure's noise. A
    misfit up to that effect, plus a fifth of the stem's noise, plus 0.02 % of the stem's movement,
    is tolerated as chance; a larger misfit is an error of the model.
    """
    record = refinement.problem.record
    first, second = refinement.residuals
    shared = float(np.mean(first * second)) - record.noise**2
    moved = 0.5 * float(np.sqrt(np.mean((first - second) ** 2)))
    spread = record.position - record.position.mean()
    rms = refinement.rms
    tolerated = (
        _MOVED_SHARE * moved + _NOISE_SHARE * record.noise + _LEAST * float(np.ptp(record.position))
    )
    fit = 1 - rms / float(np.sqrt(np.mean(spread**2)))
    return Misfit(fit, rms, float(np.sqrt(max(shared, 0.0))), tolerated)
