"""Uncertainty of the published regression, for machines whose motion cannot be simulated."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from valve_friction_ros.identification.published.identify import PublishedFit
from valve_friction_ros.identification.trust.estimating_equation import EstimatingEquation
from valve_friction_ros.identification.trust.uncertainty import (
    Covariance,
    block_covariance,
    stroke_length,
)
from valve_friction_ros.signals.measured_record import MeasuredRecord

__all__ = ["RegressionUncertainty", "regression_uncertainty"]


class RegressionUncertainty(NamedTuple):
    """Covariance of the regressed `names` over blocks of one stroke, and the strokes of the record.

    `fit` is the share of the force that is reproduced, 1 − |residual| / |force − mean|.
    """

    names: tuple[str, ...]
    covariance: Covariance
    fit: float
    strokes: int


def regression_uncertainty(record: MeasuredRecord, fit: PublishedFit) -> RegressionUncertainty:
    """Scatter of the regression's normal equations between strokes.

    Without a spring no force returns the stem, and its simulation drifts away from the record
    whatever the parameters. Only the regression is left. Its scores are the residual times the
    regressors, φ_t·(F_t − φ_tᵀθ), at the samples above the chosen threshold.
    """
    estimate, regression = fit
    settings = estimate.settings
    velocity = record.derivatives(settings.published_window, settings.order).velocity
    moving = regression.speed > estimate.threshold
    values = np.array([estimate.values[name] for name in regression.names])
    residual: NDArray[np.float64] = regression.columns @ values - regression.force
    columns = regression.columns * moving[:, None]
    equation = EstimatingEquation.of_least_squares(columns, residual)
    stroke = stroke_length(np.cumsum(velocity * moving))
    covariance = block_covariance(equation, stroke)
    force = regression.force[moving]
    share = 1 - float(np.linalg.norm(residual[moving]) / np.linalg.norm(force - force.mean()))
    return RegressionUncertainty(regression.names, covariance, share, residual.size // stroke)
