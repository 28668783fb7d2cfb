"""The measured stem beside the simulated one, for every method of identification."""

from functools import singledispatch
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification import (
    Assessment,
    ForceBalanceAssessment,
    SweepAssessment,
)

__all__ = ["Comparison", "comparison_of"]


class Comparison(NamedTuple):
    """Measured and simulated stem at the same times.

    Attributes
    ----------
    sample_period : float
        Time between two samples, s.
    measured : ndarray of float, shape (m,)
        Measured position as the identification took it, m.
    simulated : ndarray of float, shape (m,)
        Position of the model's stem, m.
    """

    sample_period: float
    measured: NDArray[np.float64]
    simulated: NDArray[np.float64]

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each sample since the first one, s, shape (m,)."""
        return np.arange(self.measured.size, dtype=np.float64) * self.sample_period

    @property
    def residual(self) -> NDArray[np.float64]:
        """Simulated less measured position, m, shape (m,)."""
        return self.simulated - self.measured

    def autocorrelation(self, lags: int) -> NDArray[np.float64]:
        """Return the autocorrelation of the residual at lags of 0 … `lags` − 1 samples.

        It is 1 at lag 0, and 0 everywhere for a residual that is nothing at all.
        """
        residual = self.residual - self.residual.mean()
        size = 2 * residual.size
        spectrum = np.abs(np.fft.rfft(residual, size)) ** 2
        products = np.fft.irfft(spectrum, size)[:lags]
        power = float(products[0])
        return np.asarray(products / (power or 1.0), dtype=np.float64)


@singledispatch
def comparison_of(assessment: Assessment) -> Comparison | None:
    """Return both stems of an assessment, None where none can be simulated (without a spring)."""
    raise NotImplementedError(type(assessment))


@comparison_of.register
def _(assessment: SweepAssessment) -> Comparison | None:
    refinement = assessment.refinement
    if refinement is None:
        return None
    record = refinement.problem.record
    return Comparison(record.sample_period, record.position, refinement.simulated)


@comparison_of.register
def _(assessment: ForceBalanceAssessment) -> Comparison:
    recording = assessment.validation.recording
    return Comparison(recording.sample_period, recording.position, assessment.simulated)
