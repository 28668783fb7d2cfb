# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Choice of the threshold δv on the plateau of the sweep."""

import numpy as np

from valve_friction_ros.identification.published.sweep import Sweep
from valve_friction_ros.identification.refusal import LittleMotionError

_RESOLUTION = 1e-12
"""Residuals below this share of the largest in the sweep are rounding, not misfit.

Chosen: double precision rounds forces at 1e-16, and the sweep adds up some 10,000 of them."""


def choose_threshold(sweep: Sweep, window: int) -> int:
    """Choose the step of the sweep whose estimates are determined best.

    The published rule takes the region of smallest σ_s. Taken by the letter it fails: far up the
    sweep a handful of samples, all of nearly one speed, fits any parameters, and σ_s is smallest
    where it means least. The criterion must be the smallest uncertainty of the *estimates*, not of
    the force. Their covariance is σ_s²·(ΦᵀΦ)⁻¹, and its determinant, the generalised variance,

        ln det = 2·n_P·ln σ_s − ln det ΦᵀΦ ,

    weighs both sides of the sweep in one number that no choice of units changes (the
    D-criterion of experimental design). Below the plateau resting samples violate (4) and raise
    σ_s; above it the loss of samples, and of the range of speed, lowers det ΦᵀΦ. The smallest
    value lies on the plateau, at its low end where σ_s has settled, and so keeps the most
    samples that still obey the sliding force balance. Steps with fewer samples than n_P windows
    are left out, because the derivatives within one window are not independent.

    Parameters
    ----------
    sweep : Sweep
        Estimates for each threshold.
    window : int
        Length d of the derivative window, samples.

    Returns
    -------
    int
        Index into the arrays of `sweep`.

    Raises
    ------
    RefusalError
        If no threshold leaves enough samples to determine the free parameters.
    """
    usable = np.isfinite(sweep.sigma) & (sweep.samples >= sweep.free * window)
    if not usable.any():
        raise LittleMotionError(
            "no threshold leaves enough moving samples to determine "
            f"{sweep.free} parameters: record more strokes, or fix a parameter"
        )
    floor = _RESOLUTION * max(float(np.nanmax(sweep.sigma)), np.finfo(float).tiny)
    criterion = 2 * sweep.free * np.log(np.maximum(sweep.sigma, floor)) - sweep.log_information
    return int(np.argmin(np.where(usable, criterion, np.inf)))
