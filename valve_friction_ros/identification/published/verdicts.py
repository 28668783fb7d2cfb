"""Verdicts on the parameters of a regression."""

import numpy as np

from valve_friction_ros.identification.published.identify import PublishedFit
from valve_friction_ros.identification.published.regression_uncertainty import RegressionUncertainty
from valve_friction_ros.identification.settings import IdentificationSettings
from valve_friction_ros.identification.trust.limits import (
    NO_SLIP,
    finest_half_share,
    too_few_strokes,
)
from valve_friction_ros.identification.trust.sliding import FINEST_SLIDING, SLIDING
from valve_friction_ros.identification.trust.verdict import (
    Parameter,
    fixed,
    not_identifiable,
    with_verdict,
)

__all__ = ["regression_verdicts"]


def regression_verdicts(
    found: PublishedFit, regression: RegressionUncertainty, settings: IdentificationSettings
) -> dict[str, Parameter]:
    """Give each parameter of a regression its verdict, for a machine without a spring."""
    covariance = regression.covariance
    few = too_few_strokes(regression.strokes)
    parameters = {}
    for name, value in found.estimate.values.items():
        if name in settings.fixed:
            parameters[name] = fixed(name, settings.fixed[name])
        elif name == "static_friction":
            parameters[name] = not_identifiable(name, NO_SLIP)
        elif name not in regression.names:
            parameters[name] = not_identifiable(name, "the record does not determine it")
        else:
            gradient = np.eye(len(regression.names))[regression.names.index(name)]
            error = covariance.standard_error(gradient)
            width = max(
                covariance.half_width(gradient), finest_half_share(name, settings) * abs(value)
            )
            parameters[name] = with_verdict(name, value, error, width, few)
    value, parts = found.sliding_friction, {"coulomb_friction": 1.0}
    parts["viscous_friction"] = found.sliding_speed
    gradient = np.array([parts.get(name, 0.0) for name in regression.names])
    error, width = covariance.standard_error(gradient), covariance.half_width(gradient)
    width = max(width, FINEST_SLIDING * abs(value))
    parameters[SLIDING] = with_verdict(SLIDING, value, error, width, few)
    return parameters
